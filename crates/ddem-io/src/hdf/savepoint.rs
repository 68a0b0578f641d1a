//! Appends to an HDF5 file that a kill cannot tear, and the way back to a former state of it.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use hdf5::OpenMode;
use serde::{Deserialize, Serialize};

use super::structure::{FileBlock, FilePages, Structure};
use super::with_file;
use crate::output_error::OutputError;
use crate::replace::temporary;
use crate::room;

/// Adds to a file, for which it reserves a number of bytes.
///
/// HDF5 replaces its blocks in an order of its own. A process that is killed between two of them would leave an index that
/// does not belong to its array. `work` therefore changes a copy without the data. The end of the copy is then added to the
/// file, and the changed blocks replace those of the file, in an order in which all former data stay readable. Returns the
/// state of the file before.
///
/// # Errors
///
/// The file is as before, unless the disk itself is damaged.
pub(crate) fn append(
    path: &Path,
    bytes: u64,
    work: impl FnOnce(&hdf5::File) -> hdf5::Result<()>,
) -> Result<Savepoint, OutputError> {
    let io = |e| OutputError::io(path, "writing", e);
    let file = open(path, "writing")?;
    let mut pages = FilePages::of(&file).map_err(io)?;
    let before = Structure::read(&mut pages).map_err(|e| unreadable(path, "writing", e))?;
    let copy = temporary(path);
    let changed = describe(pages, before.end, &copy).map_err(io).and_then(|()| {
        with_file(&copy, OpenMode::ReadWrite, "writing", |changed| {
            // HDF5 does not survive a full disk. It does not know of the room: it has the file open.
            room::reserve(&copy, bytes).map_err(io)?;
            work(changed).map_err(|e| OutputError::hdf5(path, "writing", e))
        })
    });
    let done = changed.and_then(|()| take_over(&file, &before, &copy).map_err(io));
    // The first error is the one to report; the next append overwrites the remains.
    let _ = fs::remove_file(&copy);
    done.map(|()| Savepoint(before))
}

/// Makes a file of the same length with the same description and without data.
fn describe(pages: FilePages<'_>, end: u64, copy: &Path) -> io::Result<()> {
    let file = File::create(copy)?;
    pages.into_blocks().try_for_each(|block| put(&file, &block))?;
    file.set_len(end)
}

/// Adds the end of the copy to the file, then replaces the blocks that differ. If that fails, the file is as before.
fn take_over(mut file: &File, before: &Structure, copy: &Path) -> io::Result<()> {
    let mut copy = File::open(copy)?;
    let mut changed = FilePages::of(&copy)?;
    let more = changed.end()?.saturating_sub(before.end);
    let changed = before.growing.iter().map(|old| changed.block(old.at, old.bytes.len()));
    let changed = changed.collect::<io::Result<Vec<_>>>()?;
    // An append that was killed may have left something.
    file.set_len(before.end)?;
    let added = room::allocate(file, before.end, more).and_then(|()| {
        file.seek(SeekFrom::Start(before.end))?;
        copy.seek(SeekFrom::Start(before.end))?;
        let copied = io::copy(&mut (&copy).take(more), &mut file)?;
        if copied < more { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(()) }
    });
    if added.is_err() {
        file.set_len(before.end)?;
        return added;
    }
    let changed = changed.iter().zip(&before.growing).filter(|(new, old)| new != old);
    let replaced = changed.map(|(new, _)| new).try_for_each(|block| put(file, block));
    if replaced.is_err() {
        // The first error is the one to report.
        let _ = restore(file, before);
    }
    replaced
}

/// Replaces the blocks by former ones and cuts the file at its former end.
fn restore(file: &File, structure: &Structure) -> io::Result<()> {
    structure.growing.iter().rev().try_for_each(|block| put(file, block))?;
    file.set_len(structure.end)
}

fn put(mut file: &File, block: &FileBlock) -> io::Result<()> {
    file.seek(SeekFrom::Start(block.at))?;
    file.write_all(&block.bytes)
}

/// State of a file to which it can return after more was appended to it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Savepoint(Structure);

impl Savepoint {
    /// State of a file between two appends.
    pub(crate) fn of(path: &Path) -> Result<Self, OutputError> {
        let file = File::open(path).map_err(|e| OutputError::io(path, "saving", e))?;
        let structure = FilePages::of(&file).and_then(|mut pages| Structure::read(&mut pages));
        structure.map(Self).map_err(|e| unreadable(path, "saving", e))
    }

    /// Brings a file back to this state, also after a kill in the middle of an append.
    pub(crate) fn roll_back(&self, path: &Path) -> Result<(), OutputError> {
        let Self(structure) = self;
        let file = open(path, "reopening")?;
        let length = file.metadata().map_err(|e| OutputError::io(path, "reopening", e))?.len();
        if length < structure.end {
            let message = format!(
                "the file has {length} bytes, but the run to resume had written {}: restore it, or run from the start",
                structure.end
            );
            return Err(OutputError::unusable(path, message));
        }
        let mut pages = FilePages::of(&file).map_err(|e| OutputError::io(path, "reopening", e))?;
        let mut is_same = |block: &FileBlock| {
            pages.block(block.at, block.bytes.len()).is_ok_and(|now| now == *block)
        };
        if !structure.fixed.iter().all(&mut is_same) {
            let message = "the file is damaged, or not the one that the run to resume has written: restore it, or run from \
                           the start";
            return Err(OutputError::unusable(path, message));
        }
        restore(&file, structure).map_err(|e| OutputError::io(path, "reopening", e))
    }
}

/// Opens a file and locks it, as HDF5 does, against viewers that read it.
fn open(path: &Path, operation: &'static str) -> Result<File, OutputError> {
    let file = File::options().read(true).write(true).open(path);
    let file = file.map_err(|e| OutputError::io(path, operation, e))?;
    match file.try_lock() {
        Err(fs::TryLockError::WouldBlock) => {
            let (path, source) = (path.to_owned(), io::Error::from(io::ErrorKind::WouldBlock));
            Err(OutputError::Busy { path, operation, source: source.into() })
        }
        // Some file systems have no locks.
        _ => Ok(file),
    }
}

fn unreadable(path: &Path, operation: &'static str, error: io::Error) -> OutputError {
    match error.kind() {
        io::ErrorKind::InvalidData => {
            let message =
                format!("the file is damaged ({error}): restore it, or run from the start");
            OutputError::unusable(path, message)
        }
        _ => OutputError::io(path, operation, error),
    }
}
