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
//! other across gaps move as one point. Rigid bodies follow the functions at their centres.

mod block;
mod bodies;
mod grid;
mod points;
mod stiffness;

use std::collections::HashMap;

use fearless_simd::{Level, Simd, dispatch};
use fearless_simd_macros::simd;
use rayon::prelude::*;

use super::rigid::RigidMasses;
use super::springs::SpringSum;
use super::{InverseMassRows, NO_CLASS, Preconditioner};
use crate::model::Model;
use crate::step::{BodyStep, Poses};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::SpatialVector;
use ddem_mesh::Vec3;
use ddem_mesh::parallel::{each_pack, node_start};

use block::CornerVectors;
use bodies::{BodyTurns, SmoothBodies, SmoothBody, centres};
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
    /// Forces on the corners of the blocks of each pack `[N]`.
    forces: Vec<CornerVectors>,
    /// Forces on the points `[N]`, then their motion `[m]`.
    moved: Vec<Vec3>,
}

impl SmoothMotions {
    /// Motions of the blocks and rigid bodies of a model, given the springs around the bodies; `None`
    /// if it has so few that they save no steps. Held degrees of freedom do not take part.
    pub(super) fn new(
        model: &Model,
        held: &HashMap<u32, [bool; 3]>,
        rigid: &RigidMasses,
        springs: &[SpringSum],
    ) -> Option<Self> {
        let centres = centres(model, rigid);
        let points = SmoothPoints::new(model, &centres);
        if points.blocks_in_row() < FEWEST_BLOCKS {
            return None;
        }
        let mut grids = FunctionGrid::over(&points);
        let centres: Vec<Vec3> = centres.into_iter().map(|[centre, _]| centre).collect();
        let turns = BodyTurns::new(grids.first()?, &centres);
        let body = |(number, springs)| SmoothBody::new(springs, rigid.free_axes(number));
        let bodies = springs.iter().enumerate().map(body).collect();
        let bodies = SmoothBodies { turns: &turns, bodies };
        let (inverse, softest) = stiffness::invert(model, held, &points, &bodies, &mut grids);
        Some(Self {
            inverse,
            softest,
            has_turned: false,
            grids,
            turns,
            forces: vec![CornerVectors::default(); model.packs.packs.len()],
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
    fn turn(&mut self) {
        if !std::mem::replace(&mut self.has_turned, true) {
            self.scale(self.softest);
        }
    }

    /// Computes the motion of the points from the forces on the corners and the wrenches on rigid
    /// bodies. Returns the motions of the bodies.
    fn respond(&mut self, wrenches: &[SpatialVector]) -> Vec<SpatialVector> {
        let Self { points, turns, inverse, grids, forces, moved, .. } = self;
        let corners = points.n_corners();
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

    /// Adds the motion of a pack of deformable blocks with `n` divisions.
    #[simd]
    pub(super) fn add<S: Simd>(
        &self,
        simd: S,
        class: &InverseMassRows,
        pack: usize,
        n: usize,
        out: &mut [Lanes],
    ) {
        block::add_motion(simd, class, n, &self.corners_of(pack), out);
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
    /// Turns the masses with the blocks, whose frames are given.
    pub(crate) fn turn(&mut self, frames: &Vec<Frame>) {
        self.frames.clone_from(frames);
        self.smooth.iter_mut().for_each(SmoothMotions::turn);
    }

    /// Computes the motions of bodies and the smooth motions under the forces `f` on all nodes, which
    /// `accelerations` uses. `steps` has the wrenches on bodies of several blocks, or is empty.
    pub(crate) fn respond(
        &mut self,
        model: &Model,
        poses: &[Poses],
        f: &[Lanes],
        steps: &[BodyStep],
        level: Level,
    ) {
        let wrenches = self.rigid.respond(model, poses, f, steps);
        let Self { smooth: Some(smooth), classes, of_pack, rigid, .. } = self else { return };
        let packs = &model.packs;
        each_pack(packs, [], &mut smooth.forces, |index, [], forces| {
            if of_pack[index] == NO_CLASS {
                return;
            }
            let f = &f[node_start(packs, index)..node_start(packs, index + 1)];
            let class = &classes[of_pack[index] as usize];
            let n = packs.numbering_of(&packs.packs[index]).divisions;
            dispatch!(level, simd => block::corner_forces(simd, class, n, f, forces));
        });
        rigid.add(model, poses, &smooth.respond(&wrenches));
    }
}
