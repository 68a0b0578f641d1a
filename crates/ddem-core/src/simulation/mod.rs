//! A model in motion: the state, and what is done to it.

mod measure;
mod pace;
mod rigid;

pub use pace::SHORTEST_STEP;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::breaks::Losses;
use crate::cluster::Relaxation;
use crate::conditions::{Active, Applied};
use crate::deck::{Damping, TimeStep};
use crate::error::{Fault, RunError};
use crate::model::Model;
use crate::motion::Motion;
use crate::scratch::Scratch;
use crate::simd::Simd;
use crate::state::State;
use crate::step::{Context, step};
use crate::sums::Sums;

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
    /// Nothing fails for the moment.
    holds: bool,
    /// What takes long shall stop.
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
        let scratch = Scratch::new(&model, &state, simd.level());
        let active = model.active(0, &state.applied);
        // What acts until it is first asked for.
        let factors = state.load_factors.clone();
        let velocities = vec![[0.0; 3]; model.conditions.fixed.len()];
        // Until a step is set, energies are those of a vanishing one.
        let motion = Motion::dynamic(&model.assembly, Damping::None, 1e-12);
        let mut simulation = Self {
            model,
            state,
            scratch,
            active,
            motion,
            relaxation: None,
            factors,
            velocities,
            critical_steps: [None; 2],
            last: Sums::default(),
            initial_energy: 0.0,
            started: false,
            measured: None,
            strain: [0.0; 2],
            losing: Losses::default(),
            damping: Damping::None,
            holds: false,
            stop: Arc::default(),
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

    /// Lets another thread stop what takes long before the first step, the search for the critical
    /// step and for the masses of a relaxation: it ends with [`RunError::Stopped`] when this is
    /// true.
    pub fn stop_when(&mut self, stop: Arc<AtomicBool>) {
        self.stop = stop;
    }

    /// What is wrong with a relaxation under the supports in force: a rigid motion that they leave
    /// free.
    #[must_use]
    pub fn free_motion(&self) -> Option<Fault> {
        let model = &self.model;
        let at = (0, "in force");
        crate::mechanism::free_motion(&model.deck, &model.geometry, &self.active, at)
    }

    /// Loads in force whose history is 0 at the present time, by their numbers in the deck.
    #[must_use]
    pub fn idle_loads(&self) -> Vec<usize> {
        let State { stage, time, stage_starts, .. } = &self.state;
        self.model.conditions.idle(*stage, *time, stage_starts)
    }

    /// The stage of the deck whose supports and loads are in force.
    #[must_use]
    pub fn stage(&self) -> usize {
        self.state.stage
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
        self.active = self.model.active(stage, &self.state.applied);
        self.measured = None;
        // Loads and driven supports that come at once change the scheme's measure of kinetic
        // energy, of which half a step lies ahead: no imbalance either.
        self.initial_energy += self.mechanical_energy() - before;
    }

    /// One explicit step of time, eq. (2). [`start`](Self::start) sets its length and damping; after
    /// a relaxation, or without it, the first step starts with `"auto"` and the damping there was
    /// last, or none.
    ///
    /// # Errors
    ///
    /// A number that is not finite: the run has diverged. A history that a program computes and that
    /// has no value: nothing has moved.
    pub fn step(&mut self) -> Result<(), RunError> {
        if !self.started {
            self.start(self.damping, TimeStep::Auto, None)?;
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
        self.book(sums);
        self.book_losses(losses);
        self.check(sums)
    }

    fn try_step(&mut self, waits: bool) -> Result<Option<(Sums, Losses)>, RunError> {
        self.take_factors()?;
        self.motion.start = self.state.whole;
        self.state.load_factors.clone_from(&self.factors);
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
        work.contact += losses.contact;
        work.damping += losses.damping;
        for (failed, more) in failed.iter_mut().zip(losses.failed) {
            *failed += more;
        }
    }

    pub(crate) fn check(&self, sums: Sums) -> Result<(), RunError> {
        if sums.free.is_finite() {
            self.check_speed(sums)?;
            return self.check_depth();
        }
        let (block, node) = self.worst_node();
        Err(RunError::Diverged { step: self.state.steps, time: self.state.time, block, node })
    }

    /// Blocks that are deep in each other may come out on the other side.
    fn check_depth(&self) -> Result<(), RunError> {
        let Some(surfaces) = &self.model.contact else { return Ok(()) };
        let patches = self.state.contacts.patches.iter();
        for patch in patches.filter(|patch| patch.depth > 0.25 * surfaces.shortest) {
            let blocks = patch.blocks.map(|block| block as usize);
            let edges = blocks.map(|block| self.model.geometry.shortest_edge(block));
            let edge = edges[0].min(edges[1]);
            if patch.depth > 0.25 * edge && !self.motion.fictitious {
                let (step, time, depth) = (self.state.steps, self.state.time, patch.depth);
                return Err(RunError::TooDeep { blocks, step, time, depth, edge });
            }
        }
        Ok(())
    }

    /// Contacts are found from step to step: nothing may go far in one.
    fn check_speed(&self, sums: Sums) -> Result<(), RunError> {
        let Some(surfaces) = &self.model.contact else { return Ok(()) };
        let way = self.motion.time_step * sums.fastest.0[0];
        if self.motion.fictitious || way <= 0.25 * surfaces.shortest {
            return Ok(());
        }
        let fastest = |sums: &Sums| sums.fastest.0.into_iter().fold(0.0, f64::max);
        let of_pack = self.scratch.sums.iter().map(fastest).enumerate();
        let (pack, _) = of_pack.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
        let lanes = self.scratch.sums[pack].fastest.0;
        let lane = (0..lanes.len()).max_by(|&a, &b| lanes[a].total_cmp(&lanes[b])).unwrap_or(0);
        Err(RunError::TooFast {
            block: self.model.packs.packs[pack].bodies[lane] as usize,
            step: self.state.steps,
            time: self.state.time,
            way,
            edge: surfaces.shortest,
        })
    }

    /// Applies forces to nodes `[N]`, from now on and whatever the stage, besides the deck's loads:
    /// for coupling with another program, at every step if need be. The force on a node replaces
    /// what an earlier call applied to it; those of one call on the same node add up.
    ///
    /// # Panics
    ///
    /// A node that the model does not have.
    pub fn apply_force(&mut self, nodes: &[u32], forces: &[[f64; 3]]) {
        // A first step does not know the half step before it: as in `enter`, what the forces change
        // in its measure of kinetic energy is no imbalance.
        let before = self.state.whole.then(|| self.mechanical_energy());
        let mut sums = Applied::new();
        for (&node, force) in nodes.iter().zip(forces) {
            let sum = sums.entry(node).or_default();
            *sum = [0, 1, 2].map(|c| sum[c] + force[c]);
        }
        let mut rebuild = false;
        for (&node, &force) in &sums {
            let (pack, local, lane) = self.model.place(node as usize);
            let at = 3 * (self.model.packs.packs[pack].start + local) as u32;
            let load = self.model.n_loads() as u32;
            match self.active.force_mut((pack, at, lane as u8), load) {
                Some(present) => *present = force,
                None => rebuild = true,
            }
        }
        self.state.applied.extend(sums);
        if rebuild {
            self.active = self.model.active(self.state.stage, &self.state.applied);
        }
        self.measured = None;
        if let Some(before) = before {
            self.initial_energy += self.mechanical_energy() - before;
        }
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
    fn take_factors(&mut self) -> Result<(), RunError> {
        let State { stage, time, stage_starts, .. } = &self.state;
        let half = time + 0.5 * self.motion.time_step;
        let conditions = &self.model.conditions;
        let velocities = conditions.velocities(half, stage_starts)?;
        self.factors = conditions.factors(*stage, *time, stage_starts)?;
        self.factors.push(1.0);
        self.velocities = velocities;
        Ok(())
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
            failing: (!self.motion.fictitious && !self.holds).then_some(1.0),
            waits: false,
            time: self.state.time,
        };
        (context, &mut self.state, &mut self.scratch)
    }
}
