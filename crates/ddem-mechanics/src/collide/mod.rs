//! Contact geometry of two blocks: distance and features, overlap of faces, closest points of two edges. Formulas of
//! two parallelepipeds; no mesh, no search.
//!
//! Nothing here allocates, and nothing depends on more than the numbers given: of answers that are
//! equally good the first in a fixed order is taken. Degenerate cells, faces and edges have answers
//! too: an area of zero, some point of the edge.

mod edges;
mod overlap;
mod separation;
#[cfg(test)]
mod tests;

pub use edges::nearest;
pub use overlap::{Vertex, bilinear, overlap, weights};
pub use separation::FaceId;
pub use separation::{ContactFeature, EdgeId, Parallelepiped, Separation, separation};
