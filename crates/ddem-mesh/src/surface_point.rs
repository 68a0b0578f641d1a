//! Points of the faces of blocks.

use serde::{Deserialize, Serialize};

use super::Topology;
use ddem_mechanics::collide::{FaceId, weights};

/// Point of a face, fixed to its block: an element of the face and bilinear coordinates in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// Number of the block after the first one of its cell; 0 unless it is a part of a cell.
    pub part: u16,
    /// Number of the face.
    pub face: u8,
    /// Element along the next two directions, cyclically.
    pub element: [u16; 2],
    /// Coordinates in the element, each from 0 to 1.
    pub on: [f32; 2],
}

impl SurfacePoint {
    /// Point of an element of a face, by its coordinates there.
    pub fn new(face: FaceId, element: [usize; 2], on: [f64; 2]) -> Self {
        let element = element.map(|i| i as u16);
        Self { part: 0, face: face.number(), element, on: on.map(|x| x as f32) }
    }

    /// Block of the point, given the first one of its cell.
    #[inline(always)]
    pub fn block(&self, first: u32) -> usize {
        first as usize + usize::from(self.part)
    }

    /// Face of the point.
    #[inline(always)]
    pub fn face(&self) -> FaceId {
        FaceId::from_number(self.face)
    }

    /// Nodes of the element that contains the point, numbered as in the block, and their weights.
    #[inline(always)]
    pub fn weights(&self, topology: Topology) -> [(usize, f64); 4] {
        let nodes = topology.quad(self.face(), self.element.map(usize::from));
        let weights = weights(self.on.map(f64::from));
        std::array::from_fn(|k| (nodes[k], weights[k]))
    }
}
