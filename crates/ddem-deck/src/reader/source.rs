//! Text of a deck, with the position of each key.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Text from which a deck was read, with the position of every key.
#[derive(Clone, Debug)]
pub struct Source {
    name: Arc<str>,
    text: Arc<str>,
    /// Starts of the lines of the text.
    lines: Vec<usize>,
    root: SourceNode,
}

#[derive(Clone, Debug)]
struct SourceNode {
    span: Range<usize>,
    children: Children,
}

#[derive(Clone, Debug)]
enum Children {
    None,
    Keys(BTreeMap<String, SourceNode>),
    Entries(Vec<SourceNode>),
}

impl Source {
    pub(super) fn new(name: &str, text: &str, table: &Spanned<DeTable<'_>>) -> Self {
        let root = SourceNode { span: 0..0, children: Children::keys(table.get_ref()) };
        let ends = text.match_indices('\n').map(|(end, _)| end + 1);
        let lines = std::iter::once(0).chain(ends).collect();
        Self { name: name.into(), text: text.into(), lines, root }
    }

    /// Name of the deck, usually the path of its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn shared(&self) -> (Arc<str>, Arc<str>) {
        (self.name.clone(), self.text.clone())
    }

    /// Line and column of a position in the text, from 1, the column in characters. The lines are counted once: a
    /// deck may have a mistake in each of very many.
    pub(crate) fn line_and_column(&self, at: usize) -> (usize, usize) {
        let line = self.lines.partition_point(|start| *start <= at).max(1);
        let before = self.text.get(self.lines[line - 1]..at).unwrap_or_default();
        (line, before.chars().count() + 1)
    }

    /// Location of the value at a [`Fault::place`](ddem_core::Fault::place), in bytes of the text.
    ///
    /// For a table with a header it is the header. For a missing key it is the nearest enclosing
    /// table in the text, or else the start of the text.
    pub fn locate(&self, place: &str) -> Range<usize> {
        let mut node = &self.root;
        for segment in segments(place) {
            let child = match (&node.children, segment) {
                (Children::Keys(keys), PathSegment::Key(key)) => keys.get(&key),
                (Children::Entries(entries), PathSegment::Index(index)) => entries.get(index),
                _ => None,
            };
            match child {
                Some(child) => node = child,
                None => break,
            }
        }
        node.span.clone()
    }
}

impl SourceNode {
    fn new(value: &Spanned<DeValue<'_>>) -> Self {
        let children = match value.get_ref() {
            DeValue::Table(table) => Children::keys(table),
            DeValue::Array(array) => Children::Entries(array.iter().map(SourceNode::new).collect()),
            _ => Children::None,
        };
        Self { span: value.span(), children }
    }
}

impl Children {
    fn keys(table: &DeTable<'_>) -> Self {
        let keys = table.iter();
        Children::Keys(
            keys.map(|(key, value)| (key.get_ref().to_string(), SourceNode::new(value))).collect(),
        )
    }
}

#[derive(Debug, PartialEq)]
enum PathSegment {
    Key(String),
    Index(usize),
}

/// Parts of a place such as `materials."hard rock".young` or `blocks[0].size[1]`.
fn segments(place: &str) -> Vec<PathSegment> {
    let mut segments = Vec::new();
    let mut letters = place.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '.' | ']' => {}
            '[' => {
                let mut digits = String::new();
                while let Some(digit) = letters.next_if(char::is_ascii_digit) {
                    digits.push(digit);
                }
                segments.push(PathSegment::Index(digits.parse().unwrap_or(usize::MAX)));
            }
            '"' => {
                let mut key = String::new();
                while let Some(letter) = letters.next() {
                    match letter {
                        '"' => break,
                        '\\' => key.extend(letters.next()),
                        _ => key.push(letter),
                    }
                }
                segments.push(PathSegment::Key(key));
            }
            _ => {
                let mut key = String::from(letter);
                while let Some(letter) = letters.next_if(|letter| !".[".contains(*letter)) {
                    key.push(letter);
                }
                segments.push(PathSegment::Key(key));
            }
        }
    }
    segments
}
