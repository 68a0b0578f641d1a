//! A model in motion: the state, and what is done to it.

mod conditions;
mod excavation;
mod increment;
mod measure;
mod peaks;
pub(crate) mod relax;
mod results;
mod rounding;
pub(crate) mod safety;
pub(crate) mod saved;
mod stops;
mod time_step;

pub(crate) use rounding::LOOKS;
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
use crate::step::{Context, step};
use ddem_joint::losses::Losses;
use ddem_mechanics::math::simd::Simd;
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::math::tracked::Tracked;

use measure::Measured;

/// A model, its state, and scratch space.
///
/// [`step`](Self::step) and [`relax`](Self::relax) are the two ways to move it. A deck's stages
/// decide which supports and loads act: [`enter`](Self::enter) one before moving; without it the
/// first one is on.
#[derive(Debug)]
pub struct Simulation {
    pub(crate) model: Tracked<Model>,
    pub(crate) state: Tracked<State>,
    pub(crate) scratch: Tracked<Scratch>,
    pub(crate) view: StageView,
    pub(crate) motion: Tracked<Motion>,
    pub(crate) relaxation: Option<Relaxation>,
    /// Of the model as it starts, and with all joints that can fail turned to springs.
    pub(crate) critical_steps: [Option<f64>; 2],
    pub(crate) last: StepSums,
    /// Kinetic and strain energy at the start of the run `[J]`, by the scheme's own measure.
    pub(crate) initial_energy: f64,
    /// [`start`](Self::start) has set the time step.
    pub(crate) started: bool,
    measured: Measured,
    /// Motion of neighbours that counts as failure in a relaxation where it goes on, as a part of an edge.
    pub(crate) far: f64,
    /// True in the failing trial of a factor of safety.
    pub(crate) failing: bool,
    /// Damping of the motion.
    pub(crate) damping: Damping,
    /// Nothing fails for the moment.
    holds: bool,
    /// Time between two looks at the stresses for peaks `[s]`; none without peaks.
    look: Option<f64>,
    /// Flag that stops long computations.
    pub(crate) stop: Arc<AtomicBool>,
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
        let mut simulation = Self::with_state(model, state, simd);
        simulation.initial_energy = simulation.mechanical_energy();
        simulation
    }

    /// In a given state, without anything that sets it in motion.
    pub(crate) fn with_state(model: Model, state: State, simd: Simd) -> Self {
        let scratch = Scratch::new(&model, &state, simd.level());
        let view = StageView::new(&model, &state);
        // Until a step is set, energies are those of a vanishing one.
        let motion = Motion::dynamic(&model.assembly, Damping::None, 0.0, 1e-12);
        Self {
            look: peaks::look(&model),
            model: Tracked::new(model),
            state: Tracked::new(state),
            scratch: Tracked::new(scratch),
            view,
            motion: Tracked::new(motion),
            relaxation: None,
            critical_steps: [None; 2],
            last: StepSums::default(),
            initial_energy: 0.0,
            started: false,
            measured: Measured::default(),
            far: FAR,
            failing: false,
            damping: Damping::None,
            holds: false,
            stop: Arc::default(),
        }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Rigid motion that the supports in force leave free to blocks that joints and contacts hold together.
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

    /// Unbalanced force ratio at the last step (§7).
    #[must_use]
    pub fn unbalanced(&self) -> f64 {
        self.last.ratio()
    }

    /// Lets another thread stop what takes long before the first step, the search for the critical
    /// step and for the masses of a relaxation: it ends with [`RunError::Stopped`] when this is
    /// true.
    pub fn stop_when(&mut self, stop: Arc<AtomicBool>) {
        self.stop = stop;
    }

    /// Loads in force whose history is 0 at the present time, by their numbers in the deck.
    #[must_use]
    pub fn idle_loads(&self) -> Vec<usize> {
        let State { stage, time, stage_starts, .. } = &*self.state;
        self.model.conditions.idle(*stage, *time, stage_starts, self.model.n_loads())
    }

    /// The stage of the deck whose supports and loads are in force.
    #[must_use]
    pub fn stage(&self) -> usize {
        self.state.stage
    }

    /// One explicit step of time, eq. (2). [`start`](Self::start) sets its length and damping; after
    /// a relaxation, or without it, the first step starts with `"auto"` and the damping there was
    /// last, or none.
    ///
    /// # Errors
    ///
    /// [`RunError::Diverged`]: a number is not finite. [`RunError::TooFast`] and [`RunError::TooDeep`]: a block
    /// went so far, or is so deep in another, that contacts could be missed. [`RunError::History`]: one that a
    /// program computes has no value, and nothing has moved. The first step has those of
    /// [`start`](Self::start), too; so has one after an excavation.
    pub fn step(&mut self) -> Result<(), RunError> {
        if !self.started {
            self.start(self.damping, TimeStep::Auto, None)?;
        }
        self.state.fresh = None;
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
        self.state.shells = self.update_gas();
        self.state.load_factors.clone_from(&self.view.factors);
        let (mut context, state, scratch) = self.parts();
        context.waits = waits;
        Ok(step(context, state, scratch))
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

    /// The numbers of (M2) become those of the step that the velocities are of.
    pub(crate) fn match_motion(&mut self) {
        if !self.motion.fictitious && self.motion.before != self.state.before {
            *self.motion = self.motion.after(&self.model.assembly, self.state.before);
        }
    }

    /// Work of the step that was taken, from its powers.
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
            // By the scheme's measure it does so with the velocity after it: all of the difference, but
            // for that of forces which are there at the start, is what kinetic energy was ahead.
            let more = |power: [f64; 2]| 0.25 * time_step * (power[1] - power[0]);
            let less = more(sums.loads) + more(sums.supports) - more(sums.damping);
            self.initial_energy += less - sums.change;
        }
        self.last = sums;
    }

    /// Adds joint losses of an accepted pass.
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

    /// Applies forces to nodes `[N]`, from now on and whatever the stage, besides the deck's loads:
    /// for coupling with another program, at every step if need be. The force on a node replaces
    /// what an earlier call applied to it; those of one call on the same node add up.
    ///
    /// # Panics
    ///
    /// If the model has no such node, or there is not one force for each of them.
    pub fn apply_force(&mut self, nodes: &[u32], forces: &[[f64; 3]]) {
        let (n, found) = (nodes.len(), forces.len());
        assert!(n == found, "there are {found} forces for {n} nodes");
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
        self.check(sums, &self.scratch.trial_contacts)
    }

    /// Factors of the loads and velocities of the supports for the next step.
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

    /// Context of a step from the present state, with what a step changes.
    pub(crate) fn parts(&mut self) -> (Context<'_>, &mut State, &mut Scratch) {
        let Self { model, state, scratch, view, motion, holds, .. } = self;
        view.sliding.clear();
        if !motion.fictitious && !model.is_shaken(state.time, &state.stage_starts) {
            let failed = state.failed != [0; 2];
            let State { broken_joints, contacts, .. } = &**state;
            model.sliding.rates(&model.packs, failed, broken_joints, contacts, &mut view.sliding);
        }
        (Context::new(model, state, view, motion, *holds), state, scratch)
    }

    /// Context of the step, with the sliding blocks of the last step.
    fn context(&self) -> Context<'_> {
        Context::new(&self.model, &self.state, &self.view, &self.motion, self.holds)
    }
}
