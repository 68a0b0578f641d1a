//! §6: how long the steps of time are.

use std::borrow::Cow;
use std::sync::atomic::Ordering;

use super::Simulation;
use crate::error::RunError;
use crate::model::Model;
use crate::model::stage::{Damping, TimeStep, allow_motion};
use crate::state::motion::Motion;
use crate::step::timestep::largest_eigenvalue;
use ddem_joint::contact::{AddedStiffness, ContactSurfaces, bound};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::math::sums::StepSums;

/// Part of the critical step that `"auto"` takes (§6).
const SAFETY: f64 = 0.9;

/// Safety factor of the critical step once pairs have failed: frictional springs, some sliding, flutter close to the
/// critical step.
const BROKEN_SAFETY: f64 = 0.8;

/// Part of these that is left where rigid blocks may meet: a contact that lasts a few steps only gains or
/// loses some per cent of the energy.
const RESOLVED: f64 = 0.25;

/// Part of the critical step below which a step, or a duration, is a mistake, and its inverse may
/// overflow.
pub const SHORTEST_STEP: f64 = 1e-9;

impl Simulation {
    /// Critical time step `2/ω_max` `[s]`; computed at the first call. Contacts that may come are in
    /// it, as stiff as they can be. Once pairs have failed it is
    /// the smaller one of the model as it started and with all joints that can fail turned to
    /// springs, which can be a fifth less.
    ///
    /// # Errors
    ///
    /// [Told to stop](Self::stop_when): a large model takes seconds.
    pub fn critical_step(&mut self) -> Result<f64, RunError> {
        let intact = self.critical(false)?;
        Ok(if self.state.failed == [0; 2] { intact } else { intact.min(self.critical(true)?) })
    }

    /// Time step `[s]` up to which the model stays stable however its joints fail.
    ///
    /// # Errors
    ///
    /// As [`critical_step`](Self::critical_step).
    pub fn safe_step(&mut self) -> Result<f64, RunError> {
        let intact = self.critical(false)?;
        if !self.model.can_fail() {
            return Ok(intact);
        }
        Ok(BROKEN_SAFETY * intact.min(self.critical(true)?))
    }

    /// Automatic step of a stage that begins with blocks at rest, or `moving` `[s]`. It lasts until the first
    /// failure, when it becomes a shorter one. A shock is too rough for such a change: where joints can fail, a
    /// stage that begins with blocks in motion has the shorter step from the start.
    ///
    /// # Errors
    ///
    /// As [`critical_step`](Self::critical_step).
    pub fn automatic_step(&mut self, damping: Damping, moving: bool) -> Result<f64, RunError> {
        if self.state.failed != [0; 2] || (moving && self.model.can_fail()) {
            return self.broken_step(damping);
        }
        Ok(SAFETY * self.resolved() * damping.stable_step(self.critical(false)?))
    }

    /// Automatic step from the first failure on `[s]`.
    ///
    /// # Errors
    ///
    /// As [`critical_step`](Self::critical_step).
    pub fn broken_step(&mut self, damping: Damping) -> Result<f64, RunError> {
        let critical = self.critical(false)?.min(self.critical(true)?);
        Ok(BROKEN_SAFETY * self.resolved() * damping.stable_step(critical))
    }

    /// True where any block moves.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.state.v.iter().any(|v| *v != Lanes::ZERO)
    }

    fn resolved(&self) -> f64 {
        let meet = self.model.can_meet() && self.model.packs.rigid > 0;
        if meet { RESOLVED } else { 1.0 }
    }

    fn critical(&mut self, broken: bool) -> Result<f64, RunError> {
        if let Some(step) = self.critical_steps[usize::from(broken)] {
            return Ok(step);
        }
        let mass = |inertia: &ddem_mesh::inertia::Inertia, at: usize, lane: usize| {
            inertia.mass[at / 3].0[lane]
        };
        let model = &*self.model;
        let contact_model = if broken { model.contact.as_ref() } else { model.open_surfaces() };
        // One set of blocks whose joints all hold has neither contacts nor dashpots.
        let ratio = if broken || contact_model.is_some() { model.sliding.ratio } else { 0.0 };
        let Model { geometry, packs, assembly, .. } = model;
        let own = || ContactSurfaces::new(&model.properties, &model.laws, &model.geometry);
        let surfaces =
            contact_model.map_or_else(|| Cow::Owned(own()), |s| Cow::Borrowed(&s.surfaces));
        let added = (contact_model.is_some() || ratio > 0.0).then(|| {
            AddedStiffness::new(
                &surfaces,
                geometry,
                packs,
                assembly,
                contact_model.is_some(),
                ratio,
            )
        });
        let mut broken_joints = model.tangent(broken);
        let stop = || self.stop.load(Ordering::Relaxed);
        let squares = added.as_ref().map_or(&[][..], |added| &added.squares);
        let scratch = &mut self.scratch;
        let largest =
            largest_eigenvalue(model, &mut broken_joints, scratch, &mass, squares, &stop)?;
        let deformable = added.map_or(2.0 / largest.sqrt(), |added| added.critical_step(largest));
        // Rigid blocks without any joint have no stiffness: they step as if they met others.
        let met = contact_model.is_some() || largest == 0.0;
        let fastest =
            largest.max(if met { bound(&surfaces, geometry, packs, assembly)[1] } else { 0.0 });
        let damped = if model.packs.rigid > 0 { ratio } else { 0.0 };
        let rigid = 2.0 / fastest.sqrt() * ((1.0 + damped * damped).sqrt() - damped);
        let step = self.critical_step_with_gas(deformable.min(rigid));
        self.critical_steps[usize::from(broken)] = Some(step);
        Ok(step)
    }

    /// Sets the damping and the time step of the steps that follow: `"auto"` takes the
    /// [automatic one](Self::automatic_step), with a `duration` `[s]` shrunk so that whole steps fill it. Returns
    /// the number of steps that fill the duration (0 without one).
    ///
    /// # Errors
    ///
    /// A damping, a time step or a duration that no deck could have; a time step above the critical one or far
    /// below it; [told to stop](Self::stop_when). Nothing has changed then.
    pub fn start(
        &mut self,
        damping: Damping,
        time_step: TimeStep,
        duration: Option<f64>,
    ) -> Result<u64, RunError> {
        allow_motion(damping, time_step, duration)?;
        let critical = damping.stable_step(self.critical(false)?);
        if !(critical.is_finite() && critical > 0.0) {
            return Err(RunError::NoCriticalStep);
        }
        let given = if let TimeStep::Seconds(step) = time_step { Some(step) } else { None };
        if let Some(time_step) = given.filter(|&step| step > critical) {
            return Err(RunError::TimeStep { time_step, critical });
        }
        let shortest = given.into_iter().chain(duration).fold(f64::INFINITY, f64::min);
        if shortest < SHORTEST_STEP * critical {
            return Err(RunError::TooShort { time_step: shortest, critical });
        }
        if given.is_none() && (self.state.before > 0.0 || self.moves()) && self.model.can_fail() {
            // What can be stopped comes before the first change.
            self.critical(true)?;
        }
        self.synchronise();
        let step = match given {
            Some(step) => step,
            None => self.automatic_step(damping, self.moves())?,
        };
        let steps = duration.map_or(0.0, |duration| whole_steps(duration, step));
        let step = match (time_step, duration) {
            (TimeStep::Auto, Some(duration)) => duration / steps,
            _ => step,
        };
        self.state.automatic = time_step == TimeStep::Auto;
        self.state.end = self.state.time + duration.unwrap_or(f64::INFINITY);
        let whole = duration.map_or(u64::MAX, |_| steps as u64);
        self.state.last_step = self.state.steps.saturating_add(whole);
        let before = self.state.before;
        self.change_motion(Motion::dynamic(&self.model.assembly, damping, before, step));
        self.damping = damping;
        self.drop_relaxation();
        self.state.fresh = None;
        self.state.origin = (self.state.time, self.state.steps);
        self.started = true;
        self.state.watch_anew(&self.model, true);
        Ok(steps as u64)
    }

    /// Steps that are left of the duration; `None` without one.
    #[must_use]
    pub fn steps_left(&self) -> Option<u64> {
        let last = self.state.last_step;
        (last != u64::MAX).then(|| last.saturating_sub(self.state.steps))
    }

    /// Springs can be stiffer than the elements whose place they take, and faces can meet: an
    /// automatic step becomes shorter when the first pairs fail.
    pub(super) fn shorten(&mut self) -> Result<(), RunError> {
        self.state.broken_joints = self.model.broken_joints();
        let safe = self.broken_step(self.damping)?;
        self.slow_down(safe);
        Ok(())
    }

    /// Checks that the time step is stable after an excavation or after failures between two steps. An
    /// automatic step is shortened if necessary.
    pub(super) fn check_step(&mut self) -> Result<(), RunError> {
        if self.state.automatic {
            // Between two steps velocities have been set anew.
            let moving = self.state.before == 0.0 && self.moves();
            let longest = self.automatic_step(self.damping, moving)?;
            self.slow_down(longest);
            return Ok(());
        }
        let critical = self.damping.stable_step(self.critical(false)?);
        let time_step = self.motion.time_step;
        if time_step > critical {
            // To be said at the next step, too.
            self.critical_steps = [None; 2];
            return Err(RunError::TimeStep { time_step, critical });
        }
        Ok(())
    }

    /// Makes the steps at most this long `[s]`, from the present time on.
    fn slow_down(&mut self, longest: f64) {
        // Steps that fill a duration are longer than asked for, by rounding.
        if self.motion.time_step <= longest * (1.0 + 1e-9) {
            return;
        }
        let step = self.fill_up(longest);
        let before = self.state.before;
        *self.motion = Motion::dynamic(&self.model.assembly, self.damping, before, step);
        self.state.origin = (self.state.time, self.state.steps);
        if before > 0.0 {
            self.keep_energy();
        }
    }

    /// Takes h a little longer or shorter, between Δt⁺ and Δt⁻, so that a change of the step leaves the scheme's
    /// energy as it is, `½ v⁻ m v⁺ + U` of steps as long as each of the two. With d what velocities change by over h,
    /// one of `(1 + κ) h` has `κ Σ v⁻ m d + ½ (1 + κ) (1 + κ − Δt⁺/h) Σ d m d` more. Velocities are right to the
    /// same order for every |κ| up to `1 − Δt⁺/h`.
    fn keep_energy(&mut self) {
        let StepSums { power, change, .. } = self.measure_once().sums;
        let Motion { before, time_step, interval, .. } = *self.motion;
        let most = 1.0 - time_step / interval;
        let part = shift(power + change * (1.0 + most), change, change * most);
        let interval = interval * (1.0 + part.clamp(-most.abs(), most.abs()));
        let steps = [before, time_step];
        *self.motion = Motion::over(&self.model.assembly, self.damping, steps, interval);
    }

    /// The longest step, at most this long, of which whole ones fill what is left of the duration `[s]`.
    fn fill_up(&mut self, longest: f64) -> f64 {
        let left = self.state.end - self.state.time;
        // Programs may go on beyond the end.
        if !left.is_finite() || left <= 0.0 {
            return longest;
        }
        let steps = whole_steps(left, longest);
        self.state.last_step = self.state.steps.saturating_add(steps as u64);
        left / steps
    }

    /// The scheme's measure of kinetic energy depends on its step: what a new one changes in it
    /// between stages is no imbalance.
    pub(super) fn change_motion(&mut self, motion: Motion) {
        let before = self.mechanical_energy();
        *self.motion = motion;
        self.initial_energy += self.mechanical_energy() - before;
    }
}

/// The κ nearest to 0 at which `κ b + κ² a + c` is 0, or nearest to it.
fn shift(b: f64, a: f64, c: f64) -> f64 {
    if a == 0.0 {
        return 0.0;
    }
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    if root == 0.0 { -0.5 * b / a } else { -2.0 * c / (b + root.copysign(b)) }
}

/// Number of steps that fill a duration, at least one.
fn whole_steps(duration: f64, step: f64) -> f64 {
    (duration / step - 1e-9).ceil().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_are_the_nearest_roots() {
        // κ² + 3 κ + 2 has −1 and −2, κ² − 3 κ + 2 has 1 and 2; κ² + κ + 1 is least at −1/2.
        let found = [shift(3.0, 1.0, 2.0), shift(-3.0, 1.0, 2.0), shift(1.0, 1.0, 1.0)];
        assert_eq!(found, [-1.0, 1.0, -0.5]);
        // With κ² − 4: either of two as near.
        assert_eq!(shift(0.0, 1.0, -4.0).abs(), 2.0);
        assert_eq!([shift(1.0, 0.0, 1.0), shift(0.0, 1.0, 0.0)], [0.0; 2]);
    }
}
