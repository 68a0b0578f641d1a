//! Contact geometry of two blocks: distance and features, overlap of faces, closest points of two
//! edges. These are formulas of two parallelepipeds or convex polyhedra, without mesh or search.
//!
//! Results depend on the given numbers alone: of equally good answers the first in a fixed order is
//! taken. Degenerate cells, faces and edges have results too: an area of zero, some point of the
//! edge. Nothing here allocates but the separation of polyhedra and the points of joints at rest.

mod edges;
mod exact_areas;
mod hull;
mod overlap;
mod separation;
#[cfg(test)]
mod tests;

pub use edges::nearest;
pub use exact_areas::{OverlapPoint, exact_areas};
pub use hull::{ConvexHull, HullEdge, HullFeature, HullSeparation, HullTopology, hull_separation};
pub use overlap::{Vertex, bilinear, overlap, weights};
pub use separation::FaceId;
pub use separation::{ContactFeature, EdgeId, Parallelepiped, Separation, separation};
