//! Decks in, results out.

pub mod deck;
pub mod diagnose;

pub use deck::Source;
pub use diagnose::{DeckError, Finding};
