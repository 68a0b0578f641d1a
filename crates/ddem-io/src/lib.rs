//! Decks in, results out.

#![warn(clippy::print_stdout)]

pub mod checkpoint;
pub mod deck;
pub mod diagnose;
pub mod folder;
mod hdf;
mod near;
mod output_error;
mod replace;
pub mod run;
pub mod summary;
pub mod tables;
pub mod vtkhdf;

pub use deck::Source;
pub use diagnose::{DeckError, Finding};
pub use near::near;
pub use output_error::{Cause, OutputError};
pub use {serde_json, toml};
