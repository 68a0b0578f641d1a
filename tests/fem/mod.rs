//! An independent finite element model of a jointed lattice, for comparison in tests.
//!
//! It is written from the definitions alone: hex8 elements, explicit 2×2×2 Gauss points, an
//! assembled sparse matrix, a preconditioned conjugate gradient solver. It shares no code with the
//! program that it checks, and prefers the plain textbook form to speed.
//!
//! A degree of freedom is `3 · node + component`. Voigt order is xx, yy, zz, xy, yz, zx with
//! engineering shear strains. Units are SI; tension is positive.
//!
//! ```ignore
//! let mesh = OracleLattice::boxed([12.0, 3.0, 3.0], [12, 3, 3], 4, 0.01, rock).mesh();
//! let system = System::assemble(&mesh, Formulation::Standard);
//! let solution = system.solve(&loads, &prescribed);
//! ```

#![allow(
    dead_code,
    unused_imports,
    reason = "each test binary uses the part of the oracle it needs"
)]
#![allow(unreachable_pub, reason = "the oracle is a module of several test binaries")]

mod element;
mod lattice;
mod mesh;
mod solver;
mod sparse;
mod system;
mod transient;

pub use element::{Formulation, lumped_masses, stiffness, stress_at_centroid, volume};
pub use lattice::{Face, OracleLattice};
pub use mesh::{Hexahedron, LatticePart, Mesh};
pub use solver::Solution;
pub use sparse::Csr;
pub use system::System;
pub use transient::Transient;

/// An isotropic linear elastic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleMaterial {
    /// Mass density, kg/m³.
    pub density: f64,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

impl OracleMaterial {
    /// Lamé's first constant λ.
    pub fn lambda(&self) -> f64 {
        self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
    }

    /// The shear modulus G.
    pub fn shear(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// The modulus of uniaxial strain, λ + 2G.
    pub fn confined(&self) -> f64 {
        self.lambda() + 2.0 * self.shear()
    }
}
