//! Poses of the rigid bodies at the present time.

use super::Simulation;
use crate::parallel::node_start;
use crate::rigid::Pose;
use crate::step::{Poses, before, carry, present};

impl Simulation {
    /// Packs of rigid bodies.
    fn rigid_packs(&self) -> Vec<usize> {
        let packs = &self.model.packs.packs;
        (0..packs.len()).filter(|&index| packs[index].rigid).collect()
    }

    /// Poses of the rigid bodies with their velocities at the present time, under the forces that
    /// were last measured.
    pub(crate) fn present_poses(&mut self) -> Vec<Poses> {
        let packs = self.rigid_packs();
        self.present_poses_of(&packs)
    }

    /// Those of some packs of rigid bodies.
    pub(crate) fn present_poses_of(&mut self, rigid: &[usize]) -> Vec<Poses> {
        let packs = &self.model.packs.packs;
        let poses = rigid.iter().map(|&index| self.state.poses[packs[index].rigid_start]);
        if self.motion.fictitious {
            return poses.map(|poses| poses.map(Pose::resting)).collect();
        }
        if self.state.whole || rigid.is_empty() {
            return poses.collect();
        }
        let (context, state, scratch) = self.parts();
        let packs = &context.model.packs;
        let pose = |&index: &usize| {
            let nodes = node_start(packs, index)..node_start(packs, index + 1);
            let poses = &state.poses[packs.packs[index].rigid_start];
            present(context, index, poses, &scratch.f[nodes])
        };
        rigid.iter().map(pose).collect()
    }

    /// Velocities of the rigid bodies go back half a step, under the forces of the present time.
    pub(super) fn rigid_before(&mut self) {
        for index in self.rigid_packs() {
            let (context, state, scratch) = self.parts();
            let packs = &context.model.packs;
            let poses = &mut state.poses[packs.packs[index].rigid_start];
            let nodes = node_start(packs, index)..node_start(packs, index + 1);
            *poses = before(context, index, poses, &scratch.f[nodes.clone()]);
            carry(context.model, index, poses, &mut state.v[nodes]);
        }
    }
}
