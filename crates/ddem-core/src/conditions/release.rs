//! The forces of blocks that are taken out, as loads that fade.

use super::{Applied, Charged, Conditions, Factor, Loaded};
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
    /// The stage at whose start they begin to.
    from: usize,
    /// Relax stages, which take them back whatever the time.
    relaxing: Vec<usize>,
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

    /// Whether its forces may change after a time.
    pub(super) fn changes_after(&self, time: f64, starts: &[f64]) -> bool {
        let since = match &self.fading {
            Some(fading) => time - fading.began,
            None => self.period.since(time, starts),
        };
        self.history.changes_after(since)
    }

    /// Whether its forces are gone in a stage, whatever the time.
    pub(crate) fn ends(&self, stage: usize) -> bool {
        // Programs may enter a stage from before, and leave out those between.
        let ends = |fading: &Fading, relax: usize| {
            relax == stage || (fading.from..=stage).contains(&relax)
        };
        self.fading.as_ref().is_some_and(|f| f.relaxing.iter().any(|&relax| ends(f, relax)))
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

impl Conditions {
    /// Factors from which loads go to those of the first relaxation where there is a stress at the start,
    /// which bears all of them at once: only what removed blocks exerted goes from where it is `now`.
    pub(crate) fn at_once(&self, to: &[f64], now: &[f64]) -> Vec<f64> {
        let mut from = to.to_vec();
        let loads = self.loaded.iter().zip(from.iter_mut().zip(now));
        loads.filter(|(load, _)| load.fading.is_some()).for_each(|(_, (from, now))| *from = *now);
        from
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
    let stages = deck.stage.iter().enumerate();
    let relaxing = stages.filter(|(_, stage)| stage.kind == StageKind::Relax);
    let relaxing = relaxing.map(|(stage, _)| stage).collect();
    Loaded {
        forces: Vec::new(),
        history: Course::Given(History::Table(table)),
        period: Period::new(deck, None, None),
        fading: Some(Fading { from, relaxing, began: 0.0, over: false }),
    }
}
