//! Decks: reader, checks, blocks and warnings.

#![no_main]

use ddem_deck::{BuiltDeck, Size};
use libfuzzer_sys::fuzz_target;

/// Size above which a program refuses a model, because it has no more memory.
const MOST_BYTES: f64 = 2e8;

fuzz_target!(|text: &str| {
    let deck = match ddem_deck::parse_alone(text, "deck.toml") {
        Ok((deck, _)) => deck,
        Err(error) => return assert!(!error.report(false).is_empty()),
    };
    if !ddem_deck::check(&deck).is_empty() || Size::of(&deck).bytes > MOST_BYTES {
        return;
    }
    if let Ok(built) = BuiltDeck::new(&deck) {
        let _ = built.warnings(&built.model());
    }
});
