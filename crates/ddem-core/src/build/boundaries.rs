//! From `[[boundary]]` to faces and columns.

use std::collections::BTreeSet;

use super::faces::{in_cavities, twice, with_areas};
use super::geometry::{Region, nothing};
use super::{Site, at_stage};
use crate::boundary::{Border, Borders, Clamped, Ground, Made, NoColumn, Outside, impedance};
use crate::conditions::{Active, Applied, Conditions};
use crate::deck::{Boundary, BoundaryKind, Deck, Stage, StageKind, Where};
use crate::error::Fault;
use crate::geometry::{Geometry, Stages, Surface, Vec3};
use crate::history::Course;
use crate::model::Model;
use crate::pack::Packs;
use crate::properties::Properties;

/// All boundaries of a deck.
pub(super) fn borders(
    site: &Site,
    stages: &Stages,
    properties: &Properties,
) -> Result<Borders, Vec<Fault>> {
    let (mut faults, mut list) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (index, entry) in site.deck.boundary.iter().enumerate() {
        match border((site, stages, properties), index, entry, &mut first) {
            Ok(border) => list.push(border),
            Err(fault) => faults.push(fault),
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    Ok(Borders { list })
}

/// Boundaries and what else is in force, stage by stage.
pub(super) struct InForce<'a> {
    pub(super) stages: &'a Stages,
    pub(super) conditions: &'a Conditions,
    pub(super) borders: &'a Borders,
    pub(super) packs: &'a Packs,
}

impl InForce<'_> {
    /// What is in force at the boundaries in a stage, and on what it acts.
    fn at(&self, stage: usize) -> (Made<'_>, Outside) {
        let (geometry, start) = (self.stages.at(stage), self.stages.at(0));
        let made = Made { geometry, start, packs: self.packs };
        let none = Applied::default();
        let active = Active::new(self.conditions, geometry, self.packs, stage, &none);
        let now = (self.conditions, stage, &active);
        (made, Outside::new(self.borders, made, now, &none))
    }
}

/// Faults of boundaries all of whose nodes are held, and of columns that stand on nothing.
pub(super) fn idle(deck: &Deck, in_force: &InForce<'_>) -> Vec<Fault> {
    let borders = in_force.borders;
    let mut faults = twice(borders, deck, in_force.stages);
    if borders.list.is_empty() {
        return faults;
    }
    let (known, n_stages) = (faults.len(), deck.stage.len().max(1));
    for stage in 0..n_stages {
        let (made, outside) = in_force.at(stage);
        let name = deck.stage.get(stage).map_or("", |stage| &stage.name);
        for index in (0..borders.list.len()).filter(|&index| borders.has(index, stage)) {
            let held = outside.clamped(made, &borders.list[index]);
            if held.all() {
                faults.push(
                    Fault::new(
                        format!("boundary[{index}]"),
                        format!(
                            "all {} nodes of this boundary are held in all directions in stage \
                             `{name}`, by {}: no dashpot there can move",
                            held.nodes,
                            names(&held)
                        ),
                    )
                    .help(
                        "`until` ends the fix at the start of the stage from which (`from`) the \
                         boundary is there; what the fix bore goes on as constant forces",
                    ),
                );
            }
            if let Some(column) = outside.floating(index, &borders.list[index]) {
                let [x, y, z] = point(made, column.nodes[0]);
                faults.push(
                    Fault::new(
                        format!("boundary[{index}]"),
                        format!(
                            "the free-field column at ({x}, {y}, {z}) stands on nothing in \
                             stage `{name}`"
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

/// What is said of boundaries that are held in part.
pub(super) fn doubts(model: &Model) -> Vec<String> {
    let Model { stages, conditions, borders, packs, .. } = model;
    let in_force = InForce { stages, conditions, borders, packs };
    let mut doubts = in_cavities(model);
    let stage = |stage| model.deck().stage.get(stage);
    let moves = |at| stage(at).is_none_or(|stage: &Stage| stage.kind == StageKind::Dynamic);
    for index in 0..borders.list.len() {
        let stages = 0..model.n_stages();
        for stage in stages.filter(|&stage| borders.has(index, stage)) {
            let (made, outside) = in_force.at(stage);
            let held = outside.clamped(made, &borders.list[index]);
            if let Some(first) = held.first {
                let [x, y, z] = point(made, first);
                doubts.push(format!(
                    "boundary {index}: {} of its {} nodes are held in all directions by {}, first \
                     that at ({x}, {y}, {z}): no dashpot there can move",
                    held.count,
                    held.nodes,
                    names(&held)
                ));
                break;
            }
            // A base that waves come in by may bear the weight.
            let side = borders.list[index].wave.is_none() && moves(stage);
            let across = outside.held_across(made, &borders.list[index]).filter(|_| side);
            if let Some((axis, fix)) = across {
                let name = model.deck().stage.get(stage).map_or("", |stage| &stage.name);
                doubts.push(format!(
                    "boundary {index}: fix {fix} holds its nodes along {}, its normal, in stage `{name}`: \
                     what comes straight to it goes back (`until` ends a fix, and what it bore goes on)",
                    ["x", "y", "z"][axis]
                ));
                break;
            }
        }
    }
    doubts
}

/// Fault of a boundary behind a face of which no column can stand.
fn no_column(why: NoColumn, place: &str) -> Fault {
    let (what, help) = match why {
        NoColumn::Level => (
            "a face that looks up or down is no side of a free field",
            "free-field sides are upright, z; the base has a boundary of kind \"viscous\"",
        ),
        NoColumn::Aslant => (
            "a free field needs blocks with one upright edge, along z, and two level ones",
            "take kind \"viscous\" for the sides of other blocks",
        ),
        NoColumn::Unmatched => (
            "a side that goes on in split blocks or in another set has no free field in this version",
            "let the blocks along the side be of one set, and none of them split, from the base up",
        ),
    };
    Fault::new(format!("{place}.where"), what).help(help)
}

/// Fixes that hold nodes, for a message.
fn names(held: &Clamped) -> String {
    let names: Vec<String> = held.fixes.iter().map(|fix| format!("fix[{fix}]")).collect();
    names.join(" and ")
}

fn border(
    (site, stages, properties): (&Site, &Stages, &Properties),
    index: usize,
    entry: &Boundary,
    first: &mut usize,
) -> Result<Border, Fault> {
    let deck = &site.deck;
    let (geometry, start) = (at_stage(deck, stages, entry.from.as_ref()), &**stages.at(0));
    let region = site.region(&entry.region);
    let place = format!("boundary[{index}]");
    let surfaces = surfaces(&region, geometry, &place)?;
    let mut border = Border {
        dashpots: Vec::new(),
        faces: with_areas((&region, &site.region(&Where::default())), geometry, &surfaces),
        under: BTreeSet::new(),
        wave: entry.velocity.map(Vec3::from),
        history: Course::new(entry.history.as_ref()),
        period: deck.period(entry.from.as_ref(), entry.until.as_ref()),
        columns: Vec::new(),
        sides: Vec::new(),
    };
    if entry.kind == BoundaryKind::FreeField {
        let mut ground = Ground::new((geometry, start), properties, first);
        for surface in &surfaces {
            let strips = region.strips(geometry, surface);
            ground.stand(surface, strips).map_err(|why| no_column(why, &place))?;
        }
        (border.columns, border.sides) = ground.done();
        border.dashpots = border.sides.iter().map(|side| (side.node, side.resistance)).collect();
        return Ok(border);
    }
    // Columns go on below what has been taken out.
    for (ground, surfaces) in [(geometry, &surfaces), (start, &region.surfaces(start))] {
        let below = surfaces.iter().filter(|face| face.outward(ground).z < 1e-9 - 1.0);
        let areas = below.flat_map(|face| region.areas(ground, face));
        border.under.extend(areas.map(|(node, _)| node));
    }
    for surface in &surfaces {
        let impedance = impedance(geometry, properties, surface);
        let areas = region.areas(geometry, surface).into_iter();
        border.dashpots.extend(areas.map(|(node, area)| (node, impedance * area)));
    }
    Ok(border)
}

/// The outer faces of deformable blocks that a boundary selects.
fn surfaces(region: &Region, geometry: &Geometry, place: &str) -> Result<Vec<Surface>, Fault> {
    let surfaces = region.surfaces(geometry);
    let place = format!("{place}.where");
    if surfaces.is_empty() {
        let inside = !region.nodes(geometry).is_empty();
        let what = "no outer face of a block";
        let fault = nothing(place, what);
        return Err(match inside {
            true => fault.help(
                "the nodes there are inside of the model or at a joint: a boundary takes faces without a \
                 neighbour, on every plane given",
            ),
            false => fault,
        });
    }
    if surfaces.iter().any(|surface| region.cuts_askew(geometry, surface)) {
        let message = "a range cuts an oblique face askew, which cannot be taken in part";
        return Err(Fault::new(place, message));
    }
    if surfaces.iter().any(|surface| geometry.lattice(surface.body).rigid) {
        let message = "selects faces of rigid blocks: waves go through deformable ones only";
        return Err(Fault::new(place, message).help(
            "leave the boundary out, or make the blocks along it a set with `body = \"deformable\"`",
        ));
    }
    Ok(surfaces)
}

/// Reference position of a node `[m]`.
fn point(made: Made<'_>, node: u32) -> [f64; 3] {
    let (body, at) = made.geometry.locate(node as usize);
    made.geometry.position(body, at).into()
}
