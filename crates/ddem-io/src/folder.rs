//! Folder of the results: the deck to which it belongs, and its files.
//!
//! `ddem.json` in the folder names the deck of the results. It prevents one deck from overwriting
//! the results of another, and a resumed run from continuing with a changed deck. A new run moves
//! earlier results to a folder beside it.

mod in_place;
mod marker;

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

pub(crate) use self::in_place::check_in_place;
use self::in_place::try_writing;
use self::marker::{Marker, create_marker, find_marker, write_marker};
use crate::output_error::OutputError;
use crate::replace::temporary;
use ddem_core::ErrorCode;

const MARKER: &str = "ddem.json";
const BLOCKS: &str = "blocks.vtkhdf";
const CELLS: &str = "blocks.csv";
const FRACTURES: &str = "fractures.csv";
const JOINTS: &str = "joints.vtkhdf";
const CONTACTS: &str = "contacts.vtkhdf";
const PROBES: &str = "probes.csv";
const ENERGY: &str = "energy.csv";
const FRAGMENTS: &str = "fragments.csv";
pub(crate) const FRAMES: &str = "frames.csv";
/// Name of the summary in a folder of results.
pub const SUMMARY: &str = "summary.json";
/// Name of the status in a folder of results.
pub const STATUS: &str = "status.json";
pub(crate) const CHECKPOINT: &str = "checkpoint.h5";
const PREVIOUS: &str = "checkpoint-previous.h5";
/// Names of all results. Checkpoints come first: they are removed before the files that they continue, and moved after
/// them.
const RESULTS: [&str; 13] = [
    CHECKPOINT, PREVIOUS, BLOCKS, CELLS, FRACTURES, JOINTS, CONTACTS, PROBES, ENERGY, FRAGMENTS,
    FRAMES, SUMMARY, STATUS,
];

/// Reason why a folder cannot take the results; nothing was written. The message states the fact only: the remedy
/// depends on the program's options for the folder and [`Earlier`].
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// The results in it come from another deck.
    #[error(
        "{} holds the results of another deck, {deck}{} [{}]",
        folder.display(), quoted(title), ErrorCode::ResultsFolder
    )]
    OtherDeck {
        /// The folder.
        folder: PathBuf,
        /// File name of the deck.
        deck: String,
        /// Title of the deck.
        title: String,
    },
    /// A file has the name of a result, but nothing shows that this program wrote it.
    #[error(
        "{} holds {file}, which ddem did not write [{}]",
        folder.display(), ErrorCode::ResultsFolder
    )]
    ForeignFile {
        /// The folder.
        folder: PathBuf,
        /// Name of the file.
        file: String,
    },
    /// The path names a file.
    #[error("{} is a file, not a folder [{}]", folder.display(), ErrorCode::ResultsFolder)]
    NotAFolder {
        /// The path.
        folder: PathBuf,
    },
    /// Another run is writing its results there.
    #[error("another run is writing to {} [{}]", folder.display(), ErrorCode::ResultsFolder)]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder holds no checkpoint to resume.
    #[error("{} holds no checkpoint to resume [{}]", folder.display(), ErrorCode::ResultsFolder)]
    NothingToResume {
        /// The folder.
        folder: PathBuf,
    },
    /// The deck is not the one the run was started with.
    #[error(
        "the deck has changed since the run in {} started; a run resumes with the same deck only [{}]",
        folder.display(),
        ErrorCode::ResultsFolder
    )]
    DeckChanged {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder cannot be created or written to.
    #[error(transparent)]
    NotWritable {
        /// The cause, which names the file.
        source: OutputError,
    },
}

ddem_core::debug_as_display!(FolderError);

impl FolderError {
    /// Code of the error.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::NotWritable { source } => source.code(),
            _ => ErrorCode::ResultsFolder,
        }
    }
}

/// Treatment of the results that a folder holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Earlier {
    /// Earlier results are moved to a folder beside it, `NAME.1` or the next free number.
    #[default]
    Keep,
    /// Earlier results are removed if they belong to the same deck, by file name and title.
    Overwrite,
    /// The run continues them; the text of the deck must be the same. Without a checkpoint, as after a kill in its first
    /// second, it starts from the beginning.
    Resume,
    /// The session that wrote them continues them; the checkpoint must be there.
    Reopen,
}

/// Folder that is ready for results. While this value exists, no other run can use the folder.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    kept: Option<PathBuf>,
    /// Holds the lock.
    _marker: File,
}

/// Prepares the folder at `out` for the results of a deck, and creates it if necessary. Files that
/// are not results remain.
///
/// # Errors
///
/// [`FolderError`] gives the reason why the folder cannot be used. The folder is then unchanged.
pub fn prepare(
    out: &Path,
    deck_name: &str,
    title: &str,
    deck_text: &str,
    earlier: Earlier,
) -> Result<Folder, FolderError> {
    let path = out.to_owned();
    if path.exists() && !path.is_dir() {
        return Err(FolderError::NotAFolder { folder: path });
    }
    let wanted =
        Marker { deck: deck_name.to_owned(), title: title.to_owned(), text: deck_text.to_owned() };
    let found = find_marker(&path)?;
    check(&path, found.as_ref().and_then(|(_, marker)| marker.as_ref()), &wanted, earlier)?;
    fs::create_dir_all(&path).map_err(|e| not_writable(&path, "creating", e))?;
    try_writing(&path).map_err(|e| not_writable(&path, "writing to", e))?;
    let kept = match (earlier, &found) {
        (Earlier::Keep, Some((_, Some(marker)))) => keep(&path, marker)?,
        _ => None,
    };
    let mut file = match found {
        Some((file, _)) => file,
        None => create_marker(&path)?,
    };
    let resumes = match earlier {
        Earlier::Keep | Earlier::Overwrite => false,
        Earlier::Resume => has_checkpoint(&path),
        Earlier::Reopen => true,
    };
    if !resumes {
        remove_results(&path)?;
        write_marker(&path, &mut file, &wanted)?;
    }
    Ok(Folder { path, kept, _marker: file })
}

impl Folder {
    /// Folder to which earlier results were moved, if there were any.
    pub fn kept(&self) -> Option<&Path> {
        self.kept.as_deref()
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// `blocks.vtkhdf`.
    pub fn blocks(&self) -> PathBuf {
        self.path.join(BLOCKS)
    }

    /// `blocks.csv`.
    pub fn cells(&self) -> PathBuf {
        self.path.join(CELLS)
    }

    /// `fractures.csv`.
    pub fn fractures(&self) -> PathBuf {
        self.path.join(FRACTURES)
    }

    /// `joints.vtkhdf`.
    pub fn joints(&self) -> PathBuf {
        self.path.join(JOINTS)
    }

    /// `contacts.vtkhdf`.
    pub fn contacts(&self) -> PathBuf {
        self.path.join(CONTACTS)
    }

    /// `probes.csv`.
    pub fn probes(&self) -> PathBuf {
        self.path.join(PROBES)
    }

    /// `energy.csv`.
    pub fn energy(&self) -> PathBuf {
        self.path.join(ENERGY)
    }

    /// `fragments.csv`.
    pub fn fragments(&self) -> PathBuf {
        self.path.join(FRAGMENTS)
    }

    /// `frames.csv`.
    pub fn frames(&self) -> PathBuf {
        self.path.join(FRAMES)
    }

    /// `summary.json`.
    pub fn summary(&self) -> PathBuf {
        self.path.join(SUMMARY)
    }

    /// `checkpoint.h5`.
    pub fn checkpoint(&self) -> PathBuf {
        self.path.join(CHECKPOINT)
    }

    /// `checkpoint-previous.h5`.
    pub fn previous_checkpoint(&self) -> PathBuf {
        self.path.join(PREVIOUS)
    }
}

/// True if a run holds the lock of a folder.
pub(crate) fn in_use(folder: &Path) -> bool {
    // A shared lock disturbs no other reader. It ends with the file.
    let marker = File::open(folder.join(MARKER));
    marker.is_ok_and(|marker| matches!(marker.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// True if a folder has a checkpoint from which a run can continue.
pub(crate) fn has_checkpoint(folder: &Path) -> bool {
    [CHECKPOINT, PREVIOUS].iter().any(|name| folder.join(name).exists())
}

fn not_writable(path: &Path, operation: &'static str, source: std::io::Error) -> FolderError {
    FolderError::NotWritable { source: OutputError::io(path, operation, source) }
}

/// Title in quotes after a space; empty without a title.
fn quoted(title: &str) -> String {
    if title.is_empty() { String::new() } else { format!(" \"{title}\"") }
}

fn foreign(folder: &Path, file: &str) -> FolderError {
    FolderError::ForeignFile { folder: folder.to_owned(), file: file.to_owned() }
}

/// Name of an entry of a folder that results, or the next version of one, would replace.
fn found_result(folder: &Path) -> Option<String> {
    let names = RESULTS.iter().map(|name| folder.join(name));
    let mut paths = names.flat_map(|path| [temporary(&path), path]);
    // A link that leads nowhere is one, too.
    let found = paths.find(|path| path.symlink_metadata().is_ok())?;
    found.file_name().map(|name| name.to_string_lossy().into_owned())
}

fn check(
    folder: &Path,
    found: Option<&Marker>,
    wanted: &Marker,
    earlier: Earlier,
) -> Result<(), FolderError> {
    let folder_path = || folder.to_owned();
    let resume = matches!(earlier, Earlier::Resume | Earlier::Reopen);
    let Some(found) = found else {
        return match found_result(folder) {
            Some(name) => Err(foreign(folder, &name)),
            None if earlier == Earlier::Reopen => {
                Err(FolderError::NothingToResume { folder: folder_path() })
            }
            None => Ok(()),
        };
    };
    if earlier != Earlier::Keep && (&found.deck, &found.title) != (&wanted.deck, &wanted.title) {
        let (deck, title) = (found.deck.clone(), found.title.clone());
        return Err(FolderError::OtherDeck { folder: folder_path(), deck, title });
    }
    if let Some(name) = RESULTS.iter().find(|name| folder.join(name).is_dir()) {
        return Err(foreign(folder, name));
    }
    if earlier == Earlier::Reopen && !folder.join(CHECKPOINT).exists() {
        return Err(FolderError::NothingToResume { folder: folder_path() });
    }
    if resume && found.text != wanted.text {
        return Err(FolderError::DeckChanged { folder: folder_path() });
    }
    Ok(())
}

/// Moves the results in a folder, if there are any, to a folder beside it with a free number.
fn keep(folder: &Path, marker: &Marker) -> Result<Option<PathBuf>, FolderError> {
    let there: Vec<&str> = RESULTS.into_iter().filter(|name| folder.join(name).exists()).collect();
    if there.is_empty() {
        return Ok(None);
    }
    // `.` and `..` have no name of their own.
    let full = folder.canonicalize().map_err(|e| not_writable(folder, "reading", e))?;
    let name = full.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut number = 1;
    let kept = loop {
        let next = full.with_file_name(format!("{name}.{number}"));
        match fs::create_dir(&next) {
            Ok(()) => break next,
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            Err(e) => return Err(not_writable(&next, "creating", e)),
        }
    };
    let mut file = create_marker(&kept)?;
    write_marker(&kept, &mut file, marker)?;
    let moves = |from: &Path, to: &Path, name: &str| fs::rename(from.join(name), to.join(name));
    let there: Vec<&str> = there.into_iter().rev().collect();
    for (at, name) in there.iter().enumerate() {
        moves(folder, &kept, name).map_err(|e| {
            // Undo all moves, so that the results stay together.
            for name in &there[..at] {
                let _ = moves(&kept, folder, name);
            }
            let _ = fs::remove_file(kept.join(MARKER)).and_then(|()| fs::remove_dir(&kept));
            not_writable(&kept.join(name), "moving", e)
        })?;
    }
    // The path is written as the folder was given, unless that leads elsewhere, as with a link or
    // `..`.
    let near = folder.with_file_name(format!("{name}.{number}"));
    let leads_there = near.canonicalize().is_ok_and(|near| near == kept);
    Ok(Some(if leads_there { near } else { kept }))
}

fn remove_results(folder: &Path) -> Result<(), FolderError> {
    let names = RESULTS.iter().map(|name| folder.join(name));
    for path in names.flat_map(|path| [temporary(&path), path]) {
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(not_writable(&path, "removing", e));
            }
            _ => {}
        }
    }
    Ok(())
}
