//! A model in motion: the state, and what is done to it.

use std::ops::ControlFlow;

use crate::breaks::Losses;
use crate::cluster::Relaxation;
use crate::conditions::Active;
use crate::deck::{Damping, TimeStep};
use crate::energy::Energy;
use crate::error::RunError;
use crate::lanes::Lanes;
use crate::model::Model;
use crate::motion::Motion;
use crate::scratch::Scratch;
use crate::simd::Simd;
use crate::state::{State, Work};
use crate::step::{Context, balance, step};
use crate::sums::Sums;
use crate::timestep::largest_eigenvalue;

/// Part of the critical step that `"auto"` takes (§6).
const SAFETY: f64 = 0.9;

/// Part of the critical step up to which an automatic step is left as it is when pairs fail.
const LEAST_SAFE: f64 = 0.95;

/// A model, its state, and scratch space.
///
/// [`step`](Self::step) and [`relax`](Self::relax) are the two ways to move it. A deck's stages
/// decide which supports and loads act: [`enter`](Self::enter) one before moving; without it the
/// first one is on.
#[derive(Debug)]
pub struct Simulation {
    pub(crate) model: Model,
    pub(crate) state: State,
    pub(crate) scratch: Scratch,
    pub(crate) active: Active,
    pub(crate) motion: Motion,
    pub(crate) relaxation: Option<Relaxation>,
    pub(crate) factors: Vec<f64>,
    pub(crate) velocities: Vec<[f64; 3]>,
    /// Of the model as it starts, and with all joints that can fail turned to springs.
    pub(crate) critical_steps: [Option<f64>; 2],
    pub(crate) last: Sums,
    /// Kinetic and strain energy at the start of the run `[J]`, by the scheme's own measure.
    pub(crate) initial_energy: f64,
    /// [`start`](Self::start) has set the time step.
    pub(crate) started: bool,
    /// The step at whose end forces and sums were measured.
    pub(crate) measured: Option<u64>,
    strain: [f64; 2],
    /// What the joints lose at the next step, as it was measured.
    losing: Losses,
    /// Damping of the motion.
    pub(crate) damping: Damping,
}

impl Simulation {
    /// At the start of the run, with the best instruction set of this machine.
    #[must_use]
    pub fn new(model: Model) -> Self {
        Self::with_simd(model, Simd::default())
    }

    /// With a given instruction set; the results have the same bits with every one.
    #[must_use]
    pub fn with_simd(model: Model, simd: Simd) -> Self {
        let state = State::new(&model);
        let scratch = Scratch::new(&model, &state.u, simd.level());
        let active = model.active(0);
        // Until a step is set, energies are those of a vanishing one.
        let motion = Motion::dynamic(&model.assembly, Damping::None, 1e-12);
        let mut simulation = Self {
            model,
            state,
            scratch,
            active,
            motion,
            relaxation: None,
            factors: Vec::new(),
            velocities: Vec::new(),
            critical_steps: [None; 2],
            last: Sums::default(),
            initial_energy: 0.0,
            started: false,
            measured: None,
            strain: [0.0; 2],
            losing: Losses::default(),
            damping: Damping::None,
        };
        simulation.initial_energy = simulation.mechanical_energy();
        simulation
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Simulated time `[s]`.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Steps since the start of the run, those of relaxation included.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.state.steps
    }

    /// Time step in use `[s]`; 0 before the first [`start`](Self::start) and after relaxation.
    #[must_use]
    pub fn time_step(&self) -> f64 {
        if self.started { self.motion.time_step } else { 0.0 }
    }

    /// Unbalanced force ratio at the last step (§7).
    #[must_use]
    pub fn unbalanced(&self) -> f64 {
        self.last.ratio()
    }

    /// Critical time step `2/ω_max` `[s]`; computed at the first call. Once pairs have failed it is
    /// the smaller one of the model as it started and with all joints that can fail turned to
    /// springs, which can be a sixth less.
    pub fn critical_step(&mut self) -> f64 {
        let intact = self.critical(false);
        if self.state.failed == [0; 2] { intact } else { intact.min(self.critical(true)) }
    }

    /// Largest time step that can be given `[s]`: with it the model is stable however its joints
    /// fail.
    pub fn largest_step(&mut self) -> f64 {
        let intact = self.critical(false);
        if self.model.can_fail() { intact.min(self.critical(true)) } else { intact }
    }

    fn critical(&mut self, broken: bool) -> f64 {
        if let Some(step) = self.critical_steps[usize::from(broken)] {
            return step;
        }
        let mass = |inertia: &crate::assembly::Inertia, at: usize, lane: usize| {
            inertia.mass[at / 3].0[lane]
        };
        self.measured = None;
        let mut breaks = self.model.tangent(broken);
        let largest = largest_eigenvalue(&self.model, &mut breaks, &mut self.scratch, &mass);
        let step = 2.0 / largest.sqrt();
        self.critical_steps[usize::from(broken)] = Some(step);
        step
    }

    /// Begins stage `stage` of the deck: its supports and loads come into force.
    pub fn enter(&mut self, stage: usize) {
        self.settle();
        let before = self.mechanical_energy();
        self.state.stage = stage;
        // Stages that were skipped begin together with this one.
        self.state.stage_starts.resize(stage.max(self.state.stage_starts.len()), self.state.time);
        self.state.stage_starts.truncate(stage);
        self.state.stage_starts.push(self.state.time);
        self.active = self.model.active(stage);
        self.measured = None;
        // Loads and driven supports that come at once change the scheme's measure of kinetic
        // energy, of which half a step lies ahead: no imbalance either.
        self.initial_energy += self.mechanical_energy() - before;
    }

    /// Sets the damping and the time step of the steps that follow. `"auto"` takes 0.9 of the
    /// critical step; with a `duration` `[s]` it is shrunk so that whole steps fill it. Returns
    /// the number of steps that fill the duration (0 without one).
    ///
    /// # Errors
    ///
    /// A time step above the critical one.
    pub fn start(
        &mut self,
        damping: Damping,
        time_step: TimeStep,
        duration: Option<f64>,
    ) -> Result<u64, RunError> {
        self.settle();
        let critical = self.critical_step();
        let largest = if time_step == TimeStep::Auto { critical } else { self.largest_step() };
        if !(critical.is_finite() && critical > 0.0) {
            return Err(RunError::NoCriticalStep);
        }
        let step = match time_step {
            TimeStep::Auto => SAFETY * critical,
            TimeStep::Seconds(step) if step > largest => {
                return Err(RunError::TimeStep { time_step: step, critical: largest });
            }
            TimeStep::Seconds(step) => step,
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
        self.change_motion(Motion::dynamic(&self.model.assembly, damping, step));
        self.damping = damping;
        self.relaxation = None;
        self.state.origin = (self.state.time, self.state.steps);
        self.started = true;
        Ok(steps as u64)
    }

    /// Steps that are left of the duration; `None` without one.
    #[must_use]
    pub fn steps_left(&self) -> Option<u64> {
        let last = self.state.last_step;
        (last != u64::MAX).then(|| last.saturating_sub(self.state.steps))
    }

    /// Springs can be stiffer than the elements whose place they take: an automatic step that
    /// would no longer be stable becomes shorter at the first failure.
    fn shorten(&mut self) {
        let critical = self.critical_step();
        let left = self.state.end - self.state.time;
        let stable = self.motion.time_step <= LEAST_SAFE * critical;
        if stable || !self.state.automatic || self.steps_left() == Some(0) {
            return;
        }
        self.settle();
        let step = SAFETY * critical;
        let steps = whole_steps(left, step);
        let step = if left.is_finite() { left / steps } else { step };
        self.state.last_step = self.state.steps.saturating_add(steps as u64);
        self.change_motion(Motion::dynamic(&self.model.assembly, self.damping, step));
        self.state.origin = (self.state.time, self.state.steps);
    }

    /// The scheme's measure of kinetic energy depends on its step: what a new one changes in it
    /// is no imbalance.
    pub(crate) fn change_motion(&mut self, motion: Motion) {
        let before = self.mechanical_energy();
        self.motion = motion;
        self.measured = None;
        self.initial_energy += self.mechanical_energy() - before;
    }

    /// One explicit step of time, eq. (2). [`start`](Self::start) sets its length; without it,
    /// the first step starts with `"auto"` and no damping.
    ///
    /// # Errors
    ///
    /// A number that is not finite: the run has diverged.
    pub fn step(&mut self) -> Result<(), RunError> {
        if !self.started {
            self.start(Damping::None, TimeStep::Auto, None)?;
        }
        self.motion.start = self.state.whole;
        self.take_factors();
        self.state.load_factors.clone_from(&self.factors);
        let (context, state, scratch) = self.parts();
        let (sums, losses) = step(context, state, scratch);
        self.book(sums);
        let is_first = self.state.failed == [0; 2] && losses.failed != [0; 2];
        self.book_losses(losses);
        self.check(sums)?;
        if is_first {
            self.shorten();
        }
        Ok(())
    }

    /// Several steps; stops early when `observe` breaks.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step).
    pub fn run(
        &mut self,
        steps: u64,
        mut observe: impl FnMut(&mut Self) -> ControlFlow<()>,
    ) -> Result<(), RunError> {
        for _ in 0..steps {
            self.step()?;
            if observe(self).is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Work of the step that was taken, from its powers.
    pub(crate) fn book(&mut self, sums: Sums) {
        // The first half step of a stage does its work with the velocity after it alone.
        let before = if self.motion.start { 0.0 } else { 1.0 };
        let half = 0.5 * self.motion.time_step;
        let done = |power: [f64; 2]| half * (before * power[0] + power[1]);
        let work = &mut self.state.work;
        work.loads += done(sums.loads);
        work.supports += done(sums.supports);
        work.damping += done(sums.damping);
        self.last = sums;
    }

    /// What the joints lost in a pass over them that the state keeps.
    pub(crate) fn book_losses(&mut self, losses: Losses) {
        let State { work, failed, .. } = &mut self.state;
        work.friction += losses.friction;
        work.fracture += losses.fracture;
        for (failed, more) in failed.iter_mut().zip(losses.failed) {
            *failed += more;
        }
    }

    pub(crate) fn check(&self, sums: Sums) -> Result<(), RunError> {
        if sums.free.is_finite() {
            return Ok(());
        }
        let (block, node) = self.worst_node();
        Err(RunError::Diverged { step: self.state.steps, time: self.state.time, block, node })
    }

    /// Whether forces are finite at the present time: what [`step`](Self::step) would find next.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step).
    pub fn check_finite(&mut self) -> Result<(), RunError> {
        let (sums, _) = self.measure_once();
        self.check(sums)
    }

    /// Block and node with the largest force; one that is not a number is larger than any.
    fn worst_node(&self) -> (usize, usize) {
        let size = |x: f64| if x.is_nan() { f64::INFINITY } else { x.abs() };
        let mut worst = (f64::NEG_INFINITY, 0, 0);
        for (index, pack) in self.model.packs.packs.iter().enumerate() {
            let nodes = self.model.packs.shape_of(pack).nodes;
            let forces = &self.scratch.f[3 * pack.start..3 * (pack.start + nodes)];
            for (at, f) in forces.iter().enumerate() {
                for lane in 0..pack.filled {
                    if size(f.0[lane]) <= worst.0 {
                        continue;
                    }
                    let block = self.model.packs.packs[index].bodies[lane] as usize;
                    worst = (size(f.0[lane]), block, at / 3);
                }
            }
        }
        let (_, block, local) = worst;
        (block, self.model.geometry.bodies[block].first_node as usize + local)
    }

    /// Factors of the loads and velocities of the supports for the next step.
    fn take_factors(&mut self) {
        let State { stage, time, stage_starts, .. } = &self.state;
        let half = time + 0.5 * self.motion.time_step;
        let conditions = &self.model.conditions;
        conditions.factors(*stage, *time, stage_starts, &mut self.factors);
        conditions.velocities(half, stage_starts, &mut self.velocities);
        self.factors.push(1.0);
    }

    pub(crate) fn parts(&mut self) -> (Context<'_>, &mut State, &mut Scratch) {
        let gravity = self.factors.last().copied().unwrap_or(1.0);
        let context = Context {
            model: &self.model,
            active: &self.active,
            motion: &self.motion,
            factors: &self.factors,
            gravity: (self.model.gravity * gravity).into(),
            velocities: &self.velocities,
            failing: (!self.motion.fictitious).then_some(1.0),
            time: self.state.time,
        };
        (context, &mut self.state, &mut self.scratch)
    }

    /// Forces, reactions, energies and sums at the present time; nothing moves.
    fn measure(&mut self) -> (Sums, [f64; 2]) {
        self.motion.start = self.state.whole && !self.motion.fictitious;
        if !self.motion.fictitious {
            self.take_factors();
        }
        let (context, state, scratch) = self.parts();
        let mut trial = std::mem::take(&mut scratch.trial);
        trial.clone_from(&state.breaks);
        let (sums, losses) = balance(context, (&state.u, &state.v), &mut trial, scratch, true);
        scratch.trial = trial;
        self.losing = losses;
        self.last = sums;
        self.measured = Some(self.state.steps);
        self.strain = self.scratch.strain_energy();
        (sums, self.strain)
    }

    /// Measures unless that has been done since the last step.
    pub(crate) fn measure_once(&mut self) -> (Sums, [f64; 2]) {
        if self.measured == Some(self.state.steps) {
            (self.last, self.strain)
        } else {
            self.measure()
        }
    }

    /// Brings velocities from the last half step to the present time, so that a stage with
    /// another time step can begin: `v = (v⁻ + v⁺)/2`.
    pub fn settle(&mut self) {
        if self.state.whole {
            return;
        }
        if self.motion.fictitious {
            self.stop();
        } else {
            let (sums, _) = self.measure_once();
            let half = 0.5 * self.motion.time_step;
            self.state.work.loads += half * sums.loads[0];
            self.state.work.supports += half * sums.supports[0];
            self.state.work.damping += half * sums.damping[0];
            self.state.v = self.present_velocities();
        }
        self.state.whole = true;
        self.measured = None;
    }

    /// Brings everything to rest; damping takes the kinetic energy.
    pub(crate) fn stop(&mut self) {
        let before = self.energy().kinetic;
        self.state.v.fill(Lanes::ZERO);
        self.measured = None;
        self.state.work.damping += before - self.energy().kinetic;
        self.started = false;
    }

    /// Energies at the present time and their balance (§6).
    pub fn energy(&mut self) -> Energy {
        let (sums, [bodies, joints]) = self.measure_once();
        let Work { loads, supports, damping, friction, fracture } = self.state.work;
        // What the velocity before has done up to now and the next step will book.
        let (damped, done) = if self.state.whole {
            (0.0, 0.0)
        } else if self.motion.fictitious {
            (0.5 * sums.power, sums.loads[0])
        } else {
            let half = 0.5 * self.motion.time_step;
            (half * sums.damping[0], half * (sums.loads[0] + sums.supports[0]))
        };
        let external = loads + supports + done;
        let strain = [bodies, joints];
        let Losses { friction: slid, fracture: broke, .. } = self.losing;
        let lost = [damping + damped, friction + slid, fracture + broke];
        Energy::new(sums.kinetic, strain, lost, external, self.initial_energy)
    }

    /// Pairs that have failed, in shear and in tension.
    #[must_use]
    pub fn failed_pairs(&self) -> [u64; 2] {
        let [shear, tension] = self.state.failed;
        // Those that fail at the present time count once it has been looked at.
        let measured = self.measured == Some(self.state.steps);
        let more = if measured { self.losing.failed } else { [0; 2] };
        [shear + more[0], tension + more[1]]
    }

    fn mechanical_energy(&mut self) -> f64 {
        let energy = self.energy();
        let lost = energy.friction + energy.fracture;
        energy.kinetic + energy.strain_bodies + energy.strain_joints + lost
    }
}

/// Whole steps that fill a duration, at least one.
fn whole_steps(duration: f64, step: f64) -> f64 {
    (duration / step - 1e-9).ceil().max(1.0)
}
