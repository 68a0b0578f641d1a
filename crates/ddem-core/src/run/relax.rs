//! Dynamic relaxation to static equilibrium (§7).
//!
//! This is the step of (2) with fictitious masses and Δt = 1,
//! `v⁺ = [(1 − c/2) v + M⁻¹F] / (1 + c/2)`, `u⁺ = u + v⁺`. M⁻¹ is the inverse stiffness of each
//! cluster of facing nodes and of smooth motions of many blocks
//! ([`preconditioner`](crate::step::preconditioner)), scaled so that Δt = 1 is stable for every
//! mode. The damping fades, `c = 3/(k + 3/2)` with k the steps since the last restart.
//! The motion restarts from rest when it turns against the forces (`F·v < 0`). It is near-critical
//! for the lowest mode that is still active, without an estimate of its frequency.

use std::sync::atomic::Ordering;

use crate::error::RunError;
use crate::model::stage::allow_tolerance;
use crate::run::{ROUNDING_CHECKS, Simulation};
use crate::state::motion::Motion;
use crate::state::{RelaxationProgress, State};
use crate::step::preconditioner::{Preconditioner, Relaxation, has_rotated};
use crate::step::{EvaluationStep, advance_relaxing, balance};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::math::sums::StepSums;

/// Fraction of the path length in the last steps at which displacements have only rounding left.
const AT_REST: f64 = 1e-12;

/// Steps between two checks for forces that are only rounding.
const ROUNDING_CHECK_INTERVAL: u64 = 200;
/// Steps between two checks of the rotations of blocks.
const ROTATION_CHECK_INTERVAL: u64 = 10;

/// Progress of a relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relaxed {
    /// Blocks still move.
    Moving,
    /// Number of increments of the loads that are in equilibrium.
    Increment(u64),
    /// All loads are in equilibrium.
    Done,
}

impl Simulation {
    /// Begins a relaxation: loads go from their present values to those of the stage in
    /// `increments` equal parts. Time stands still; supports with a velocity rest.
    ///
    /// # Errors
    ///
    /// A history that a program computes and that has no value; [stopped](Self::stop_when):
    /// everything is at rest then.
    pub fn start_relaxation(&mut self, increments: u32) -> Result<(), RunError> {
        let state = &self.state;
        let conditions = &self.model.conditions;
        let mut to = conditions.factors(state.stage, state.time, &state.stage_starts)?;
        to.push(1.0);
        let from_stage = state.stage_entry.map_or(state.stage, |entry| entry.from_stage);
        if increments > 1 {
            self.model.check_ramp(&self.model.back(from_stage, state.stage))?;
        }
        self.synchronise();
        self.stop();
        self.drop_relaxation();
        let state = &self.state;
        // An in-situ stress balances all loads at once, not a part of them.
        let all = self.model.in_situ.is_some() && state.steps == 0;
        let progress = RelaxationProgress {
            increments: u64::from(increments.max(1)),
            increment: 1,
            from_stage,
            driven: state.stage_entry.map(|entry| entry.first),
            from: match all {
                true => self.model.conditions.at_once(&to, &state.load_factors),
                false => state.load_factors.clone(),
            },
            path_length: state.path_length,
            to,
            ..RelaxationProgress::default()
        };
        let stop = self.stop.clone();
        let begins = progress.clone();
        self.set_relaxation(progress, &|| stop.load(Ordering::Relaxed))?;
        self.state.stage_entry = None;
        self.keep_slip(true);
        self.begin_increment(&begins);
        self.state.restart_watch(&self.model, true);
        Ok(())
    }

    /// Stores slip and damage of failed pairs and contacts as equilibrium if `now`, otherwise
    /// clears it. A relaxation maps slip from the stored equilibrium.
    pub(super) fn keep_slip(&mut self, now: bool) {
        self.state.broken_joints.set_equilibrium(now);
        self.state.contacts.set_equilibrium(now);
    }

    /// Gives closed faces that have parted their residual cohesion again, in an equilibrium.
    pub(super) fn regain_cohesion(&mut self) {
        self.state.broken_joints.regain_cohesion();
        self.state.contacts.regain_cohesion();
    }

    /// Continues a relaxation from a checkpoint.
    pub(super) fn continue_relaxation(&mut self, progress: RelaxationProgress) {
        if progress.increments > 1 {
            self.ramp_strengths(progress.from_stage, progress.fraction(), false);
        }
        // This cannot stop, needs no history, and had masses before. Otherwise the next step starts
        // a new relaxation and reports the error.
        let _ = self.set_relaxation(progress, &|| false);
    }

    fn set_relaxation(
        &mut self,
        mut progress: RelaxationProgress,
        stop: &dyn Fn() -> bool,
    ) -> Result<(), RunError> {
        self.change_motion(Motion::relaxing(&self.model.assembly));
        self.rest();
        // The former loads act until an increment has made its first step.
        if progress.path_length != 0.0 || !progress.last.is_empty() {
            self.view.factors = progress.present_factors();
        }
        let preconditioner = self.masses(&progress, stop)?;
        preconditioner.contact_masses.note(&mut progress);
        self.relaxation = Some(Relaxation { progress, preconditioner });
        Ok(())
    }

    /// Sets the motion as after a relaxation: everything at rest, with the last loads.
    pub(super) fn rest(&mut self) {
        *self.motion = Motion::relaxing(&self.model.assembly);
        self.view.velocities = vec![[0.0; 3]; self.model.conditions.fixed.len()];
        self.view.factors.clone_from(&self.state.load_factors);
        self.view.boundary_forces = self.view.boundaries.locked_reactions().collect();
    }

    /// Takes one step of relaxation towards the unbalanced force ratio `tolerance`. The step is not
    /// taken if the ratio is reached and the displacements have stopped.
    ///
    /// # Errors
    ///
    /// As [`relax`](Self::relax), but for [`RunError::NotConverged`]; the first step also has those
    /// of [`start_relaxation`](Self::start_relaxation).
    pub fn relax_step(&mut self, tolerance: f64) -> Result<Relaxed, RunError> {
        allow_tolerance(tolerance)?;
        if self.relaxation.is_none() {
            self.start_relaxation(self.default_increments())?;
        }
        let Some(mut relaxation) = self.relaxation.take() else { return Ok(Relaxed::Done) };
        let result = self.relax_with(&mut relaxation, tolerance);
        self.relaxation = Some(relaxation);
        result
    }

    fn relax_with(
        &mut self,
        Relaxation { progress, preconditioner }: &mut Relaxation,
        tolerance: f64,
    ) -> Result<Relaxed, RunError> {
        let sums = self.unbalanced_sums(progress)?;
        let contact_masses = self.contact_masses(progress);
        if contact_masses.differ_by_cells(&preconditioner.contact_masses) {
            contact_masses.note(progress);
            self.add_contact_masses(preconditioner, contact_masses)?;
        } else if preconditioner.contact_masses != contact_masses {
            contact_masses.note(progress);
            // This overwrites the forces: the step is not taken, and the next begins from rest.
            *preconditioner = self.masses_for(contact_masses, progress, &|| false)?;
            self.state.v.fill(Lanes::ZERO);
            progress.rest();
            return Ok(Relaxed::Moving);
        }
        progress.is_smooth = preconditioner.is_smooth();
        let had_failed = self.state.failed != [0; 2];
        if self.fails_now(progress, tolerance) {
            if !had_failed {
                // This cannot be stopped, because pairs have failed already.
                *preconditioner = self.masses(progress, &|| false)?;
            }
            progress.rest();
            return Ok(Relaxed::Moving);
        }
        let is_checked = self.state.steps.is_multiple_of(ROUNDING_CHECK_INTERVAL);
        let at_rest = progress.has_stopped(AT_REST);
        let unloaded = is_checked && self.check_rounding(progress, tolerance, at_rest)?;
        let still = progress.has_stopped(tolerance.max(self.still));
        let stopped = still || progress.rounded >= ROUNDING_CHECKS;
        if unloaded || (sums.ratio() <= tolerance && stopped) {
            return Ok(self.end_increment(progress));
        }
        self.check_motion()?;
        self.move_relaxing(progress, preconditioner, sums.power);
        Ok(Relaxed::Moving)
    }

    /// Computes the forces at the present displacements and load increment, and books their work.
    fn unbalanced_sums(&mut self, progress: &mut RelaxationProgress) -> Result<StepSums, RunError> {
        self.view.factors = progress.present_factors();
        // No gas vents while time stands still.
        let detonation_volume = self.update_gas().into_iter().map(|fill| fill.detonation_volume);
        self.state
            .gas_surfaces
            .iter_mut()
            .zip(detonation_volume)
            .for_each(|(surface, detonation_volume)| surface.detonation_volume = detonation_volume);
        let (context, state, scratch) = self.parts();
        let State { u, v, poses, broken_joints, contacts, .. } = state;
        let (mut sums, losses) =
            balance(context, EvaluationStep { u, v, poses, broken_joints, contacts }, scratch);
        if sums.applied == 0.0 {
            // Without applied forces the ratio refers to the forces at the start.
            progress.first = if progress.first == 0.0 { sums.free } else { progress.first };
            sums.applied = progress.first;
        }
        progress.most = progress.most.max(sums.applied);
        self.last = sums;
        self.add_losses(losses);
        let work = &mut self.state.work;
        work.loads += sums.loads[0];
        work.most = work.most.max((work.loads + work.supports).abs());
        work.damping += 0.5 * sums.power;
        self.check(sums, &self.state.contacts)?;
        self.state.before = self.motion.time_step;
        Ok(sums)
    }

    /// Ends an increment in equilibrium, and begins the next one if there is one.
    fn end_increment(&mut self, progress: &mut RelaxationProgress) -> Relaxed {
        let done = progress.increment;
        self.regain_cohesion();
        self.note_stresses();
        self.state.v.fill(Lanes::ZERO);
        self.state.load_factors.clone_from(&self.view.factors);
        if done == progress.increments {
            return Relaxed::Done;
        }
        progress.next_increment();
        self.keep_slip(true);
        self.begin_increment(progress);
        let state = &mut *self.state;
        state.watch.note_near_equilibrium(state.steps);
        state.restart_watch(&self.model, false);
        Relaxed::Increment(done)
    }

    /// Moves along the forces by one step with Nesterov's momentum. It restarts from rest if the
    /// last step went against the forces; `power` is their power in it.
    fn move_relaxing(
        &mut self,
        progress: &mut RelaxationProgress,
        preconditioner: &mut Preconditioner,
        power: f64,
    ) {
        if !progress.has_rotated && self.state.steps.is_multiple_of(ROTATION_CHECK_INTERVAL) {
            progress.has_rotated = has_rotated(&self.model, &self.scratch.frames);
            progress.since_restart *= u64::from(!progress.has_rotated);
        }
        if progress.has_rotated {
            preconditioner.turn(&self.model, &self.scratch.frames);
        }
        let restart = progress.since_restart == 0 || power < 0.0;
        progress.since_restart *= u64::from(!restart);
        let c = (3.0 / (progress.since_restart as f64 + 1.5)).min(2.0);
        progress.since_restart += 1;
        let keep = if restart { 0.0 } else { (1.0 - c / 2.0) / (1.0 + c / 2.0) };
        let push = 1.0 / (1.0 + c / 2.0);
        let (state, scratch) = (&mut self.state, &mut self.scratch);
        let moved = advance_relaxing(&self.model, preconditioner, [keep, push], state, scratch);
        self.state.work.damping += 0.5 * moved.power;
        self.state.steps += 1;
        progress.add_path(moved.moved.sqrt());
        self.state.path_length = progress.path_length;
    }

    /// Checks if blocks continue to move against each other. Stores slip if they only rattle.
    fn check_motion(&mut self) -> Result<(), RunError> {
        self.state.watch_motion(&self.model, self.last.ratio(), true);
        if self.state.watch.fails(self.far) {
            return Err(self.no_equilibrium());
        }
        if self.state.watch.rattles(self.state.steps) {
            self.keep_slip(true);
        }
        Ok(())
    }

    /// Relaxes to equilibrium and returns the number of steps.
    ///
    /// # Errors
    ///
    /// [`RunError::NotConverged`] after `max_steps` steps, with the ratio reached;
    /// [`RunError::NoEquilibrium`] if blocks move without end; [`RunError::UnreachableTolerance`]
    /// if rounding keeps the ratio above the tolerance; [`RunError::DeepPenetration`] if a contact
    /// does not carry its load; [`RunError::Diverged`]; [`RunError::Values`] of a tolerance that is
    /// not between 0 and 1; those of [`start_relaxation`](Self::start_relaxation).
    pub fn relax(&mut self, tolerance: f64, max_steps: u64) -> Result<u64, RunError> {
        allow_tolerance(tolerance)?;
        self.start_relaxation(self.default_increments())?;
        for step in 0..=max_steps {
            let relaxed = self.relax_step(tolerance);
            if matches!(relaxed, Err(_) | Ok(Relaxed::Done)) {
                self.finish_relaxation();
                return relaxed.map(|_| step);
            }
        }
        let error = self.not_converged(tolerance, max_steps);
        self.finish_relaxation();
        Err(error)
    }

    /// Ends a relaxation and brings everything to rest.
    pub fn finish_relaxation(&mut self) {
        self.synchronise();
        if self.drop_relaxation() {
            self.state.load_factors.clone_from(&self.view.factors);
        }
    }

    /// Drops a relaxation with its data and restores the strengths of the deck. Returns true if
    /// there was one.
    pub(super) fn drop_relaxation(&mut self) -> bool {
        let Some(Relaxation { progress, .. }) = self.relaxation.take() else { return false };
        if progress.increment < progress.increments {
            self.ramp_strengths(progress.from_stage, 1.0, true);
        }
        self.keep_slip(false);
        true
    }
}
