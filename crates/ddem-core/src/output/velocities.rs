//! Velocities and poses at the present time, interpolated between the half steps around it.

use std::ops::Range;

use super::Snapshot;
use crate::step::{Poses, present, set_corner_velocities};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::math::leapfrog::local_damping;
use ddem_mechanics::rigid::Pose;

impl Snapshot<'_> {
    /// Writes the velocities of a range of nodes `[m/s]`; zero in a relaxation.
    pub(crate) fn fill_velocities(&self, range: Range<usize>, out: &mut [f64]) {
        let model = self.model;
        let blocks = model.blocks_of(range.clone());
        let mut rigid: Vec<usize> = blocks.map(|block| model.packs.slot(block).0).collect();
        rigid.retain(|&pack| model.packs.packs[pack].rigid);
        rigid.sort_unstable();
        rigid.dedup();
        let poses: Vec<Poses> = rigid.iter().map(|&pack| self.pose(pack)).collect();
        model.fill_nodes(range, out, |block| {
            let (pack, lane) = model.packs.slot(block);
            let corners = rigid.binary_search(&pack).ok().map(|at| {
                let mut corners = [Lanes::ZERO; 24];
                set_corner_velocities(model, pack, &poses[at], &mut corners);
                corners
            });
            move |node| {
                [0, 1, 2].map(|c| match &corners {
                    Some(corners) => corners[3 * node + c].0[lane],
                    None => self.velocity(pack, 3 * node + c, lane),
                })
            }
        });
    }

    /// Velocities in the layout of the state `[m/s]`.
    pub(crate) fn velocities(&self) -> Vec<Lanes> {
        let mut velocities = self.state.v.clone();
        let poses = self.poses();
        for (index, pack) in self.model.packs.packs.iter().enumerate() {
            if pack.rigid {
                let nodes = 3 * pack.start..3 * (pack.start + 8);
                set_corner_velocities(
                    self.model,
                    index,
                    &poses[pack.rigid_start],
                    &mut velocities[nodes],
                );
                continue;
            }
            for at in 0..3 * self.model.packs.numbering_of(pack).nodes {
                let v = |lane| self.velocity(index, at, lane);
                velocities[3 * pack.start + at] = Lanes(std::array::from_fn(v));
            }
        }
        velocities
    }

    /// Velocity between `v⁻` and `v⁺` `[m/s]`.
    fn velocity(&self, pack: usize, at: usize, lane: usize) -> f64 {
        let motion = self.context.motion;
        let slot = 3 * self.model.packs.packs[pack].start + at;
        let v = self.state.v[slot].0[lane];
        if motion.fictitious {
            return 0.0;
        }
        if self.state.before == 0.0 {
            return v;
        }
        let class = &motion.classes[self.model.assembly.pack_inertia[pack] as usize];
        let [a, b, _] = class.at(at, lane);
        let f = self.scratch.f[slot].0[lane];
        let (force, r) = (f - local_damping(motion.local, f, v), motion.previous_step_ratio());
        0.5 * ((2.0 - r) * v + r * (a * v) + r * (b * force))
    }

    /// Poses of the rigid blocks with their present velocities.
    pub(crate) fn poses(&self) -> Vec<Poses> {
        let packs = &self.model.packs.packs;
        (0..packs.len()).filter(|&pack| packs[pack].rigid).map(|pack| self.pose(pack)).collect()
    }

    /// Poses of the blocks of one rigid pack.
    fn pose(&self, pack: usize) -> Poses {
        let all = &self.state.poses;
        let poses = all[self.model.packs.packs[pack].rigid_start];
        if self.context.motion.fictitious {
            return poses.map(Pose::resting);
        }
        if self.state.before == 0.0 {
            return poses;
        }
        present(self.context, pack, all, &self.scratch.f)
    }
}
