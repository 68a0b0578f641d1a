//! Decks in, results out.

mod bad_decks;
mod good_decks;

/// A deck with every key that this version has.
const GOOD: &str = include_str!("decks/good.toml");

/// What is said about a deck: nothing when it is good.
fn report(text: &str) -> String {
    let error = match ddem_io::deck::parse(text, "deck.toml") {
        Ok((deck, source)) => match ddem_io::deck::check(&deck, &source) {
            Ok(()) => return String::new(),
            Err(error) => error,
        },
        Err(error) => error,
    };
    error.report(false)
}
