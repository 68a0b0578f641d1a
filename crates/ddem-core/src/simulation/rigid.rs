//! Poses of the rigid bodies at the present time.

use super::Simulation;
use crate::parallel::node_start;
use crate::rigid::Pose;
use crate::step::{Poses, present};

impl Simulation {
    /// Packs of rigid bodies.
    fn rigid_packs(&self) -> Vec<usize> {
        let packs = &self.model.packs.packs;
        (0..packs.len()).filter(|&index| packs[index].rigid).collect()
    }

    /// Poses of the rigid bodies with their velocities at the present time, under the forces that
    /// were last measured.
    pub(crate) fn present_poses(&self) -> Vec<Poses> {
        self.present_poses_of(&self.rigid_packs())
    }

    /// Those of some packs of rigid bodies.
    pub(crate) fn present_poses_of(&self, rigid: &[usize]) -> Vec<Poses> {
        rigid.iter().map(|&index| self.present_pose(index)).collect()
    }

    /// Those of one pack.
    pub(crate) fn present_pose(&self, index: usize) -> Poses {
        let poses = self.state.poses[self.model.packs.packs[index].rigid_start];
        if self.motion.fictitious {
            return poses.map(Pose::resting);
        }
        if self.state.before == 0.0 {
            return poses;
        }
        let packs = &self.model.packs;
        let nodes = node_start(packs, index)..node_start(packs, index + 1);
        present(self.context(), index, &poses, &self.scratch.f[nodes])
    }
}
