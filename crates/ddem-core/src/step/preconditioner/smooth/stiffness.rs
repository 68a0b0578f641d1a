//! Stiffness of a model against smooth motions.
//!
//! It only has to be about right, because all inverse masses are scaled together to the limit of
//! stability afterwards. A function w that moves along c has the energy
//! `½ Σ V [(M − G) (∂w/∂c)² + G |∇w|²]` with the volume V and the moduli of each block, and
//! `½ k w²` at each held node, which does not follow its surroundings.

use std::collections::HashMap;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::WEIGHT;
use super::block::CORNERS;
use super::bodies::{AtCentre, BodyTurns, SmoothBody, coarser};
use super::grid::FunctionGrid;
use super::points::{NO_POINT, SmoothPoints};
use crate::model::Model;
use crate::step::preconditioner::VTK;
use ddem_mechanics::element::hex8::{gauss_points, shape_derivatives};
use ddem_mesh::Vec3;
use ddem_mesh::assembly::NO_TABLE;

/// Fraction of the largest stiffness below which a motion is free.
const NOTHING: f64 = 1e-9;

/// Functions with their values at a point.
type FunctionValues = Vec<(u32, f64)>;

/// Block as the smooth motions see it.
struct SmoothBlock {
    /// Points at its corners.
    points: [u32; CORNERS],
    /// Moduli M of uniaxial strain and G of shear `[Pa]`.
    moduli: [f64; 2],
    shape: Shape,
    /// Held nodes: weights of the corners there, and the stiffness along each axis `[N/m]`.
    held: Vec<([f64; CORNERS], Vec3)>,
}

/// Shape of a block.
enum Shape {
    Parallelepiped {
        /// Volume `[m³]`.
        volume: f64,
        /// Gradients along its edges: the dual of the edge vectors, by rows `[1/m]`.
        dual: Matrix3<f64>,
    },
    /// Any other, by its corners `[m]`.
    Hexahedron([Vec3; CORNERS]),
}

impl SmoothBlock {
    fn new(model: &Model, block: usize, points: [u32; CORNERS]) -> Option<Self> {
        let geometry = &model.geometry;
        let (pack, lane) = model.packs.slot(block);
        let table = model.assembly.pack_tables[pack][0];
        let element = (table != NO_TABLE)
            .then(|| model.assembly.tables[table as usize].elements[lane])
            .flatten()?;
        let elastic = &model.assembly.elements[element as usize].elastic;
        let moduli = [elastic.p_modulus(), elastic.shear];
        let shape = if geometry.part(block).is_some() {
            Shape::Hexahedron(geometry.corners(block))
        } else {
            let edges = [0, 1, 2].map(|d| geometry.axes(block)[d] * geometry.edge(block, d));
            let edges = Matrix3::from_columns(&edges);
            Shape::Parallelepiped { volume: edges.determinant().abs(), dual: edges.try_inverse()? }
        };
        Some(Self { points, moduli, shape, held: Vec::new() })
    }

    /// Adds a held node at lattice steps `at` of a block of `n` divisions. `diagonal` is that of the
    /// stiffness there `[N/m]`.
    fn hold(&mut self, at: [usize; 3], n: usize, axes: [bool; 3], diagonal: Vec3) {
        let k = match self.shape {
            Shape::Parallelepiped { volume, .. } => {
                // The part of the elements around a node on a face that belong to this block.
                let sides = at.iter().filter(|&&at| at == 0 || at == n).count() as i32;
                let element = libm::cbrt(volume) / n as f64;
                Vec3::repeat(self.moduli[0] * element * 0.5_f64.powi(sides - 1))
            }
            Shape::Hexahedron(_) => diagonal,
        };
        let weights = std::array::from_fn(|corner| {
            let part = |d: usize| {
                let fraction = at[d] as f64 / n as f64;
                if corner >> d & 1 == 1 { fraction } else { 1.0 - fraction }
            };
            part(0) * part(1) * part(2)
        });
        self.held.push((weights, Vec3::from([0, 1, 2].map(|c| if axes[c] { k[c] } else { 0.0 }))));
    }

    /// Stiffness against a function for each component, from its values at the corners `[N/m]`.
    fn stiffness(&self, values: &[f64; CORNERS]) -> Vec3 {
        let [axial, shear] = self.moduli;
        let of_volume = |volume: f64, squares: Vec3| {
            let all = squares.sum();
            squares.map(|own| volume * ((axial - shear) * own + shear * all))
        };
        let mut stiffness = match &self.shape {
            Shape::Parallelepiped { volume, dual } => of_volume(*volume, squares(dual, values)),
            Shape::Hexahedron(corners) => {
                let points = gauss_points().map(|at| gradient(corners, values, at));
                points.iter().fold(Vec3::zeros(), |sum, (gradient, volume)| {
                    sum + of_volume(*volume, gradient.map(|x| x * x))
                })
            }
        };
        for (weights, k) in &self.held {
            let value: f64 = weights.iter().zip(values).map(|(weight, value)| weight * value).sum();
            stiffness += k * (value * value);
        }
        stiffness
    }

    /// Stiffness of this block against each function that does not vanish on it `[N/m]`; `of` gives
    /// the functions at each point.
    fn stiffnesses(&self, of: &[FunctionValues]) -> Vec<(u32, Vec3)> {
        let mut functions: Vec<(u32, [f64; CORNERS])> = Vec::new();
        for (corner, &point) in self.points.iter().enumerate() {
            for &(function, value) in &of[point as usize] {
                let known = functions.iter().position(|(number, _)| *number == function);
                let own = known.unwrap_or_else(|| {
                    functions.push((function, [0.0; CORNERS]));
                    functions.len() - 1
                });
                functions[own].1[corner] = value;
            }
        }
        let stiffness = |(function, values): &(u32, _)| (*function, self.stiffness(values));
        functions.iter().map(stiffness).collect()
    }
}

/// Mean squares of the derivatives of a function in a parallelepiped along x, y and z `[1/m²]`.
fn squares(dual: &Matrix3<f64>, values: &[f64; CORNERS]) -> Vec3 {
    let (mut mean, mut rest) = (Vec3::zeros(), Vec3::zeros());
    for d in 0..3 {
        // Differences along the four edges. The derivative is bilinear between them.
        let [next, last] = [1 << ((d + 1) % 3), 1 << ((d + 2) % 3)];
        let slope = [0, next, last, next | last].map(|k| values[k | 1 << d] - values[k]);
        let [a, b, c, e] = slope;
        mean[d] = 0.25 * (a + b + c + e);
        let squares: f64 = slope.iter().map(|x| x * x).sum();
        let products = (a + e) * (b + c) / 9.0 + (a * e + b * c) / 18.0;
        rest[d] = squares / 9.0 + products - mean[d] * mean[d];
    }
    // The mean gradient, and the rest along each edge alone.
    let mut squares = (dual.transpose() * mean).map(|x| x * x);
    for (rest, row) in rest.iter().zip(dual.row_iter()) {
        squares += row.transpose().map(|x| x * x * rest);
    }
    squares
}

/// Gradient of a function in a hexahedron at a reference point `[1/m]`, and the volume there `[m³]`.
fn gradient(corners: &[Vec3; CORNERS], values: &[f64; CORNERS], at: [f64; 3]) -> (Vec3, f64) {
    let (mut jacobian, mut along) = (Matrix3::zeros(), Vec3::zeros());
    for (&corner, derivative) in VTK.iter().zip(shape_derivatives(at)) {
        let derivative = Vec3::from(derivative);
        jacobian += derivative * corners[corner].transpose();
        along += derivative * values[corner];
    }
    let inverse = jacobian.try_inverse().unwrap_or_default();
    (inverse * along, jacobian.determinant())
}

/// Blocks that take part in smooth motions.
fn smooth_blocks(
    model: &Model,
    held: &HashMap<u32, [bool; 3]>,
    points: &SmoothPoints,
) -> Vec<SmoothBlock> {
    let geometry = &model.geometry;
    let mut of_block = vec![None; geometry.blocks.len()];
    let mut blocks = Vec::new();
    for (pack, at) in model.packs.packs.iter().zip(&points.of_pack) {
        for lane in 0..pack.filled {
            let own = at.map(|corner| corner[lane]);
            let block = pack.blocks[lane] as usize;
            if own[0] == NO_POINT {
                continue;
            }
            if let Some(own) = SmoothBlock::new(model, block, own) {
                of_block[block] = Some(blocks.len());
                blocks.push(own);
            }
        }
    }
    // In the order of the nodes, so that sums do not depend on that of the map.
    let mut held: Vec<(u32, [bool; 3])> = held.iter().map(|(&node, &axes)| (node, axes)).collect();
    held.sort_unstable();
    for (node, axes) in held {
        let (block, at) = geometry.locate(node as usize);
        if let Some(own) = of_block[block] {
            let slot = model.node_slot(node as usize);
            let inertia = &model.assembly.inertia[model.assembly.pack_inertia[slot.pack] as usize];
            let local = slot.local(&model.packs);
            let k = [0, 1, 2].map(|c| inertia.diagonal[3 * local + c].0[slot.lane()]);
            blocks[own].hold(at, geometry.topology(block).divisions(), axes, k.into());
        }
    }
    blocks
}

/// Inverse stiffnesses `[m/N]` from the stiffnesses of blocks and bodies against some functions.
fn inverses(own: impl Iterator<Item = (u32, Vec3)>, functions: usize) -> Vec<[f64; 3]> {
    let mut sums = vec![Vec3::zeros(); functions];
    for (function, stiffness) in own {
        sums[function as usize] += stiffness;
    }
    // A motion that nothing holds has a stiffness of rounding only, and takes no part.
    let least = NOTHING * sums.iter().map(|sum| sum.max()).fold(0.0, f64::max);
    let invert = |k: f64| if k > least { WEIGHT / k } else { 0.0 };
    sums.iter().map(|sum| sum.map(invert).into()).collect()
}

/// Sets the inverse stiffnesses of the grids; returns those of the corners `[m/N]`, and the smallest
/// ratio of the stiffnesses of a block or body along different directions.
pub(super) fn invert(
    model: &Model,
    held: &HashMap<u32, [bool; 3]>,
    points: &SmoothPoints,
    turns: &BodyTurns,
    bodies: &[SmoothBody<'_>],
    grids: &mut [FunctionGrid],
) -> (Vec<[f64; 3]>, f64) {
    let blocks = smooth_blocks(model, held, points);
    let of_blocks = |of: &[FunctionValues]| -> Vec<(u32, Vec3)> {
        blocks.par_iter().flat_map_iter(|block| block.stiffnesses(of)).collect()
    };
    let all = points.positions.len();
    let mut of: Vec<FunctionValues> = (0..all as u32).map(|point| vec![(point, 1.0)]).collect();
    let of_corners = inverses(of_blocks(&of).into_iter(), points.n_corners());
    let mut at_centres: Vec<Vec<AtCentre>> = turns.functions();
    for (level, grid) in grids.iter_mut().enumerate() {
        of = of.par_iter().map(|finer| grid.coarser(finer)).collect();
        if level > 0 {
            at_centres = at_centres.par_iter().map(|finer| coarser(grid, finer)).collect();
        }
        let of_body = |(body, at): (&SmoothBody<'_>, &Vec<AtCentre>)| -> Vec<(u32, Vec3)> {
            at.iter().map(|own| (own.function, body.stiffness(own))).collect()
        };
        let own: Vec<_> = bodies.par_iter().zip(&at_centres).flat_map_iter(of_body).collect();
        grid.inverse = inverses(of_blocks(&of).into_iter().chain(own), grid.moved.len());
    }
    let ratio = |block: &SmoothBlock| block.moduli[1] / block.moduli[0];
    let of_blocks = blocks.iter().filter(|block| block.moduli[0] > 0.0).map(ratio);
    let softest = of_blocks.chain(bodies.iter().filter_map(SmoothBody::softest));
    (of_corners, softest.fold(1.0, f64::min))
}
