//! Length of the time steps (§6).

use super::Simulation;
use crate::error::RunError;
use crate::model::stage::{Damping, TimeStep, allow_motion};
use crate::state::motion::Motion;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::math::sums::StepSums;

/// Fraction of the critical step that `"auto"` uses (§6).
const SAFETY: f64 = 0.9;

/// Fraction of the critical step in use once pairs have failed. Frictional springs, some of them
/// sliding, flutter close to the critical step.
const BROKEN_SAFETY: f64 = 0.8;

/// Factor on these fractions if rigid blocks may meet. A contact that lasts only a few steps gains
/// or loses some per cent of the energy.
const RESOLVED: f64 = 0.25;

/// Fraction of the critical step below which a step, or a duration, is an error, and its inverse
/// may overflow.
pub const SHORTEST_STEP: f64 = 1e-9;

impl Simulation {
    /// Critical time step `2/ω_max` `[s]`, computed at the first call. It includes possible
    /// contacts, as stiff as they can be. Once pairs have failed it is the smaller of two steps:
    /// that of the model as it started, and that with springs in place of all joints that can fail.
    /// The second can be a fifth smaller.
    ///
    /// # Errors
    ///
    /// [Stopped](Self::stop_when): a large model takes seconds.
    pub fn critical_step(&mut self) -> Result<f64, RunError> {
        let intact = self.critical(false)?;
        Ok(if self.state.failed == [0; 2] { intact } else { intact.min(self.critical(true)?) })
    }

    /// Time step up to which the model stays stable in any failure of its joints `[s]`.
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

    /// Automatic step of a stage that begins with blocks at rest, or `moving` `[s]`. It lasts until
    /// the first failure and then becomes shorter. A shock is too rough for such a change: if
    /// joints can fail, a stage that begins with moving blocks has the shorter step from the start.
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

    /// True if any block moves.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.state.v.iter().any(|v| *v != Lanes::ZERO)
    }

    fn resolved(&self) -> f64 {
        let meet = self.model.can_meet() && self.model.packs.rigid > 0;
        if meet { RESOLVED } else { 1.0 }
    }

    /// Sets the damping and the time step of the steps that follow. `"auto"` uses the [automatic
    /// step](Self::automatic_step), reduced so that whole steps fill the `duration` `[s]`. Returns
    /// the number of steps that fill the duration (0 without one).
    ///
    /// # Errors
    ///
    /// A damping, a time step or a duration that is invalid in a deck; a time step above the
    /// critical one or far below it; [stopped](Self::stop_when). Nothing has changed then.
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
            return Err(RunError::UnstableTimeStep { time_step, critical });
        }
        let shortest = given.into_iter().chain(duration).fold(f64::INFINITY, f64::min);
        if shortest < SHORTEST_STEP * critical {
            return Err(RunError::TooShort { time_step: shortest, critical });
        }
        if given.is_none() && (self.state.before > 0.0 || self.moves()) && self.model.can_fail() {
            // This can be stopped, and therefore precedes the first change.
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
        self.state.stage_entry = None;
        self.state.origin = (self.state.time, self.state.steps);
        self.started = true;
        self.state.restart_watch(&self.model, true);
        Ok(steps as u64)
    }

    /// Remaining steps of the duration; `None` without one.
    #[must_use]
    pub fn steps_left(&self) -> Option<u64> {
        let last = self.state.last_step;
        (last != u64::MAX).then(|| last.saturating_sub(self.state.steps))
    }

    /// Shortens an automatic step when the first pairs fail. Springs can be stiffer than the
    /// elements that they replace, and faces can meet.
    pub(super) fn shorten(&mut self) -> Result<(), RunError> {
        self.state.broken_joints = self.model.broken_joints();
        let safe = self.broken_step(self.damping)?;
        self.limit_step(safe);
        Ok(())
    }

    /// Checks that the time step is stable after an excavation or after failures between two steps.
    /// An automatic step is shortened if necessary.
    pub(super) fn check_step(&mut self) -> Result<(), RunError> {
        if self.state.automatic {
            // Velocities have been set between two steps.
            let moving = self.state.before == 0.0 && self.moves();
            let longest = self.automatic_step(self.damping, moving)?;
            self.limit_step(longest);
            return Ok(());
        }
        let critical = self.damping.stable_step(self.critical(false)?);
        let time_step = self.motion.time_step;
        if time_step > critical {
            // The next step must report this, too.
            self.forget_critical_steps();
            return Err(RunError::UnstableTimeStep { time_step, critical });
        }
        Ok(())
    }

    /// Limits the steps to this length `[s]`, from the present time on.
    fn limit_step(&mut self, longest: f64) {
        // Rounding makes steps that fill a duration longer than requested.
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

    /// Adjusts h between Δt⁺ and Δt⁻ so that a change of the step conserves the scheme's energy,
    /// `½ v⁻ m v⁺ + U` of steps as long as each of the two. With d the change of velocities over h,
    /// `(1 + κ) h` has `κ Σ v⁻ m d + ½ (1 + κ) (1 + κ − Δt⁺/h) Σ d m d` more. Velocities have the
    /// same order of accuracy for every |κ| up to `1 − Δt⁺/h`.
    fn keep_energy(&mut self) {
        let StepSums { power, change, .. } = self.measure_once().sums;
        let Motion { before, time_step, interval, .. } = *self.motion;
        let most = 1.0 - time_step / interval;
        let part = shift(power + change * (1.0 + most), change, change * most);
        let interval = interval * (1.0 + part.clamp(-most.abs(), most.abs()));
        let steps = [before, time_step];
        *self.motion = Motion::over(&self.model.assembly, self.damping, steps, interval);
    }

    /// Longest step, at most `longest`, of which whole steps fill the rest of the duration `[s]`.
    fn fill_up(&mut self, longest: f64) -> f64 {
        let left = self.state.end - self.state.time;
        // Programs may continue beyond the end.
        if !left.is_finite() || left <= 0.0 {
            return longest;
        }
        let steps = whole_steps(left, longest);
        self.state.last_step = self.state.steps.saturating_add(steps as u64);
        left / steps
    }

    /// Changes the motion. The scheme's measure of kinetic energy depends on the step, and its
    /// change between stages does not count as imbalance.
    pub(super) fn change_motion(&mut self, motion: Motion) {
        let before = self.mechanical_energy();
        *self.motion = motion;
        self.initial_energy += self.mechanical_energy() - before;
    }
}

/// Root κ nearest to 0 of `κ b + κ² a + c`, or the κ where it is nearest to 0.
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
    fn shift_is_the_root_nearest_to_zero() {
        // The roots of κ² + 3 κ + 2 are −1 and −2, those of κ² − 3 κ + 2 are 1 and 2. κ² + κ + 1 is
        // least at −1/2.
        let found = [shift(3.0, 1.0, 2.0), shift(-3.0, 1.0, 2.0), shift(1.0, 1.0, 1.0)];
        assert_eq!(found, [-1.0, 1.0, -0.5]);
        // κ² − 4 has two roots that are equally near.
        assert_eq!(shift(0.0, 1.0, -4.0).abs(), 2.0);
        assert_eq!([shift(1.0, 0.0, 1.0), shift(0.0, 1.0, 0.0)], [0.0; 2]);
    }
}
