//! Fictitious masses of deformable cells that move as rigid bodies.

use nalgebra::{Matrix3, Matrix6};

use super::MassContext;
use super::rigid::pseudo_inverse;
use super::springs::{BodyPatch, SpringSum};
use crate::model::Model;
use ddem_mechanics::rigid::SpatialVector;
use ddem_mesh::parallel::node_start;
use ddem_mesh::{BodyPart, Vec3, bounds_of};

/// Node of a part of a cell.
pub(super) struct CellNode {
    /// Number of the node.
    pub(super) number: usize,
    /// Index of its x component in a nodal field.
    pub(super) at: usize,
    pub(super) lane: usize,
    /// Position at rest `[m]`; equal for tied nodes, to the bit.
    pub(super) x: Vec3,
    /// Part in the node that it is tied to.
    share: f64,
    /// Diagonal of the stiffness of the part `[N/m]`.
    diagonal: Vec3,
}

impl CellNode {
    /// Nodes of the parts of a cell, those tied to others several times.
    pub(super) fn all(model: &Model, parts: &[BodyPart]) -> Vec<Self> {
        let geometry = &model.geometry;
        let mut nodes = Vec::new();
        for &BodyPart { block, pack, lane } in parts {
            let inertia = &model.assembly.inertia[model.assembly.pack_inertia[pack] as usize];
            let shares = model.assembly.shares(pack);
            let (start, first) =
                (node_start(&model.packs, pack), geometry.blocks[block].first_node);
            for local in 0..geometry.topology(block).nodes() {
                let number = first as usize + local;
                let tied = geometry.ties.with(number as u32).first();
                let (of, at) = geometry.locate(tied.map_or(number, |&node| node as usize));
                let diagonal = [0, 1, 2].map(|c| inertia.diagonal[3 * local + c].0[lane]);
                nodes.push(Self {
                    number,
                    at: start + 3 * local,
                    lane,
                    x: geometry.position(of, at),
                    share: shares.map_or(1.0, |shares| shares[local].0[lane]),
                    diagonal: diagonal.into(),
                });
            }
        }
        nodes
    }
}

/// Fictitious mass of a deformable cell that moves as a rigid body.
#[derive(Clone, Debug)]
pub(super) struct CellMass {
    /// Centre of its nodes at rest `[m]`.
    pub(super) centre: Vec3,
    /// Extent along x, y and z `[m]`.
    pub(super) extent: Vec3,
    /// Number of its nodes; tied ones count once.
    pub(super) nodes: f64,
    /// Size, by which rotations are multiplied `[m]`.
    pub(super) size: f64,
    /// Inverse stiffness against its six motions.
    pub(super) inverse: Matrix6<f64>,
    /// Springs around it.
    pub(super) springs: SpringSum,
}

impl CellMass {
    /// Mass of a cell with these nodes and joints. `contacts` are upper bounds of the stiffness of
    /// contacts at each node `[N/m]`, or empty.
    pub(super) fn new(
        MassContext { model, held, .. }: MassContext<'_>,
        nodes: &[CellNode],
        patches: &[BodyPatch],
        contacts: &[f64],
    ) -> Self {
        let count: f64 = nodes.iter().map(|node| node.share).sum();
        let sum = nodes.iter().fold(Vec3::zeros(), |sum, node| sum + node.x * node.share);
        let centre = sum / count;
        let square = |node: &CellNode| node.share * (node.x - centre).norm_squared();
        let size = (nodes.iter().map(square).sum::<f64>() / count).sqrt();
        let mut springs = SpringSum::default();
        let blocks = model.contact.as_ref().map_or(&[][..], |contact| &contact.blocks);
        for &patch in patches {
            springs.add_patch(model, patch, blocks, &centre, size);
        }
        for node in nodes {
            let arm = node.x - centre;
            if let Some(&k) = contacts.get(node.number).filter(|k| **k > 0.0) {
                springs.add(&Matrix3::from_diagonal_element(k), &arm, size);
            }
            if let Some(axes) = held.get(&(node.number as u32)) {
                let held = Vec3::from(axes.map(|held| f64::from(u8::from(held))));
                springs.hold(node.diagonal.component_mul(&held), &arm, size);
            }
        }
        let inverse = pseudo_inverse(springs.stiffness, springs.stiffness.trace());
        let points: Vec<Vec3> = nodes.iter().map(|node| node.x).collect();
        let [low, high] = bounds_of(&points);
        Self { centre, extent: high - low, nodes: count, size, inverse, springs }
    }

    /// True if supports hold some of its nodes. These do not turn with the cell, and neither does its
    /// mass.
    pub(super) fn is_held(&self) -> bool {
        self.springs.held != Matrix6::zeros()
    }

    /// Motion under a wrench, with the rotation of the cell.
    pub(super) fn motion(&self, turn: &Matrix3<f64>, wrench: &SpatialVector) -> SpatialVector {
        let own = SpatialVector {
            linear: turn.tr_mul(&wrench.linear),
            angular: turn.tr_mul(&wrench.angular) / self.size,
        };
        let moved = SpatialVector::from_vector(&(self.inverse * own.to_vector()));
        SpatialVector { linear: turn * moved.linear, angular: turn * moved.angular / self.size }
    }
}
