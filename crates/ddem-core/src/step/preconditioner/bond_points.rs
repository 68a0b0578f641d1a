//! Joints of deformable cells as springs between points, in the search for the largest eigenvalue of
//! a relaxation.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::springs::{joins_cells, per_area};
use crate::model::Model;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::Vec3;
use ddem_mesh::parallel::{each_pack, node_start};

/// Number of points that one thread takes at a time.
const TOGETHER: usize = 256;

/// Joints between cells of which one at least is deformable.
#[derive(Debug, Default)]
pub(crate) struct BondPoints {
    points: Vec<BondPoint>,
    /// Stiffness of each joint per unit of area `[Pa/m]`.
    joints: Vec<Matrix3<f64>>,
    /// Forces on the nodes, those of tied ones on their copies.
    f: Vec<Lanes>,
    /// Sums over tied nodes.
    tied: Vec<[f64; 3]>,
}

/// Point of a joint.
#[derive(Clone, Copy, Debug)]
struct BondPoint {
    joint: u32,
    area: f64,
    /// Nodes of the two sides: index of the x component, times [`LANES`], plus the lane.
    nodes: [[u32; 4]; 2],
    weights: [[f64; 4]; 2],
}

impl BondPoint {
    /// Displacement of the second side against the first.
    fn opening(&self, x: &[Lanes]) -> Vec3 {
        let [first, second] = [0, 1].map(|side| {
            let nodes = self.nodes[side].iter().zip(self.weights[side]);
            nodes.fold(Vec3::zeros(), |sum, (&node, weight)| {
                let (at, lane) = (node as usize / LANES, node as usize % LANES);
                sum + Vec3::from([0, 1, 2].map(|c| x[at + c].0[lane])) * weight
            })
        });
        second - first
    }
}

impl BondPoints {
    /// Points of a model.
    pub(crate) fn new(model: &Model) -> Self {
        let geometry = &model.geometry;
        let Some(contact) = model.contact.as_ref().filter(|_| model.has_cells()) else {
            return Self::default();
        };
        let mut all = Self::default();
        for joint in &model.bonded_patches {
            let blocks = joint.patch.blocks.map(|block| block as usize);
            let removed = blocks.iter().any(|&block| geometry.is_removed(block));
            let rigid = blocks.iter().all(|&block| geometry.is_rigid(block));
            if removed || rigid || !joins_cells(model, blocks) {
                continue;
            }
            let number = all.joints.len() as u32;
            all.joints.push(per_area(&joint.patch));
            let first = blocks.map(|block| {
                let slot = model.node_slot(geometry.blocks[block].first_node as usize);
                slot.at * LANES as u32 + u32::from(slot.lane)
            });
            for point in &joint.patch.points {
                let sides: [[(usize, f64); 4]; 2] = std::array::from_fn(|side| {
                    contact.blocks[blocks[side]].weights(&point.points[side])
                });
                all.points.push(BondPoint {
                    joint: number,
                    area: point.pair.area,
                    nodes: std::array::from_fn(|side| {
                        sides[side].map(|(node, _)| first[side] + (3 * LANES * node) as u32)
                    }),
                    weights: sides.map(|side| side.map(|(_, weight)| weight)),
                });
            }
        }
        if !all.points.is_empty() {
            all.f = vec![Lanes::ZERO; 3 * model.packs.nodes];
        }
        all
    }

    /// Adds the forces of the joints to `f` at the displacements `x`.
    pub(crate) fn add_forces(&mut self, model: &Model, x: &[Lanes], f: &mut [Lanes]) {
        if self.points.is_empty() {
            return;
        }
        let Self { points, joints, f: own, tied } = self;
        let force =
            |point: &BondPoint| joints[point.joint as usize] * point.opening(x) * point.area;
        let forces: Vec<Vec3> = points.par_iter().with_min_len(TOGETHER).map(force).collect();
        own.fill(Lanes::ZERO);
        for (point, force) in points.iter().zip(forces) {
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                for (&node, weight) in point.nodes[side].iter().zip(point.weights[side]) {
                    let (at, lane) = (node as usize / LANES, node as usize % LANES);
                    (0..3).for_each(|c| own[at + c].0[lane] += sign * weight * force[c]);
                }
            }
        }
        model.ties.sum(own, tied);
        let packs = &model.packs;
        let mut none = vec![(); packs.packs.len()];
        each_pack(packs, [own, f], &mut none, |pack, [own, f], ()| {
            model.ties.share(pack, tied, node_start(packs, pack), own);
            for (f, own) in f.iter_mut().zip(own) {
                (0..LANES).for_each(|lane| f.0[lane] += own.0[lane]);
            }
        });
    }
}
