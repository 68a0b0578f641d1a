//! `checkpoint.h5`: arrays, counters and texts, kept bit for bit.
//!
//! ```text
//! /            attributes format = "ddem checkpoint", version = 6
//! /deck        the text of the deck, bytes
//! /arrays/*    doubles, one dimension, as they are: neither converted nor compressed
//! /counters/*  one unsigned integer, 64 bits, each
//! /texts/*     UTF-8 bytes
//! ```
//!
//! What the arrays mean is the business of whoever saves them.

use std::collections::BTreeMap;
use std::path::Path;

use hdf5::types::FixedAscii;
use hdf5::{File, Group, H5Type, OpenMode, Result};

use crate::hdf::{scalar_attribute, with_file, word_attribute};
use crate::output_error::OutputError;
use crate::replace::replace;

/// Tells our files from others.
const FORMAT: &[u8; 15] = b"ddem checkpoint";

/// Grows when files of before can no longer be read.
const VERSION: u64 = 7;

/// Everything a checkpoint holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Text of the deck.
    pub deck: String,
    /// Arrays by name.
    pub arrays: BTreeMap<String, Vec<f64>>,
    /// Counters by name.
    pub counters: BTreeMap<String, u64>,
    /// Texts by name.
    pub texts: BTreeMap<String, String>,
}

/// Saves a checkpoint from borrowed arrays, without copying them. The file at `path` is replaced
/// when the new one is complete and on the disk; until then, and if anything fails, it stays.
///
/// # Errors
///
/// [`OutputError::Mismatch`] if a name is empty, occurs twice or has a `/`; others if the file
/// cannot be written.
pub fn save(
    path: impl AsRef<Path>,
    deck: &str,
    arrays: &[(&str, &[f64])],
    counters: &[(&str, u64)],
    texts: &[(&str, &str)],
) -> std::result::Result<(), OutputError> {
    let path = path.as_ref();
    check_names(path, arrays.iter().map(|a| a.0))?;
    check_names(path, counters.iter().map(|c| c.0))?;
    check_names(path, texts.iter().map(|t| t.0))?;
    let fill = |file: &File| -> Result<()> {
        word_attribute(file, "format", FORMAT)?;
        scalar_attribute(file, "version", &VERSION)?;
        store(file, "deck", deck.as_bytes())?;
        let group = file.create_group("arrays")?;
        arrays.iter().try_for_each(|(name, values)| store(&group, name, values))?;
        let group = file.create_group("counters")?;
        counters.iter().try_for_each(|(name, value)| store(&group, name, &[*value]))?;
        let group = file.create_group("texts")?;
        texts.iter().try_for_each(|(name, text)| store(&group, name, text.as_bytes()))
    };
    replace(path, |part| {
        with_file(part, OpenMode::Create, "saving", |file| {
            fill(file).map_err(|e| OutputError::hdf5(path, "saving", e))
        })
    })
}

impl Checkpoint {
    /// Loads a checkpoint.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if the file is truncated, not a checkpoint, or of a newer version.
    pub fn load(path: impl AsRef<Path>) -> std::result::Result<Self, OutputError> {
        let path = path.as_ref();
        let unusable = |e: String| OutputError::unusable(path, e);
        let metadata = std::fs::metadata(path).map_err(|e| OutputError::io(path, "loading", e))?;
        if metadata.is_dir() {
            let error = std::io::Error::new(std::io::ErrorKind::IsADirectory, "it is a folder");
            return Err(OutputError::io(path, "loading", error));
        }
        let size = metadata.len();
        with_file(path, OpenMode::Read, "loading", |file| {
            check_format(file).map_err(unusable)?;
            read(file, size).map_err(|e| unusable(format!("the checkpoint is damaged ({e})")))
        })
    }
}

fn check_format(file: &File) -> std::result::Result<(), String> {
    let format = file.attr("format").and_then(|a| a.read_scalar::<FixedAscii<15>>());
    if format.ok().is_none_or(|f| f.as_bytes() != FORMAT) {
        return Err("not a checkpoint of ddem".to_owned());
    }
    match file.attr("version").and_then(|a| a.read_scalar::<u64>()) {
        Ok(VERSION) => Ok(()),
        Ok(version) => Err(format!(
            "the checkpoint has format {version}, this version of ddem reads format {VERSION}"
        )),
        Err(e) => Err(format!("the checkpoint does not tell its format ({e})")),
    }
}

fn read(file: &File, size: u64) -> Result<Checkpoint> {
    let mut checkpoint = Checkpoint { deck: text(file, "deck", size)?, ..Checkpoint::default() };
    let group = file.group("arrays")?;
    for name in group.member_names()? {
        checkpoint.arrays.insert(name.clone(), fetch(&group, &name, size)?);
    }
    let group = file.group("counters")?;
    for name in group.member_names()? {
        let value = fetch(&group, &name, size)?;
        let [value] = value[..] else { return Err(format!("`{name}` is no counter").into()) };
        checkpoint.counters.insert(name, value);
    }
    let group = file.group("texts")?;
    for name in group.member_names()? {
        checkpoint.texts.insert(name.clone(), text(&group, &name, size)?);
    }
    Ok(checkpoint)
}

fn text(group: &Group, name: &str, size: u64) -> Result<String> {
    String::from_utf8(fetch(group, name, size)?).map_err(|e| format!("`{name}`: {e}").into())
}

fn store<T: H5Type>(group: &Group, name: &str, values: &[T]) -> Result<()> {
    let dataset = group.new_dataset::<T>().shape(values.len()).create(name)?;
    if !values.is_empty() {
        dataset.write_raw(values)?;
    }
    // Dropping a dataset writes what HDF5 still buffers, and cannot tell that the disk is full.
    dataset.flush()
}

fn fetch<T: H5Type>(group: &Group, name: &str, size: u64) -> Result<Vec<T>> {
    let dataset = group.dataset(name)?;
    if !dataset.dtype()?.is::<T>() {
        return Err(format!("`{name}` has numbers of another type").into());
    }
    // A damaged length must not make us ask for memory without end.
    let bytes = (dataset.size() as u64).saturating_mul(size_of::<T>() as u64);
    if bytes > size {
        return Err(format!("`{name}` is longer than the file").into());
    }
    dataset.read_raw::<T>()
}

fn check_names<'a>(
    path: &Path,
    names: impl Iterator<Item = &'a str>,
) -> std::result::Result<(), OutputError> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if name.is_empty() || name == "." || name.contains(['/', '\0']) || !seen.insert(name) {
            let message = format!("`{name}` cannot name an entry, or names two");
            return Err(OutputError::mismatch(path, message));
        }
    }
    Ok(())
}
