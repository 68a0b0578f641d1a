//! Conversion of `[[boundary]]` entries to faces and columns.

use std::collections::BTreeSet;

use ddem_core::problem::{
    BlockFace, Boundaries, BoundaryHold, ColumnBuilder, Geometry, ModelBoundary, NoColumn,
    TimeFunction, Vec3, impedance,
};
use ddem_core::{ErrorCode, Fault, Problem};

use super::at_stage;
use super::faces::{twice, with_areas};
use super::geometry::{Selector, no_face, nothing};
use crate::lint::{Code, Diagnostic};
use crate::schema::{Boundary, BoundaryKind, Deck, Stage, StageKind, Where};

/// All boundaries of a deck.
pub(super) fn boundaries(deck: &Deck, problem: &Problem) -> Result<Boundaries, Vec<Fault>> {
    let (mut faults, mut list) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (index, entry) in deck.boundary.iter().enumerate() {
        match boundary((deck, problem), index, entry, &mut first) {
            Ok(boundary) => list.push(boundary),
            Err(fault) => faults.push(fault),
        }
    }
    if faults.is_empty() { Ok(Boundaries { list }) } else { Err(faults) }
}

/// Faults of boundaries whose nodes are all held, and of columns without a base.
pub(super) fn held_faults(
    deck: &Deck,
    problem: &Problem,
    holds: &[Vec<BoundaryHold>],
) -> Vec<Fault> {
    let mut faults = twice(deck, problem);
    let known = faults.len();
    for (stage, holds) in holds.iter().enumerate() {
        let entry = deck.stage.get(stage);
        let during = entry.map_or(String::new(), |stage| format!(" in stage `{}`", stage.name));
        for hold in holds {
            let index = hold.boundary;
            if hold.nodes > 0 && hold.held == hold.nodes {
                faults.push(
                    Fault::new(
                        ErrorCode::InvalidBoundary,
                        format!("boundary[{index}]"),
                        format!(
                            "all {} nodes of this boundary are held in all directions{during}, by {}: no \
                             dashpot there can move",
                            hold.nodes,
                            names(hold)
                        ),
                    )
                    .help(
                        "set `until` of the fix to the stage in `from` of the boundary; its reactions then \
                         act as constant forces",
                    ),
                );
            }
            if let Some([x, y, z]) = hold.floating {
                faults.push(
                    Fault::new(
                        ErrorCode::InvalidBoundary,
                        format!("boundary[{index}]"),
                        format!(
                            "the free-field column at ({x}, {y}, {z}) stands on nothing{during}"
                        ),
                    )
                    .help("give the base of the model a boundary of kind \"viscous\", or fix it"),
                );
            }
        }
        if faults.len() > known {
            break;
        }
    }
    faults
}

/// Warnings about boundaries that are held in part.
pub(super) fn warnings(
    deck: &Deck,
    problem: &Problem,
    holds: &[Vec<BoundaryHold>],
) -> Vec<Diagnostic> {
    let mut held: Vec<Option<Diagnostic>> = vec![None; problem.boundaries.list.len()];
    for (stage, holds) in holds.iter().enumerate() {
        for hold in holds {
            let known = &mut held[hold.boundary];
            *known = known.take().or_else(|| held_in_part(deck, problem, stage, hold));
        }
    }
    held.into_iter().flatten().collect()
}

/// Warning about a boundary that is held in part in a stage.
fn held_in_part(
    deck: &Deck,
    problem: &Problem,
    stage: usize,
    hold: &BoundaryHold,
) -> Option<Diagnostic> {
    let index = hold.boundary;
    let at = format!("boundary[{index}].where");
    if let Some([x, y, z]) = hold.first {
        let message = format!(
            "{} of {} nodes are held in all directions by {}, the first at ({x}, {y}, {z}): no dashpot there \
             can move",
            hold.held,
            hold.nodes,
            names(hold)
        );
        let help = "leave these nodes out of the fix or out of the boundary";
        return Some(Diagnostic::warning(Code::HeldBoundary, at, message, help));
    }
    let entry = deck.stage.get(stage);
    let moves = entry.is_none_or(|stage: &Stage| stage.kind == StageKind::Dynamic);
    // A base with an incoming wave may be held along its normal to carry the weight.
    let side = problem.boundaries.list[index].wave.is_none() && moves;
    let (axis, fix) = hold.across.filter(|_| side)?;
    let message = format!(
        "`fix[{fix}]` holds the nodes along {}, their normal, in stage `{}`: waves along it are reflected",
        ["x", "y", "z"][axis],
        entry.map_or("", |stage| &stage.name)
    );
    let help = "`until` ends a fix; its reaction stays as a constant force";
    Some(Diagnostic::warning(Code::ReflectingBoundary, at, message, help))
}

/// Fault of a free-field boundary with a face at which no column can stand.
fn no_column(why: NoColumn, place: &str) -> Fault {
    let (what, help) = match why {
        NoColumn::Level => (
            "a face that looks up or down cannot be a free-field side",
            "free-field sides are upright, z; the base has a boundary of kind \"viscous\"",
        ),
        NoColumn::Aslant => (
            "a free field needs blocks with one upright edge, along z, and two level ones",
            "use kind \"viscous\" for the sides of other blocks",
        ),
        NoColumn::Unmatched => (
            "a side whose blocks are split, or of several sets, has no free field",
            "use blocks of one set along the side, none of them split, from the base up",
        ),
    };
    Fault::new(ErrorCode::InvalidBoundary, format!("{place}.where"), what).help(help)
}

/// Fixes that hold nodes, for a message.
fn names(held: &BoundaryHold) -> String {
    let names: Vec<String> = held.fixes.iter().map(|fix| format!("fix[{fix}]")).collect();
    names.join(" and ")
}

fn boundary(
    (deck, problem): (&Deck, &Problem),
    index: usize,
    entry: &Boundary,
    first: &mut usize,
) -> Result<ModelBoundary, Fault> {
    let Problem { stages, properties, sets, .. } = problem;
    let (geometry, start) = (at_stage(deck, stages, entry.from.as_ref()), &**stages.at(0));
    let selector = Selector::new(&entry.r#where, sets);
    let place = format!("boundary[{index}]");
    let surfaces = surfaces(&selector, geometry, &place)?;
    let mut boundary = ModelBoundary {
        dashpots: Vec::new(),
        faces: with_areas(
            (&selector, &Selector::new(&Where::default(), sets)),
            geometry,
            &surfaces,
        ),
        under: BTreeSet::new(),
        wave: entry.velocity.map(Vec3::from),
        history: TimeFunction::new(entry.history.as_ref()),
        in_force: deck.stage_range(entry.from.as_ref(), entry.until.as_ref()),
        columns: Vec::new(),
        sides: Vec::new(),
    };
    if entry.kind == BoundaryKind::FreeField {
        let mut ground = ColumnBuilder::new(geometry, start, properties, first);
        for surface in &surfaces {
            let lengths = selector.tributary_lengths(geometry, surface);
            ground.add_columns(surface, lengths).map_err(|why| no_column(why, &place))?;
        }
        (boundary.columns, boundary.sides) = ground.done();
        boundary.dashpots =
            boundary.sides.iter().map(|side| (side.node, side.resistance)).collect();
        return Ok(boundary);
    }
    // Columns continue below removed blocks, so the faces at the start count, too.
    for (ground, surfaces) in [(geometry, &surfaces), (start, &selector.surfaces(start))] {
        let below = surfaces.iter().filter(|face| face.outward(ground).z < 1e-9 - 1.0);
        let areas = below.flat_map(|face| selector.areas(ground, face));
        boundary.under.extend(areas.map(|(node, _)| node));
    }
    for surface in &surfaces {
        let impedance = impedance(geometry, properties, surface);
        let areas = selector.areas(geometry, surface).into_iter();
        boundary.dashpots.extend(areas.map(|(node, area)| (node, impedance * area)));
    }
    Ok(boundary)
}

/// Outer faces of deformable blocks that a boundary selects.
fn surfaces(
    selector: &Selector,
    geometry: &Geometry,
    place: &str,
) -> Result<Vec<BlockFace>, Fault> {
    let surfaces = selector.surfaces(geometry);
    let place = format!("{place}.where");
    if surfaces.is_empty() {
        let inside = !selector.nodes(geometry).is_empty();
        let what = "no outer face of a block";
        let fault = nothing(place, what);
        return Err(match inside {
            true => fault.help(
                "the nodes there are inside of the model or at a joint: a boundary takes faces without a \
                 neighbour, on every plane given",
            ),
            false => no_face(fault, selector, geometry),
        });
    }
    if surfaces.iter().any(|surface| selector.cuts_askew(geometry, surface)) {
        let message = "a range cuts an oblique face askew: a boundary takes whole faces";
        return Err(Fault::new(ErrorCode::InvalidBoundary, place, message));
    }
    if surfaces.iter().any(|surface| geometry.is_rigid(surface.block)) {
        let message = "selects faces of rigid blocks: waves travel in deformable blocks only";
        return Err(Fault::new(ErrorCode::InvalidBoundary, place, message).help(
            "leave the boundary out, or make the blocks along it a set with `body = \"deformable\"`",
        ));
    }
    Ok(surfaces)
}
