//! Decks in, results out.

#![allow(clippy::disallowed_methods, clippy::print_stdout)]

mod bad_decks;
mod bad_input;
mod errors;
mod files;
mod good_decks;
mod keys;
mod lint;
mod places;
mod selection;
mod sets;
mod warnings;

// Shared with the tests of the method, which use more of them.
#[allow(dead_code)]
#[path = "../../../ddem-core/tests/it/decks.rs"]
mod decks;
#[allow(dead_code)]
#[path = "../../../ddem-core/tests/it/hollows.rs"]
mod hollows;

/// A deck with every key that this version has.
const GOOD: &str = include_str!("decks/good.toml");

/// What is wrong with a deck, if anything.
fn judge(text: &str) -> Option<ddem_deck::DeckError> {
    ddem_deck::parse(text, "deck.toml").and_then(|(deck, source)| source.check(&deck)).err()
}

/// What is said about a deck: nothing when it is good.
fn report(text: &str) -> String {
    judge(text).map(|error| error.report(false)).unwrap_or_default()
}
