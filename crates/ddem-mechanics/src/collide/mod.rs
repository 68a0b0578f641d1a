//! Where two blocks touch: how far apart they are and what meets, the part of a face that lies over
//! another, the closest points of two edges. Formulas of two cells; no mesh, no search.
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
pub use separation::FaceOf;
pub use separation::{Cell, EdgeOf, Meeting, Separation, separation};
