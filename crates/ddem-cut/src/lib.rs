//! Convex cells: regions of rock cut by joint sets, faults and tunnels.
//!
//! A [`CellComplex`] begins with the convex parts of regions ([`Polyhedron`], [`prism`]) and cuts
//! them by planes ([`CutPlane`], [`JointSet`], [`Tunnel`], [`Fracture`], [`FractureNetwork`]),
//! by a [`Ground`], or between seeds ([`CellComplex::cut_voronoi`]). Cells share points. The side of a point
//! to a plane is decided once, and an edge is divided once, so that neighbours always agree. Faces
//! that they have in common match, unless a cut ended there ([`CommonFace`]). Only the cells whose boxes a plane meets are visited.
//!
//! ```
//! use ddem_cut::{CellComplex, CutPlane, Polyhedron};
//! use nalgebra::Vector3;
//!
//! let cube = Polyhedron::brick(Vector3::zeros(), Vector3::repeat(1.0))?;
//! let mut rock = CellComplex::new(&[vec![cube]]);
//! let diagonal = CutPlane::new(Vector3::new(1.0, 1.0, 0.0), Vector3::x(), 0, false);
//! rock.cut(&diagonal.into_iter().collect::<Vec<_>>(), vec![true]);
//! assert_eq!(rock.cells().len(), 2);
//! assert_eq!(rock.common_faces().len(), 1);
//! assert!((rock.properties(0).volume - 0.5).abs() < 1e-15);
//! # Ok::<(), ddem_cut::ShapeError>(())
//! ```

mod buckets;
mod cell;
mod clipped;
mod columns;
mod complex;
mod coplanar;
mod expected;
mod fracture;
mod ground;
mod ground_cut;
mod height_field;
mod hexes;
mod hull;
mod joint_set;
mod measure;
mod neighbours;
mod network;
mod outline;
mod overlaps;
mod parts;
mod plane;
mod polyhedron;
mod random;
mod regions;
mod seeds;
mod simplify;
mod split;
mod stability;
mod tree;
mod tunnel;
mod voronoi;
mod whole_faces;

pub use cell::{CellDefect, CellFace, ConvexCell};
pub use complex::{CellComplex, CutCount, MOST_CELLS, ON_PLANE};
pub use expected::expected_cells;
pub use fracture::{Fracture, TOUCHED};
pub use ground::Ground;
pub use height_field::HeightField;
pub use hexes::CellHexes;
pub use joint_set::{JointSet, Spacing};
pub use measure::CellProperties;
pub use neighbours::CommonFace;
pub use network::{DiscCount, DiscSize, FractureNetwork};
pub use outline::Outline;
pub use overlaps::first_overlap;
pub use parts::{CellPart, PartPoint};
pub use plane::{Compass, CutPlane, PlaneSource, sin_cos_degrees};
pub use polyhedron::{Polyhedron, ShapeError, prism};
pub use random::RandomStream;
pub use regions::RegionParts;
pub use seeds::voronoi_seeds;
pub use stability::{FirstMotion, JointFace, merged_faces};
pub use tunnel::Tunnel;
