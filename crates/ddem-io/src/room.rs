//! Room on the disk, made before HDF5 needs it: it does not survive a full disk.

use std::fs::File;
use std::io;
use std::path::Path;

use crate::output_error::OutputError;

/// Checks that the disk, and the limit of the size of files, have room for a new file that HDF5 will write at `part`, in
/// place of `path`. HDF5 does not survive a file whose first bytes it cannot write: closing it ends the program.
pub(crate) fn check(part: &Path, path: &Path, bytes: u64) -> Result<(), OutputError> {
    let emptied = |file: File| file.set_len(0);
    reserve(part, bytes)
        .and_then(|()| File::options().write(true).open(part).and_then(emptied))
        .map_err(|e| OutputError::io(path, "writing", e))
}

/// Makes a file longer by a number of bytes, which the disk then holds where the system can tell.
pub(crate) fn reserve(path: &Path, bytes: u64) -> io::Result<()> {
    let file = File::options().write(true).open(path)?;
    let end = file.metadata()?.len();
    let reserved = allocate(&file, end, bytes);
    if reserved.is_err() {
        // A part may have been reserved.
        file.set_len(end)?;
    }
    reserved
}

/// Makes bytes after the `end` of a file part of it, which the disk then holds where the system can tell.
#[cfg(target_os = "linux")]
pub(crate) fn allocate(file: &File, end: u64, bytes: u64) -> io::Result<()> {
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
pub(crate) fn allocate(file: &File, end: u64, bytes: u64) -> io::Result<()> {
    file.set_len(end.saturating_add(bytes))
}
