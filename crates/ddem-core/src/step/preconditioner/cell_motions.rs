//! Rigid motions of deformable cells in the masses of a relaxation.
//!
//! The masses of nodes see the elements and joints around each node. On soft joints whole cells move,
//! and their motions are soft against these masses. Each cell therefore adds `R S⁻¹ Rᵀ` to the
//! inverse masses, with its six rigid motions R at its present place and the stiffness S of its joints,
//! contacts and held nodes against them.

use std::collections::BTreeSet;

use fearless_simd::{Level, Simd, dispatch};
use fearless_simd_macros::simd;
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::cell_masses::{CellMass, CellNode};
use super::cells::contact_bounds;
use super::smooth::SmoothBody;
use super::springs::patches_of;
use super::{InverseMassRows, MassContext, NodeMasses};
use crate::model::Model;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{LANES, Lanes, add, cross, load, load_at, scale, store_at, zero};
use ddem_mechanics::rigid::{SpatialLanes, SpatialVector};
use ddem_mesh::pack::Packs;
use ddem_mesh::parallel::{each_pack, node_start};
use ddem_mesh::{BodyPart, CellBodies, Vec3};

/// Number of cells that one thread takes at a time.
const TOGETHER: usize = 64;

/// Deformable cells of a model as rigid bodies.
#[derive(Clone, Debug, Default)]
pub(super) struct CellMotions {
    bodies: CellBodies,
    cells: Vec<CellMass>,
    /// Vectors from the centre of its cell to each node at rest `[m]`; equal for tied nodes.
    arms: Vec<Lanes>,
    /// Forces and displacements of the parts.
    of_parts: Vec<PartSums>,
    /// Motions of the cells about their centres.
    motions: Vec<CellMotion>,
}

/// Sums over the nodes of the parts of a pack, tied nodes by their shares.
#[derive(Clone, Copy, Debug, Default)]
struct PartSums {
    /// Forces and their torques about the centres of the cells at rest.
    wrench: SpatialLanes,
    /// Displacements `[m]`.
    moved: [Lanes; 3],
}

/// Motion of a cell.
#[derive(Clone, Copy, Debug, Default)]
struct CellMotion {
    /// Mean displacement of its nodes before the motion `[m]`.
    before: Vec3,
    motion: SpatialVector,
}

/// Present displacements of all nodes and frames of all packs; `None` if rotations are ignored.
pub(crate) type Rotated<'a> = Option<(&'a [Lanes], &'a [Frame])>;

impl CellMotions {
    /// Motions of the deformable cells of a model.
    pub(super) fn new(around: MassContext<'_>) -> Self {
        let model = around.model;
        let bodies = CellBodies::deformable(&model.geometry, &model.packs, &model.properties);
        if bodies.is_empty() {
            return Self::default();
        }
        let mut motions = Self {
            of_parts: vec![PartSums::default(); model.packs.packs.len()],
            arms: vec![Lanes::ZERO; 3 * model.packs.nodes],
            motions: vec![CellMotion::default(); bodies.len()],
            bodies,
            cells: Vec::new(),
        };
        let all: Vec<usize> = (0..motions.len()).collect();
        for (nodes, mass) in motions.masses(around, &all) {
            for CellNode { at, lane, x, .. } in nodes {
                let arm = x - mass.centre;
                (0..3).for_each(|c| motions.arms[at + c].0[lane] = arm[c]);
            }
            motions.cells.push(mass);
        }
        motions
    }

    /// Nodes and masses of some cells.
    fn masses(&self, around: MassContext<'_>, wanted: &[usize]) -> Vec<(Vec<CellNode>, CellMass)> {
        let patches = patches_of(around.model, &self.bodies);
        let contacts = contact_bounds(around.model, around.contact_masses);
        let mass = |&cell: &usize| {
            let nodes = CellNode::all(around.model, self.bodies.parts(cell));
            let mass = CellMass::new(around, &nodes, &patches[cell], &contacts);
            (nodes, mass)
        };
        wanted.par_iter().map(mass).collect()
    }

    /// Renews the masses of some cells and multiplies them by a factor.
    pub(super) fn renew(&mut self, around: MassContext<'_>, wanted: &[usize], factor: f64) {
        if wanted.is_empty() {
            return;
        }
        for (&cell, (_, mut mass)) in wanted.iter().zip(self.masses(around, wanted)) {
            mass.inverse *= factor;
            self.cells[cell] = mass;
        }
    }

    /// Cell of a lane of a pack; `None` for another block.
    pub(super) fn body(&self, pack: usize, lane: usize) -> Option<usize> {
        self.bodies.body(pack, lane)
    }

    /// Cells that have one of some blocks, and the packs of all their parts; both are sorted.
    pub(super) fn with_parts(&self, wanted: impl Fn(usize) -> bool) -> (Vec<usize>, Vec<usize>) {
        let has_one = |&cell: &usize| self.bodies.parts(cell).iter().any(|part| wanted(part.block));
        let cells: Vec<usize> = (0..self.len()).filter(has_one).collect();
        let parts = cells.iter().flat_map(|&cell| self.bodies.parts(cell));
        let packs: BTreeSet<usize> = parts.map(|part| part.pack).collect();
        (cells, packs.into_iter().collect())
    }

    /// Cells that have parts in some packs.
    pub(super) fn bodies_in(&self, packs: &[usize]) -> BTreeSet<usize> {
        let lanes = |&pack: &usize| (0..LANES).filter_map(move |lane| self.body(pack, lane));
        packs.iter().flat_map(lanes).collect()
    }

    /// Number of cells.
    pub(super) fn len(&self) -> usize {
        self.bodies.len()
    }

    /// True without deformable cells.
    pub(super) fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Cells as smooth motions see them.
    pub(super) fn smooth_bodies(&self) -> impl Iterator<Item = SmoothBody<'_>> {
        let held = Vec3::zeros();
        self.cells.iter().map(move |CellMass { centre, extent, size, springs, .. }| SmoothBody {
            centre: *centre,
            extent: *extent,
            size: *size,
            springs,
            held,
        })
    }

    pub(super) fn scale(&mut self, factor: f64) {
        self.cells.iter_mut().for_each(|cell| cell.inverse *= factor);
    }

    /// Computes the motions of the cells under the forces `f` on all nodes. Returns the wrenches on the
    /// cells about their present centres.
    pub(super) fn respond(
        &mut self,
        model: &Model,
        masses: &NodeMasses,
        rotated: Rotated<'_>,
        f: &[Lanes],
        level: Level,
    ) -> Vec<SpatialVector> {
        if self.cells.is_empty() {
            return Vec::new();
        }
        let Self { bodies, of_parts, arms, .. } = &mut *self;
        let packs = &model.packs;
        each_pack(packs, [], of_parts, |index, [], sums| {
            if !bodies.has(index) {
                return;
            }
            let class = masses.of(index);
            let nodes = node_start(packs, index)..node_start(packs, index + 1);
            let shares = model.assembly.shares(index);
            let u = rotated.map(|(u, _)| &u[nodes.clone()]);
            let (f, arms) = (&f[nodes.clone()], &arms[nodes]);
            *sums = dispatch!(level, simd => sum_of_parts(simd, class, [f, arms], u, shares));
        });
        let this = &*self;
        let of_cell = |cell: usize| {
            let (mut wrench, mut before) = (SpatialVector::default(), Vec3::zeros());
            for &BodyPart { pack, lane, .. } in this.bodies.parts(cell) {
                let sums = &this.of_parts[pack];
                let own = sums.wrench.of(lane);
                wrench.linear += own.linear;
                wrench.angular += own.angular;
                before += Vec3::from(sums.moved.map(|c| c.0[lane]));
            }
            let mass = &this.cells[cell];
            before /= mass.nodes;
            wrench.angular -= before.cross(&wrench.linear);
            let turning = rotated.filter(|_| !mass.is_held());
            let turn = turning.map_or_else(Matrix3::identity, |(_, frames)| {
                let BodyPart { pack, lane, .. } = this.bodies.parts(cell)[0];
                Matrix3::from_fn(|row, c| frames[pack].rotation[row][c].0[lane])
            });
            (wrench, CellMotion { before, motion: mass.motion(&turn, &wrench) })
        };
        let cells = (0..self.len()).into_par_iter().with_min_len(TOGETHER);
        let (wrenches, motions) = cells.map(of_cell).unzip();
        self.motions = motions;
        wrenches
    }

    /// Adds motions to those of the cells.
    pub(super) fn add(&mut self, more: &[SpatialVector]) {
        for (own, more) in self.motions.iter_mut().zip(more) {
            own.motion.linear += more.linear;
            own.motion.angular += more.angular;
        }
    }

    /// Adds the motions of the cells to those of the free nodes of a pack, whose displacements are `u`.
    #[simd]
    pub(super) fn add_to_nodes<S: Simd>(
        &self,
        simd: S,
        packs: &Packs,
        class: &InverseMassRows,
        index: usize,
        u: Option<&[Lanes]>,
        out: &mut [Lanes],
    ) {
        if !self.bodies.has(index) {
            return;
        }
        let start = node_start(packs, index);
        let [mut linear, mut angular] = [[Lanes::ZERO; 3]; 2];
        for lane in 0..LANES {
            let Some(cell) = self.bodies.body(index, lane) else { continue };
            let CellMotion { before, motion } = &self.motions[cell];
            let at_rest = motion.linear - motion.angular.cross(before);
            for c in 0..3 {
                linear[c].0[lane] = at_rest[c];
                angular[c].0[lane] = motion.angular[c];
            }
        }
        let (linear, angular) = (load(simd, &linear), load(simd, &angular));
        for node in 0..out.len() / 3 {
            let mut arm = load_at(simd, &self.arms, start + 3 * node);
            if let Some(u) = u {
                arm = add(arm, load_at(simd, u, 3 * node));
            }
            let moved = class.free(simd, node, add(linear, cross(angular, arm)));
            store_at(out, 3 * node, add(load_at(simd, out, 3 * node), moved));
        }
    }
}

/// Sums of forces and displacements over the nodes of the parts of a pack.
#[simd]
fn sum_of_parts<S: Simd>(
    simd: S,
    class: &InverseMassRows,
    [f, arms]: [&[Lanes]; 2],
    u: Option<&[Lanes]>,
    shares: Option<&[Lanes]>,
) -> PartSums {
    let [mut force, mut torque, mut moved] = [zero(simd); 3];
    for node in 0..f.len() / 3 {
        let mut on = class.free(simd, node, load_at(simd, f, 3 * node));
        let share = shares.map(|shares| shares[node].load(simd));
        if let Some(share) = share {
            on = scale(on, share);
        }
        let mut arm = load_at(simd, arms, 3 * node);
        if let Some(u) = u {
            let u = load_at(simd, u, 3 * node);
            arm = add(arm, u);
            moved = add(moved, share.map_or(u, |share| scale(u, share)));
        }
        force = add(force, on);
        torque = add(torque, cross(arm, on));
    }
    PartSums {
        wrench: SpatialLanes { linear: force.map(Lanes::from), angular: torque.map(Lanes::from) },
        moved: moved.map(Lanes::from),
    }
}
