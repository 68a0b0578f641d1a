//! Seal at the end of a file: a mark, and the CRC-32 of all bytes before the seal.
//!
//! A CRC-32 detects every change within 32 bits in a row, and misses one of four billion others.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use crc32fast::Hasher;

const MARK: &[u8; 12] = b"ddem crc-32:";
const LENGTH: usize = MARK.len() + 4;

/// Number of bytes that are read at once.
const PART: usize = 1 << 20;

/// State of the seal of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seal {
    /// The file is as it was written.
    Whole,
    /// Bytes have changed.
    Wrong,
    /// The file has no seal.
    Missing,
}

/// Adds the seal to a complete file.
pub(super) fn add(path: &Path) -> io::Result<()> {
    let mut file = File::options().read(true).append(true).open(path)?;
    let checksum = checksum(&mut file, u64::MAX)?;
    file.write_all(MARK)?;
    file.write_all(&checksum.to_le_bytes())
}

/// Compares a file with its seal.
pub(super) fn state(path: &Path) -> io::Result<Seal> {
    let mut file = File::open(path)?;
    let Some(size) = file.metadata()?.len().checked_sub(LENGTH as u64) else {
        return Ok(Seal::Missing);
    };
    let mut end = [0; LENGTH];
    file.seek(SeekFrom::Start(size))?;
    file.read_exact(&mut end)?;
    let Some(expected) = end.strip_prefix(MARK) else { return Ok(Seal::Missing) };
    file.rewind()?;
    let found = checksum(&mut file, size)?.to_le_bytes();
    Ok(if found == *expected { Seal::Whole } else { Seal::Wrong })
}

/// CRC-32 of the first bytes of a file.
fn checksum(file: &mut File, bytes: u64) -> io::Result<u32> {
    let mut hasher = Hasher::new();
    let mut reader = file.take(bytes);
    let mut part = vec![0; PART];
    loop {
        match reader.read(&mut part)? {
            0 => return Ok(hasher.finalize()),
            read => hasher.update(&part[..read]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of CRC-32 (ISO 3309) is that of the nine digits.
    #[test]
    fn seal_has_the_standard_checksum() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("digits");
        std::fs::write(&path, "123456789").unwrap();
        assert_eq!(state(&path).unwrap(), Seal::Missing);
        add(&path).unwrap();
        let mut sealed = b"123456789ddem crc-32:".to_vec();
        sealed.extend(0xCBF4_3926_u32.to_le_bytes());
        assert_eq!(std::fs::read(&path).unwrap(), sealed);
        assert_eq!(state(&path).unwrap(), Seal::Whole);
    }
}
