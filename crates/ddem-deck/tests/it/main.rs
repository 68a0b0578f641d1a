//! Tests of decks and of models built from them.

#![allow(clippy::disallowed_methods, clippy::print_stdout)]

mod bad_decks;
mod bad_input;
mod coverage;
mod defaults;
mod errors;
mod file_messages;
mod files;
mod fuzz;
mod generated;
mod good_decks;
mod keys;
mod lint;
mod messages;
mod model_messages;
mod notation;
mod rock;
mod rock_beside;
mod rock_decks;
mod rock_files;
mod rock_fractures;
mod rock_ground;
mod rock_join;
mod rock_loads;
mod rock_run;
mod rock_stability;
mod rock_steps;
mod rock_tessellations;
mod rock_thin;
mod rock_voronoi;
mod run_messages;
mod selection;
mod selectors;
mod sets;
mod step_limits;
mod verdicts;
mod warnings;

// Modules shared with the tests of the method, which use more of them.
#[allow(dead_code)]
#[path = "../../../ddem-core/tests/it/cavities.rs"]
mod cavities;
#[allow(dead_code)]
#[path = "../../../ddem-core/tests/it/decks.rs"]
mod decks;

// Notation of the Python module, whose docstrings the tests write.
#[path = "../../../ddem-py/src/notation.rs"]
mod python;

/// Deck with every key of this version.
const GOOD: &str = include_str!("decks/good.toml");

/// Error of a deck, if there is one.
fn judge(text: &str) -> Option<ddem_deck::DeckError> {
    ddem_deck::parse(text, "deck.toml").and_then(|(deck, source)| source.check(&deck)).err()
}

/// Error report of a deck; empty if it is good.
fn report(text: &str) -> String {
    judge(text).map(|error| error.report(false)).unwrap_or_default()
}
