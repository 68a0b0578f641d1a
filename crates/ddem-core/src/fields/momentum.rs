//! Momentum and its moment.

use crate::geometry::Vec3;
use crate::simulation::Simulation;

impl Simulation {
    /// Momentum of the whole model at the present time, `P = Σ m v` `[kg m/s]`: over the nodes of
    /// deformable blocks with their lumped masses, eq. (3), and over rigid blocks; zero in a
    /// relaxation. It changes by what loads and supports do alone.
    pub fn momentum(&mut self) -> [f64; 3] {
        self.momenta()[0].into()
    }

    /// Its moment about the origin `[kg m²/s]`: `Σ x × m v` over the nodes of deformable blocks, and
    /// `x × m v + R I Rᵀ ω` of each rigid one, with its centroid x, rotation R and inertia I at rest.
    pub fn angular_momentum(&mut self) -> [f64; 3] {
        self.momenta()[1].into()
    }

    /// Both, block after block.
    fn momenta(&mut self) -> [Vec3; 2] {
        let (velocities, poses) = (self.velocities(), self.present_poses());
        let (model, mut sums) = (&self.model, [Vec3::zeros(); 2]);
        let mut add = |x: Vec3, p: Vec3, turning: Vec3| {
            sums[0] += p;
            sums[1] += x.cross(&p) + turning;
        };
        for (block, body) in model.geometry.bodies.iter().enumerate() {
            let (pack, lane) = model.packs.slot(block);
            let pack = &model.packs.packs[pack];
            if pack.rigid {
                let pose = &poses[pack.rigid_start][lane];
                let matter = &model.assembly.rigid[pack.rigid_start][lane];
                let centre = model.geometry.position(block, [0; 3]) - matter.arm(0);
                add(centre + pose.shift, pose.velocity * matter.mass, pose.momentum);
                continue;
            }
            let nodes = velocities.iter().enumerate().skip(body.first_node as usize);
            for (node, v) in nodes.take(model.packs.shape_of(pack).nodes) {
                let x = Vec3::from(model.point(node)) + Vec3::from(self.displacement(node));
                add(x, Vec3::from(*v) * model.mass(node), Vec3::zeros());
            }
        }
        sums
    }
}
