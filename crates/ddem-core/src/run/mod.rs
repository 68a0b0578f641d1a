//! Simulation: a model and its state, and the operations on them.

mod conditions;
mod critical;
mod excavation;
mod increment;
mod masses;
mod measure;
mod most_loaded;
mod peaks;
mod profile;
pub(crate) mod relax;
mod results;
mod rounding;
pub(crate) mod safety;
pub(crate) mod saved;
mod step_limit;
mod stops;
mod time_step;

pub(crate) use rounding::ROUNDING_CHECKS;
pub use step_limit::{Limiter, StepLimit};
pub use time_step::SHORTEST_STEP;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::error::RunError;
use crate::model::Model;
use crate::model::conditions::AppliedForces;
use crate::model::mechanism::{FreeMotion, free_motion};
use crate::model::stage::{Damping, TimeStep};
use crate::state::State;
use crate::state::motion::Motion;
use crate::state::view::StageView;
use crate::state::watch::FAR;
use crate::step::preconditioner::Relaxation;
use crate::step::scratch::Scratch;
use crate::step::timestep::Tridiagonal;
use crate::step::{Context, step};
use ddem_joint::losses::Losses;
use ddem_mechanics::math::simd::Simd;
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::math::tracked::Tracked;

use measure::Measured;

/// Model with its state and scratch data.
///
/// [`step`](Self::step) and [`relax`](Self::relax) are the two ways to move it. The stages of a
/// deck decide which supports and loads act: [`enter`](Self::enter) a stage before moving. Without
/// it the first stage is in force.
#[derive(Debug)]
pub struct Simulation {
    pub(crate) model: Tracked<Model>,
    pub(crate) state: Tracked<State>,
    pub(crate) scratch: Tracked<Scratch>,
    pub(crate) view: StageView,
    pub(crate) motion: Tracked<Motion>,
    pub(crate) relaxation: Option<Relaxation>,
    /// Critical steps of the model as it starts, and with springs in place of all joints that can
    /// fail `[s]`.
    pub(crate) critical_steps: [Option<f64>; 2],
    /// Iterations with which these critical steps were found, until their limiters are known.
    spectra: [Option<Tridiagonal>; 2],
    /// Parts of the model that limit these critical steps.
    limiters: [Option<Limiter>; 2],
    pub(crate) last: StepSums,
    /// Kinetic and strain energy at the start of the run `[J]`, by the scheme's own measure.
    pub(crate) initial_energy: f64,
    /// True if [`start`](Self::start) has set the time step.
    pub(crate) started: bool,
    measured: Measured,
    /// Relative motion of neighbours at which a continuing motion counts as failure in a
    /// relaxation, as a fraction of an edge.
    pub(crate) far: f64,
    /// Tolerance for the path of the last steps at which a relaxation is at rest, if it is above that
    /// of the forces.
    pub(crate) still: f64,
    /// True in the failing trial of a factor of safety.
    pub(crate) failing: bool,
    /// Damping of the motion.
    pub(crate) damping: Damping,
    /// True while failure is suspended.
    failure_suspended: bool,
    /// Time between two samples of the stresses for peaks `[s]`; `None` without peaks.
    sampling_period: Option<f64>,
    /// Flag that stops long computations.
    pub(crate) stop: Arc<AtomicBool>,
}

impl Simulation {
    /// Simulation at the start of the run, with the best available instruction set.
    #[must_use]
    pub fn new(model: Model) -> Self {
        Self::with_simd(model, Simd::default())
    }

    /// Simulation with a given instruction set; the results have the same bits with every one.
    #[must_use]
    pub fn with_simd(model: Model, simd: Simd) -> Self {
        let state = State::new(&model);
        let mut simulation = Self::with_state(model, state, simd);
        simulation.initial_energy = simulation.mechanical_energy();
        simulation
    }

    /// Simulation in a given state, without a time step or a relaxation.
    pub(crate) fn with_state(model: Model, state: State, simd: Simd) -> Self {
        let scratch = Scratch::new(&model, &state, simd.level());
        let view = StageView::new(&model, &state);
        let motion = Motion::without_step(&model.assembly);
        Self {
            sampling_period: peaks::sampling_period(&model),
            model: Tracked::new(model),
            state: Tracked::new(state),
            scratch: Tracked::new(scratch),
            view,
            motion: Tracked::new(motion),
            relaxation: None,
            critical_steps: [None; 2],
            spectra: [None, None],
            limiters: [None; 2],
            last: StepSums::default(),
            initial_energy: 0.0,
            started: false,
            measured: Measured::default(),
            far: FAR,
            still: 0.0,
            failing: false,
            damping: Damping::None,
            failure_suspended: false,
            stop: Arc::default(),
        }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Rigid motion that the supports in force do not prevent, of a group of blocks that joints and
    /// contacts hold together.
    #[must_use]
    pub fn free_motion(&self) -> Option<FreeMotion> {
        free_motion(
            &self.model.geometry,
            &self.view.conditions,
            self.model.properties.contact.search,
        )
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

    /// Unbalanced force ratio of the last step (§7).
    #[must_use]
    pub fn unbalanced(&self) -> f64 {
        self.last.ratio()
    }

    /// Sets a flag with which another thread stops long computations before the first step: the
    /// search for the critical step and for the masses of a relaxation. They end with
    /// [`RunError::Stopped`] when the flag is true.
    pub fn stop_when(&mut self, stop: Arc<AtomicBool>) {
        self.stop = stop;
    }

    /// Loads in force whose history is 0 at the present time, by their numbers in the deck.
    #[must_use]
    pub fn loads_at_zero(&self) -> Vec<usize> {
        let State { stage, time, stage_starts, .. } = &*self.state;
        self.model.conditions.loads_at_zero(*stage, *time, stage_starts, self.model.n_loads())
    }

    /// Stage of the deck whose supports and loads are in force.
    #[must_use]
    pub fn stage(&self) -> usize {
        self.state.stage
    }

    /// Takes one explicit time step, eq. (2). [`start`](Self::start) sets its length and damping.
    /// After a relaxation, or without `start`, the first step uses `"auto"` and the last damping,
    /// or none.
    ///
    /// # Errors
    ///
    /// [`RunError::Diverged`] if a number is not finite. [`RunError::BlockTooFast`] and
    /// [`RunError::DeepPenetration`] if a block moved so far, or penetrates another so deeply, that
    /// contacts could be missed. [`RunError::HistoryFailed`] if a history that a program computes
    /// has no value; nothing has moved then. The first step, and one after an excavation, also have
    /// those of [`start`](Self::start).
    pub fn step(&mut self) -> Result<(), RunError> {
        if !self.started {
            self.start(self.damping, TimeStep::Auto, None)?;
        }
        self.state.stage_entry = None;
        self.check_new_gas()?;
        if self.critical_steps[0].is_none() || self.state.before == 0.0 {
            self.check_step()?;
        }
        // An automatic step becomes shorter before the first failure.
        let waits = self.state.automatic && self.state.failed == [0; 2];
        let done = match self.try_step(waits)? {
            None => {
                self.shorten()?;
                self.try_step(false)?
            }
            done => done,
        };
        let Some((sums, losses)) = done else { return Ok(()) };
        self.move_columns();
        self.add_work(sums);
        self.add_losses(losses);
        self.note_peaks();
        self.state.watch_motion(&self.model, sums.ratio(), false);
        self.check(sums, &self.state.contacts)
    }

    fn try_step(&mut self, waits: bool) -> Result<Option<(StepSums, Losses)>, RunError> {
        self.update_factors()?;
        self.match_motion();
        self.update_boundary_forces()?;
        self.state.gas_surfaces = self.update_gas();
        self.state.load_factors.clone_from(&self.view.factors);
        let (mut context, state, scratch) = self.parts();
        context.waits = waits;
        Ok(step(context, state, scratch))
    }

    /// Takes several steps; stops early when `observe` breaks.
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

    /// Updates the coefficients of (M2) to the step of the present velocities.
    pub(crate) fn match_motion(&mut self) {
        if !self.motion.fictitious && self.motion.before != self.state.before {
            *self.motion = self.motion.after(&self.model.assembly, self.state.before);
        }
    }

    /// Adds the work of the last step, from its powers.
    fn add_work(&mut self, sums: StepSums) {
        let Motion { before, time_step, .. } = *self.motion;
        let starts = before == 0.0;
        let done = |power: [f64; 2]| match before == time_step {
            true => 0.5 * time_step * (power[0] + power[1]),
            // The first half step of a stage does its work with its mean velocity.
            false if starts => 0.25 * time_step * (power[0] + power[1]),
            false => 0.5 * (before * power[0] + time_step * power[1]),
        };
        let work = &mut self.state.work;
        work.loads += done(sums.loads);
        work.supports += done(sums.supports);
        work.damping += done(sums.damping);
        work.most = work.most.max((work.loads + work.supports).abs());
        if starts {
            // In the scheme's measure this half step works with the velocity after it. The
            // difference, without that of the forces present at the start, is the excess of kinetic
            // energy.
            let more = |power: [f64; 2]| 0.25 * time_step * (power[1] - power[0]);
            let less = more(sums.loads) + more(sums.supports) - more(sums.damping);
            self.initial_energy += less - sums.change;
        }
        self.last = sums;
    }

    /// Adds the losses of joints and contacts in an accepted pass.
    pub(crate) fn add_losses(&mut self, losses: Losses) {
        let State { work, failed, .. } = &mut *self.state;
        work.friction += losses.friction;
        work.fracture += losses.fracture;
        work.contact += losses.contact;
        work.damping += losses.damping;
        for (failed, more) in failed.iter_mut().zip(losses.failed) {
            *failed += more;
        }
    }

    /// Applies forces to nodes `[N]` from now on, in all stages and besides the deck's loads. Use
    /// it to couple another program, at every step if necessary. The force on a node replaces that
    /// of an earlier call; the forces of one call on the same node add up.
    ///
    /// # Panics
    ///
    /// If the model has no such node, or the numbers of nodes and forces differ.
    pub fn apply_force(&mut self, nodes: &[u32], forces: &[[f64; 3]]) {
        let (n, found) = (nodes.len(), forces.len());
        assert!(
            n == found,
            "the numbers of forces ({found}) and of nodes ({n}) differ: give one force for each node"
        );
        let mut sums = AppliedForces::new();
        for (&node, force) in nodes.iter().zip(forces) {
            let sum = sums.entry(node).or_default();
            *sum = [0, 1, 2].map(|c| sum[c] + force[c]);
        }
        let mut rebuild = false;
        for (&node, &force) in &sums {
            let slot = self.model.node_slot(node as usize);
            let load = self.model.conditions.applied_factor() as u32;
            match self.view.conditions.force_mut(slot, load) {
                Some(present) => *present = force,
                None => rebuild = true,
            }
        }
        self.state.applied.extend(sums);
        if rebuild {
            self.view.renew(&self.model, &self.state);
        }
    }

    /// Checks that the present forces are finite, as the next [`step`](Self::step) would.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step).
    pub fn check_finite(&mut self) -> Result<(), RunError> {
        let sums = self.measure_once().sums;
        self.check(sums, &self.scratch.measured_contacts)
    }

    /// Updates the factors of the loads and the velocities of the supports for the next step.
    fn update_factors(&mut self) -> Result<(), RunError> {
        let State { stage, time, stage_starts, .. } = &*self.state;
        let half = time + 0.5 * self.motion.time_step;
        let conditions = &self.model.conditions;
        let velocities = conditions.velocities(half, stage_starts)?;
        self.view.factors = conditions.factors(*stage, *time, stage_starts)?;
        self.view.factors.push(1.0);
        self.view.velocities = velocities;
        Ok(())
    }

    /// Context of a step from the present state, and the data that a step changes.
    pub(crate) fn parts(&mut self) -> (Context<'_>, &mut State, &mut Scratch) {
        let Self { model, state, scratch, view, motion, failure_suspended, .. } = self;
        view.sliding.clear();
        if !motion.fictitious && !model.has_blast_waves(state.time, &state.stage_starts) {
            let failed = state.failed != [0; 2];
            let State { broken_joints, contacts, .. } = &**state;
            model.sliding.rates(&model.packs, failed, broken_joints, contacts, &mut view.sliding);
        }
        (Context::new(model, state, view, motion, *failure_suspended), state, scratch)
    }

    /// Context of the step, with the sliding blocks of the last step.
    fn context(&self) -> Context<'_> {
        Context::new(&self.model, &self.state, &self.view, &self.motion, self.failure_suspended)
    }
}
