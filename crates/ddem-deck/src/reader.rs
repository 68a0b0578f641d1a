//! Reading and writing of decks as TOML: every mistake is located, and a written deck reads back
//! equal.

mod contents;
mod de;
mod files;
mod fractures;
pub(crate) mod numbers;
mod obj;
mod rock_files;
mod source;
pub(crate) mod syntax;
mod tess;

pub use contents::{file_contents, restore_files};
pub use files::{join_paths, read_files};
pub use source::Source;

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::string::FromUtf8Error;

use ddem_core::{ErrorCode, Fault, ModelError};
use toml::de::DeTable;

use crate::diagnose::{DeckError, Finding};
use crate::schema::Deck;

/// Reads a deck file.
///
/// Its values are checked by [`Source::check`].
///
/// # Errors
///
/// The file cannot be read, is not TOML, has unknown keys, values of the wrong type or missing
/// keys, or names files that cannot be read. The error holds all mistakes that are found, not only
/// the first.
pub fn read(path: &Path) -> Result<(Deck, Source), DeckError> {
    let unreadable = |source| DeckError::Unreadable { path: path.to_owned(), source };
    let text = String::from_utf8(bytes(path).map_err(unreadable)?);
    let text = text.map_err(|error| unreadable(not_text(&error)))?;
    parse(&text, &path.display().to_string())
}

/// Largest size of a deck `[bytes]`.
const MOST_BYTES: u64 = 1 << 30;

/// Bytes of a deck: a file, or what a shell pipes to `/dev/stdin` or `/dev/fd/N`.
fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let piped = ["/dev/stdin", "/dev/fd"].iter().any(|pipe| path.starts_with(pipe));
    let file = if piped { File::open(path)? } else { files::open(path)? };
    let mut bytes = Vec::new();
    // A pipe does not know its length.
    if file.metadata()?.len() <= MOST_BYTES {
        file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 <= MOST_BYTES {
            return Ok(bytes);
        }
    }
    let message = format!("it has more than {MOST_BYTES} bytes");
    Err(io::Error::new(io::ErrorKind::FileTooLarge, message))
}

/// Error of a text in another encoding, with its line.
fn not_text(error: &FromUtf8Error) -> io::Error {
    let valid = error.utf8_error().valid_up_to();
    let before = error.as_bytes().iter().take(valid);
    let line = before.filter(|byte| **byte == b'\n').count() + 1;
    io::Error::new(io::ErrorKind::InvalidData, format!("line {line} is not UTF-8"))
}

/// Reads a deck from its text. Errors call it `name`. Files that the deck names are relative to the
/// folder of `name`.
///
/// # Errors
///
/// Those of [`read`].
pub fn parse(text: &str, name: &str) -> Result<(Deck, Source), DeckError> {
    let (mut deck, source) = parse_alone(text, name)?;
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    match read_files(&mut deck, folder) {
        Ok(()) => Ok((deck, source)),
        Err(error) => Err(DeckError::from_faults(&source, error.faults)),
    }
}

/// Reads a deck without the files that it names.
///
/// # Errors
///
/// Those of [`parse`], except for files.
pub fn parse_alone(text: &str, name: &str) -> Result<(Deck, Source), DeckError> {
    let (table, errors) = DeTable::parse_recoverable(text);
    let source = Source::new(name, text, &table);
    if let Some(finding) = Finding::syntax(&source, &errors) {
        return Err(DeckError::wrong(&source, vec![finding]));
    }
    match de::read(&table) {
        Ok(deck) => Ok((deck, source)),
        Err(mistakes) => {
            let findings =
                mistakes.into_iter().map(|(fault, span)| Finding::new(&source, fault, span));
            Err(DeckError::wrong(&source, findings.collect()))
        }
    }
}

/// Reads a deck from a table that a program has made, by the same rules. [`read_files`] reads the
/// files that it names.
///
/// # Errors
///
/// All unknown keys, values of the wrong type and missing keys that are found.
pub fn from_table(table: &toml::Table) -> Result<Deck, ModelError> {
    let unreadable =
        |message: String| ModelError::from(Fault::new(ErrorCode::WrongType, "", message));
    let text = toml::to_string(table).map_err(|error| unreadable(error.to_string()))?;
    match parse_alone(&text, "") {
        Ok((deck, _)) => Ok(deck),
        Err(DeckError::Wrong { findings, .. }) => {
            Err(ModelError { faults: findings.into_iter().map(|finding| finding.fault).collect() })
        }
        Err(error) => Err(unreadable(error.to_string())),
    }
}

impl Source {
    /// Checks the deck alone, before any geometry is built; see [`check`](crate::check()).
    ///
    /// # Errors
    ///
    /// All faults that were found, located in the text.
    pub fn check(&self, deck: &Deck) -> Result<(), DeckError> {
        let faults = crate::check(deck);
        if faults.is_empty() { Ok(()) } else { Err(DeckError::from_faults(self, faults)) }
    }
}

/// Text of the deck as TOML, which reads back equal.
///
/// # Errors
///
/// TOML cannot hold a value: a whole number of 2⁶³ or more.
pub fn write(deck: &Deck) -> Result<String, DeckError> {
    toml::to_string(deck).map_err(|error| DeckError::Unwritable { message: error.to_string() })
}

/// JSON Schema of decks, for editors.
pub fn json_schema() -> serde_json::Value {
    schemars::schema_for!(Deck).to_value()
}
