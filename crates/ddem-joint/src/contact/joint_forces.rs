//! Forces of nonconforming joints with deformable blocks, side by side, and the nodes to which they go.
//!
//! The points of a joint stay where they are until the joint ends. Each block therefore has a list of
//! the shares of its nodes in their forces. Blocks that went from patch to patch instead would wait
//! for memory most of the time.

use std::sync::Arc;

use super::Patch;
use super::fixed::NodalShare;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::Vec3;

/// Stands for the torque on the block instead of a node.
const TORQUE: u32 = u32::MAX;

/// Forces of all joints with deformable blocks, and the shares of the nodes in them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct JointForces {
    /// Number of forces before each patch, shape `(patches + 1)`.
    starts: Vec<u32>,
    /// Forces of the points of each joint on block a `[N]`, then the couples on a and b `[N m]`.
    forces: Vec<Vec3>,
    /// Number of shares before those of each block, shape `(blocks + 1)`.
    firsts: Arc<[u32]>,
    /// Shares of the nodes of each block. Copies of a state share them, because they change only where
    /// joints end.
    shares: Arc<[NodalShare]>,
}

/// Patches of one task, with the forces of their joints.
pub(super) struct PatchRun<'a> {
    patches: &'a mut [Patch],
    starts: &'a [u32],
    forces: &'a mut [Vec3],
}

impl JointForces {
    /// Numbers the forces again because patches have been added or removed. Joints may end but not begin:
    /// as long as there are as many forces, the shares stay the same.
    pub(super) fn renew(&mut self, patches: &[Patch], blocks: usize) {
        let n_forces = |patch: &Patch| {
            let any = [0, 1].into_iter().any(|side| patch.is_on_nodes(side));
            if any { patch.points.len() + 2 } else { 0 }
        };
        self.starts.clear();
        let mut n = 0;
        for patch in patches {
            self.starts.push(n as u32);
            n += n_forces(patch);
        }
        self.starts.push(n as u32);
        if n == self.forces.len() && self.firsts.len() == blocks + 1 {
            return;
        }
        // Joints that hold have been updated in this step already.
        self.forces = patches.iter().filter(|patch| n_forces(patch) > 0).flat_map(forces).collect();
        self.find_shares(patches, blocks);
    }

    fn find_shares(&mut self, patches: &[Patch], blocks: usize) {
        let each =
            || patches.iter().zip(&self.starts).flat_map(|(patch, &start)| shares(patch, start));
        let mut firsts = vec![0_u32; blocks + 1];
        each().for_each(|(block, _)| firsts[block + 1] += 1);
        for block in 0..blocks {
            firsts[block + 1] += firsts[block];
        }
        let mut next = firsts.clone();
        let mut all = vec![NodalShare::default(); firsts[blocks] as usize];
        for (block, share) in each() {
            all[next[block] as usize] = share;
            next[block] += 1;
        }
        (self.firsts, self.shares) = (firsts.into(), all.into());
    }

    /// Runs of some number of patches, each with the forces of its joints.
    pub(super) fn runs<'a>(
        &'a mut self,
        patches: &'a mut [Patch],
        together: usize,
    ) -> Vec<PatchRun<'a>> {
        debug_assert_eq!(self.starts.len(), patches.len() + 1);
        let mut left = &mut self.forces[..];
        let run = |(number, patches): (usize, &'a mut [Patch])| {
            let first = number * together;
            let starts = &self.starts[first..=first + patches.len()];
            let n = (starts[patches.len()] - starts[0]) as usize;
            let (forces, rest) = std::mem::take(&mut left).split_at_mut(n);
            left = rest;
            PatchRun { patches, starts, forces }
        };
        patches.chunks_mut(together).enumerate().map(run).collect()
    }

    /// Adds the forces of joints on a deformable block to those of its pack, `f`, and their couples to the
    /// torque on the block in a lane. The nodal fields of the pack begin at `start`.
    pub(super) fn add_to(
        &self,
        block: usize,
        [start, lane]: [usize; 2],
        f: &mut [Lanes],
        torque: &mut [Lanes; 3],
    ) {
        let [from, to] = [0, 1].map(|end| self.firsts[block + end] as usize);
        for NodalShare { weight, slot, force } in &self.shares[from..to] {
            let force = &self.forces[*force as usize];
            let node = match *slot {
                TORQUE => &mut torque[..],
                slot => {
                    let at = slot as usize / LANES - start;
                    &mut f[at..at + 3]
                }
            };
            let [x, y, z] = node else { unreachable!() };
            for (component, force) in [x, y, z].into_iter().zip(force.iter()) {
                component.0[lane] += weight * force;
            }
        }
    }

    /// Memory in use `[bytes]`.
    pub(super) fn bytes(&self) -> usize {
        4 * (self.starts.len() + self.firsts.len())
            + size_of_val(&self.forces[..])
            + size_of_val(&self.shares[..])
    }
}

impl<'a> PatchRun<'a> {
    /// Patches of the task. A joint with a deformable block comes with its list of forces, other patches
    /// with an empty one.
    pub(super) fn each(self) -> impl Iterator<Item = (&'a mut Patch, &'a mut [Vec3])> {
        let Self { patches, starts, forces: mut left } = self;
        patches.iter_mut().zip(starts.windows(2)).map(move |(patch, ends)| {
            let (own, rest) = std::mem::take(&mut left).split_at_mut((ends[1] - ends[0]) as usize);
            left = rest;
            (patch, own)
        })
    }
}

/// Forces of the points of a joint at their last update, and its couples on both blocks.
fn forces(patch: &Patch) -> impl Iterator<Item = Vec3> + '_ {
    let axes = patch.frame();
    let each = patch.points.iter().map(move |point| Patch::force_along(&axes, point));
    each.chain(patch.couples())
}

/// Shares of nodes in the forces of a joint, which begin at `start`, each with its block.
fn shares(patch: &Patch, start: u32) -> impl Iterator<Item = (usize, NodalShare)> + '_ {
    let sides = [0, 1].into_iter().filter(|&side| patch.is_on_nodes(side));
    sides.flat_map(move |side| {
        let force = start + (patch.points.len() + side) as u32;
        let couple = NodalShare { weight: 1.0, slot: TORQUE, force };
        let block = patch.blocks[side] as usize;
        patch.nodal_shares(side, start).chain([couple]).map(move |share| (block, share))
    })
}
