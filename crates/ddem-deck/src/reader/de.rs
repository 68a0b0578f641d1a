//! Conversion of TOML values to a deck, with mistakes in the words of the deck.
//!
//! The reader of the `toml` crate describes a mistake by a line of text about Rust types. This
//! reader knows the place of the mistake and the expected value, and continues after an unknown
//! key.

mod access;
mod mistake;

use std::cell::RefCell;
use std::ops::Range;

use crate::schema::names::{list, segment};
use ddem_core::Fault;
use serde::de::{Deserialize, Deserializer, Visitor};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::numbers;
use crate::schema::Deck;
use access::{Entries, Keys, Variant};
use mistake::{Mistake, describe};

/// Deck of a table, or all mistakes with their places in the text.
pub(super) fn read(table: &Spanned<DeTable<'_>>) -> Result<Deck, Vec<(Fault, Range<usize>)>> {
    let unknown = RefCell::new(Vec::new());
    let mut mistakes: Vec<Mistake> = Vec::new();
    match Deck::deserialize(Reader::root(table, &[], &unknown)) {
        Ok(deck) if unknown.borrow().is_empty() => return Ok(deck),
        Ok(_) => {}
        // Reading stopped at the first mistake, so each part of the deck is now read alone.
        Err(_) => {
            unknown.borrow_mut().clear();
            for part in parts(table.get_ref()) {
                mistakes.extend(Deck::deserialize(Reader::root(table, &part, &unknown)).err());
            }
        }
    }
    let unknown = unknown.into_inner();
    mistakes.retain(|mistake| !mistake.follows_from(&unknown));
    mistakes.extend(unknown);
    let mut found: Vec<(Fault, Range<usize>)> = Vec::new();
    for mistake in mistakes.into_iter().map(Mistake::into_fault) {
        // A section of the wrong type gives the same mistake once for each of its parts.
        if !found.contains(&mistake) {
            found.push(mistake);
        }
    }
    Err(found)
}

/// Key or entry to which reading is limited.
#[derive(Clone, Copy)]
enum Pick<'a> {
    Key(&'a str),
    Entry(usize),
}

/// Parts that can be read alone: each key, each entry of an array, each table of a table of tables.
fn parts<'a>(root: &'a DeTable<'_>) -> Vec<Vec<Pick<'a>>> {
    let mut parts = Vec::new();
    for (key, value) in root {
        let key = Pick::Key(key.get_ref());
        match value.get_ref() {
            DeValue::Array(array) if !array.is_empty() => {
                parts.extend((0..array.len()).map(|i| vec![key, Pick::Entry(i)]));
            }
            DeValue::Table(table) if table.values().any(|value| value.get_ref().is_table()) => {
                parts.extend(table.keys().map(|inner| vec![key, Pick::Key(inner.get_ref())]));
            }
            _ => parts.push(vec![key]),
        }
    }
    parts
}

/// One value, with its place.
struct Reader<'a> {
    value: ValueForm<'a>,
    span: Range<usize>,
    place: String,
    /// Path to which reading is limited; empty for everything.
    picks: &'a [Pick<'a>],
    /// Unknown keys found so far.
    unknown: &'a RefCell<Vec<Mistake>>,
}

/// Forms of a value that a deck distinguishes.
#[derive(Clone, Copy)]
enum ValueForm<'a> {
    Table(&'a DeTable<'a>),
    Array(&'a [Spanned<DeValue<'a>>]),
    Text(&'a str),
    Integer(i128),
    Number(f64),
    Truth(bool),
    Date,
    /// A whole number with too many digits.
    TooLarge,
}

impl<'a> ValueForm<'a> {
    fn new(value: &'a DeValue<'a>) -> Self {
        match value {
            DeValue::Table(table) => ValueForm::Table(table),
            DeValue::Array(array) => ValueForm::Array(array),
            DeValue::String(text) => ValueForm::Text(text),
            DeValue::Boolean(truth) => ValueForm::Truth(*truth),
            DeValue::Datetime(_) => ValueForm::Date,
            DeValue::Integer(digits) => {
                let text = digits.as_str().replace('_', "");
                i128::from_str_radix(&text, digits.radix())
                    .map_or(ValueForm::TooLarge, ValueForm::Integer)
            }
            DeValue::Float(digits) => {
                let text = digits.as_str().replace('_', "");
                text.parse().map_or(ValueForm::TooLarge, ValueForm::Number)
            }
        }
    }
}

impl<'a> Reader<'a> {
    fn root(
        table: &'a Spanned<DeTable<'a>>,
        picks: &'a [Pick<'a>],
        unknown: &'a RefCell<Vec<Mistake>>,
    ) -> Self {
        let value = ValueForm::Table(table.get_ref());
        Self { value, span: 0..0, place: String::new(), picks, unknown }
    }

    fn key(&self, key: &str, value: &'a Spanned<DeValue<'a>>) -> Self {
        let dot = if self.place.is_empty() { "" } else { "." };
        self.child(format!("{}{dot}{}", self.place, segment(key)), value)
    }

    fn entry(&self, index: usize, value: &'a Spanned<DeValue<'a>>) -> Self {
        self.child(format!("{}[{index}]", self.place), value)
    }

    fn child(&self, place: String, value: &'a Spanned<DeValue<'a>>) -> Self {
        Self {
            value: ValueForm::new(value.get_ref()),
            span: value.span(),
            place,
            picks: self.picks.get(1..).unwrap_or_default(),
            unknown: self.unknown,
        }
    }

    fn expected(&self, what: impl std::fmt::Display) -> Mistake {
        Mistake::new(format!("expected {what}, found {}", describe(self.value))).at(self)
    }

    /// Reads a table, with only the `known` keys if they are given. `what` describes the expected
    /// value.
    fn table<V: Visitor<'a>>(
        &self,
        visitor: V,
        known: Option<&'static [&'static str]>,
        what: impl std::fmt::Display,
    ) -> Result<V::Value, Mistake> {
        match self.value {
            ValueForm::Table(table) => visitor.visit_map(Keys::new(self, table, known)),
            ValueForm::Array(_) if known.is_some() && !self.place.contains(['.', '[']) => {
                let help = format!("it begins with `[{}]`, in one pair of brackets", self.place);
                Err(self.expected(what).help(help))
            }
            _ => match self.place.split_once('.') {
                Some((section, key)) if !self.place.contains('[') && !key.contains('.') => {
                    let help = format!("each has a name and a table, `[{section}.NAME]`");
                    Err(self.expected(what).help(help))
                }
                _ => Err(self.expected(what)),
            },
        }
        .map_err(|mistake| mistake.at(self))
    }

    fn array<V: Visitor<'a>>(&self, visitor: V) -> Result<V::Value, Mistake> {
        match self.value {
            ValueForm::Array(array) => visitor.visit_seq(Entries::new(self, array)),
            ValueForm::Table(_) if !self.place.contains('.') => {
                let key = &self.place;
                Err(self
                    .expected("entries in an array")
                    .help(format!("each entry begins with `[[{key}]]`, in two pairs of brackets")))
            }
            _ => Err(self.expected("a list `[…]`")),
        }
        .map_err(|mistake| mistake.at(self))
    }

    fn number<V: Visitor<'a>>(&self, visitor: V) -> Result<V::Value, Mistake> {
        match self.value {
            ValueForm::Number(number) => visitor.visit_f64(number),
            ValueForm::Integer(number) => visitor.visit_f64(number as f64),
            ValueForm::Text(text) => {
                let mistake = self.expected("a number");
                Err(match numbers::hint(text) {
                    Some(hint) => mistake.help(hint),
                    None => mistake,
                })
            }
            _ => Err(self.expected("a number")),
        }
        .map_err(|mistake| mistake.at(self))
    }

    fn integer<V: Visitor<'a>>(&self, visitor: V, most: u64) -> Result<V::Value, Mistake> {
        let ValueForm::Integer(number) = self.value else {
            return Err(self.expected("a whole number"));
        };
        match u64::try_from(number).ok().filter(|number| *number <= most) {
            Some(number) => visitor.visit_u64(number).map_err(|mistake: Mistake| mistake.at(self)),
            None if number < 0 => Err(self.expected("a whole number that is not negative")),
            None => Err(self.expected(format!("a whole number up to {most}"))),
        }
    }

    fn text<V: Visitor<'a>>(&self, visitor: V) -> Result<V::Value, Mistake> {
        match self.value {
            ValueForm::Text(text) => visitor.visit_str(text),
            _ => Err(self.expected("text in quotes")),
        }
        .map_err(|mistake| mistake.at(self))
    }
}

impl<'a> Deserializer<'a> for Reader<'a> {
    type Error = Mistake;

    fn deserialize_any<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        match self.value {
            ValueForm::Table(_) => self.table(visitor, None, ""),
            ValueForm::Array(_) => self.array(visitor),
            ValueForm::Text(_) => self.text(visitor),
            // A whole number stays one, so that it is quoted as it was written.
            ValueForm::Integer(number) => match i64::try_from(number) {
                Ok(number) => {
                    visitor.visit_i64(number).map_err(|mistake: Mistake| mistake.at(&self))
                }
                Err(_) => self.number(visitor),
            },
            ValueForm::Number(_) => self.number(visitor),
            ValueForm::Truth(truth) => {
                visitor.visit_bool(truth).map_err(|mistake: Mistake| mistake.at(&self))
            }
            ValueForm::Date | ValueForm::TooLarge => {
                Err(Mistake::unexpected(self.value, &visitor).at(&self))
            }
        }
    }

    fn deserialize_bool<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        match self.value {
            ValueForm::Truth(truth) => visitor.visit_bool(truth),
            _ => Err(self.expected("`true` or `false`")),
        }
    }

    fn deserialize_f64<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        self.number(visitor)
    }

    fn deserialize_u32<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        self.integer(visitor, u64::from(u32::MAX))
    }

    fn deserialize_u64<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        // This limit of TOML integers ensures that every value that is read can be written.
        self.integer(visitor, i64::MAX as u64)
    }

    fn deserialize_str<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        self.text(visitor)
    }

    fn deserialize_string<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        self.text(visitor)
    }

    fn deserialize_option<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        visitor.visit_some(self)
    }

    fn deserialize_seq<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        self.array(visitor)
    }

    fn deserialize_tuple<V: Visitor<'a>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Mistake> {
        let ValueForm::Array(array) = self.value else {
            return Err(self.expected(format!("a list of {length} numbers")));
        };
        if array.len() != length {
            let lists = array.iter().any(|entry| entry.get_ref().is_array());
            let what = if lists { "lists of numbers" } else { "numbers" };
            let message = format!("expected {length} {what}, found {}", array.len());
            return Err(Mistake::new(message).at(&self));
        }
        self.array(visitor)
    }

    fn deserialize_map<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        self.table(visitor, None, format!("tables `[{}.NAME]`", self.place))
    }

    fn deserialize_struct<V: Visitor<'a>>(
        self,
        _name: &'static str,
        keys: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mistake> {
        let what = format!("a table with keys out of {}", list(keys.iter().copied()));
        self.table(visitor, Some(keys), what)
    }

    fn deserialize_enum<V: Visitor<'a>>(
        self,
        _name: &'static str,
        values: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mistake> {
        match self.value {
            ValueForm::Text(text) => visitor.visit_enum(Variant(text)).map_err(|m| m.at(&self)),
            _ => {
                let values: Vec<String> =
                    values.iter().map(|value| format!("`\"{value}\"`")).collect();
                Err(self.expected(values.join(" or ")))
            }
        }
    }

    fn deserialize_ignored_any<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Mistake> {
        visitor.visit_unit()
    }

    serde::forward_to_deserialize_any! {
        <V: Visitor<'a>>
        i8 i16 i32 i64 i128 u8 u16 u128 f32 char bytes byte_buf unit unit_struct newtype_struct
        tuple_struct identifier
    }
}
