//! Decks in, results out.

mod bad_decks;
mod files;
mod good_decks;

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
