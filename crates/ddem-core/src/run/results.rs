//! Results at the present time: the data of a [`Snapshot`], measured first if necessary.

use super::Simulation;
use crate::output::{
    Contact, ContactCounts, ContactSummary, Fragment, FragmentSummary, Snapshot, StateSummary,
};
use ddem_mechanics::math::lanes::Lanes;

impl Simulation {
    /// Fields at the present time. Nothing moves.
    ///
    /// ```
    /// # use ddem_core::{FIELDS, Simulation};
    /// # fn values(simulation: &mut Simulation) {
    /// let snapshot = simulation.snapshot();
    /// for field in &FIELDS {
    ///     let n = snapshot.len(field.on);
    ///     let mut first = vec![0.0; n.min(100) * field.components];
    ///     snapshot.fill(field, 0..n.min(100), &mut first);
    /// }
    /// # }
    /// ```
    pub fn snapshot(&mut self) -> Snapshot<'_> {
        self.measure_once();
        self.as_measured()
    }

    /// Fields at the present time, with forces, broken joints and contacts of the last measurement.
    pub(super) fn as_measured(&self) -> Snapshot<'_> {
        Snapshot::new(self.context(), &self.state, &self.scratch, self.failing)
    }

    /// Displacement of a node `[m]`.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn displacement(&self, node: usize) -> [f64; 3] {
        self.model.get(&self.state.u, node)
    }

    /// Displacements of all nodes `[m]`, shape `(n_nodes, 3)`.
    #[must_use]
    pub fn displacements(&self) -> Vec<[f64; 3]> {
        self.model.plain(&self.state.u)
    }

    /// Displacement `[m]` and velocity at the last half step `[m/s]` of each level of the
    /// free-field columns, shape `(levels, 2, 3)`.
    #[must_use]
    pub fn column_levels(&self) -> Vec<[[f64; 3]; 2]> {
        self.state.columns.iter().map(|level| level.map(Into::into)).collect()
    }

    /// Velocities of all nodes at the present time `[m/s]`, shape `(n_nodes, 3)`; zero in a
    /// relaxation.
    pub fn velocities(&mut self) -> Vec<[f64; 3]> {
        let mut velocities = vec![[0.0; 3]; self.model.n_nodes()];
        let nodes = 0..velocities.len();
        self.snapshot().fill_velocities(nodes, velocities.as_flattened_mut());
        velocities
    }

    /// Velocity of a node at the present time `[m/s]`.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    pub fn velocity(&mut self, node: usize) -> [f64; 3] {
        let mut velocity = [0.0; 3];
        self.model.geometry.has_node(node);
        self.snapshot().fill_velocities(node..node + 1, &mut velocity);
        velocity
    }

    /// Internal force `f = K u` of the blocks and joints on each node `[N]`, shape `(n_nodes, 3)`,
    /// eq. (8) and eq. (11). It does not include nonconforming joints.
    pub fn internal_forces(&mut self) -> Vec<[f64; 3]> {
        self.evaluate_forces();
        self.scratch.collect(&self.model, &self.state.poses, false);
        let forces = self.model.plain(&self.scratch.f);
        forces.into_iter().map(|f| f.map(|x| -x)).collect()
    }

    /// Runs the first pass of a step alone: elastic forces of blocks and joints. Nothing moves.
    pub fn evaluate_forces(&mut self) {
        let (context, state, scratch) = self.parts();
        let mut joints = std::mem::take(&mut scratch.measured_joints);
        joints.clone_from(&state.broken_joints);
        let pass = context.pass(&state.u, &state.v, &state.poses);
        let pass = crate::step::FirstPass { viscous: None, ..pass };
        crate::step::forces(pass, &mut joints, None, scratch);
        scratch.measured_joints = joints;
    }

    /// Force that accelerates each node `[N]`, shape `(n_nodes, 3)`: loads and reactions less the
    /// internal forces, `F = Q + R − f`; zero in equilibrium.
    pub fn forces(&mut self) -> Vec<[f64; 3]> {
        self.measure_once();
        self.model.plain(&self.scratch.f)
    }

    /// Sum of the reactions at some nodes, as they act on the model `[N]`. The order of the nodes
    /// does not matter; a node given twice counts once.
    pub fn reaction(&mut self, nodes: &[u32]) -> [f64; 3] {
        let mut nodes = nodes.to_vec();
        nodes.sort_unstable();
        if let Some(&last) = nodes.last() {
            self.model.geometry.has_node(last as usize);
        }
        self.measure_once();
        let mut sum = [0.0; 3];
        for (support, reaction) in self.view.conditions.supports.iter().zip(&self.scratch.reactions)
        {
            if nodes.binary_search(&support.node).is_ok() {
                sum[support.axis as usize] += reaction;
            }
        }
        sum
    }

    /// Traction of each pair on its first node's side `[Pa]`, shape `(n_pairs, 3)`, in global axes:
    /// `T = (F_a − F_b)/(2 A_p)` of the forces that the joint's elements and springs exert, (M1).
    /// Its product with the normal from a to b is positive in tension. It is 0 if a contact has
    /// replaced the joint.
    pub fn tractions(&mut self) -> Vec<[f64; 3]> {
        self.snapshot().tractions()
    }

    /// Stress at the centre of each hex8 element `[Pa]`: xx yy zz xy yz zx, tension positive, shape
    /// `(n_elements, 6)`; blocks in order, x fastest in a block. It is 0 in rigid blocks.
    #[must_use]
    pub fn stresses(&self) -> Vec<[f64; 6]> {
        self.as_measured().stresses()
    }

    /// Stress at the centre of the element at lattice steps `at` of a block `[Pa]`.
    ///
    /// # Panics
    ///
    /// If the model has no such block, or the block no such element.
    #[must_use]
    pub fn stress(&self, block: usize, at: [usize; 3]) -> [f64; 6] {
        self.as_measured().stress(block, at)
    }

    /// Peak particle velocity: largest speed of each node in all time steps since the start of the
    /// run `[m/s]`. It is empty if the deck has no `peaks`.
    #[must_use]
    pub fn peak_velocities(&self) -> Vec<f64> {
        self.as_measured().peak_velocities()
    }

    /// Largest principal tension and compression at the centre of each element since the start of
    /// the run, both at least 0 `[Pa]`. They are sampled at least four times while a wave crosses
    /// an element, or in every step, and in every equilibrium. Empty if the deck has no `peaks`.
    #[must_use]
    pub fn peak_stresses(&self) -> Vec<[f64; 2]> {
        self.as_measured().peak_stresses()
    }

    /// Contacts that carry force at the present time, in the order of their blocks. Nothing moves.
    pub fn contacts(&mut self) -> Vec<Contact> {
        self.snapshot().contacts()
    }

    /// Numbers of contacts at the present time. Nothing moves.
    pub fn contact_counts(&mut self) -> ContactCounts {
        self.snapshot().contact_counts()
    }

    /// Number of pairs of blocks that pressed on each other at the last step. It needs no
    /// measurement.
    #[must_use]
    pub fn touching_blocks(&self) -> usize {
        self.as_measured().touching_blocks()
    }

    /// Fragments at the present time by decreasing volume, equal ones by their lowest block. A
    /// joint holds as long as one of its pairs is bonded. Joints without tensile strength and
    /// cohesion never hold, and neither do contacts.
    pub fn fragments(&mut self) -> Vec<Fragment> {
        self.snapshot().fragments()
    }

    /// Fragment number of each block, in the order of [`fragments`](Self::fragments); removed
    /// blocks have the number after the last.
    pub fn block_fragments(&mut self) -> Vec<usize> {
        self.snapshot().block_fragments()
    }

    /// Momentum of the whole model at the present time, `P = Σ m v` `[kg m/s]`: over the nodes of
    /// deformable blocks with their lumped masses, eq. (3), and over rigid blocks. It is zero in a
    /// relaxation. Only loads and supports change it.
    pub fn momentum(&mut self) -> [f64; 3] {
        self.snapshot().momentum()
    }

    /// Angular momentum about the origin `[kg m²/s]`: `Σ x × m v` over the nodes of deformable
    /// blocks, and `x × m v + R I Rᵀ ω` of each rigid block, with its centroid x, rotation R and
    /// inertia I at rest.
    pub fn angular_momentum(&mut self) -> [f64; 3] {
        self.snapshot().angular_momentum()
    }

    /// Summary of the present state. Nothing moves.
    pub fn state_summary(&mut self) -> StateSummary {
        let energy = self.energy();
        self.snapshot().state_summary(energy)
    }

    /// Summary of the contacts at the present time. Nothing moves.
    pub fn contact_summary(&mut self) -> ContactSummary {
        self.snapshot().contact_summary()
    }

    /// Summary of the fragments at the present time. Nothing moves.
    pub fn fragment_summary(&mut self) -> FragmentSummary {
        self.snapshot().fragment_summary()
    }

    /// Memory in use while the simulation steps `[bytes]`.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lanes = self.state.u.len() + self.state.v.len();
        lanes * size_of::<Lanes>()
            + self.scratch.bytes()
            + self.state.broken_joints.bytes()
            + self.state.contacts.bytes()
            + self.state.peaks.bytes()
            + size_of_val(&self.state.poses[..])
            + self.model.bytes()
            + self.motion.classes.iter().map(|c| 3 * c.a.len() * size_of::<Lanes>()).sum::<usize>()
    }

    /// Numbers of pairs of contact points at the last step: all, and those that press on each
    /// other.
    #[must_use]
    pub fn contact_points(&self) -> [usize; 2] {
        self.as_measured().contact_points()
    }

    /// Memory of the contacts `[bytes]`.
    #[must_use]
    pub fn contact_bytes(&self) -> usize {
        self.state.contacts.bytes()
    }
}
