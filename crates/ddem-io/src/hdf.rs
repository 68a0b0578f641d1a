//! Opening and closing of HDF5 files, such that no file stays open after an error.

mod savepoint;
mod structure;

#[cfg(test)]
mod tests;

use std::fs;
use std::ops::Range;
use std::path::Path;

use hdf5::file::{FileCloseDegree, LibraryVersion};
use hdf5::types::FixedAscii;
use hdf5::{Dataset, Extent, File, FileBuilder, Group, H5Type, Location, OpenMode, SimpleExtents};

use crate::output_error::OutputError;
use crate::version::{REVISION, VERSION};
pub use savepoint::Savepoint;
pub(crate) use savepoint::append;

/// Runs `work` on the file and closes the file with all its objects, even after an error.
///
/// Errors of closing count, too: HDF5 writes its index then, and a full disk shows only there.
pub(crate) fn with_file<T>(
    path: &Path,
    mode: OpenMode,
    operation: &'static str,
    work: impl FnOnce(&File) -> Result<T, OutputError>,
) -> Result<T, OutputError> {
    if matches!(mode, OpenMode::Read | OpenMode::ReadWrite) {
        fs::metadata(path).map_err(|e| OutputError::io(path, operation, e))?;
    }
    let file = builder().open_as(path, mode).map_err(|e| refused(path, mode, operation, e))?;
    let done = work(&file).and_then(|value| match mode {
        OpenMode::Read => Ok(value),
        _ => file.flush().map(|()| value).map_err(|e| OutputError::hdf5(path, operation, e)),
    });
    let closed = file.close().map_err(|e| OutputError::hdf5(path, operation, e));
    let value = done?;
    closed.map(|()| value)
}

fn refused(
    path: &Path,
    mode: OpenMode,
    operation: &'static str,
    error: hdf5::Error,
) -> OutputError {
    match OutputError::hdf5(path, operation, error) {
        OutputError::Format { error, .. } if mode != OpenMode::Create => {
            // It may have been removed meanwhile.
            if let Err(error) = fs::metadata(path) {
                return OutputError::io(path, operation, error);
            }
            let message = format!(
                "the file is not a complete HDF5 file ({error}): restore it, or run from the start"
            );
            OutputError::unusable(path, message)
        }
        other => other,
    }
}

/// File builder. With `Earliest` as the lower bound the files have the format that `structure` knows, without a mark
/// "open for writing" that would have to be removed after a kill.
fn builder() -> FileBuilder {
    let mut builder = FileBuilder::new();
    builder.with_fapl(|access| {
        access
            .libver_bounds(LibraryVersion::Earliest, LibraryVersion::V110)
            .fclose_degree(FileCloseDegree::Strong)
            // Room in advance would be lost in each append, which opens the file anew.
            .meta_block_size(0)
            .small_data_block_size(0)
            // A kill may come between two pages of a block, but not within one. Nodes have 2096 or 2616 bytes.
            .alignment(2048, 4096)
    });
    builder
}

/// Storage of a growing dataset.
#[derive(Clone, Copy)]
pub(crate) struct Storage {
    /// Rows of one chunk.
    pub(crate) chunk: usize,
    /// Deflate level; `None` stores the numbers uncompressed. A chunk that is written again later must not be compressed:
    /// HDF5 would move it to a place that others have left.
    pub(crate) deflate: Option<u8>,
    /// True if each chunk has a checksum. A chunk that is written again later must not have one: a kill in the middle of
    /// that would make its earlier rows unreadable.
    pub(crate) checksum: bool,
}

/// Creates an empty dataset that grows along its first axis, of shape `(0)` or `(0, columns)`.
pub(crate) fn growable<T: H5Type>(
    group: &Group,
    name: &str,
    columns: Option<usize>,
    storage: Storage,
) -> hdf5::Result<()> {
    let mut builder = group.new_dataset::<T>();
    if let Some(level) = storage.deflate {
        builder = builder.shuffle().deflate(level);
    }
    if storage.checksum {
        builder = builder.fletcher32();
    }
    match columns {
        None => builder
            .chunk(storage.chunk)
            .shape(SimpleExtents::new([Extent::resizable(0)]))
            .create(name),
        Some(columns) => builder
            .chunk((storage.chunk, columns))
            .shape(SimpleExtents::new([Extent::resizable(0), Extent::fixed(columns)]))
            .create(name),
    }?;
    Ok(())
}

/// Writes whole rows chunk by chunk and ends the dataset after them. `fill` writes the numbers of the rows of a chunk,
/// counted from the first row.
///
/// HDF5 reads the rows of a chunk that is not in the file as zeros, so that whole chunks of zeros are not stored. Zeros
/// there lose their sign.
pub(crate) fn write<T>(
    group: &Group,
    name: &str,
    rows: Range<usize>,
    fill: impl Fn(Range<usize>, &mut [T]) + Sync,
) -> hdf5::Result<()>
where
    T: H5Type + Default + Copy + PartialEq + Send + Sync,
{
    let dataset = group.dataset(name)?;
    let shape = dataset.get_shape()?;
    resize(&dataset, &shape, rows.end)?;
    let columns: usize = shape[1..].iter().product();
    let chunk = dataset.chunk().and_then(|chunk| chunk.first().copied()).unwrap_or(1).max(1);
    let piece = |at: usize| at..rows.end.min((at / chunk + 1) * chunk);
    let filled = |piece: &Range<usize>, numbers: &mut Vec<T>| {
        numbers.resize(piece.len() * columns, T::default());
        if piece.is_empty() {
            return;
        }
        fill(piece.start - rows.start..piece.end - rows.start, numbers);
    };
    let store = |piece: &Range<usize>, numbers: &[T]| -> hdf5::Result<()> {
        if piece.len() == chunk && numbers.iter().all(|number| *number == T::default()) {
            return Ok(());
        }
        if shape.len() == 1 {
            return dataset.write_slice(numbers, piece.clone());
        }
        let view = ndarray::ArrayView2::from_shape((piece.len(), columns), numbers);
        dataset.write_slice(view.map_err(|e| e.to_string())?, (piece.clone(), ..))
    };
    let (mut now, mut next) = (piece(rows.start), Vec::new());
    let mut numbers = Vec::new();
    filled(&now, &mut numbers);
    while !now.is_empty() {
        let after = piece(now.end);
        // One thread computes the next chunk while another one writes this one.
        let (stored, ()) = rayon::join(|| store(&now, &numbers), || filled(&after, &mut next));
        stored?;
        std::mem::swap(&mut numbers, &mut next);
        now = after;
    }
    // Dropping a dataset would also write the buffer of HDF5, but cannot report a full disk.
    dataset.flush()
}

/// Writes one number and ends the dataset after it.
pub(crate) fn put<T: H5Type + Default + Copy + PartialEq + Send + Sync>(
    group: &Group,
    name: &str,
    row: usize,
    number: T,
) -> hdf5::Result<()> {
    write(group, name, row..row + 1, |_, numbers| numbers.fill(number))
}

fn resize(dataset: &Dataset, shape: &[usize], rows: usize) -> hdf5::Result<()> {
    match *shape {
        [_] => dataset.resize(rows),
        [_, columns] => dataset.resize((rows, columns)),
        _ => {
            let name = dataset.name();
            Err(format!(
                "`{name}` has {} dimensions: restore the file, or run the deck again",
                shape.len()
            )
            .into())
        }
    }
}

/// Adds a scalar attribute.
pub(crate) fn scalar_attribute<T: H5Type>(
    at: &Location,
    name: &str,
    value: &T,
) -> hdf5::Result<()> {
    at.new_attr::<T>().create(name)?.write_scalar(value)
}

/// Adds a short ASCII attribute of fixed length, the only kind of text that VTK reads.
pub(crate) fn word_attribute<const N: usize>(
    at: &Location,
    name: &str,
    word: &[u8; N],
) -> hdf5::Result<()> {
    let word = FixedAscii::<N>::from_ascii(word).map_err(|e| e.to_string())?;
    scalar_attribute(at, name, &word)
}

/// Adds the version of ddem that writes the file, and its revision if it is known.
pub(crate) fn origin(file: &File) -> hdf5::Result<()> {
    let word = |text: &str| FixedAscii::<32>::from_ascii(text).map_err(|e| e.to_string());
    scalar_attribute(file, "ddem_version", &word(VERSION)?)?;
    match REVISION {
        Some(revision) => scalar_attribute(file, "ddem_revision", &word(revision)?),
        None => Ok(()),
    }
}
