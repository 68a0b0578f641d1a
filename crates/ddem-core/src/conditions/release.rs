//! The forces of blocks that are taken out, as loads that fade.

use super::{Charged, Loaded};
use crate::deck::{Deck, History, Period, Remove, StageKind};
use crate::error::Fault;
use crate::geometry::Stages;
use crate::history::Course;

impl Loaded {
    pub(super) fn acts(&self, stage: usize) -> bool {
        self.period.has(stage) && self.ends.is_none_or(|ends| stage < ends)
    }
}

/// What is wrong with a charge whose walls are taken out while it is in force.
pub(super) fn without_walls(
    (deck, stages): (&Deck, &Stages),
    (index, charged): (usize, &Charged),
) -> Option<Fault> {
    let mut acts = deck.stage.iter().enumerate().filter(|(stage, _)| charged.period.has(*stage));
    let (_, stage) = acts.find(|&(stage, _)| {
        let geometry = stages.at(stage);
        let gone = |node: &u32| geometry.is_gone(geometry.locate(*node as usize).0);
        charged.charge.nodes.iter().any(gone)
    })?;
    let message = format!("blocks that it pushes are taken out in stage `{}`", stage.name);
    let help = format!("`until = \"{}\"` ends it in time", stage.name);
    Some(Fault::new(format!("charge[{index}]"), message).help(help))
}

/// The load in which the forces that blocks exerted go on when they are taken out: there are none before.
pub(super) fn released(deck: &Deck, remove: &Remove) -> Loaded {
    let period = Period::new(deck, remove.from.as_ref(), None);
    let fades = remove.release.filter(|&time| time > 0.0);
    let table = fades.map_or(vec![[0.0, 0.0]], |time| vec![[0.0, 1.0], [time, 0.0]]);
    let stages = deck.stage.iter().enumerate().skip(period.from.unwrap_or(0));
    let mut relaxing = stages.filter(|(_, stage)| stage.kind == StageKind::Relax);
    let ends = relaxing.next().map(|(stage, _)| stage);
    Loaded { forces: Vec::new(), history: Course::Given(History::Table(table)), period, ends }
}
