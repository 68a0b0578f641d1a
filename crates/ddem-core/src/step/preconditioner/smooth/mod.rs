//! Smooth motions of many blocks, which accelerate a relaxation (§7).
//!
//! The masses of clusters see the stiffness of neighbours only. A motion over many blocks is soft
//! against them and takes a number of steps that grows with the number of blocks. Functions on ever
//! coarser grids, from the corners of the blocks to the whole model, therefore add to the inverse
//! masses: `M⁻¹ = C⁻¹ + Σ P D⁻¹ Pᵀ`, with C the masses of the clusters, P the functions of a grid
//! at the nodes and D the stiffness against each function. This is the multilevel preconditioner
//! of Bramble, Pasciak and Xu.
//!
//! Within a deformable block each function is trilinear between the corners. Corners that face each
//! other across gaps move as one point, and so do tied ones. Bodies follow the functions at their
//! centres: rigid ones, and deformable cells that move as such.

mod block;
mod bodies;
mod grid;
mod points;
mod stiffness;

use std::collections::HashMap;

use fearless_simd::{Level, Simd, dispatch};
use fearless_simd_macros::simd;
use rayon::prelude::*;

use super::cell_motions::Rotated;
use super::{InverseMassRows, NodeMasses, Preconditioner};
use crate::model::Model;
use crate::step::{BodyStep, Poses};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::SpatialVector;
use ddem_mesh::Vec3;
use ddem_mesh::parallel::{each_pack, node_start};

use block::CornerVectors;
use bodies::BodyTurns;
pub(super) use bodies::{SmoothBody, smooth_bodies};
use grid::FunctionGrid;
use points::{NO_POINT, SmoothPoints};

/// Weight of the smooth motions beside the masses of clusters. With 1 the largest eigenvalue of
/// `M⁻¹K` doubles, which costs more steps than the smaller stiffness saves.
const WEIGHT: f64 = 0.5;
/// Number of blocks in the longest row of a model from which on smooth motions save steps.
const FEWEST_BLOCKS: f64 = 4.5;
/// Number of points or functions that one thread takes at a time.
const TOGETHER: usize = 2000;

/// Smooth motions of a model.
#[derive(Clone, Debug, Default)]
pub(super) struct SmoothMotions {
    points: SmoothPoints,
    turns: BodyTurns,
    /// Inverse stiffness of the motion of each corner of deformable blocks `[m/N]`.
    inverse: Vec<[f64; 3]>,
    /// Smallest ratio of stiffnesses along different directions: `G/M` of the moduli of a block.
    softest: f64,
    /// True if the stiffnesses allow for blocks that have rotated.
    has_turned: bool,
    /// Grids, from the finest to the coarsest.
    grids: Vec<FunctionGrid>,
    /// Forces on the corners of the blocks of each pack `[N]`; empty if no blocks take part.
    forces: Vec<CornerVectors>,
    /// Forces on the points `[N]`, then their motion `[m]`.
    moved: Vec<Vec3>,
}

impl SmoothMotions {
    /// Motions of the blocks of a model and of some bodies; with `parts`, of those of deformable cells
    /// too. `None` if these are so few that they save no steps. Held degrees of freedom do not take
    /// part.
    pub(super) fn new(
        model: &Model,
        held: &HashMap<u32, [bool; 3]>,
        bodies: &[SmoothBody<'_>],
        parts: bool,
    ) -> Option<Self> {
        let points = SmoothPoints::new(model, bodies, parts);
        if points.blocks_in_row() < FEWEST_BLOCKS {
            return None;
        }
        let mut grids = FunctionGrid::over(&points);
        let turns = BodyTurns::new(grids.first()?, bodies);
        let found = stiffness::invert(model, held, &points, &turns, bodies, &mut grids);
        let (mut inverse, softest) = found;
        if parts {
            // The corners of parts are nodes, which have masses of their own.
            inverse.fill([0.0; 3]);
        }
        let taking = if points.n_corners() > 0 { model.packs.packs.len() } else { 0 };
        Some(Self {
            inverse,
            softest,
            has_turned: false,
            grids,
            turns,
            forces: vec![CornerVectors::default(); taking],
            moved: vec![Vec3::zeros(); points.positions.len()],
            points,
        })
    }

    /// Multiplies the inverse stiffnesses by a factor.
    pub(super) fn scale(&mut self, factor: f64) {
        let grids = self.grids.iter_mut().flat_map(|grid| &mut grid.inverse);
        self.inverse.iter_mut().chain(grids).flatten().for_each(|inverse| *inverse *= factor);
    }

    /// Adapts the stiffnesses to blocks that have rotated far. The modulus G along a function
    /// becomes M at most.
    pub(super) fn turn(&mut self) {
        if !std::mem::replace(&mut self.has_turned, true) {
            self.scale(self.softest);
        }
    }

    /// Computes the motion of the points from the forces on the corners and the wrenches on
    /// bodies, of which the first ones take part. Returns the motions of these.
    fn respond(&mut self, wrenches: &[SpatialVector]) -> Vec<SpatialVector> {
        let Self { points, turns, inverse, grids, forces, moved, .. } = self;
        let corners = points.n_corners();
        let wrenches = &wrenches[..moved.len() - corners];
        moved.par_iter_mut().with_min_len(TOGETHER).enumerate().for_each(|(point, moved)| {
            *moved = match point.checked_sub(corners) {
                Some(body) => wrenches[body].linear,
                None => {
                    let on = points.corners_of(point).iter();
                    on.fold(Vec3::zeros(), |sum, corner| sum + corner.of(forces))
                }
            };
        });
        let mut finer: &[Vec3] = moved;
        for (level, grid) in grids.iter_mut().enumerate() {
            grid.collect(finer);
            if level == 0 && !wrenches.is_empty() {
                let add = |(function, force): (usize, &mut Vec3)| {
                    *force += turns.force(function, wrenches);
                };
                grid.moved.par_iter_mut().with_min_len(TOGETHER).enumerate().for_each(add);
            }
            finer = &grid.moved;
        }
        let mut coarser: Option<&FunctionGrid> = None;
        for grid in grids.iter_mut().rev() {
            grid.respond(coarser);
            coarser = Some(grid);
        }
        let respond = |(point, moved): (usize, &mut Vec3)| {
            let own = inverse
                .get(point)
                .map_or_else(Vec3::zeros, |&k| moved.component_mul(&Vec3::from(k)));
            *moved = own + coarser.map_or_else(Vec3::zeros, |grid| grid.at(point));
        };
        moved.par_iter_mut().with_min_len(TOGETHER).enumerate().for_each(respond);
        let finest = &grids[0].moved;
        let motion = |(body, &linear): (usize, &Vec3)| SpatialVector {
            linear,
            angular: turns.rotation(body, finest),
        };
        moved[corners..].par_iter().with_min_len(TOGETHER).enumerate().map(motion).collect()
    }

    /// Computes the forces on the corners of all blocks that take part from those on all nodes.
    fn collect(&mut self, model: &Model, masses: &NodeMasses, f: &[Lanes], level: Level) {
        let (packs, points) = (&model.packs, &self.points);
        if points.n_corners() == 0 {
            return;
        }
        each_pack(packs, [], &mut self.forces, |index, [], forces| {
            if !points.has(index) {
                return;
            }
            let f = &f[node_start(packs, index)..node_start(packs, index + 1)];
            let class = masses.of(index);
            let n = packs.numbering_of(&packs.packs[index]).divisions;
            let shares = model.assembly.shares(index);
            dispatch!(level, simd => block::corner_forces(simd, class, n, f, shares, forces));
        });
    }

    /// Adds the motion of the blocks of a pack.
    #[simd]
    pub(super) fn add<S: Simd>(
        &self,
        simd: S,
        model: &Model,
        class: &InverseMassRows,
        pack: usize,
        out: &mut [Lanes],
    ) {
        if self.points.has(pack) {
            let n = model.packs.numbering_of(&model.packs.packs[pack]).divisions;
            let is_tied = model.assembly.shares(pack).is_some();
            block::add_motion(simd, class, n, is_tied, &self.corners_of(pack), out);
        }
    }

    /// Motion of the corners of the blocks of a pack `[m]`.
    fn corners_of(&self, pack: usize) -> CornerVectors {
        let mut corners = CornerVectors::default();
        for (corner, at) in self.points.of_pack[pack].iter().enumerate() {
            for (lane, &point) in at.iter().enumerate().filter(|(_, point)| **point != NO_POINT) {
                let moved = &self.moved[point as usize];
                (0..3).for_each(|c| corners.0[corner][c].0[lane] = moved[c]);
            }
        }
        corners
    }
}

impl Preconditioner {
    /// Computes the motions of bodies and the smooth motions under the forces `f` on all nodes, which
    /// `accelerations` uses. `steps` has the wrenches on bodies of several blocks, or is empty.
    pub(crate) fn respond(
        &mut self,
        model: &Model,
        poses: &[Poses],
        f: &[Lanes],
        steps: &[BodyStep],
        rotated: Rotated<'_>,
        level: Level,
    ) {
        let Self { smooth, nodes, rigid, cells, .. } = self;
        let mut wrenches = rigid.respond(model, poses, f, steps);
        wrenches.extend(cells.respond(model, nodes, rotated, f, level));
        for smooth in smooth {
            smooth.collect(model, nodes, f, level);
            let more = smooth.respond(&wrenches);
            rigid.add(model, poses, &more[..rigid.len()]);
            cells.add(&more[rigid.len()..]);
        }
    }
}
