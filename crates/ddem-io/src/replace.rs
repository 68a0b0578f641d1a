//! Replacement of files: a file is always either the old one or the complete new one.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use crate::output_error::OutputError;

/// Path of a file that will replace another one, or become a part of it. It is in the same folder, so
/// that the rename does not cross file systems.
pub(crate) fn temporary(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    path.with_file_name(name)
}

/// Replaces `path` durably by the file that `write` writes under the temporary name.
///
/// If anything fails, the old file is unchanged and the temporary one is removed.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&Path) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let part = temporary(path);
    // If the file cannot be created, the error of the system is clearer than that of the libraries.
    File::create(&part).map_err(|e| OutputError::io(path, "writing", e))?;
    let done = write(&part)
        .and_then(|()| sync(&part))
        .and_then(|()| fs::rename(&part, path).map_err(|e| OutputError::io(path, "replacing", e)));
    if done.is_err() {
        // The first error is the one to report; the next attempt overwrites the remains.
        let _ = fs::remove_file(&part);
        return done;
    }
    sync_folder(path);
    done
}

/// Gives the file at `path` a second name, so that its next version does not remove it.
///
/// A kill at any moment leaves the file under one of the names. Errors are ignored: the next version is then the only
/// one, as it is on file systems without links that cannot rename it either.
pub(crate) fn keep_previous(path: &Path, previous: &Path) {
    if path.exists() {
        let _ = fs::remove_file(previous);
        if fs::hard_link(path, previous).is_err() {
            let _ = fs::rename(path, previous);
        }
    }
}

/// Waits until the file is on the disk.
pub(crate) fn sync(path: &Path) -> Result<(), OutputError> {
    // Windows syncs only through a handle that may write.
    File::options()
        .read(true)
        .write(true)
        .open(path)
        .and_then(|file| file.sync_all())
        .map_err(|e| OutputError::io(path, "saving", e))
}

/// Makes the new name itself durable. Some systems and file systems cannot do that; it is no error,
/// because the file is complete in any case.
fn sync_folder(path: &Path) {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// Writes to a file even if a viewer holds it.
///
/// A viewer locks the file that it shows. To avoid a failure after hours of a run, a copy replaces
/// the file. The viewer keeps its open file and finds the new one when it loads it again.
pub(crate) fn unless_busy<T>(
    path: &Path,
    mut write: impl FnMut() -> Result<T, OutputError>,
) -> Result<T, OutputError> {
    match write() {
        Err(OutputError::Busy { .. }) => {
            replace(path, |part| {
                fs::copy(path, part).map(|_| ()).map_err(|e| OutputError::io(path, "copying", e))
            })?;
            write()
        }
        done => done,
    }
}
