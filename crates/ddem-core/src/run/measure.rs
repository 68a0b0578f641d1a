//! Forces and energies at the present time. Nothing moves.

use super::Simulation;
use crate::output::energy::Energy;
use crate::state::motion::Motion;
use crate::state::{State, Work};
use crate::step::{EvaluationStep, balance};
use ddem_joint::losses::Losses;
use ddem_mechanics::math::sums::StepSums;

/// Results of a measurement at the present time, valid until something changes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Measured {
    /// Revisions of model, state, scratch data and motion at the measurement, and true if failure
    /// was suspended; `None` before the first measurement.
    revisions: Option<([u64; 4], bool)>,
    pub(super) sums: StepSums,
    /// Strain energy of blocks and joints `[J]`.
    strain: [f64; 2],
    /// Losses of joints and contacts that the next step will book.
    losing: Losses,
    /// Energy that points have given in excess of what they took `[J]`, at most 0.
    energy_deficit: f64,
}

impl Simulation {
    /// Measures forces, reactions, energies and sums at the present time. Nothing moves.
    fn measure(&mut self) {
        self.match_motion();
        if !self.motion.fictitious {
            // If a program cannot compute a factor, the former one stays. The next step reports
            // why.
            let _ = self.update_factors().and_then(|()| self.update_boundary_forces());
        }
        self.update_gas();
        let (mut context, state, scratch) = self.parts();
        context.energies = true;
        let mut broken_joints = std::mem::take(&mut scratch.measured_joints);
        broken_joints.clone_from(&state.broken_joints);
        let mut contacts = std::mem::take(&mut scratch.measured_contacts);
        contacts.clone_from(&state.contacts);
        let State { u, v, poses, .. } = state;
        let evaluation = EvaluationStep {
            u,
            v,
            poses,
            broken_joints: &mut broken_joints,
            contacts: &mut contacts,
        };
        let (sums, losing) = balance(context, evaluation, scratch);
        let mut strain = scratch.strain_energy();
        let energy_deficit = broken_joints.energy_deficit() + contacts.energy_deficit();
        let model = &self.model;
        let stored = |rock: bool| contacts.stored(|patch| model.is_whole_rock(patch) == rock);
        strain[0] += stored(true);
        strain[1] += stored(false) - energy_deficit;
        (self.scratch.measured_joints, self.scratch.measured_contacts) = (broken_joints, contacts);
        self.last = sums;
        self.measured =
            Measured { revisions: Some(self.revisions()), sums, strain, losing, energy_deficit };
    }

    /// Measures if anything has changed since the last measurement; returns the results.
    pub(super) fn measure_once(&mut self) -> Measured {
        if !self.is_measured() {
            self.measure();
        }
        self.measured
    }

    fn is_measured(&self) -> bool {
        self.measured.revisions == Some(self.revisions())
    }

    fn revisions(&self) -> ([u64; 4], bool) {
        let Self { model, state, scratch, motion, failure_suspended, .. } = self;
        let revisions = [model.revision(), state.revision(), scratch.revision(), motion.revision()];
        (revisions, *failure_suspended)
    }

    /// Brings velocities from the last half step to the present time:
    /// `v = v⁻ + ½ (Δt⁻/h) (v⁺ − v⁻)`, which is `(v⁻ + v⁺)/2` if the step does not change.
    pub fn synchronise(&mut self) {
        if self.state.before == 0.0 {
            return;
        }
        if self.motion.fictitious {
            self.stop();
            self.state.before = 0.0;
        } else {
            let before = self.energy().balance;
            let Measured { sums, losing, .. } = self.measure_once();
            let half = 0.5 * self.state.before;
            self.state.work.loads += half * sums.loads[0];
            self.state.work.supports += half * sums.supports[0];
            self.state.work.damping += half * sums.damping[0];
            let snapshot = self.as_measured();
            let (v, poses) = (snapshot.velocities(), snapshot.poses());
            self.state.v = v;
            self.synchronise_columns();
            self.state.poses = poses;
            // The failures and the slip of the measurement become part of the state.
            std::mem::swap(&mut self.state.broken_joints, &mut self.scratch.measured_joints);
            std::mem::swap(&mut self.state.contacts, &mut self.scratch.measured_contacts);
            self.add_losses(losing);
            self.state.before = 0.0;
            // Velocities at the present time have another measure of kinetic energy.
            self.account_from(before);
        }
    }

    /// Brings everything to rest. The kinetic energy is booked as damping.
    pub(super) fn stop(&mut self) {
        let before = self.energy().kinetic;
        self.state.rest();
        self.state.work.damping += before - self.energy().kinetic;
        self.started = false;
    }

    /// Energies at the present time and their balance (§6).
    pub fn energy(&mut self) -> Energy {
        let Measured { sums, strain, losing, energy_deficit, .. } = self.measure_once();
        let Work { loads, supports, damping, friction, fracture, contact, most } = self.state.work;
        // This is the work of the last velocities up to now, which the next step will book.
        let half = 0.5 * self.state.before;
        let (damped, done) = if self.motion.fictitious && half > 0.0 {
            (0.5 * sums.power, sums.loads[0])
        } else {
            (half * sums.damping[0], half * (sums.loads[0] + sums.supports[0]))
        };
        let external = loads + supports + done;
        let Losses { friction: slid, fracture: broke, contact: met, damping: dashed, .. } = losing;
        let contact = contact + met + energy_deficit;
        let lost = [damping + damped + dashed, friction + slid, fracture + broke, contact];
        Energy::new(sums.kinetic, strain, lost, external, [self.initial_energy, most])
    }

    /// Numbers of failed pairs, in shear and in tension.
    #[must_use]
    pub fn failed_pairs(&self) -> [u64; 2] {
        let [shear, tension] = self.state.failed;
        // Pairs that fail at the present time count once they have been measured.
        let more = if self.is_measured() { self.measured.losing.failed } else { [0; 2] };
        [shear + more[0], tension + more[1]]
    }

    pub(super) fn mechanical_energy(&mut self) -> f64 {
        let energy = self.energy();
        let lost = energy.friction + energy.fracture + energy.contact;
        energy.kinetic + energy.strain_bodies + energy.strain_joints + lost
    }

    /// Sets the displacements of all nodes `[m]`, shape `(n_nodes, 3)`; removed blocks keep theirs.
    /// The energy balance includes the change, and contacts are reset.
    ///
    /// # Panics
    ///
    /// If there is not one displacement for each node.
    pub fn set_displacements(&mut self, displacements: &[[f64; 3]]) {
        self.model.one_for_each_node("displacements", displacements.len());
        let before = self.energy().balance;
        for (node, u) in self.model.existing_nodes(displacements) {
            self.model.set(&mut self.state.u, node, *u);
        }
        self.state.place_rigid(&self.model);
        self.state.contacts.clear_contacts();
        self.scratch.fit(&self.model, &self.state);
        self.account_from(before);
    }

    /// Sets the velocities of all nodes at the present time `[m/s]`, shape `(n_nodes, 3)`; removed
    /// blocks stay at rest. The energy balance includes the change. A relaxation ends.
    ///
    /// # Panics
    ///
    /// If there is not one velocity for each node.
    pub fn set_velocities(&mut self, velocities: &[[f64; 3]]) {
        self.model.one_for_each_node("velocities", velocities.len());
        self.synchronise();
        // Velocities end a relaxation.
        if self.motion.fictitious {
            self.finish_relaxation();
            self.change_motion(Motion::without_step(&self.model.assembly));
        }
        let before = self.energy().balance;
        for (node, v) in self.model.existing_nodes(velocities) {
            self.model.set(&mut self.state.v, node, *v);
        }
        self.state.move_rigid(&self.model);
        let state = &mut *self.state;
        state.peaks.note_velocities(&state.v);
        self.account_from(before);
    }

    /// Adjusts the energy balance so that a state set by a program causes no imbalance. The balance
    /// restarts after a state that was not finite.
    fn account_from(&mut self, before: f64) {
        let more = self.energy().balance - before;
        if more.is_finite() {
            self.initial_energy += more;
            return;
        }
        self.state.work = Work::default();
        self.initial_energy = 0.0;
        self.initial_energy = self.energy().balance;
    }
}
