//! Formulas of one element (§2–3), independent of model and mesh.
//!
//! [`hex8`] is the element of the paper by Gauss points, the reference of the tests. [`modal`] is
//! the same stiffness in the form that every loop uses. `lattice` applies it to a lattice of equal
//! elements, four lattices at a time. [`hexahedron`] is the element of blocks that are no
//! parallelepipeds.

pub mod elastic;
pub mod hex8;
pub mod modal;

pub mod corotation;
pub mod hexahedron;
pub mod lattice;
mod principal;
pub mod table;

use serde::{Deserialize, Serialize};

pub use elastic::Elastic;
pub use principal::principal;

/// The element of the blocks (§3); that of joints is always the trilinear one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ElementKind {
    /// The paper's trilinear hexahedron, which locks in bending.
    Standard,
    /// With the incompatible modes of Wilson and Taylor: no shear locking in bending.
    #[default]
    Incompatible,
}

#[cfg(test)]
mod tests;
