//! Fields that the passes over the packs borrow, divided between tasks.

use std::ops::Range;

use super::TaskWorkspaces;
use crate::model::boundary::ActiveBoundaries;
use crate::model::conditions::ActiveConditions;
use ddem_joint::broken::BrokenLattices;
use ddem_joint::losses::Losses;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::rigid::Pose;
use ddem_mesh::pack::Packs;
use ddem_mesh::parallel::{Split, cut, neighbour_force_start, node_start, rigid_start};

/// Field of the second pass: a step changes it, a trial only reads it.
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

    /// Mutable field in a step; `None` in a trial.
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

/// Fields of the first pass, of a run of packs.
pub(crate) struct FirstPassFields<'a> {
    pub(crate) f: &'a mut [Lanes],
    /// Viscous forces; empty if blocks have never been viscous.
    pub(crate) viscous: &'a mut [Lanes],
    pub(crate) neighbour_forces: &'a mut [Lanes],
    pub(crate) torques: &'a mut [[Lanes; 3]],
    /// Strain energies; empty if they are not requested.
    pub(crate) energies: &'a mut [[Lanes; 2]],
    pub(crate) broken_joints: &'a mut [BrokenLattices],
    pub(crate) losses: &'a mut [Losses],
    pub(crate) workspaces: &'a mut [TaskWorkspaces],
}

/// Fields of the second pass, of a run of packs.
pub(crate) struct SecondPass<'a> {
    pub(super) conditions: &'a ActiveConditions,
    pub(super) boundaries: &'a ActiveBoundaries,
    pub(super) blocks: BlockMotion<'a>,
    pub(super) f: &'a mut [Lanes],
    /// Viscous forces; empty if blocks have never been viscous.
    pub(super) viscous: &'a mut [Lanes],
    pub(super) torques: &'a mut [[Lanes; 3]],
    pub(super) sums: &'a mut [StepSums],
    pub(super) reactions: &'a mut [f64],
    pub(super) drags: &'a mut [[f64; 3]],
    pub(super) workspaces: &'a mut [TaskWorkspaces],
}

/// Fields of one pack in the second pass.
pub(crate) struct PackFields<'a> {
    pub(crate) blocks: BlockMotion<'a>,
    pub(crate) f: &'a mut [Lanes],
    /// Viscous forces of the blocks, against the motion; empty if they are not viscous.
    pub(crate) viscous: &'a mut [Lanes],
    pub(crate) torque: &'a mut [Lanes; 3],
    pub(crate) sums: &'a mut StepSums,
    pub(crate) reactions: &'a mut [f64],
    /// Forces of the boundary dashpots.
    pub(crate) drags: &'a mut [[f64; 3]],
    /// Loads; undefined unless `loaded`.
    pub(crate) q: &'a mut [Lanes],
    pub(crate) loaded: bool,
    /// Working space for a nodal field.
    pub(crate) room: &'a mut Vec<Lanes>,
}

impl PackFields<'_> {
    pub(crate) fn is_viscous(&self) -> bool {
        !self.viscous.is_empty()
    }
}

impl SecondPass<'_> {
    /// Fields of pack `index`, whose blocks are `viscous` or not. The fields begin at pack `first`.
    pub(crate) fn pack(
        &mut self,
        packs: &Packs,
        first: usize,
        index: usize,
        viscous: bool,
    ) -> PackFields<'_> {
        let node = node_start(packs, first);
        let nodes = node_start(packs, index) - node..node_start(packs, index + 1) - node;
        let support = self.conditions.first_support(first);
        let supports = self.conditions.first_support(index) - support
            ..self.conditions.first_support(index + 1) - support;
        let drag = self.boundaries.first(first);
        let drags = self.boundaries.first(index) - drag..self.boundaries.first(index + 1) - drag;
        let spaces = &mut self.workspaces[0];
        if spaces.q.len() < nodes.len() {
            spaces.q.resize(nodes.len(), Lanes::ZERO);
        }
        PackFields {
            blocks: self.blocks.pack(packs, first, index, nodes.clone()),
            viscous: match self.viscous.get_mut(nodes.clone()) {
                Some(own) if viscous => own,
                _ => &mut [],
            },
            q: &mut spaces.q[..nodes.len()],
            f: &mut self.f[nodes],
            torque: &mut self.torques[index - first],
            sums: &mut self.sums[index - first],
            reactions: &mut self.reactions[supports],
            drags: &mut self.drags[drags],
            loaded: false,
            room: &mut spaces.room,
        }
    }
}

impl BlockMotion<'_> {
    fn pack(
        &mut self,
        packs: &Packs,
        first: usize,
        index: usize,
        nodes: Range<usize>,
    ) -> BlockMotion<'_> {
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

impl Split for FirstPassFields<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let neighbour_forces =
            neighbour_force_start(packs, at) - neighbour_force_start(packs, first);
        let low = Self {
            f: cut(&mut self.f, nodes),
            viscous: cut(&mut self.viscous, nodes),
            neighbour_forces: cut(&mut self.neighbour_forces, neighbour_forces),
            torques: cut(&mut self.torques, at - first),
            energies: cut(&mut self.energies, at - first),
            broken_joints: cut(&mut self.broken_joints, at - first),
            losses: cut(&mut self.losses, at - first),
            workspaces: cut(&mut self.workspaces, low_runs),
        };
        (low, self)
    }
}

impl Split for SecondPass<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let Self { conditions, boundaries, .. } = self;
        let nodes = node_start(packs, at) - node_start(packs, first);
        let supports = conditions.first_support(at) - conditions.first_support(first);
        let (blocks, rest) = self.blocks.split(packs, first, at, low_runs);
        self.blocks = rest;
        let low = Self {
            conditions,
            boundaries,
            blocks,
            f: cut(&mut self.f, nodes),
            viscous: cut(&mut self.viscous, nodes),
            torques: cut(&mut self.torques, at - first),
            sums: cut(&mut self.sums, at - first),
            reactions: cut(&mut self.reactions, supports),
            drags: cut(&mut self.drags, boundaries.first(at) - boundaries.first(first)),
            workspaces: cut(&mut self.workspaces, low_runs),
        };
        (low, self)
    }
}
