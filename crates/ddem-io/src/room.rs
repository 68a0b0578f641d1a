//! Room on the disk, reserved before HDF5 needs it.
//!
//! A file that HDF5 cannot complete may never open again: its first block then names a length that it does not have. On
//! a full disk a step is therefore refused before it begins.

use std::io;
use std::path::Path;

/// Reserves a number of bytes after the end of a file. HDF5 gives back what it does not use when it closes the file. File
/// systems that cannot reserve have the room or report its lack later.
#[cfg(target_os = "linux")]
pub(crate) fn reserve(path: &Path, bytes: u64) -> io::Result<()> {
    use nix::errno::Errno;
    use nix::fcntl::{FallocateFlags, fallocate};
    let file = std::fs::File::options().write(true).open(path)?;
    let end = file.metadata()?.len();
    let offset = |n: u64| n.try_into().map_err(io::Error::other);
    match fallocate(&file, FallocateFlags::empty(), offset(end)?, offset(bytes)?) {
        Ok(()) | Err(Errno::EOPNOTSUPP | Errno::ENOSYS) => Ok(()),
        Err(error) => {
            // A part may have been reserved.
            file.set_len(end)?;
            Err(error.into())
        }
    }
}

/// Reserves nothing: other systems have no common way to do it.
#[cfg(not(target_os = "linux"))]
pub(crate) fn reserve(_: &Path, _: u64) -> io::Result<()> {
    Ok(())
}
