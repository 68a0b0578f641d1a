//! Conversion of `[[fix]]`, `[[load]]`, `[[charge]]` and `[[remove]]` entries to conditions at
//! nodes.

use ddem_core::problem::{
    BlockFace, Conditions, ForceFading, Geometry, LoadPattern, StageRange, Stages, StartMotion,
    SupportGroup, TimeFunction, TimedCharge, Vec3,
};
use ddem_core::{ErrorCode, Fault, Problem};

use super::at_stage;
use super::charge::{Holes, charge};
use super::geometry::{NodeSearch, Selector, no_face, no_node, nothing};
use crate::lint::Diagnostic;
use crate::schema::{ChargeHistory, Deck, History, Initial, Load, Remove, StageKind, Where};

/// Supports, loads and charges of a deck, with the warnings about each charge.
///
/// Each entry refers to the geometry at the start of its stage. Faces that an excavation exposes
/// can therefore be loaded and held from then on.
pub(super) fn conditions(
    deck: &Deck,
    problem: &Problem,
) -> Result<(Conditions, Vec<Vec<Diagnostic>>), Vec<Fault>> {
    let mut faults = Vec::new();
    let (fixed, loaded) = (fixes(deck, problem, &mut faults), loads(deck, problem, &mut faults));
    let (charged, warnings) = charges(deck, problem, &mut faults);
    let mut conditions = Conditions { fixed, loaded, charged };
    let Problem { stages, sets, .. } = problem;
    let charges = conditions.charged.iter().enumerate();
    faults.extend(charges.filter_map(|charge| without_walls((deck, stages), charge)));
    conditions.loaded.extend(deck.remove.iter().map(|remove| released(deck, remove)));
    let moving = |initial: &&Initial| initial.velocity.is_some() || initial.spin.is_some();
    let search = NodeSearch::new(stages.at(0));
    for (index, initial) in deck.initial.iter().enumerate().filter(|(_, i)| moving(i)) {
        let selector = Selector::new(&initial.r#where, sets);
        if search.nodes(&selector).is_empty() {
            faults.push(no_node(format!("initial[{index}].where"), &selector, stages.at(0)));
        }
    }
    if faults.is_empty() { Ok((conditions, warnings)) } else { Err(faults) }
}

/// Supports, with the nodes that each holds.
fn fixes(deck: &Deck, problem: &Problem, faults: &mut Vec<Fault>) -> Vec<SupportGroup> {
    let Problem { stages, sets, .. } = problem;
    let selector = |r: &Where| Selector::new(r, sets);
    let mut fixed = Vec::new();
    for (index, fix) in deck.fix.iter().enumerate() {
        let geometry = at_stage(deck, stages, fix.from.as_ref());
        let nodes = selector(&fix.r#where).nodes(geometry);
        if nodes.is_empty() {
            let selector = selector(&fix.r#where);
            faults.push(no_node(format!("fix[{index}].where"), &selector, geometry));
        }
        fixed.push(SupportGroup {
            nodes,
            removed: selector(&fix.r#where).removed_nodes(stages.at(0), geometry),
            axes: ['x', 'y', 'z'].map(|axis| fix.axes.contains(axis)),
            velocity: fix.velocity,
            displacement: fix.displacement.unwrap_or_default(),
            history: TimeFunction::new(fix.history.as_ref()),
            in_force: deck.stage_range(fix.from.as_ref(), fix.until.as_ref()),
        });
    }
    fixed
}

/// Loads, with their nodal forces.
fn loads(deck: &Deck, problem: &Problem, faults: &mut Vec<Fault>) -> Vec<LoadPattern> {
    let Problem { stages, sets, .. } = problem;
    let selector = |r: &Where| Selector::new(r, sets);
    let mut loaded = Vec::new();
    for (index, load) in deck.load.iter().enumerate() {
        let geometry = at_stage(deck, stages, load.from.as_ref());
        let at = format!("load[{index}].where");
        match nodal_forces(load, &selector(&load.r#where), geometry, at) {
            Ok(forces) => loaded.push(LoadPattern {
                forces,
                history: TimeFunction::new(load.history.as_ref()),
                in_force: deck.stage_range(load.from.as_ref(), load.until.as_ref()),
                fading: None,
            }),
            Err(fault) => faults.push(fault),
        }
    }
    loaded
}

/// Charges, with the warnings about each.
fn charges(
    deck: &Deck,
    problem: &Problem,
    faults: &mut Vec<Fault>,
) -> (Vec<TimedCharge>, Vec<Vec<Diagnostic>>) {
    let Problem { stages, sets, .. } = problem;
    let selector = |r: &Where| Selector::new(r, sets);
    let mut charged = Vec::new();
    let mut warnings = Vec::new();
    let mut holes: Vec<Holes<'_>> = Vec::new();
    for (index, entry) in deck.charge.iter().enumerate() {
        let geometry = at_stage(deck, stages, entry.from.as_ref());
        let known = holes.iter().position(|holes| std::ptr::eq(holes.geometry, geometry));
        let at = known.unwrap_or_else(|| {
            holes.push(Holes::new(geometry));
            holes.len() - 1
        });
        match charge(index, deck, &selector(&entry.r#where), &holes[at]) {
            Ok((charge, warning)) => {
                warnings.push(warning);
                charged.push(TimedCharge {
                    charge,
                    history: match &entry.history {
                        Some(ChargeHistory::Given(history)) => TimeFunction::new(Some(history)),
                        _ => TimeFunction::Constant,
                    },
                    delay: entry.delay.unwrap_or_default(),
                    in_force: deck.stage_range(entry.from.as_ref(), entry.until.as_ref()),
                });
            }
            Err(fault) => faults.push(fault),
        }
    }
    (charged, warnings)
}

/// Initial motions of nodes. Entries before the first motion are skipped; a later entry without
/// motion sets its nodes to rest.
pub(super) fn motions(deck: &Deck, problem: &Problem) -> Vec<StartMotion> {
    let search = NodeSearch::new(problem.stages.at(0));
    let motion = |initial: &Initial| StartMotion {
        nodes: search.nodes(&Selector::new(&initial.r#where, &problem.sets)),
        velocity: Vec3::from(initial.velocity.unwrap_or_default()),
        spin: Vec3::from(initial.spin.unwrap_or_default()),
        centre: Vec3::from(initial.centre.unwrap_or_default()),
    };
    let moving = |initial: &&Initial| initial.velocity.is_some() || initial.spin.is_some();
    deck.initial.iter().skip_while(|initial| !moving(initial)).map(motion).collect()
}

/// Nodal forces of one load, whose `where` is at this place of the deck.
fn nodal_forces(
    load: &Load,
    selector: &Selector,
    geometry: &Geometry,
    at: String,
) -> Result<Vec<(u32, Vec3)>, Fault> {
    let refused = |message: &str| Fault::new(ErrorCode::EmptySelection, at.clone(), message);
    let forces: Vec<(u32, Vec3)> = if let Some(line) = load.line {
        let lengths = selector.lengths(geometry).ok_or_else(|| {
            refused("a line needs planes on two axes, and blocks with an edge along the third")
        })?;
        lengths.into_iter().map(|(node, length)| (node, Vec3::from(line) * length)).collect()
    } else if let Some(force) = load.force {
        let weights = selector.weights(geometry);
        let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
        weights.into_iter().map(|(node, w)| (node, Vec3::from(force) * (w / total))).collect()
    } else {
        let surfaces = selector.surfaces(geometry);
        if surfaces.iter().any(|face| selector.cuts_askew(geometry, face)) {
            return Err(refused(
                "a range cuts an oblique face askew, which cannot be loaded in part",
            ));
        }
        let of = |face: &BlockFace| {
            let traction = match (load.traction, load.pressure) {
                (Some(traction), _) => Vec3::from(traction),
                (None, pressure) => -face.outward(geometry) * pressure.unwrap_or(0.0),
            };
            let areas = selector.areas(geometry, face).into_iter();
            areas.map(move |(node, area)| (node, traction * area)).collect::<Vec<_>>()
        };
        surfaces.iter().flat_map(of).collect()
    };
    if !forces.is_empty() {
        return Ok(forces);
    }
    Err(match (load.line, load.force) {
        (Some(_), _) => nothing(at, "no node lies on that line"),
        (None, Some(_)) => no_node(at, selector, geometry),
        _ => no_face(nothing(at, "no outer face of a block"), selector, geometry),
    })
}

/// Fault of a charge whose walls are removed while it is in force.
fn without_walls(
    (deck, stages): (&Deck, &Stages),
    (index, charged): (usize, &TimedCharge),
) -> Option<Fault> {
    let mut acts = deck.stage.iter().enumerate().filter(|(stage, _)| charged.in_force.has(*stage));
    let (_, stage) = acts.find(|&(stage, _)| {
        let geometry = stages.at(stage);
        let removed = |node: &u32| geometry.is_removed(geometry.locate(*node as usize).0);
        charged.charge.nodes.iter().any(removed)
    })?;
    let message = format!("stage `{}` removes blocks that this charge pushes", stage.name);
    let help = format!("`until = \"{}\"` ends it in time", stage.name);
    Some(Fault::new(ErrorCode::NotSupported, format!("charge[{index}]"), message).help(help))
}

/// Load that continues the forces of removed blocks. It has no forces before their removal.
fn released(deck: &Deck, remove: &Remove) -> LoadPattern {
    let from = deck.stage_range(remove.from.as_ref(), None).from.unwrap_or(0);
    let fades = Some(remove.release.unwrap_or_default()).filter(|&time| time > 0.0);
    let table = fades.map_or(vec![[0.0, 0.0]], |time| vec![[0.0, 1.0], [time, 0.0]]);
    let stages = deck.stage.iter().enumerate();
    let relaxing = stages.filter(|(_, stage)| stage.kind == StageKind::Relax);
    let relaxing = relaxing.map(|(stage, _)| stage).collect();
    LoadPattern {
        forces: Vec::new(),
        history: TimeFunction::Given(History::Table(table)),
        in_force: StageRange::ALWAYS,
        fading: Some(ForceFading::new(from, fades.is_some(), relaxing)),
    }
}

#[cfg(test)]
mod tests;
