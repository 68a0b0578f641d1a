//! Points of the faces of blocks.

use serde::{Deserialize, Serialize};

use super::Topology;
use ddem_mechanics::collide::{FaceId, weights};

/// Point of a face, fixed to its block: an element of the face and bilinear coordinates in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// Element along the next two directions, cyclically.
    pub element: [u16; 2],
    /// Coordinates in the element, each from 0 to 1.
    pub on: [f32; 2],
}

impl SurfacePoint {
    /// Point of an element of a face, by its coordinates there.
    pub fn new(element: [usize; 2], on: [f64; 2]) -> Self {
        Self { element: element.map(|i| i as u16), on: on.map(|x| x as f32) }
    }

    /// Nodes of the element that contains the point, numbered as in the block, and their weights.
    #[inline(always)]
    pub fn weights(&self, topology: Topology, face: FaceId) -> [(usize, f64); 4] {
        let nodes = topology.quad(face, self.element.map(usize::from));
        let weights = weights(self.on.map(f64::from));
        std::array::from_fn(|k| (nodes[k], weights[k]))
    }
}
