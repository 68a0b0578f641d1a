//! The forces of blocks that are taken out, as loads that fade.

use super::{Loaded, Period};
use crate::deck::{Deck, History, Remove, StageKind};
use crate::history::Course;

impl Loaded {
    pub(super) fn acts(&self, stage: usize) -> bool {
        self.period.has(stage) && self.ends.is_none_or(|ends| stage < ends)
    }
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
