//! Keys of the tables of a deck, from its schema.

use std::sync::LazyLock;

use serde_json::{Map, Value};

use super::StageKind;
use crate::json_schema;

static SCHEMA: LazyLock<Value> = LazyLock::new(json_schema);

/// Keys of a table with their schemas; none for an unknown name.
fn properties(table: &str) -> impl Iterator<Item = (&'static str, &'static Value)> + use<> {
    let table: &'static Value = &SCHEMA["$defs"][table];
    let all: Option<&'static Map<String, Value>> = table["properties"].as_object();
    all.into_iter().flatten().map(|(key, schema)| (key.as_str(), schema))
}

/// Keys of a table, in the order of its struct, by the name of the struct.
///
/// ```
/// assert_eq!(ddem_deck::keys("Refine"), ["where", "factor"]);
/// ```
#[must_use]
pub fn keys(table: &str) -> Vec<&'static str> {
    properties(table).map(|(key, _)| key).collect()
}

/// Keys of the entries of a section, by its name in a deck.
///
/// ```
/// assert!(ddem_deck::section_keys("fix").contains(&"where"));
/// ```
#[must_use]
pub fn section_keys(section: &str) -> Vec<&'static str> {
    let section = &SCHEMA["properties"][section];
    let forms = [section, &section["items"], &section["additionalProperties"]];
    let table = forms.iter().find_map(|form| form["$ref"].as_str()?.rsplit('/').next());
    table.map(keys).unwrap_or_default()
}

/// True if a section is a list, whose entries begin with `[[section]]`.
pub(crate) fn is_list(section: &str) -> bool {
    SCHEMA["properties"][section]["type"] == "array"
}

/// Kinds of stages that have a key, from the beginning of its description, as in `relax, safety:`;
/// `None` if all have it.
pub(crate) fn kinds(key: &str) -> Option<Vec<StageKind>> {
    let (_, schema) = properties("Stage").find(|(own, _)| *own == key)?;
    let (kinds, _) = schema["description"].as_str()?.split_once(": ")?;
    kinds.split(", ").map(|kind| serde_json::from_value(kind.into()).ok()).collect()
}

/// Keys of stages of one kind besides `name` and `kind`, in the order of [`Stage`](super::Stage).
///
/// ```
/// # use ddem_deck::{StageKind, stage_keys};
/// let relax = stage_keys(StageKind::Relax);
/// assert_eq!(relax, ["tolerance", "max_steps", "increments", "on_failure"]);
/// ```
#[must_use]
pub fn stage_keys(kind: StageKind) -> Vec<&'static str> {
    let own = |key: &&str| kinds(key).is_some_and(|kinds| kinds.contains(&kind));
    keys("Stage").into_iter().filter(own).collect()
}
