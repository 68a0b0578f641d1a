//! A model in motion: the state, and what is done to it.

use std::ops::ControlFlow;

use crate::conditions::Active;
use crate::deck::{Damping, TimeStep};
use crate::energy::Energy;
use crate::error::RunError;
use crate::lanes::Lanes;
use crate::model::Model;
use crate::motion::Motion;
use crate::relax::Relaxation;
use crate::scratch::Scratch;
use crate::simd::Simd;
use crate::state::{State, Work};
use crate::step::{Context, balance, step};
use crate::sums::Sums;
use crate::timestep::largest_eigenvalue;

/// Part of the critical step that `"auto"` takes (§6).
const SAFETY: f64 = 0.9;

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
    pub(crate) critical_step: Option<f64>,
    pub(crate) last: Sums,
    /// Kinetic and strain energy at the start of the run `[J]`, by the scheme's own measure.
    pub(crate) initial_energy: f64,
    /// [`start`](Self::start) has set the time step.
    pub(crate) started: bool,
    /// The step at whose end forces and sums were measured.
    pub(crate) measured: Option<u64>,
    strain: [f64; 2],
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
        let motion = Motion::dynamic(&model.assembly, Damping::None, 1.0);
        let mut simulation = Self {
            model,
            state,
            scratch,
            active,
            motion,
            relaxation: None,
            factors: Vec::new(),
            velocities: Vec::new(),
            critical_step: None,
            last: Sums::default(),
            initial_energy: 0.0,
            started: false,
            measured: None,
            strain: [0.0; 2],
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

    /// Time step in use `[s]`.
    #[must_use]
    pub fn time_step(&self) -> f64 {
        self.motion.time_step
    }

    /// Unbalanced force ratio at the last step (§7).
    #[must_use]
    pub fn unbalanced(&self) -> f64 {
        self.last.ratio()
    }

    /// Critical time step `2/ω_max` `[s]`; computed at the first call.
    pub fn critical_step(&mut self) -> f64 {
        if let Some(step) = self.critical_step {
            return step;
        }
        let mass = |inertia: &crate::assembly::Inertia, at: usize, lane: usize| {
            inertia.mass[at / 3].0[lane]
        };
        self.measured = None;
        let step = 2.0 / largest_eigenvalue(&self.model, &mut self.scratch, &mass).sqrt();
        self.critical_step = Some(step);
        step
    }

    /// Begins stage `stage` of the deck: its supports and loads come into force.
    pub fn enter(&mut self, stage: usize) {
        self.settle();
        self.state.stage = stage;
        // Stages that were skipped begin together with this one.
        self.state.stage_starts.resize(stage.max(self.state.stage_starts.len()), self.state.time);
        self.state.stage_starts.truncate(stage);
        self.state.stage_starts.push(self.state.time);
        self.active = self.model.active(stage);
        self.measured = None;
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
        let step = match time_step {
            TimeStep::Auto => SAFETY * critical,
            TimeStep::Seconds(step) if step > critical => {
                return Err(RunError::TimeStep { time_step: step, critical });
            }
            TimeStep::Seconds(step) => step,
        };
        let steps = duration.map_or(0.0, |duration| (duration / step - 1e-9).ceil().max(1.0));
        let step = match (time_step, duration) {
            (TimeStep::Auto, Some(duration)) => duration / steps,
            _ => step,
        };
        self.change_motion(Motion::dynamic(&self.model.assembly, damping, step));
        self.relaxation = None;
        self.state.origin = (self.state.time, self.state.steps);
        self.started = true;
        Ok(steps as u64)
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
        let (context, state, scratch) = self.parts();
        let sums = step(context, state, scratch);
        self.book(sums);
        self.check(sums)
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

    pub(crate) fn check(&self, sums: Sums) -> Result<(), RunError> {
        if sums.free.is_finite() {
            return Ok(());
        }
        let at = self.scratch.f.iter().position(|f| f.0.iter().any(|x| !x.is_finite()));
        let (block, node) = at.map_or((0, 0), |at| self.whose(at));
        Err(RunError::Diverged { step: self.state.steps, time: self.state.time, block, node })
    }

    /// Block and node of a place in a nodal field that is not finite.
    fn whose(&self, at: usize) -> (usize, usize) {
        let packs = &self.model.packs;
        let pack = packs.packs.partition_point(|p| 3 * p.start <= at) - 1;
        let lane = self.scratch.f[at].0.iter().position(|x| !x.is_finite()).unwrap_or(0);
        let block = packs.packs[pack].bodies[lane] as usize;
        let local = at / 3 - packs.packs[pack].start;
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
        self.state.load_factors.clone_from(&self.factors);
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
        let sums = balance(context, state, scratch, true);
        self.last = sums;
        self.measured = Some(self.state.steps);
        self.strain = self.scratch.strain_energy();
        (sums, self.strain)
    }

    /// Measures unless that has been done since the last step.
    pub(crate) fn measure_once(&mut self) -> (Sums, [f64; 2]) {
        if self.measured == Some(self.state.steps) { (self.last, self.strain) } else { self.measure() }
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
        let half = if self.state.whole { 0.0 } else { 0.5 * self.motion.time_step };
        let Work { loads, supports, damping } = self.state.work;
        Energy::new(
            sums.kinetic,
            [bodies, joints],
            damping + half * sums.damping[0],
            loads + supports + half * (sums.loads[0] + sums.supports[0]),
            self.initial_energy,
        )
    }

    fn mechanical_energy(&mut self) -> f64 {
        let energy = self.energy();
        energy.kinetic + energy.strain_bodies + energy.strain_joints
    }
}
