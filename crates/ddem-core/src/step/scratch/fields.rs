//! Fields that the passes over the packs borrow, divided between tasks.

use std::ops::Range;

use super::TaskWorkspaces;
use crate::model::boundary::ActiveBoundaries;
use crate::model::conditions::ActiveConditions;
use crate::state::pass::{Output, Workspace};
use crate::step::PartMoments;
use ddem_joint::broken::{BrokenLattices, prefetch};
use ddem_joint::losses::Losses;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::rigid::{Pose, SpatialLanes};
use ddem_mesh::pack::Packs;
use ddem_mesh::parallel::{Split, cut, neighbour_force_start, node_start, rigid_start};

/// Field of the second pass: a step changes it, an evaluation only reads it.
#[derive(Debug)]
pub(crate) enum Access<'a, T> {
    Write(&'a mut [T]),
    Read(&'a [T]),
}

impl<T> Access<'_, T> {
    pub(crate) fn get(&self) -> &[T] {
        match self {
            Self::Write(field) => field,
            Self::Read(field) => field,
        }
    }

    /// Mutable field in a step; `None` in an evaluation.
    pub(crate) fn get_mut(&mut self) -> Option<&mut [T]> {
        match self {
            Self::Write(field) => Some(field),
            Self::Read(_) => None,
        }
    }

    fn part(&mut self, range: Range<usize>) -> Access<'_, T> {
        match self {
            Self::Write(field) => Access::Write(&mut field[range]),
            Self::Read(field) => Access::Read(&field[range]),
        }
    }

    /// Splits off the first `at` values.
    fn cut(&mut self, at: usize) -> Self {
        match self {
            Self::Write(field) => Self::Write(cut(field, at)),
            Self::Read(field) => {
                let (low, high) = field.split_at(at);
                *field = high;
                Self::Read(low)
            }
        }
    }
}

/// Motion of the blocks of a run of packs.
pub(crate) struct BlockMotion<'a> {
    pub(crate) frames: Access<'a, Frame>,
    pub(crate) u: Access<'a, Lanes>,
    pub(crate) v: Access<'a, Lanes>,
    pub(crate) poses: Access<'a, [Pose; LANES]>,
}

/// Fields of the second pass of relaxation, of a run of packs.
pub(crate) struct Relaxing<'a> {
    pub(crate) frames: &'a mut [Frame],
    pub(crate) sums: &'a mut [StepSums],
    pub(crate) workspaces: &'a mut [TaskWorkspaces],
    pub(crate) u: &'a mut [Lanes],
    pub(crate) v: &'a mut [Lanes],
    pub(crate) poses: &'a mut [[Pose; LANES]],
}

/// Forces on a run of packs, and the working space of its task. The first pass computes them, the
/// second one completes them.
pub(crate) struct PackForces<'a> {
    /// First pack.
    pub(crate) first: usize,
    pub(crate) f: &'a mut [Lanes],
    /// Viscous forces; empty if blocks have never been viscous.
    pub(crate) viscous: &'a mut [Lanes],
    /// Residual torques of deformable blocks, wrenches on rigid ones.
    pub(crate) wrenches: &'a mut [SpatialLanes],
    pub(crate) workspaces: &'a mut [TaskWorkspaces],
}

/// Joints of a run of packs in the first pass.
pub(crate) struct PackJoints<'a> {
    /// First pack.
    pub(crate) first: usize,
    /// Strain energies; empty if they are not requested.
    pub(crate) energies: &'a mut [[Lanes; 2]],
    pub(crate) broken_joints: &'a mut [BrokenLattices],
    pub(crate) losses: &'a mut [Losses],
}

/// One pack in the first pass.
pub(crate) struct FirstPassPack<'a> {
    pub(crate) out: Output<'a>,
    pub(crate) broken_joints: &'a mut BrokenLattices,
    pub(crate) work: &'a mut Workspace,
}

/// Forces of the joints of a run of packs on neighbours.
pub(crate) struct NeighbourForcesMut<'a> {
    /// First pack.
    pub(crate) first: usize,
    pub(crate) forces: &'a mut [Lanes],
}

/// Motion of a run of packs in the second pass.
pub(crate) struct SecondPass<'a> {
    /// First pack.
    pub(super) first: usize,
    pub(super) conditions: &'a ActiveConditions,
    pub(super) boundaries: &'a ActiveBoundaries,
    pub(crate) blocks: BlockMotion<'a>,
    pub(super) sums: &'a mut [StepSums],
    /// Moments of sliding cells; empty if none has slid.
    pub(super) moments: &'a mut [PartMoments],
    pub(super) reactions: &'a mut [f64],
    pub(super) dashpot_forces: &'a mut [[f64; 3]],
}

/// Fields of one pack in the second pass.
pub(crate) struct PackFields<'a> {
    pub(crate) blocks: BlockMotion<'a>,
    pub(crate) f: &'a mut [Lanes],
    /// Viscous forces of the blocks, against the motion; empty if they are not viscous.
    pub(crate) viscous: &'a mut [Lanes],
    pub(crate) wrench: &'a mut SpatialLanes,
    pub(crate) sums: &'a mut StepSums,
    /// Moments of its sliding cells, if any has slid.
    pub(crate) moments: Option<&'a mut PartMoments>,
    pub(crate) reactions: &'a mut [f64],
    /// Forces of the boundary dashpots.
    pub(crate) dashpot_forces: &'a mut [[f64; 3]],
    /// Loads; undefined unless `loaded`.
    pub(crate) q: &'a mut [Lanes],
    pub(crate) loaded: bool,
    /// Working space for a nodal field.
    pub(crate) buffer: &'a mut Vec<Lanes>,
}

impl PackFields<'_> {
    pub(crate) fn is_viscous(&self) -> bool {
        !self.viscous.is_empty()
    }
}

impl PackForces<'_> {
    /// The same forces, borrowed for a shorter time.
    pub(crate) fn all(&mut self) -> PackForces<'_> {
        PackForces {
            first: self.first,
            f: &mut *self.f,
            viscous: &mut *self.viscous,
            wrenches: &mut *self.wrenches,
            workspaces: &mut *self.workspaces,
        }
    }

    /// Slots of the nodes of a pack.
    fn nodes(&self, packs: &Packs, index: usize) -> Range<usize> {
        let first = node_start(packs, self.first);
        node_start(packs, index) - first..node_start(packs, index + 1) - first
    }

    /// Forces of pack `index` alone, which are kept in `f`.
    pub(crate) fn alone<'b>(
        &'b mut self,
        packs: &Packs,
        index: usize,
        f: &'b mut Vec<Lanes>,
    ) -> PackForces<'b> {
        let nodes = self.nodes(packs, index);
        f.resize(nodes.len().max(f.len()), Lanes::ZERO);
        PackForces {
            first: index,
            f: &mut f[..nodes.len()],
            viscous: self.viscous.get_mut(nodes).unwrap_or_default(),
            wrenches: &mut self.wrenches[index - self.first..=index - self.first],
            workspaces: &mut *self.workspaces,
        }
    }
}

impl PackJoints<'_> {
    /// Pack `index` in the first pass.
    pub(crate) fn pack<'b>(
        &'b mut self,
        forces: &'b mut PackForces<'_>,
        on_neighbours: &'b mut NeighbourForcesMut<'_>,
        packs: &Packs,
        index: usize,
    ) -> FirstPassPack<'b> {
        let nodes = forces.nodes(packs, index);
        let at = |pack: usize| {
            neighbour_force_start(packs, pack) - neighbour_force_start(packs, on_neighbours.first)
        };
        let out = Output {
            viscous: forces.viscous.get_mut(nodes.clone()),
            f: &mut forces.f[nodes],
            neighbour_forces: &mut on_neighbours.forces[at(index)..at(index + 1)],
            torque: &mut forces.wrenches[index - forces.first].angular,
            energy: self.energies.get_mut(index - self.first),
            losses: &mut self.losses[index - self.first],
        };
        prefetch(self.broken_joints, index + 1 - self.first);
        let broken_joints = &mut self.broken_joints[index - self.first];
        FirstPassPack { out, broken_joints, work: &mut forces.workspaces[0].elements }
    }
}

impl SecondPass<'_> {
    /// Fields of pack `index`, whose blocks are `viscous` or not.
    pub(crate) fn pack<'b>(
        &'b mut self,
        forces: &'b mut PackForces<'_>,
        packs: &Packs,
        index: usize,
        viscous: bool,
    ) -> PackFields<'b> {
        let first = self.first;
        let support = self.conditions.first_support(first);
        let supports = self.conditions.first_support(index) - support
            ..self.conditions.first_support(index + 1) - support;
        let from = self.boundaries.first(first);
        let dashpot_forces =
            self.boundaries.first(index) - from..self.boundaries.first(index + 1) - from;
        let nodes = forces.nodes(packs, index);
        let spaces = &mut forces.workspaces[0];
        if spaces.q.len() < nodes.len() {
            spaces.q.resize(nodes.len(), Lanes::ZERO);
        }
        PackFields {
            blocks: self.blocks.pack(packs, first, index),
            viscous: match forces.viscous.get_mut(nodes.clone()) {
                Some(own) if viscous => own,
                _ => &mut [],
            },
            q: &mut spaces.q[..nodes.len()],
            f: &mut forces.f[nodes],
            wrench: &mut forces.wrenches[index - forces.first],
            sums: &mut self.sums[index - first],
            moments: self.moments.get_mut(index - first),
            reactions: &mut self.reactions[supports],
            dashpot_forces: &mut self.dashpot_forces[dashpot_forces],
            loaded: false,
            buffer: &mut spaces.buffer,
        }
    }
}

impl BlockMotion<'_> {
    fn pack(&mut self, packs: &Packs, first: usize, index: usize) -> BlockMotion<'_> {
        let node = node_start(packs, first);
        let nodes = node_start(packs, index) - node..node_start(packs, index + 1) - node;
        let rigid = rigid_start(packs, first);
        let poses = rigid_start(packs, index) - rigid..rigid_start(packs, index + 1) - rigid;
        BlockMotion {
            frames: self.frames.part(index - first..index - first + 1),
            u: self.u.part(nodes.clone()),
            v: self.v.part(nodes),
            poses: self.poses.part(poses),
        }
    }
}

impl Split for BlockMotion<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, _: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let low = Self {
            frames: self.frames.cut(at - first),
            u: self.u.cut(nodes),
            v: self.v.cut(nodes),
            poses: self.poses.cut(rigid_start(packs, at) - rigid_start(packs, first)),
        };
        (low, self)
    }
}

impl Split for Relaxing<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let low = Self {
            frames: cut(&mut self.frames, at - first),
            sums: cut(&mut self.sums, at - first),
            workspaces: cut(&mut self.workspaces, low_runs),
            u: cut(&mut self.u, nodes),
            v: cut(&mut self.v, nodes),
            poses: cut(&mut self.poses, rigid_start(packs, at) - rigid_start(packs, first)),
        };
        (low, self)
    }
}

impl Split for PackForces<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let low = Self {
            first,
            f: cut(&mut self.f, nodes),
            viscous: cut(&mut self.viscous, nodes),
            wrenches: cut(&mut self.wrenches, at - first),
            workspaces: cut(&mut self.workspaces, low_runs),
        };
        (low, Self { first: at, ..self })
    }
}

impl Split for PackJoints<'_> {
    fn split(mut self, _: &Packs, first: usize, at: usize, _: usize) -> (Self, Self) {
        let low = Self {
            first,
            energies: cut(&mut self.energies, at - first),
            broken_joints: cut(&mut self.broken_joints, at - first),
            losses: cut(&mut self.losses, at - first),
        };
        (low, Self { first: at, ..self })
    }
}

impl Split for NeighbourForcesMut<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, _: usize) -> (Self, Self) {
        let forces = neighbour_force_start(packs, at) - neighbour_force_start(packs, first);
        let low = Self { first, forces: cut(&mut self.forces, forces) };
        (low, Self { first: at, ..self })
    }
}

impl Split for SecondPass<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let Self { conditions, boundaries, .. } = self;
        let supports = conditions.first_support(at) - conditions.first_support(first);
        let (blocks, rest) = self.blocks.split(packs, first, at, low_runs);
        self.blocks = rest;
        let low = Self {
            first,
            conditions,
            boundaries,
            blocks,
            sums: cut(&mut self.sums, at - first),
            moments: cut(&mut self.moments, at - first),
            reactions: cut(&mut self.reactions, supports),
            dashpot_forces: cut(
                &mut self.dashpot_forces,
                boundaries.first(at) - boundaries.first(first),
            ),
        };
        (low, Self { first: at, ..self })
    }
}
