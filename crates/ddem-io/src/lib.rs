//! Decks in, results out.
