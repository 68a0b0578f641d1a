//! Mistakes that are found while reading a value, in the words of a deck.

use std::fmt;
use std::ops::Range;

use crate::lint::Code;
use crate::schema::examples::{example, meant};
use crate::schema::names::{list, nearest};
use ddem_core::{ErrorCode, Fault};
use serde::de::{Error, Expected, Unexpected};

use super::{Reader, ValueForm};

/// One mistake, located at the innermost value that it concerns.
#[derive(Clone, Debug)]
pub(in crate::reader) struct Mistake {
    message: String,
    help: Option<String>,
    at: Option<(String, Range<usize>)>,
    kind: MistakeKind,
}

#[derive(Clone, Debug, PartialEq)]
enum MistakeKind {
    Value,
    MissingKey(&'static str),
    UnknownKey(String),
}

impl MistakeKind {
    fn code(&self) -> ErrorCode {
        match self {
            Self::Value => ErrorCode::WrongType,
            Self::MissingKey(_) => ErrorCode::MissingKey,
            Self::UnknownKey(_) => ErrorCode::UnknownKey,
        }
    }
}

impl Mistake {
    pub(super) fn new(message: impl fmt::Display) -> Self {
        Self { message: message.to_string(), help: None, at: None, kind: MistakeKind::Value }
    }

    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Mistake about a value in a form that no reader accepts.
    pub(super) fn unexpected(found: ValueForm<'_>, expected: &dyn Expected) -> Self {
        Self::new(format!("expected {expected}, found {}", describe(found)))
    }

    /// Sets the place of the mistake, unless something inside `value` has set it.
    pub(super) fn at(mut self, value: &Reader<'_>) -> Self {
        if self.at.is_none() {
            let place = match &self.kind {
                MistakeKind::MissingKey(key) if value.place.is_empty() => (*key).to_owned(),
                MistakeKind::MissingKey(key) => format!("{}.{key}", value.place),
                _ => value.place.clone(),
            };
            self.at = Some((place, value.span.clone()));
        }
        self
    }

    pub(super) fn at_key(mut self, place: String, span: Range<usize>) -> Self {
        self.at = Some((place, span));
        self
    }

    /// True if an unknown key of the same table is probably this missing key, mistyped.
    pub(super) fn follows_from(&self, unknown: &[Mistake]) -> bool {
        let (MistakeKind::MissingKey(key), Some((place, _))) = (&self.kind, &self.at) else {
            return false;
        };
        let table = place.strip_suffix(key).unwrap_or_default();
        unknown.iter().any(|other| match (&other.kind, &other.at) {
            (MistakeKind::UnknownKey(mistyped), Some((place, _))) => {
                place.strip_prefix(table).is_some_and(|rest| !rest.contains('.'))
                    && likely(mistyped, [*key]).is_some()
            }
            _ => false,
        })
    }

    pub(super) fn into_fault(self) -> (Fault, Range<usize>) {
        let (place, span) = self.at.unwrap_or_default();
        let of_value = self.kind == MistakeKind::Value;
        let example =
            || example(&place).filter(|_| of_value).map(|value| format!("as in `{value}`"));
        let help = self.help.or_else(example);
        let fault = Fault::new(self.kind.code(), place, self.message);
        (help.into_iter().fold(fault, Fault::help), span)
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Mistake {}

impl Error for Mistake {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message)
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(format!("expected {expected}, found {}", describe_unexpected(found)))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(found: usize, expected: &dyn Expected) -> Self {
        let entries = if found == 1 { "entry" } else { "entries" };
        Self::new(format!("expected {expected}, found {found} {entries}"))
    }

    fn unknown_variant(found: &str, known: &'static [&'static str]) -> Self {
        if known.contains(&Code::ALL[0].name()) {
            return code_of_warning(found, known);
        }
        let words: Vec<String> = known.iter().map(|word| format!("`\"{word}\"`")).collect();
        let expected = words.join(" or ");
        let near = likely(found, known.iter().copied());
        let near = near.map(|word| format!("did you mean `\"{word}\"`?"));
        let message = format!("expected {expected}, found {}", quoted(found));
        near.into_iter().fold(Self::new(message), Mistake::help)
    }

    fn unknown_field(found: &str, known: &'static [&'static str]) -> Self {
        let near = likely(found, known.iter().copied())
            .map(|near| format!("did you mean `{near}`? "))
            .unwrap_or_default();
        let help = format!("{near}keys here: {}", list(known.iter().copied()));
        let mut mistake = Self::new(format!("unknown key `{}`", shortened(found))).help(help);
        mistake.kind = MistakeKind::UnknownKey(found.to_owned());
        mistake
    }

    fn missing_field(key: &'static str) -> Self {
        let mut mistake = Self::new(format!("key `{key}` is missing"));
        mistake.kind = MistakeKind::MissingKey(key);
        mistake
    }
}

/// Known key or word that a symbol, a synonym or a mistyped name probably means.
fn likely<'a>(
    found: &str,
    known: impl IntoIterator<Item = &'a str, IntoIter: Clone>,
) -> Option<&'a str> {
    let known = known.into_iter();
    meant(found, known.clone()).or_else(|| nearest(found, known))
}

/// Mistake about a word that is not the code of a warning.
fn code_of_warning(found: &str, known: &'static [&'static str]) -> Mistake {
    let is_error = ErrorCode::ALL.iter().any(|code| code.name() == found);
    let near = nearest(found, known.iter().copied());
    let help = match near {
        _ if is_error => "this is the code of an error, and errors cannot be silenced;".to_owned(),
        Some(near) => format!("did you mean `\"{near}\"`?"),
        None => "each warning is silenced by its own code, errors cannot be silenced;".to_owned(),
    };
    let message = format!("expected the code of a warning, found {}", quoted(found));
    Mistake::new(message).help(format!("{help} docs/diagnostics.md has all codes"))
}

/// Description of a value of the deck for a sentence.
pub(super) fn describe(found: ValueForm<'_>) -> String {
    match found {
        ValueForm::Table(_) => "a table".to_owned(),
        ValueForm::Array(_) => "a list".to_owned(),
        ValueForm::Text(text) => format!("the text {}", quoted(text)),
        ValueForm::Integer(number) => format!("{number}"),
        ValueForm::Number(number) => format!("{number:?}"),
        ValueForm::Truth(truth) => format!("`{truth}`"),
        ValueForm::Date => "a date".to_owned(),
        ValueForm::TooLarge => "a number with too many digits".to_owned(),
    }
}

fn describe_unexpected(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Str(text) => format!("the text {}", quoted(text)),
        Unexpected::Signed(number) => format!("{number}"),
        Unexpected::Unsigned(number) => format!("{number}"),
        Unexpected::Float(number) => format!("{number:?}"),
        Unexpected::Bool(truth) => format!("`{truth}`"),
        Unexpected::Seq => "a list".to_owned(),
        Unexpected::Map => "a table".to_owned(),
        other => other.to_string(),
    }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", shortened(text))
}

/// First 40 characters of the first line, or all of them.
fn shortened(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    let short: String = line.chars().take(40).collect();
    if short.len() < text.len() { format!("{short}…") } else { short }
}
