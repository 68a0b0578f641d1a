//! The fields that passes over the packs borrow, cut between tasks.

use std::ops::Range;

use super::Spaces;
use crate::model::boundary::Outside;
use crate::model::conditions::Active;
use ddem_joint::breaks::PackBreaks;
use ddem_joint::losses::Losses;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::sums::Sums;
use ddem_mechanics::rigid::Pose;
use ddem_mesh::pack::Packs;
use ddem_mesh::parallel::{Split, cut, node_start, rigid_start, share_start};

/// A field of the second pass: a step changes it, a trial only reads it.
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

    /// The field in a step; `None` in a trial.
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

    /// Takes the first values.
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

/// Motion of the bodies of a run of packs.
pub(crate) struct Bodies<'a> {
    pub(crate) frames: Access<'a, Frame>,
    pub(crate) u: Access<'a, Lanes>,
    pub(crate) v: Access<'a, Lanes>,
    pub(crate) poses: Access<'a, [Pose; LANES]>,
}

/// Fields of the second pass of relaxation, of a run of packs.
pub(crate) struct Relaxing<'a> {
    pub(crate) frames: &'a mut [Frame],
    pub(crate) sums: &'a mut [Sums],
    pub(crate) workspaces: &'a mut [Spaces],
    pub(crate) u: &'a mut [Lanes],
    pub(crate) v: &'a mut [Lanes],
    pub(crate) poses: &'a mut [[Pose; LANES]],
}

/// Fields of the first pass, of a run of packs.
pub(crate) struct Forces<'a> {
    pub(crate) f: &'a mut [Lanes],
    /// Empty where bodies never were viscous.
    pub(crate) viscous: &'a mut [Lanes],
    pub(crate) shares: &'a mut [Lanes],
    pub(crate) torques: &'a mut [[Lanes; 3]],
    /// Empty when energies are not asked for.
    pub(crate) energies: &'a mut [[Lanes; 2]],
    pub(crate) breaks: &'a mut [PackBreaks],
    pub(crate) losses: &'a mut [Losses],
    pub(crate) workspaces: &'a mut [Spaces],
}

/// Fields of the second pass, of a run of packs.
pub(crate) struct Second<'a> {
    pub(super) active: &'a Active,
    pub(super) outside: &'a Outside,
    pub(super) bodies: Bodies<'a>,
    pub(super) f: &'a mut [Lanes],
    /// Empty where bodies never were viscous.
    pub(super) viscous: &'a mut [Lanes],
    pub(super) torques: &'a mut [[Lanes; 3]],
    pub(super) sums: &'a mut [Sums],
    pub(super) reactions: &'a mut [f64],
    pub(super) drags: &'a mut [[f64; 3]],
    pub(super) workspaces: &'a mut [Spaces],
}

/// Fields of one pack in the second pass.
pub(crate) struct Part<'a> {
    pub(crate) bodies: Bodies<'a>,
    pub(crate) f: &'a mut [Lanes],
    /// Viscous forces of the bodies, against the motion; empty where they are not viscous.
    pub(crate) viscous: &'a mut [Lanes],
    pub(crate) torque: &'a mut [Lanes; 3],
    pub(crate) sums: &'a mut Sums,
    pub(crate) reactions: &'a mut [f64],
    /// Forces of the dashpots of boundaries.
    pub(crate) drags: &'a mut [[f64; 3]],
    /// Loads; of no meaning unless `loaded`.
    pub(crate) q: &'a mut [Lanes],
    pub(crate) loaded: bool,
    /// Room for a nodal field.
    pub(crate) room: &'a mut Vec<Lanes>,
}

impl Part<'_> {
    pub(crate) fn is_viscous(&self) -> bool {
        !self.viscous.is_empty()
    }
}

impl Second<'_> {
    /// Fields of pack `index`, whose bodies are `viscous` or not; the fields begin at pack `first`.
    pub(crate) fn pack(
        &mut self,
        packs: &Packs,
        first: usize,
        index: usize,
        viscous: bool,
    ) -> Part<'_> {
        let node = node_start(packs, first);
        let nodes = node_start(packs, index) - node..node_start(packs, index + 1) - node;
        let support = self.active.first_support(first);
        let supports = self.active.first_support(index) - support
            ..self.active.first_support(index + 1) - support;
        let drag = self.outside.first(first);
        let drags = self.outside.first(index) - drag..self.outside.first(index + 1) - drag;
        let spaces = &mut self.workspaces[0];
        if spaces.q.len() < nodes.len() {
            spaces.q.resize(nodes.len(), Lanes::ZERO);
        }
        Part {
            bodies: self.bodies.pack(packs, first, index, nodes.clone()),
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

impl Bodies<'_> {
    fn pack(
        &mut self,
        packs: &Packs,
        first: usize,
        index: usize,
        nodes: Range<usize>,
    ) -> Bodies<'_> {
        let rigid = rigid_start(packs, first);
        let poses = rigid_start(packs, index) - rigid..rigid_start(packs, index + 1) - rigid;
        Bodies {
            frames: self.frames.part(index - first..index - first + 1),
            u: self.u.part(nodes.clone()),
            v: self.v.part(nodes),
            poses: self.poses.part(poses),
        }
    }
}

impl Split for Bodies<'_> {
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

impl Split for Forces<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let shares = share_start(packs, at) - share_start(packs, first);
        let low = Self {
            f: cut(&mut self.f, nodes),
            viscous: cut(&mut self.viscous, nodes),
            shares: cut(&mut self.shares, shares),
            torques: cut(&mut self.torques, at - first),
            energies: cut(&mut self.energies, at - first),
            breaks: cut(&mut self.breaks, at - first),
            losses: cut(&mut self.losses, at - first),
            workspaces: cut(&mut self.workspaces, low_runs),
        };
        (low, self)
    }
}

impl Split for Second<'_> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let Self { active, outside, .. } = self;
        let nodes = node_start(packs, at) - node_start(packs, first);
        let supports = active.first_support(at) - active.first_support(first);
        let (bodies, rest) = self.bodies.split(packs, first, at, low_runs);
        self.bodies = rest;
        let low = Self {
            active,
            outside,
            bodies,
            f: cut(&mut self.f, nodes),
            viscous: cut(&mut self.viscous, nodes),
            torques: cut(&mut self.torques, at - first),
            sums: cut(&mut self.sums, at - first),
            reactions: cut(&mut self.reactions, supports),
            drags: cut(&mut self.drags, outside.first(at) - outside.first(first)),
            workspaces: cut(&mut self.workspaces, low_runs),
        };
        (low, self)
    }
}
