//! Room at the end of a file, made before HDF5 needs it.
//!
//! A file that HDF5 cannot complete may never open again: its first block then names a length that it does not have. On
//! a full disk a step is therefore refused before it begins.

use std::fs::File;
use std::io;
use std::path::Path;

use hdf5::OpenMode;

use crate::hdf::{mend_length, set_end, with_file};
use crate::output_error::OutputError;

/// Work on an open file.
type FileWork<'a> = &'a dyn Fn(&hdf5::File) -> hdf5::Result<()>;

/// Adds to a file, for which it reserves a number of bytes: `write` writes data, and `count` makes readers count them. A
/// process that is killed at any moment leaves a file that opens.
///
/// HDF5 writes the length of the file after its index, and cuts the file before both. The length on the disk must never be
/// less than an address of the index, nor more than that of the file. While data are written, it is therefore that with
/// the room, and afterwards that of the data.
pub(crate) fn with_room(
    path: &Path,
    bytes: u64,
    write: FileWork<'_>,
    count: FileWork<'_>,
) -> Result<(), OutputError> {
    let io = |e| OutputError::io(path, "writing", e);
    let hdf5 = |e| OutputError::hdf5(path, "writing", e);
    let end = with_file(path, OpenMode::ReadWrite, "writing", |file| {
        // HDF5 does not know of the room: it has the file open.
        reserve(path, bytes).map_err(io)?;
        mend_length(path).map_err(io)?;
        write(file).map_err(hdf5)?;
        set_end(path, file.size()).map_err(io)?;
        // Data count only once they are complete in the file.
        file.flush().and_then(|()| count(file)).map_err(hdf5)?;
        Ok(file.size())
    })?;
    give_back(path, end).map_err(io)
}

/// Checks that the disk, and the limit of the size of files, have room for a new file that HDF5 will write at `part`, in
/// place of `path`. HDF5 does not survive a file whose first bytes it cannot write: closing it ends the program.
pub(crate) fn check(part: &Path, path: &Path, bytes: u64) -> Result<(), OutputError> {
    let emptied = |file: File| file.set_len(0);
    reserve(part, bytes)
        .and_then(|()| File::options().write(true).open(part).and_then(emptied))
        .map_err(|e| OutputError::io(path, "writing", e))
}

/// Cuts a file at its end.
fn give_back(path: &Path, end: u64) -> io::Result<()> {
    let file = File::options().write(true).open(path)?;
    if file.metadata()?.len() > end { file.set_len(end) } else { Ok(()) }
}

/// Makes a file longer by a number of bytes, which the disk then holds where the system can tell.
fn reserve(path: &Path, bytes: u64) -> io::Result<()> {
    let file = File::options().write(true).open(path)?;
    let end = file.metadata()?.len();
    let reserved = allocate(&file, end, bytes);
    if reserved.is_err() {
        // A part may have been reserved.
        file.set_len(end)?;
    }
    reserved
}

#[cfg(target_os = "linux")]
fn allocate(file: &File, end: u64, bytes: u64) -> io::Result<()> {
    use nix::errno::Errno;
    use nix::fcntl::{FallocateFlags, fallocate};
    let offset = |n: u64| n.try_into().map_err(io::Error::other);
    match fallocate(file, FallocateFlags::empty(), offset(end)?, offset(bytes)?) {
        // Some file systems cannot reserve.
        Err(Errno::EOPNOTSUPP | Errno::ENOSYS) => file.set_len(end.saturating_add(bytes)),
        done => done.map_err(io::Error::from),
    }
}

/// Other systems have no common way to reserve bytes of the disk.
#[cfg(not(target_os = "linux"))]
fn allocate(file: &File, end: u64, bytes: u64) -> io::Result<()> {
    file.set_len(end.saturating_add(bytes))
}
