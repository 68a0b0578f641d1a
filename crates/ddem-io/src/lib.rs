//! Decks in, results out.

pub mod checkpoint;
pub mod folder;
mod hdf;
mod output_error;
mod replace;
pub mod summary;
pub mod tables;
pub mod vtkhdf;

pub use output_error::{Cause, OutputError};
