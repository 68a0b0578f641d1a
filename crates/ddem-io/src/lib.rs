//! Decks in, results out.

mod hdf;
mod output_error;
mod replace;
pub mod vtkhdf;

pub use output_error::{Cause, OutputError};
