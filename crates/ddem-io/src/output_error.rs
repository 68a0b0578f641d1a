//! Errors of writing or reading results.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use ddem_core::ErrorCode;

/// Cause of an [`OutputError`]. It is the `source()` of the error unless the message contains it.
pub type Cause = Box<dyn std::error::Error + Send + Sync + 'static>;

/// A result file that could not be written or read. Every variant names the file.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The disk or the quota of the user is exhausted.
    #[error(
        "no space left on the disk while {operation} {} [{}]",
        path.display(), ErrorCode::FileAccess
    )]
    DiskFull {
        /// The file being written.
        path: PathBuf,
        /// Operation, as in `writing`.
        operation: &'static str,
        /// The error of the system.
        source: Cause,
    },
    /// The file or its folder does not exist. Something may have removed it during the run.
    #[error(
        "{operation} {} failed: the file or its folder is not there: make the folder, and leave both in their place \
         during a run [{}]",
        path.display(), ErrorCode::FileAccess
    )]
    Gone {
        /// The file.
        path: PathBuf,
        /// Operation, as in `writing`.
        operation: &'static str,
        /// The error of the system.
        source: Cause,
    },
    /// Another program holds the file.
    #[error(
        "{operation} {} failed: another program holds the file; close it there [{}]",
        path.display(), ErrorCode::FileAccess
    )]
    Busy {
        /// The file which is held.
        path: PathBuf,
        /// Operation, as in `writing`.
        operation: &'static str,
        /// The error of the system.
        source: Cause,
    },
    /// The system reported an error.
    #[error(
        "{operation} {} failed: {error}{} [{}]",
        path.display(), advice(operation, error), ErrorCode::FileAccess
    )]
    Io {
        /// The file.
        path: PathBuf,
        /// Operation, as in `writing`.
        operation: &'static str,
        /// The error of the system, which the message contains.
        error: io::Error,
    },
    /// The HDF5 library, or the CSV or JSON reader, reported an error.
    #[error(
        "{operation} {} failed: {error}{} [{}]",
        path.display(), advice(operation, error), ErrorCode::FileAccess
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// Operation, as in `writing`.
        operation: &'static str,
        /// The error of the library, which the message contains.
        error: Cause,
    },
    /// The file is not of the kind that its name says: it is truncated, or another program wrote it.
    #[error("{}: {message} [{}]", path.display(), ErrorCode::InvalidFile)]
    Unusable {
        /// The file.
        path: PathBuf,
        /// Description of the fault.
        message: String,
    },
    /// Another version of ddem wrote the checkpoint.
    #[error("{}: {message} [{}]", path.display(), ErrorCode::CheckpointMismatch)]
    Version {
        /// The file.
        path: PathBuf,
        /// Description of the versions.
        message: String,
    },
    /// The given data do not fit the file.
    #[error("{}: {message} [{}]", path.display(), ErrorCode::InvalidArgument)]
    Mismatch {
        /// The file.
        path: PathBuf,
        /// Description of the mismatch.
        message: String,
    },
}

ddem_core::debug_as_display!(OutputError);

impl OutputError {
    /// The file that the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::DiskFull { path, .. }
            | Self::Gone { path, .. }
            | Self::Busy { path, .. }
            | Self::Io { path, .. }
            | Self::Format { path, .. }
            | Self::Unusable { path, .. }
            | Self::Version { path, .. }
            | Self::Mismatch { path, .. } => path,
        }
    }

    /// Code of the error.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Unusable { .. } => ErrorCode::InvalidFile,
            Self::Version { .. } => ErrorCode::CheckpointMismatch,
            Self::Mismatch { .. } => ErrorCode::InvalidArgument,
            _ => ErrorCode::FileAccess,
        }
    }

    /// True if a file would be larger than the system allows this program to write.
    pub fn is_beyond_limit(&self) -> bool {
        matches!(self, Self::Io { error, .. } if error.kind() == io::ErrorKind::FileTooLarge)
    }

    pub(crate) fn io(path: &Path, operation: &'static str, source: io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                Self::DiskFull { path, operation, source: source.into() }
            }
            io::ErrorKind::NotFound if WRITING.contains(&operation) => {
                Self::Gone { path, operation, source: source.into() }
            }
            _ => Self::Io { path, operation, error: source },
        }
    }

    /// Error from HDF5, which reports the cause only in words, including those of the system.
    pub(crate) fn hdf5(path: &Path, operation: &'static str, source: hdf5::Error) -> Self {
        if let hdf5::Error::Internal(message) = &source {
            return Self::unusable(path, message.clone());
        }
        let path = path.to_owned();
        let words = all_frames(&source);
        let has = |word: &str| words.contains(word);
        if has("errno = 2,") && WRITING.contains(&operation) {
            return Self::Gone { path, operation, source: source.into() };
        }
        if has("No space left") || has("errno = 28,") || has("quota exceeded") {
            Self::DiskFull { path, operation, source: source.into() }
        } else if has("unable to lock file") {
            Self::Busy { path, operation, source: source.into() }
        } else {
            Self::Format { path, operation, error: source.into() }
        }
    }

    pub(crate) fn csv(path: &Path, operation: &'static str, source: csv::Error) -> Self {
        let words = source.to_string();
        match source.into_kind() {
            csv::ErrorKind::Io(source) => Self::io(path, operation, source),
            _ => Self::Format { path: path.to_owned(), operation, error: words.into() },
        }
    }

    pub(crate) fn unusable(path: &Path, message: impl Into<String>) -> Self {
        Self::Unusable { path: path.to_owned(), message: message.into() }
    }

    pub(crate) fn mismatch(path: &Path, message: impl Into<String>) -> Self {
        Self::Mismatch { path: path.to_owned(), message: message.into() }
    }
}

/// Operations that write a file. If it is not found, its folder is missing.
const WRITING: [&str; 4] = ["writing", "saving", "replacing", "copying"];

/// Advice on a failed operation. Only a run that is resumed reopens its files.
fn advice(operation: &str, error: &impl Display) -> &'static str {
    if error.to_string().contains("File too large") {
        ": raise the limit on the size of files (`ulimit -f`)"
    } else if WRITING.contains(&operation) && is_protected(&error.to_string()) {
        ": leave the file and its folder writable during a run"
    } else if operation == "reopening" {
        ": restore the file, or run from the start"
    } else {
        ""
    }
}

fn is_protected(error: &str) -> bool {
    ["Permission denied", "Read-only file system"].iter().any(|words| error.contains(words))
}

/// Every message of an HDF5 error, from the outermost to the system call that failed.
fn all_frames(error: &hdf5::Error) -> String {
    match error {
        hdf5::Error::Internal(message) => message.clone(),
        hdf5::Error::HDF5(stack) => match stack.clone().expand() {
            Ok(frames) => frames.iter().map(|f| f.desc()).collect::<Vec<_>>().join("; "),
            Err(_) => String::new(),
        },
    }
}
