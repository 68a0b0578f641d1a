//! The deck of a Python model. No code here calls Python, so a draft may be locked.

use std::collections::BTreeMap;

use ddem_core::ModelError;
use ddem_deck::Deck;
use pyo3::prelude::*;
use toml::{Table, Value};

use crate::functions::{Functions, Timed};

/// A draft as Python values: the text of its deck, its functions by section and index, and its lines.
pub(crate) type DraftState = (String, Vec<(String, usize, Py<PyAny>)>, BTreeMap<String, String>);

/// Model as written so far.
#[derive(Default)]
pub(crate) struct Draft {
    root: Table,
    pub(crate) functions: Functions,
    /// File and line where each entry was made, by its place in the deck.
    lines: BTreeMap<String, String>,
}

impl Draft {
    /// Draft of a deck that has been read.
    pub(crate) fn of(deck: &Deck) -> Self {
        // The table has the form in which a deck is written, so that equal materials are equal
        // tables.
        Self { root: Table::try_from(deck).unwrap_or_default(), ..Self::default() }
    }

    /// The draft as Python values.
    pub(crate) fn state(&self, py: Python<'_>) -> Result<DraftState, toml::ser::Error> {
        Ok((toml::to_string(&self.root)?, self.functions.listed(py), self.lines.clone()))
    }

    /// Draft from its Python values.
    pub(crate) fn from_state(state: DraftState) -> Result<Self, toml::de::Error> {
        let (root, listed, lines) = state;
        Ok(Self { root: toml::from_str(&root)?, functions: Functions::of(listed), lines })
    }

    /// The deck; places in errors are those of the deck.
    pub(crate) fn deck(&self) -> Result<Deck, ModelError> {
        ddem_deck::from_table(&self.root)
    }

    /// Tables of its materials and joints.
    pub(crate) fn matter(&self) -> Table {
        let sections = ["materials", "joints"].into_iter();
        sections.filter_map(|s| Some((s.to_owned(), self.root.get(s)?.clone()))).collect()
    }

    /// True if a cut with this name is a tunnel.
    pub(crate) fn has_tunnel(&self, name: &str) -> bool {
        let cuts = self.root.get("cut").and_then(Value::as_array).into_iter().flatten();
        cuts.filter(|cut| cut.get("tunnel").is_some())
            .any(|cut| cut.get("name").and_then(Value::as_str) == Some(name))
    }

    /// Sets a section that has one table, with the script line that set it.
    pub(crate) fn set(&mut self, section: &str, table: Table, line: Option<String>) {
        self.root.insert(section.to_owned(), Value::Table(table));
        self.lines.extend(line.map(|line| (section.to_owned(), line)));
    }

    /// Adds an entry to a section, with the materials and joints that it names, its script line and
    /// its function. Returns false if the section is not a list.
    pub(crate) fn push(
        &mut self,
        section: &str,
        entry: Table,
        matter: Table,
        (line, function): (Option<String>, Option<Py<PyAny>>),
    ) -> bool {
        for (section, all) in matter {
            let known = self.root.entry(section).or_insert_with(|| Value::Table(Table::new()));
            if let (Value::Table(all), Value::Table(known)) = (all, known) {
                known.extend(all);
            }
        }
        let list = self.root.entry(section).or_insert_with(|| Value::Array(Vec::new()));
        let Some(list) = list.as_array_mut() else { return false };
        let index = list.len();
        list.push(Value::Table(entry));
        if let Some(line) = line {
            self.lines.insert(format!("{section}[{index}]"), line);
        }
        if let (Some(timed), Some(function)) = (Timed::new(section, index), function) {
            self.functions.insert(timed, function);
        }
        true
    }

    /// Line of the script that made the entry at a location of the deck.
    pub(crate) fn line(&self, place: &str) -> Option<String> {
        let entry = match place.find(']') {
            Some(end) => &place[..=end],
            None => place.split('.').next().unwrap_or(place),
        };
        self.lines.get(entry).cloned()
    }

    /// Place of a history that is a Python function, if there is one.
    pub(crate) fn function(&self) -> Option<String> {
        self.functions.places().next()
    }
}
