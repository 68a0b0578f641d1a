//! The deck that a model writes. Nothing here calls Python, so that it may be locked.

use std::collections::BTreeMap;

use ddem_core::{Deck, ModelError};
use toml::{Table, Value};

use crate::functions::Functions;

/// What has been written so far.
#[derive(Default)]
pub(crate) struct Draft {
    root: Table,
    pub(crate) functions: Functions,
    /// File and line where each entry was made, by its place in the deck.
    lines: BTreeMap<String, String>,
}

impl Draft {
    /// Of a deck that has been read.
    pub(crate) fn of(deck: &Deck) -> Self {
        // As a deck writes itself, so that equal materials are equal tables.
        Self { root: Table::try_from(deck).unwrap_or_default(), ..Self::default() }
    }

    /// The deck; places in errors are those of the deck.
    pub(crate) fn deck(&self) -> Result<Deck, ModelError> {
        ddem_io::deck::from_table(&self.root)
    }

    /// Its materials and joints.
    pub(crate) fn matter(&self) -> Table {
        let sections = ["materials", "joints"].into_iter();
        sections.filter_map(|s| Some((s.to_owned(), self.root.get(s)?.clone()))).collect()
    }

    /// Adds an entry to a section and the materials and joints that it names; gives its number, or
    /// nothing if the section is no list.
    pub(crate) fn push(&mut self, section: &str, entry: Table, matter: Table) -> Option<usize> {
        for (section, all) in matter {
            let known = self.root.entry(section).or_insert_with(|| Value::Table(Table::new()));
            if let (Value::Table(all), Value::Table(known)) = (all, known) {
                known.extend(all);
            }
        }
        let list = self.root.entry(section).or_insert_with(|| Value::Array(Vec::new()));
        let list = list.as_array_mut()?;
        list.push(Value::Table(entry));
        Some(list.len() - 1)
    }

    /// Remembers where the script has made an entry.
    pub(crate) fn made(&mut self, section: &str, index: usize, line: String) {
        self.lines.insert(format!("{section}[{index}]"), line);
    }

    /// Where the script has made what is at a place in the deck.
    pub(crate) fn line(&self, place: &str) -> Option<String> {
        let entry = place.find(']').map_or(place, |end| &place[..=end]);
        self.lines.get(entry).cloned()
    }

    /// Place of a history that is a Python function, if there is one.
    pub(crate) fn function(&self) -> Option<String> {
        self.functions.places().next()
    }
}
