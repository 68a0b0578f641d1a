//! Linear and angular momentum.

use super::Snapshot;
use ddem_mechanics::math::exact::ExactSum;
use ddem_mesh::Vec3;

impl Snapshot<'_> {
    /// Implements [`Simulation::momentum`](crate::Simulation::momentum).
    pub(crate) fn momentum(&self) -> [f64; 3] {
        self.momenta()[0].into()
    }

    /// Implements [`Simulation::angular_momentum`](crate::Simulation::angular_momentum).
    pub(crate) fn angular_momentum(&self) -> [f64; 3] {
        self.momenta()[1].into()
    }

    /// Linear `[kg m/s]` and angular momentum `[kg m²/s]`.
    fn momenta(&self) -> [Vec3; 2] {
        let mut sums: [[ExactSum; 3]; 2] = Default::default();
        self.each_mass(|_, mass, x, v, turning| {
            let p = v * mass;
            for (sums, more) in sums.iter_mut().zip([p, x.cross(&p) + turning]) {
                sums.iter_mut().zip(&more).for_each(|(sum, more)| sum.add(*more));
            }
        });
        sums.map(|sum| sum.each_ref().map(ExactSum::value).into())
    }

    /// Calls `visit` with each mass, block after block: number of its block, mass `[kg]`, present
    /// position `[m]` and velocity `[m/s]`, and angular momentum about its own centre `[kg m²/s]`.
    /// The masses are the nodes of deformable blocks, and rigid blocks.
    pub(super) fn each_mass(&self, mut visit: impl FnMut(usize, f64, Vec3, Vec3, Vec3)) {
        let model = self.model;
        let mut velocities = vec![[0.0; 3]; model.n_nodes()];
        self.fill_velocities(0..model.n_nodes(), velocities.as_flattened_mut());
        let poses = self.poses();
        for (number, block) in model.geometry.blocks.iter().enumerate() {
            let (index, lane) = model.packs.slot(number);
            let pack = &model.packs.packs[index];
            if pack.rigid {
                if !model.assembly.bodies.counts(index, lane) {
                    continue;
                }
                let pose = &poses[pack.rigid_start][lane];
                let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
                let centre = model.geometry.position(number, [0; 3]) - mass_properties.arm(0);
                visit(
                    number,
                    mass_properties.mass,
                    centre + pose.shift,
                    pose.velocity,
                    pose.momentum,
                );
                continue;
            }
            let nodes = velocities.iter().enumerate().skip(block.first_node as usize);
            for (node, v) in nodes.take(model.packs.numbering_of(pack).nodes) {
                let x = Vec3::from(model.point(node)) + Vec3::from(model.get(&self.state.u, node));
                visit(number, model.mass(node), x, Vec3::from(*v), Vec3::zeros());
            }
        }
    }
}
