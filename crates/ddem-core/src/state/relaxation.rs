//! Progress of a relaxation from step to step.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

/// Number of steps over which the displacements must have stopped, and of those in a relaxation so
/// short that a third of it is less. What takes few steps to move is seen in few steps.
const WINDOW: usize = 50;
const SHORT_WINDOW: usize = 20;

/// Progress of a relaxation. Checkpoints contain it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RelaxationProgress {
    /// Number of equal parts in which loads reach their values.
    pub(crate) increments: u64,
    /// Increment that is being relaxed, counted from 1.
    pub(crate) increment: u64,
    /// Stage with the strengths at the start.
    pub(crate) from_stage: usize,
    /// First of the stages that begin, if any do; their supports are driven.
    pub(crate) driven: Option<usize>,
    /// Steps since the last restart.
    pub(crate) since_restart: u64,
    /// Load factors at the start (`from`) and at the end (`to`).
    pub(crate) from: Vec<f64>,
    pub(crate) to: Vec<f64>,
    /// True if failure has been checked near this equilibrium.
    pub(crate) failure_checked: bool,
    /// True if pairs have failed in this increment.
    pub(crate) fails_on: bool,
    /// Largest overload around each block at the last look since pairs have failed; none at first.
    pub(crate) overloads: Vec<f64>,
    /// True if the masses contain smooth motions of many blocks.
    pub(crate) is_smooth: bool,
    /// True if blocks have met in this relaxation between which smooth motions do not hold.
    pub(crate) has_met: bool,
    /// Cells that have been in contact in this relaxation, sorted.
    pub(crate) contact_cells: Vec<u32>,
    /// True if blocks have rotated far, so that the masses rotate with them.
    pub(crate) has_rotated: bool,
    /// Number of successive checks at which only rounding was out of balance.
    pub(crate) rounded: u64,
    /// Unbalanced force ratio at the first of these checks.
    pub(crate) least: f64,
    /// Path length of relaxation so far, and of the last steps of this increment (`last`) `[m]`.
    pub(crate) path_length: f64,
    pub(crate) last: VecDeque<f64>,
    /// Number of steps of this increment since it began, or since pairs failed.
    pub(crate) steps: usize,
    /// Largest `Σ (Q + R)²` so far `[N²]`.
    pub(crate) most: f64,
    /// Sum `Σ F²` at the start, if nothing is applied `[N²]`.
    pub(crate) first: f64,
}

impl RelaxationProgress {
    /// Load factors of the increment that is being relaxed.
    pub(crate) fn present_factors(&self) -> Vec<f64> {
        let fraction = self.fraction();
        let between = |(from, to): (&f64, &f64)| from + (to - from) * fraction;
        self.from.iter().zip(&self.to).map(between).collect()
    }

    /// Fraction of the change of loads and strengths that the present increment reaches.
    pub(crate) fn fraction(&self) -> f64 {
        self.increment as f64 / self.increments as f64
    }

    pub(crate) fn add_path(&mut self, step: f64) {
        self.path_length += step;
        self.steps += 1;
        self.last.push_back(step);
        if self.last.len() > WINDOW {
            self.last.pop_front();
        }
    }

    /// True if the last steps are short relative to the whole path, or if nothing has had to move.
    pub(crate) fn has_stopped(&self, tolerance: f64) -> bool {
        let least = if self.is_smooth { SHORT_WINDOW } else { WINDOW };
        let window = (self.steps / 3).clamp(least, WINDOW);
        let last: f64 = self.last.iter().rev().take(window).sum();
        self.path_length == 0.0
            || (self.last.len() >= window && last <= 2.0 * tolerance * self.path_length)
    }

    pub(crate) fn next_increment(&mut self) {
        self.increment += 1;
        self.fails_on = false;
        self.rest();
    }

    /// Restarts from rest.
    pub(crate) fn rest(&mut self) {
        self.since_restart = 0;
        self.last.clear();
        self.steps = 0;
        self.failure_checked = false;
        self.overloads.clear();
        self.rounded = 0;
    }
}
