//! §6: how long the steps of time are.

use std::borrow::Cow;
use std::iter::zip;
use std::sync::atomic::Ordering;

use super::Simulation;
use crate::contact::{Added, Skins, bound};
use crate::deck::{Damping, Stage, TimeStep};
use crate::error::RunError;
use crate::lanes::Lanes;
use crate::motion::Motion;
use crate::pack::Pack;
use crate::state::State;
use crate::timestep::largest_eigenvalue;

/// Part of the critical step that `"auto"` takes (§6).
const SAFETY: f64 = 0.9;

/// The same once pairs have failed: springs with friction of which some slide flutter when a step is close to
/// the critical one.
const BROKEN_SAFETY: f64 = 0.8;

/// Part of these that is left where rigid blocks may meet: a contact that lasts a few steps only gains or
/// loses some per cent of the energy.
const RESOLVED: f64 = 0.25;

/// Part of an automatic step that is taken while an impact at the start of a stage goes through the joints
/// that it breaks, and for how many automatic steps that is so: half a vibration of a thin joint is over then.
const IMPACT: (f64, f64) = (0.125, 4.0);

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

    /// What an automatic step is not longer than from the first failure on `[s]`.
    ///
    /// # Errors
    ///
    /// As [`critical_step`](Self::critical_step).
    pub fn broken_step(&mut self, damping: Damping) -> Result<f64, RunError> {
        Ok(self.resolved() * damping.stable_step(self.safe_step()?))
    }

    /// Part of the critical step that `"auto"` takes before anything has failed.
    #[must_use]
    pub fn automatic_part(&self) -> f64 {
        SAFETY * self.resolved()
    }

    /// The same with the joints as they are now.
    fn present_part(&self) -> f64 {
        let safety = if self.state.failed == [0; 2] { SAFETY } else { BROKEN_SAFETY };
        safety * self.resolved()
    }

    fn resolved(&self) -> f64 {
        let meet = self.model.can_meet() && self.model.packs.rigid > 0;
        if meet { RESOLVED } else { 1.0 }
    }

    fn critical(&mut self, broken: bool) -> Result<f64, RunError> {
        if let Some(step) = self.critical_steps[usize::from(broken)] {
            return Ok(step);
        }
        let mass = |inertia: &crate::inertia::Inertia, at: usize, lane: usize| {
            inertia.mass[at / 3].0[lane]
        };
        self.measured = None;
        let model = &self.model;
        let surfaces = if broken { model.contact.as_ref() } else { model.open_surfaces() };
        // One set of blocks whose joints all hold has neither contacts nor dashpots.
        let ratio = if broken || surfaces.is_some() { model.sliding.ratio } else { 0.0 };
        let of = (&*model.geometry, &model.packs, &model.assembly);
        let own = || Skins::new(&model.deck, &model.laws, &model.geometry);
        let skins = surfaces.map_or_else(|| Cow::Owned(own()), |s| Cow::Borrowed(&s.skins));
        let added = (surfaces.is_some() || ratio > 0.0)
            .then(|| Added::new(&skins, of, (surfaces.is_some(), ratio)));
        let mut breaks = model.tangent(broken);
        let stop = || self.stop.load(Ordering::Relaxed);
        let squares = added.as_ref().map_or(&[][..], |added| &added.squares);
        let scratch = &mut self.scratch;
        let largest = largest_eigenvalue(model, &mut breaks, scratch, &mass, squares, &stop)?;
        let deformable = added.map_or(2.0 / largest.sqrt(), |added| added.critical_step(largest));
        // Rigid blocks without any joint have no stiffness: they step as if they met others.
        let met = surfaces.is_some() || largest == 0.0;
        let fastest = largest.max(if met { bound(&skins, of)[1] } else { 0.0 });
        let damped = if model.packs.rigid > 0 { ratio } else { 0.0 };
        let rigid = 2.0 / fastest.sqrt() * ((1.0 + damped * damped).sqrt() - damped);
        let step = self.with_gas(deformable.min(rigid));
        self.critical_steps[usize::from(broken)] = Some(step);
        Ok(step)
    }

    /// Sets the damping and the time step of the steps that follow. `"auto"` takes 0.9 of the
    /// critical step, 0.8 once pairs have failed, a quarter of that where rigid blocks may meet, and of a
    /// shorter one with some damping ([`Damping::stable_step`]); with a `duration` `[s]` it is shrunk
    /// so that whole steps fill it. Returns the number of steps that fill the duration (0 without one).
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
        let (own, step) = (Some(damping), Some(time_step));
        Stage { damping: own, time_step: step, duration, ..Stage::default() }.allow()?;
        let critical = damping.stable_step(self.critical_step()?);
        let largest = damping.stable_step(self.critical(false)?);
        self.settle();
        if !(critical.is_finite() && critical > 0.0) {
            return Err(RunError::NoCriticalStep);
        }
        let impact = time_step == TimeStep::Auto && self.starts_with_impact(critical)?;
        let (part, lasts) = if impact { IMPACT } else { (1.0, 0.0) };
        let automatic = self.present_part() * critical;
        let step = match time_step {
            TimeStep::Auto => part * automatic,
            TimeStep::Seconds(step) if step > largest => {
                return Err(RunError::TimeStep { time_step: step, critical: largest });
            }
            TimeStep::Seconds(step) => step,
        };
        let shortest = duration.map_or(step, |duration| step.min(duration));
        if shortest < SHORTEST_STEP * critical {
            return Err(RunError::TooShort { time_step: shortest, critical });
        }
        let steps = duration.map_or(0.0, |duration| whole_steps(duration, step));
        let step = match (time_step, duration) {
            (TimeStep::Auto, Some(duration)) => duration / steps,
            _ => step,
        };
        self.state.automatic = time_step == TimeStep::Auto;
        self.state.impact_until = impact.then_some(self.state.time + lasts * automatic);
        self.state.end = self.state.time + duration.unwrap_or(f64::INFINITY);
        let whole = duration.map_or(u64::MAX, |_| steps as u64);
        self.state.last_step = self.state.steps.saturating_add(whole);
        self.change_motion(Motion::dynamic(&self.model.assembly, damping, step));
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
        self.state.breaks = self.model.breaks();
        let safe = self.broken_step(self.damping)?;
        self.slow_down(safe);
        Ok(())
    }

    /// After an excavation: whether the step that was set is stable in what is left. One that was chosen
    /// becomes shorter where need be.
    pub(super) fn check_step(&mut self) -> Result<(), RunError> {
        let critical = self.damping.stable_step(self.critical_step()?);
        let largest = self.damping.stable_step(self.critical(false)?);
        let time_step = self.motion.time_step;
        if self.state.automatic {
            self.slow_down(self.present_part() * critical);
        } else if time_step > largest {
            // To be said at the next step, too.
            self.critical_steps = [None; 2];
            return Err(RunError::TimeStep { time_step, critical: largest });
        }
        Ok(())
    }

    /// Steps of this length, unless they are that short.
    fn slow_down(&mut self, safe: f64) {
        if self.motion.time_step > safe {
            self.change_step(safe);
        }
    }

    /// Automatic steps have their own length again once the impact at the start of the stage is over.
    pub(super) fn leave_impact(&mut self) -> Result<(), RunError> {
        let State { time, impact_until, .. } = &mut self.state;
        if impact_until.take_if(|until| *time >= *until).is_some() {
            let critical = self.damping.stable_step(self.critical_step()?);
            let failed = self.state.failed;
            self.change_step(self.present_part() * critical);
            if self.state.failed != failed {
                // Pairs have failed just now, for which this step may be too long.
                let safe = self.broken_step(self.damping)?;
                self.slow_down(safe);
            }
        }
        Ok(())
    }

    /// Steps of at most this length. The velocities of the last half step go on with the present forces for
    /// half of each of the two steps; pairs that are about to fail have failed then. What the scheme's measure
    /// of energy still gains or loses stays in the balance.
    fn change_step(&mut self, longest: f64) {
        let (was_half, initial) = (!self.state.whole, self.initial_energy);
        let (old, last) = (self.motion.time_step, self.state.v.clone());
        let damped = self.state.failed;
        self.settle();
        // Blocks that slide from now on are damped from the next step on.
        let failed = std::mem::replace(&mut self.state.failed, damped);
        let left = self.state.end - self.state.time;
        let mut step = longest;
        // Programs may go on beyond the end.
        if left.is_finite() && left > 0.0 {
            let steps = whole_steps(left, longest);
            step = left / steps;
            self.state.last_step = self.state.steps.saturating_add(steps as u64);
        }
        // A shift of the deformable blocks alone would push them against rigid ones, and momentum with it.
        if was_half && self.model.packs.rigid == 0 {
            self.keep_energy(&last, step / old);
        }
        self.change_motion(Motion::dynamic(&self.model.assembly, self.damping, step));
        self.state.origin = (self.state.time, self.state.steps);
        // Forces change at once now: they must not do so in the middle of a step.
        if was_half {
            self.unsettle();
        }
        self.state.failed = failed;
        self.initial_energy = initial;
        self.measured = None;
    }

    /// Takes velocities a little before or after the present time, so that a step which becomes `ratio` times as
    /// long leaves the scheme's energy `½ v⁻ m v⁺ + U` of the deformable blocks as it is: with `d` the half of
    /// what a step changes velocities by, `v + κ d` has `κ Σ v m d + ½ κ² Σ d m d` more, and the new step
    /// `½ (1 − ratio²) Σ d m d`. Both are right to the same order where κ is at most what the step changes by.
    fn keep_energy(&mut self, last: &[Lanes], ratio: f64) {
        let model = &self.model;
        let deformable = || model.packs.packs.iter().enumerate().filter(|(_, pack)| !pack.rigid);
        let place =
            |pack: &Pack| 3 * pack.start..3 * (pack.start + model.packs.shape_of(pack).nodes);
        let [mut power, mut square] = [0.0; 2];
        for (index, pack) in deformable() {
            let inertia = &model.assembly.inertia[model.assembly.pack_inertia[index] as usize];
            for (at, i) in place(pack).enumerate() {
                for ((v, last), m) in zip(zip(self.state.v[i].0, last[i].0), inertia.mass[at / 3].0)
                {
                    power += m * v * (v - last);
                    square += m * (v - last) * (v - last);
                }
            }
        }
        let part = shift(power, 0.5 * square, 0.5 * (1.0 - ratio * ratio) * square);
        let most = (1.0 - ratio).abs();
        let part = part.clamp(-most, most);
        for (_, pack) in deformable() {
            for i in place(pack) {
                let now = self.state.v[i].0;
                let later = |l: usize| now[l] + part * (now[l] - last[i].0[l]);
                self.state.v[i] = Lanes(std::array::from_fn(later));
            }
        }
        self.measured = None;
    }

    /// Whether what moves at the start of a stage breaks joints in its first steps, as far as the strains of
    /// one critical step tell.
    fn starts_with_impact(&mut self, critical: f64) -> Result<bool, RunError> {
        if !self.state.whole || self.state.failed != [0; 2] || !self.model.can_fail() {
            return Ok(false);
        }
        self.take_factors()?;
        Ok(self.fails_within(critical))
    }

    /// The scheme's measure of kinetic energy depends on its step: what a new one changes in it
    /// between stages is no imbalance.
    pub(crate) fn change_motion(&mut self, motion: Motion) {
        let before = self.mechanical_energy();
        self.motion = motion;
        self.measured = None;
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

/// Whole steps that fill a duration, at least one.
fn whole_steps(duration: f64, step: f64) -> f64 {
    (duration / step - 1e-9).ceil().max(1.0)
}
