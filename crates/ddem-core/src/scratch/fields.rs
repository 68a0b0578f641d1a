//! The fields that passes over the packs borrow, cut between tasks.

use fearless_simd::{Simd, f64x4};

use super::Spaces;
use crate::boundary::Outside;
use crate::breaks::{Losses, PackBreaks};
use crate::conditions::Active;
use crate::element::corotation::Frame;
use crate::lanes::{LANES, Lanes, splat};
use crate::pack::Packs;
use crate::parallel::{Split, node_start, rigid_start, share_start};
use crate::rigid::Pose;
use crate::sums::Sums;

/// Fields of the second pass of relaxation, of a run of packs.
pub(crate) struct Relaxing<'a> {
    pub(crate) frames: &'a mut [Frame],
    pub(crate) sums: &'a mut [Sums],
    pub(crate) workspaces: &'a mut [Spaces],
    pub(crate) u: &'a mut [Lanes],
    pub(crate) v: &'a mut [Lanes],
    pub(crate) poses: &'a mut [[Pose; LANES]],
}

impl Split for Relaxing<'_> {
    fn split(self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let (u, u_high) = self.u.split_at_mut(nodes);
        let (v, v_high) = self.v.split_at_mut(nodes);
        let (frames, frames_high) = self.frames.split_at_mut(at - first);
        let (sums, sums_high) = self.sums.split_at_mut(at - first);
        let (workspaces, workspaces_high) = self.workspaces.split_at_mut(low_runs);
        let rigid = rigid_start(packs, at) - rigid_start(packs, first);
        let (poses, poses_high) = self.poses.split_at_mut(rigid);
        (
            Self { frames, sums, workspaces, u, v, poses },
            Self {
                frames: frames_high,
                sums: sums_high,
                workspaces: workspaces_high,
                u: u_high,
                v: v_high,
                poses: poses_high,
            },
        )
    }
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

/// Fields of the balance of forces, of a run of packs.
pub(crate) struct Balancing<'a> {
    pub(super) active: &'a Active,
    pub(super) outside: &'a Outside,
    pub(super) f: &'a mut [Lanes],
    /// Empty where bodies never were viscous.
    pub(super) viscous: &'a mut [Lanes],
    pub(super) torques: &'a mut [[Lanes; 3]],
    pub(super) sums: &'a mut [Sums],
    pub(super) reactions: &'a mut [f64],
    pub(super) drags: &'a mut [[f64; 3]],
    pub(super) workspaces: &'a mut [Spaces],
}

/// Fields of the second pass, of a run of packs.
pub(crate) struct Moving<'a> {
    pub(crate) balancing: Balancing<'a>,
    pub(crate) frames: &'a mut [Frame],
    pub(crate) u: &'a mut [Lanes],
    pub(crate) v: &'a mut [Lanes],
    pub(crate) poses: &'a mut [[Pose; LANES]],
}

/// One pack of the two passes' borrowed fields.
pub(crate) struct Part<'a> {
    pub(crate) f: &'a mut [Lanes],
    /// Viscous forces of the bodies, against the motion; empty where they are not viscous.
    pub(crate) viscous: &'a mut [Lanes],
    pub(crate) torque: &'a mut [Lanes; 3],
    pub(crate) sums: &'a mut Sums,
    pub(crate) reactions: &'a mut [f64],
    /// Forces of the dashpots of boundaries.
    pub(crate) drags: &'a mut [[f64; 3]],
    /// Loads; of no meaning unless `loaded`.
    pub(crate) q: &'a mut Vec<Lanes>,
    pub(crate) loaded: bool,
    /// Room for a nodal field.
    pub(crate) room: &'a mut Vec<Lanes>,
}

impl Part<'_> {
    pub(crate) fn is_viscous(&self) -> bool {
        !self.viscous.is_empty()
    }

    /// Viscous force on one component of one node.
    #[inline(always)]
    pub(crate) fn viscous<S: Simd>(&self, simd: S, at: usize) -> f64x4<S> {
        self.viscous.get(at).map_or(splat(simd, 0.0), |lanes| lanes.load(simd))
    }
}

impl Balancing<'_> {
    /// The part of one pack; the fields begin at pack `first`. `viscous` says whether its bodies are.
    pub(crate) fn pack(
        &mut self,
        active: &Active,
        packs: &Packs,
        (first, index): (usize, usize),
        viscous: bool,
    ) -> Part<'_> {
        let node = node_start(packs, first);
        let nodes = node_start(packs, index) - node..node_start(packs, index + 1) - node;
        let support = active.first_support(first);
        let supports =
            active.first_support(index) - support..active.first_support(index + 1) - support;
        let drag = self.outside.first(first);
        let drags = self.outside.first(index) - drag..self.outside.first(index + 1) - drag;
        let spaces = &mut self.workspaces[0];
        Part {
            viscous: match self.viscous.get_mut(nodes.clone()) {
                Some(own) if viscous => own,
                _ => &mut [],
            },
            f: &mut self.f[nodes],
            torque: &mut self.torques[index - first],
            sums: &mut self.sums[index - first],
            reactions: &mut self.reactions[supports],
            drags: &mut self.drags[drags],
            q: &mut spaces.q,
            loaded: false,
            room: &mut spaces.room,
        }
    }
}

impl Split for Forces<'_> {
    fn split(self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let shares = share_start(packs, at) - share_start(packs, first);
        let (f, f_high) = self.f.split_at_mut(nodes);
        let (viscous, viscous_high) = self.viscous.split_at_mut(nodes.min(self.viscous.len()));
        let (shares, shares_high) = self.shares.split_at_mut(shares);
        let (torques, torques_high) = self.torques.split_at_mut(at - first);
        let (energies, energies_high) =
            self.energies.split_at_mut((at - first).min(self.energies.len()));
        let (breaks, breaks_high) = self.breaks.split_at_mut(at - first);
        let (losses, losses_high) = self.losses.split_at_mut(at - first);
        let (workspaces, workspaces_high) = self.workspaces.split_at_mut(low_runs);
        (
            Self { f, viscous, shares, torques, energies, breaks, losses, workspaces },
            Self {
                f: f_high,
                viscous: viscous_high,
                shares: shares_high,
                torques: torques_high,
                energies: energies_high,
                breaks: breaks_high,
                losses: losses_high,
                workspaces: workspaces_high,
            },
        )
    }
}

impl Split for Balancing<'_> {
    fn split(self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let (active, outside) = (self.active, self.outside);
        let nodes = node_start(packs, at) - node_start(packs, first);
        let supports = active.first_support(at) - active.first_support(first);
        let (f, f_high) = self.f.split_at_mut(nodes);
        let (viscous, viscous_high) = self.viscous.split_at_mut(nodes.min(self.viscous.len()));
        let (torques, torques_high) = self.torques.split_at_mut(at - first);
        let (sums, sums_high) = self.sums.split_at_mut(at - first);
        let (reactions, reactions_high) = self.reactions.split_at_mut(supports);
        let drags = outside.first(at) - outside.first(first);
        let (drags, drags_high) = self.drags.split_at_mut(drags);
        let (workspaces, workspaces_high) = self.workspaces.split_at_mut(low_runs);
        (
            Self { active, outside, f, viscous, torques, sums, reactions, drags, workspaces },
            Self {
                active,
                outside,
                f: f_high,
                viscous: viscous_high,
                torques: torques_high,
                sums: sums_high,
                reactions: reactions_high,
                drags: drags_high,
                workspaces: workspaces_high,
            },
        )
    }
}

impl Split for Moving<'_> {
    fn split(self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let (u, u_high) = self.u.split_at_mut(nodes);
        let (v, v_high) = self.v.split_at_mut(nodes);
        let (frames, frames_high) = self.frames.split_at_mut(at - first);
        let rigid = rigid_start(packs, at) - rigid_start(packs, first);
        let (poses, poses_high) = self.poses.split_at_mut(rigid);
        let (balancing, balancing_high) = self.balancing.split(packs, first, at, low_runs);
        (
            Self { balancing, frames, u, v, poses },
            Self {
                balancing: balancing_high,
                frames: frames_high,
                u: u_high,
                v: v_high,
                poses: poses_high,
            },
        )
    }
}
