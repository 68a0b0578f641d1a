//! Verification of the program: decks of `examples/verification` against exact answers.
//!
//! `DDEM_VERIFICATION=docs/verification.md cargo test --test verification` writes the table in
//! `docs/verification.md`.

#![allow(clippy::print_stdout, reason = "errors that were found, shown by --nocapture")]

#[path = "../fem/mod.rs"]
mod fem;
#[path = "../shared/mod.rs"]
mod shared;

mod beam_cracks;
mod blasts;
mod block_theory;
mod boundaries;
mod cantilever;
mod cells;
mod cells_contact;
mod cells_free;
mod collisions;
mod contact_energy;
mod convergence;
mod energy;
mod explosion;
mod half_space;
mod in_situ;
mod incline;
mod incline_contact;
mod intact_planes;
mod joint_waves;
mod limit;
mod page;
mod poisson;
mod pull;
mod record;
mod regions;
mod relax_strength;
mod relaxing;
mod rocking;
mod rotation;
mod safety;
mod separation;
mod shear_box;
mod shear_planes;
mod sliding;
mod sphere;
mod stacks;
mod three_point_beam;
mod vtk_reader;
mod waves;

use fem::OracleMaterial;

/// Rock of the paper, for the independent model.
const ROCK: OracleMaterial = OracleMaterial { density: 2400.0, young: 18e9, poisson: 0.25 };
