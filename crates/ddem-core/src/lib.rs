//! The deformable block discrete element method.

pub mod deck;
mod error;

pub use deck::Deck;
pub use error::{Fault, ModelError};
