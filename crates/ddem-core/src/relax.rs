//! §7: dynamic relaxation to static equilibrium.
//!
//! The step of (M2) with fictitious masses, Δt = 1. The masses are bounds on the rows of the
//! stiffness, `m_i = ¼ Σ_j |K_ij|` (Gershgorin), summed over elements, the largest of a node's
//! three, so that Δt = 1 is stable for every mode. The damping vanishes as the motion goes on,
//! `c = 3/(k + 3/2)` with k the steps since the last restart, and the motion restarts from rest
//! when it turns against the forces (`F·v < 0`): near-critical for the lowest mode that is still
//! active, without an estimate of its frequency.

use crate::assembly::Inertia;
use crate::error::RunError;
use crate::motion::Motion;
use crate::simulation::Simulation;

/// Margin on the fictitious masses: stiffness changes a little as blocks turn.
const MARGIN: f64 = 1.02;

/// How a relaxation is going: everything that a checkpoint needs to go on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Relaxation {
    /// Equal parts in which loads reach their value.
    increments: u32,
    /// The part that is being relaxed, from 1.
    increment: u32,
    /// Steps since the last restart.
    since_restart: u64,
    /// Steps of this relaxation.
    pub(crate) steps: u64,
    /// The next step starts from rest.
    restart: bool,
    /// Load factors before and after.
    from: Vec<f64>,
    to: Vec<f64>,
}

/// Where a relaxation is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relaxed {
    /// Still moving.
    Moving,
    /// One increment of the loads is in equilibrium.
    Increment(u32),
    /// All loads are in equilibrium.
    Done,
}

impl Simulation {
    /// Begins a relaxation: loads will go from their present value to that of the stage in
    /// `increments` equal parts. Time stands still; driven supports rest.
    pub fn start_relaxation(&mut self, increments: u32) {
        self.settle();
        self.stop();
        let state = &self.state;
        let mut to = Vec::new();
        self.model.conditions.factors(state.stage, state.time, &state.stage_starts, &mut to);
        to.push(1.0);
        self.relaxation = Some(Relaxation {
            increments: increments.max(1),
            increment: 1,
            since_restart: 0,
            steps: 0,
            restart: true,
            from: state.load_factors.clone(),
            to,
        });
        self.motion = Motion::relaxing(&self.model.assembly, fictitious_mass);
        self.velocities = vec![[0.0; 3]; self.model.conditions.fixed.len()];
    }

    /// One step of relaxation towards the unbalanced force ratio `tolerance`.
    ///
    /// # Errors
    ///
    /// A number that is not finite.
    pub fn relax_step(&mut self, tolerance: f64) -> Result<Relaxed, RunError> {
        if self.relaxation.is_none() {
            self.start_relaxation(1);
        }
        let Some(relaxation) = &mut self.relaxation else { return Ok(Relaxed::Done) };
        let part = f64::from(relaxation.increment) / f64::from(relaxation.increments);
        let factors = relaxation.from.iter().zip(&relaxation.to);
        self.factors = factors.map(|(from, to)| from + (to - from) * part).collect();
        let k = relaxation.since_restart as f64;
        self.motion.damp((3.0 / (k + 1.5)).min(2.0));
        if relaxation.restart {
            self.motion.scale[0] = 0.0;
        }
        self.motion.start = false;
        let (context, state, scratch) = self.parts();
        let sums = crate::step::step(context, state, scratch);
        self.book(sums);
        self.check(sums)?;
        let Some(relaxation) = &mut self.relaxation else { return Ok(Relaxed::Done) };
        relaxation.steps += 1;
        relaxation.since_restart += 1;
        relaxation.restart = sums.power < 0.0;
        if relaxation.restart {
            relaxation.since_restart = 0;
        }
        if !converged(&sums, tolerance, relaxation.since_restart) {
            return Ok(Relaxed::Moving);
        }
        let done = relaxation.increment;
        if done == relaxation.increments {
            self.state.load_factors.clone_from(&self.factors);
            return Ok(Relaxed::Done);
        }
        relaxation.increment += 1;
        relaxation.restart = true;
        relaxation.since_restart = 0;
        Ok(Relaxed::Increment(done))
    }

    /// Relaxes to equilibrium.
    ///
    /// # Errors
    ///
    /// [`RunError::NotConverged`] after `max_steps` steps, with the ratio reached; a number that
    /// is not finite.
    pub fn relax(&mut self, tolerance: f64, max_steps: u64) -> Result<u64, RunError> {
        self.start_relaxation(1);
        for step in 1..=max_steps {
            if self.relax_step(tolerance)? == Relaxed::Done {
                self.finish_relaxation();
                return Ok(step);
            }
        }
        self.finish_relaxation();
        Err(RunError::NotConverged { ratio: self.last.ratio(), tolerance, max_steps })
    }

    /// Ends a relaxation: everything is at rest.
    pub fn finish_relaxation(&mut self) {
        self.settle();
        self.relaxation = None;
    }
}

/// In equilibrium, and no longer moving.
fn converged(sums: &crate::sums::Sums, tolerance: f64, _since_restart: u64) -> bool {
    sums.ratio() <= tolerance
}

fn fictitious_mass(inertia: &Inertia, at: usize, lane: usize) -> f64 {
    let node = at - at % 3;
    let rows = [0, 1, 2].map(|c| inertia.row_sums[node + c].0[lane]);
    0.25 * MARGIN * rows.into_iter().fold(0.0, f64::max)
}
