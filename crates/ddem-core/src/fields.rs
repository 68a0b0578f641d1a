//! What can be seen of a simulation: nodal fields, stresses, tractions.

use crate::geometry::Vec3;
use crate::lanes::Lanes;
use crate::motion::Motion;
use crate::simulation::Simulation;

impl Simulation {
    /// Displacement of a node `[m]`.
    #[must_use]
    pub fn displacement(&self, node: usize) -> [f64; 3] {
        self.model.get(&self.state.u, node)
    }

    /// Velocities at the present time in the layout of the state.
    pub(crate) fn present_velocities(&self) -> Vec<Lanes> {
        if self.state.whole {
            return self.state.v.clone();
        }
        let Motion { classes, local, .. } = &self.motion;
        let mut velocities = self.state.v.clone();
        for (pack, index) in self.model.packs.packs.iter().zip(&self.model.assembly.pack_inertia) {
            let class = &classes[*index as usize];
            for at in 0..class.a.len() {
                let place = 3 * pack.start + at;
                for lane in 0..4 {
                    let [a, b, _] = class.at(at, lane);
                    let (v, f) = (self.state.v[place].0[lane], self.scratch.f[place].0[lane]);
                    let damping = if v == 0.0 { 0.0 } else { local * f.abs() * v.signum() };
                    let next = a * v + b * (f - damping);
                    velocities[place].0[lane] = 0.5 * (v + next);
                }
            }
        }
        velocities
    }

    /// Displacements of all nodes `[m]`, shape `(n_nodes, 3)`.
    #[must_use]
    pub fn displacements(&self) -> Vec<[f64; 3]> {
        (0..self.model.n_nodes()).map(|node| self.displacement(node)).collect()
    }

    /// Internal force `f = K u` of the bodies and joints on every node `[N]`, shape
    /// `(n_nodes, 3)`, (8) and (11).
    pub fn internal_forces(&mut self) -> Vec<[f64; 3]> {
        crate::step::internal_forces(&self.model, &self.state.u, &mut self.scratch);
        let f = &self.scratch.f;
        (0..self.model.n_nodes()).map(|node| self.model.get(f, node).map(|x| -x)).collect()
    }

    /// Sets the displacements of all nodes `[m]`, shape `(n_nodes, 3)`.
    pub fn set_displacements(&mut self, displacements: &[[f64; 3]]) {
        for (node, u) in displacements.iter().enumerate().take(self.model.n_nodes()) {
            self.model.set(&mut self.state.u, node, *u);
        }
        self.scratch.fit(&self.model, &self.state.u);
    }

    /// Position of a node `[m]`.
    #[must_use]
    pub fn position(&self, node: usize) -> [f64; 3] {
        (Vec3::from(self.model.point(node)) + Vec3::from(self.displacement(node))).into()
    }
}
