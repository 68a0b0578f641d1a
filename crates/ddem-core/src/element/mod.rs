//! §2–3: formulas of one element. No model, no mesh.
//!
//! [`hex8`] is the text of the paper by Gauss points, and the oracle of the tests; [`modal`] is
//! the same stiffness in the form that every loop runs; `lattice` applies it to a lattice of
//! equal elements, four lattices at a time.

pub mod elastic;
pub mod hex8;
pub mod modal;

pub(crate) mod corotation;
pub(crate) mod lattice;
mod principal;
pub(crate) mod table;

pub use elastic::Elastic;
pub(crate) use principal::principal;

#[cfg(test)]
mod tests;
