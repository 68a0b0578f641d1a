//! Runs of decks: results, checkpoints, summaries.

#![warn(clippy::print_stdout)]

pub mod cells;
pub mod checkpoint;
pub mod folder;
mod hdf;
mod output_error;
mod replace;
mod room;
pub mod run;
pub mod status;
pub mod summary;
pub mod tables;
pub mod version;
pub mod vtkhdf;

pub use output_error::{Cause, OutputError};
pub use serde_json;
