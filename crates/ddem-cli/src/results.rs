//! Results of a run, read from its folder.

use std::path::{Path, PathBuf};

use ddem_core::ErrorCode;
use ddem_io::OutputError;
use ddem_io::folder::{STATUS, SUMMARY};
use ddem_io::summary::Summary;

/// Reason why a folder has no results.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoResults {
    /// There is no such folder.
    #[error(
        "there is no folder `{}`{} [{}]",
        folder.display(), meant(near.as_deref()), ErrorCode::ResultsFolder
    )]
    Missing {
        /// The folder.
        folder: PathBuf,
        /// Folder that was probably meant.
        near: Option<PathBuf>,
    },
    /// The path is a file.
    #[error(
        "`{}` is a file: give the folder of the results, such as `{}` [{}]",
        file.display(), likely.display(), ErrorCode::ResultsFolder
    )]
    File {
        /// The file.
        file: PathBuf,
        /// Folder of the results of a deck of this name.
        likely: PathBuf,
    },
    /// No run has completed a stage in the folder.
    #[error(
        "`{}` has no {SUMMARY}: no run has ended a stage there; give the folder of one that has [{}]",
        folder.display(), ErrorCode::ResultsFolder
    )]
    Nothing {
        /// The folder.
        folder: PathBuf,
    },
    /// No run of a deck has begun in the folder.
    #[error(
        "`{}` has no {STATUS}: no run of a deck has begun a stage there; give the folder of one that has [{}]",
        folder.display(), ErrorCode::ResultsFolder
    )]
    NoStatus {
        /// The folder.
        folder: PathBuf,
    },
    /// The summary cannot be read.
    #[error(transparent)]
    Unreadable(#[from] OutputError),
}

fn meant(near: Option<&Path>) -> String {
    match near {
        Some(near) => format!(", did you mean `{}`?", near.display()),
        None => ": give that of the results of a run".to_owned(),
    }
}

/// Summary of the run in a folder, as text.
pub(crate) fn info(folder: &Path) -> Result<String, NoResults> {
    let path = summary_path(folder)?;
    Ok(printable(&Summary::read(path)?.to_string()))
}

/// Text without characters that a terminal obeys: another program may have written the file.
pub(crate) fn printable(text: &str) -> String {
    text.replace(|letter: char| letter.is_control() && !matches!(letter, '\n' | '\t'), "\u{fffd}")
}

/// Path of the summary in a folder of results.
fn summary_path(folder: &Path) -> Result<PathBuf, NoResults> {
    is_folder(folder)?;
    let path = folder.join(SUMMARY);
    if !path.exists() {
        return Err(NoResults::Nothing { folder: folder.to_owned() });
    }
    Ok(path)
}

/// Checks that the folder exists.
pub(crate) fn is_folder(folder: &Path) -> Result<(), NoResults> {
    if folder.is_file() {
        let likely = Path::new("results").join(folder.file_stem().unwrap_or_default());
        return Err(NoResults::File { file: folder.to_owned(), likely });
    }
    if !folder.is_dir() {
        let near = ddem_deck::near(folder, Path::is_dir);
        return Err(NoResults::Missing { folder: folder.to_owned(), near });
    }
    Ok(())
}
