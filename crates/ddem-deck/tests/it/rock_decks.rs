//! Decks of regions as tests read, cut and build them.

use ddem_deck::{BuiltDeck, CutRock, Deck, parse};

pub(crate) fn deck(text: &str) -> Deck {
    parse(text, "deck.toml").unwrap_or_else(|error| panic!("{error}")).0
}

pub(crate) fn cut(text: &str) -> CutRock {
    deck(text).cut_regions().unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn built(text: &str) -> BuiltDeck {
    BuiltDeck::new(&deck(text)).unwrap_or_else(|error| panic!("{error}"))
}

/// Messages about a deck, by its reader or its builder.
pub(crate) fn messages(text: &str) -> Vec<String> {
    match parse(text, "deck.toml") {
        Ok((deck, _)) => {
            let faults = BuiltDeck::new(&deck).err().map(|error| error.faults).unwrap_or_default();
            faults.iter().map(ToString::to_string).collect()
        }
        Err(error) => error.findings().iter().map(|one| one.fault.to_string()).collect(),
    }
}
