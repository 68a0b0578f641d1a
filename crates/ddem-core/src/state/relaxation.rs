//! Progress of a relaxation from step to step.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

/// Steps over which the displacements must have stopped.
const WINDOW: usize = 50;

/// Progress of a relaxation, which a checkpoint keeps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RelaxationProgress {
    /// Equal parts in which loads reach their value.
    pub(crate) increments: u64,
    /// The part that is being relaxed, from 1.
    pub(crate) increment: u64,
    /// The stage whose strengths are those before.
    pub(crate) left: usize,
    /// The first of the stages that begin, if they do: their supports are driven.
    pub(crate) driven: Option<usize>,
    /// Steps since the last restart.
    pub(crate) since_restart: u64,
    /// Load factors before and after.
    pub(crate) from: Vec<f64>,
    pub(crate) to: Vec<f64>,
    /// Failure has been looked for near this equilibrium.
    pub(crate) looked: bool,
    /// Blocks have turned far: masses turn with them.
    pub(crate) turned: bool,
    /// Looks in a row at which nothing but rounding was out of balance.
    pub(crate) rounded: u64,
    /// The unbalanced ratio at the first of these.
    pub(crate) least: f64,
    /// Length of the way that relaxation has gone so far, and of the last steps of this part.
    pub(crate) path_length: f64,
    pub(crate) last: VecDeque<f64>,
    /// The largest `Σ (Q + R)²` so far.
    pub(crate) most: f64,
    /// `Σ F²` at the start, where nothing is applied.
    pub(crate) first: f64,
}

impl RelaxationProgress {
    /// Load factors of the part that is being relaxed.
    pub(crate) fn present_factors(&self) -> Vec<f64> {
        let part = self.part();
        let between = |(from, to): (&f64, &f64)| from + (to - from) * part;
        self.from.iter().zip(&self.to).map(between).collect()
    }

    /// Part of all increments that is being relaxed.
    pub(crate) fn part(&self) -> f64 {
        self.increment as f64 / self.increments as f64
    }

    pub(crate) fn walk(&mut self, step: f64) {
        self.path_length += step;
        self.last.push_back(step);
        if self.last.len() > WINDOW {
            self.last.pop_front();
        }
    }

    /// The last steps are short against the whole way; or nothing ever had to move.
    pub(crate) fn has_stopped(&self, tolerance: f64) -> bool {
        let last: f64 = self.last.iter().sum();
        self.path_length == 0.0
            || (self.last.len() == WINDOW && last <= 2.0 * tolerance * self.path_length)
    }

    pub(crate) fn next_increment(&mut self) {
        self.increment += 1;
        self.rest();
    }

    /// Goes on from rest.
    pub(crate) fn rest(&mut self) {
        self.since_restart = 0;
        self.last.clear();
        self.looked = false;
        self.rounded = 0;
    }
}
