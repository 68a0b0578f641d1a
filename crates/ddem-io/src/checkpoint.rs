//! `checkpoint.h5`: the state of a run, with which it resumes bit for bit.
//!
//! ```text
//! /         attributes format = "ddem checkpoint", version = 13, and the version of ddem
//! /deck     the text of the deck
//! /run      progress of the run and its files
//! /state    the simulation
//! ```
//!
//! Each dataset holds bytes, whose meaning the caller defines. After the HDF5 file follows a seal with the checksum of all
//! of it: HDF5 never reads a damaged file, and readers of HDF5 ignore the seal.

mod seal;

use std::io::{self, Write};
use std::path::Path;

use hdf5::types::FixedAscii;
use hdf5::{Dataset, File, OpenMode, Result};

use self::seal::Seal;
use crate::hdf::{origin, scalar_attribute, with_file, word_attribute};
use crate::output_error::OutputError;
use crate::replace::replace;
use crate::room;

/// Format name, which identifies checkpoints of ddem.
const FORMAT: &[u8; 15] = b"ddem checkpoint";

/// Version of the format, which grows when older files can no longer be read.
const VERSION: u64 = 13;

/// Message about a path that is not a file.
const FOLDER: &str = "it is a folder: give the file, such as checkpoint.h5";

/// Number of bytes that are written at once.
const CHUNK: usize = 1 << 20;

/// Contents of a checkpoint.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Checkpoint {
    /// Text of the deck.
    pub deck: String,
    /// Progress of the run.
    pub run: Vec<u8>,
    /// State of the simulation.
    pub state: Vec<u8>,
}

/// Saves a checkpoint from borrowed bytes, without copying them. The new file replaces the file at
/// `path` once it is complete and on the disk. If anything fails, the old file remains.
///
/// # Errors
///
/// The file cannot be written.
pub fn save(
    path: impl AsRef<Path>,
    deck: &str,
    run: &[u8],
    state: &[u8],
) -> std::result::Result<(), OutputError> {
    stream(path, deck, run, state.len(), |out| out.write_all(state))
}

/// Saves a checkpoint whose state of known size is written piece by piece. The state is never held
/// in memory as a whole.
///
/// # Errors
///
/// The file cannot be written.
pub fn stream(
    path: impl AsRef<Path>,
    deck: &str,
    run: &[u8],
    size: usize,
    state: impl Fn(&mut dyn Write) -> io::Result<()>,
) -> std::result::Result<(), OutputError> {
    let path = path.as_ref();
    let fill = |file: &File| -> Result<()> {
        word_attribute(file, "format", FORMAT)?;
        scalar_attribute(file, "version", &VERSION)?;
        origin(file)?;
        for (name, bytes) in [("deck", deck.as_bytes()), ("run", run)] {
            store(file, name, bytes.len(), &|out: &mut dyn Write| out.write_all(bytes))?;
        }
        store(file, "state", size, &state)
    };
    replace(path, |part| {
        // The last chunk of each of the three may be in part empty.
        let bytes = deck.len() + run.len() + size + 3 * CHUNK;
        room::check(part, path, bytes as u64)?;
        with_file(part, OpenMode::Create, "saving", |file| {
            fill(file).map_err(|e| OutputError::hdf5(path, "saving", e))
        })?;
        seal::add(part).map_err(|e| OutputError::io(path, "saving", e))
    })
}

impl Checkpoint {
    /// Loads a checkpoint.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if the file is damaged or not a checkpoint, [`OutputError::Version`]
    /// if another version of ddem wrote it.
    pub fn load(path: impl AsRef<Path>) -> std::result::Result<Self, OutputError> {
        let path = path.as_ref();
        let unusable = |e: String| OutputError::unusable(path, e);
        let metadata = std::fs::metadata(path).map_err(|e| OutputError::io(path, "loading", e))?;
        if metadata.is_dir() {
            let error = std::io::Error::new(std::io::ErrorKind::IsADirectory, FOLDER);
            return Err(OutputError::io(path, "loading", error));
        }
        let size = metadata.len();
        let damaged = |why: &str| {
            unusable(format!(
                "the checkpoint is damaged ({why}): use another one, or run from the start"
            ))
        };
        let seal = seal::state(path).map_err(|e| OutputError::io(path, "loading", e))?;
        if seal == Seal::Wrong {
            return Err(damaged("its checksum does not match"));
        }
        with_file(path, OpenMode::Read, "loading", |file| {
            check_format(file, path)?;
            // Files of other formats or programs have no seal.
            if seal == Seal::Missing {
                return Err(damaged("its end is missing"));
            }
            read(file, size).map_err(|e| damaged(&e.to_string()))
        })
    }
}

fn check_format(file: &File, path: &Path) -> std::result::Result<(), OutputError> {
    let format = file.attr("format").and_then(|a| a.read_scalar::<FixedAscii<15>>());
    if format.ok().is_none_or(|f| f.as_bytes() != FORMAT) {
        return Err(OutputError::unusable(path, "the file is not a checkpoint of ddem: give one"));
    }
    match file.attr("version").and_then(|a| a.read_scalar::<u64>()) {
        Ok(VERSION) => Ok(()),
        Ok(version) => {
            let other = if version < VERSION { "an earlier" } else { "a later" };
            let message = format!(
                "the checkpoint has format {version}, written by {other} version of ddem; this one reads format {VERSION}: \
                 resume with the version that wrote it, or run from the start"
            );
            Err(OutputError::Version { path: path.to_owned(), message })
        }
        Err(e) => Err(OutputError::unusable(
            path,
            format!(
                "the checkpoint has no format number ({e}): use another one, or run from the start"
            ),
        )),
    }
}

fn read(file: &File, size: u64) -> Result<Checkpoint> {
    let deck = String::from_utf8(fetch(file, "deck", size)?).map_err(|e| format!("`deck`: {e}"))?;
    Ok(Checkpoint { deck, run: fetch(file, "run", size)?, state: fetch(file, "state", size)? })
}

/// Writer that collects bytes and writes them to a dataset in chunks.
struct Parts<'a> {
    dataset: &'a Dataset,
    /// Bytes that are not yet in the dataset.
    part: Vec<u8>,
    /// Number of bytes in the dataset.
    at: usize,
    error: Option<hdf5::Error>,
}

impl Write for Parts<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = bytes.len().min(CHUNK - self.part.len());
        self.part.extend_from_slice(&bytes[..taken]);
        if self.part.len() == CHUNK {
            self.flush()?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        let end = self.at + self.part.len();
        if end > self.at {
            let written = self.dataset.write_slice(&self.part[..], self.at..end);
            self.error = written.err();
            self.at = end;
            self.part.clear();
        }
        if self.error.is_some() { Err(io::ErrorKind::Other.into()) } else { Ok(()) }
    }
}

type ByteSource<'a> = &'a dyn Fn(&mut dyn Write) -> io::Result<()>;

fn store(file: &File, name: &str, size: usize, bytes: ByteSource<'_>) -> Result<()> {
    let builder = file.new_dataset::<u8>().chunk(size.clamp(1, CHUNK));
    let dataset = builder.shape(size).create(name)?;
    let mut parts = Parts { dataset: &dataset, part: Vec::new(), at: 0, error: None };
    let written = bytes(&mut parts).and_then(|()| parts.flush());
    if let Some(error) = parts.error {
        return Err(error);
    }
    written.map_err(|error| hdf5::Error::from(error.to_string()))?;
    // Dropping a dataset would also write the buffer of HDF5, but cannot report a full disk.
    dataset.flush()
}

fn fetch(file: &File, name: &str, size: u64) -> Result<Vec<u8>> {
    let dataset = file.dataset(name)?;
    if !dataset.dtype()?.is::<u8>() {
        return Err(format!("`{name}` has no bytes").into());
    }
    // A damaged length must not make the program request unlimited memory.
    if dataset.size() as u64 > size {
        return Err(format!("`{name}` is longer than the file").into());
    }
    dataset.read_raw::<u8>()
}
