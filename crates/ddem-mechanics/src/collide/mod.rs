//! Contact geometry of two blocks: distance and features, overlap of faces, closest points of two
//! edges. These are formulas of two parallelepipeds, without mesh or search.
//!
//! Nothing here allocates. Results depend on the given numbers alone: of equally good answers the
//! first in a fixed order is taken. Degenerate cells, faces and edges have results too: an area of
//! zero, some point of the edge.

mod edges;
mod overlap;
mod separation;
#[cfg(test)]
mod tests;

pub use edges::nearest;
pub use overlap::{Vertex, bilinear, overlap, weights};
pub use separation::FaceId;
pub use separation::{ContactFeature, EdgeId, Parallelepiped, Separation, separation};
