//! The forces of blocks that are taken out, as loads that fade.

use super::{Applied, Charged, Factor, Loaded};
use crate::deck::{Deck, History, Period, Remove, StageKind};
use crate::error::Fault;
use crate::geometry::{Stages, Vec3};
use crate::history::Course;

/// Forces of removed blocks that fade.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Released {
    /// When they began to `[s]`.
    pub(crate) began: f64,
    /// A relaxation has taken them back.
    pub(crate) over: bool,
    /// By node `[N]`.
    pub(crate) forces: Applied,
}

/// How the forces of removed blocks go.
#[derive(Clone, Debug)]
pub(super) struct Fading {
    /// The first stage in which they are gone, whatever the time: relaxation takes them back.
    ends: Option<usize>,
    /// When they began to `[s]`; the stage at whose start that was may begin anew.
    began: f64,
    /// A relaxation has taken them back.
    over: bool,
}

impl Loaded {
    pub(super) fn acts(&self, stage: usize) -> bool {
        self.fading.as_ref().map_or_else(|| self.period.has(stage), |fading| !fading.over)
    }

    pub(super) fn factor(&self, time: f64, starts: &[f64]) -> Factor {
        match &self.fading {
            // Given in the deck, so that it is known.
            Some(fading) => Factor::of(&self.history, time - fading.began),
            None => self.period.factor(&self.history, time, starts),
        }
    }

    /// Whether its forces are gone in a stage, whatever the time.
    pub(crate) fn ends(&self, stage: usize) -> bool {
        let ends = self.fading.as_ref().and_then(|fading| fading.ends);
        ends.is_some_and(|ends| ends <= stage)
    }

    /// Sets the forces, and how far they are.
    pub(crate) fn release(&mut self, released: &Released) {
        let Released { began, over, forces } = released;
        self.forces = forces.iter().map(|(&node, &f)| (node, Vec3::from(f))).collect();
        if let Some(fading) = &mut self.fading {
            (fading.began, fading.over) = (*began, *over);
        }
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
    let from = Period::new(deck, remove.from.as_ref(), None).from.unwrap_or(0);
    let fades = remove.release.filter(|&time| time > 0.0);
    let table = fades.map_or(vec![[0.0, 0.0]], |time| vec![[0.0, 1.0], [time, 0.0]]);
    let stages = deck.stage.iter().enumerate().skip(from);
    let mut relaxing = stages.filter(|(_, stage)| stage.kind == StageKind::Relax);
    let ends = relaxing.next().map(|(stage, _)| stage);
    Loaded {
        forces: Vec::new(),
        history: Course::Given(History::Table(table)),
        period: Period::new(deck, None, None),
        fading: Some(Fading { ends, began: 0.0, over: false }),
    }
}
