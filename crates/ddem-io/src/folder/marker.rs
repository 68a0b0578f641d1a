//! Marker file `ddem.json`, which names the deck of the results and holds the lock of the folder.

use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{FolderError, MARKER, foreign, not_writable};

/// Contents of the marker file.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Marker {
    pub(super) deck: String,
    pub(super) title: String,
    pub(super) text: String,
}

/// Marker file, locked, and its contents; `None` if there is none. A run that was killed before it wrote its marker
/// leaves an empty one, without contents.
pub(super) fn find_marker(folder: &Path) -> Result<Option<(File, Option<Marker>)>, FolderError> {
    let path = folder.join(MARKER);
    if !path.try_exists().map_err(|e| not_writable(&path, "reading", e))? {
        return Ok(None);
    }
    let mut file = File::options()
        .read(true)
        .write(true)
        .open(&path)
        .map_err(|e| not_writable(&path, "opening", e))?;
    lock(folder, &file)?;
    let mut text = String::new();
    let marker = match file.read_to_string(&mut text) {
        Ok(0) => return Ok(Some((file, None))),
        Ok(_) => serde_json::from_str(&text).ok(),
        Err(_) => None,
    };
    marker.map(|marker| Some((file, Some(marker)))).ok_or_else(|| foreign(folder, MARKER))
}

/// Locks the folder for this process. Some network file systems have no locks; there the run
/// continues without one.
fn lock(folder: &Path, marker: &File) -> Result<(), FolderError> {
    match marker.try_lock() {
        Err(TryLockError::WouldBlock) => Err(FolderError::InUse { folder: folder.to_owned() }),
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

pub(super) fn create_marker(folder: &Path) -> Result<File, FolderError> {
    let path = folder.join(MARKER);
    // `create_new` ensures that one of two simultaneous runs finds the file of the other.
    let file = File::create_new(&path).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists => FolderError::InUse { folder: folder.to_owned() },
        _ => not_writable(&path, "creating", e),
    })?;
    lock(folder, &file)?;
    Ok(file)
}

/// Rewrites the marker in place, since replacing the file would leave its lock behind.
pub(super) fn write_marker(
    folder: &Path,
    file: &mut File,
    marker: &Marker,
) -> Result<(), FolderError> {
    let path = folder.join(MARKER);
    let writing = |e| not_writable(&path, "writing", e);
    let mut text = serde_json::to_vec_pretty(marker).map_err(|e| writing(e.into()))?;
    text.push(b'\n');
    file.set_len(0).map_err(writing)?;
    std::io::Seek::rewind(file).map_err(writing)?;
    file.write_all(&text).and_then(|()| file.sync_all()).map_err(writing)
}
