//! Appending steps.

use std::path::{Path, PathBuf};

use hdf5::{File, Group, OpenMode};

use super::create::{self, STEP_CONSTANTS, put_values};
use super::data::{self, Constant, FieldSpec, Grid, Kind, Location, Values};
use crate::hdf::{cut, put, with_file};
use crate::output_error::OutputError;
use crate::replace;

/// Writes one VTKHDF file, step by step.
///
/// Nothing is held open between the steps, so there is nothing to close: dropping it is enough.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    fields: Vec<FieldSpec>,
    points: usize,
    cells: usize,
    steps: usize,
}

impl Writer {
    /// Creates the file with its mesh, its constants and no step yet.
    ///
    /// A mesh without points and cells is fine; VTK opens it as an empty one.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if sizes, point numbers or names do not fit together, others if
    /// the file cannot be written.
    pub fn create(
        path: impl Into<PathBuf>,
        grid: &Grid,
        constants: &[Constant<'_>],
        fields: &[FieldSpec],
    ) -> Result<Self, OutputError> {
        let path = path.into();
        data::check(&path, grid, constants, fields)?;
        create::create(&path, grid, constants, fields)?;
        let (points, cells) = (grid.points.len(), grid.cells.len());
        Ok(Self { path, fields: fields.to_vec(), points, cells, steps: 0 })
    }

    /// Goes on with a file after its first `steps` steps and forgets those behind.
    ///
    /// `fields` are those the file was created with, in the order of the values to come.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if the file has other fields or fewer steps,
    /// [`OutputError::Unusable`] if it is no file of this kind.
    pub fn reopen(
        path: impl Into<PathBuf>,
        fields: &[FieldSpec],
        steps: usize,
    ) -> Result<Self, OutputError> {
        let path = path.into();
        let (points, cells) = replace::unless_busy(&path, || {
            with_file(&path, OpenMode::ReadWrite, "reopening", |file| {
                reopen(&path, file, fields, steps)
            })
        })?;
        Ok(Self { path, fields: fields.to_vec(), points, cells, steps })
    }

    /// Adds one step at `time` `[s]`: the values of every field, in the order of the fields.
    ///
    /// When it fails, the file still has the steps before, unless the disk itself is damaged, and
    /// the same step can be appended again.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if number, type or length of the values are not those of the
    /// fields, others if the file cannot be written.
    pub fn append(&mut self, time: f64, values: &[Values<'_>]) -> Result<(), OutputError> {
        data::check_values(&self.path, &self.fields, values, |location| self.rows(location))?;
        replace::unless_busy(&self.path, || {
            with_file(&self.path, OpenMode::ReadWrite, "writing", |file| {
                self.write(file, time, values)
                    .map_err(|e| OutputError::hdf5(&self.path, "writing", e))
            })
        })?;
        self.steps += 1;
        Ok(())
    }

    /// Waits until the steps so far are on the disk: they then survive a power failure.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`] or [`OutputError::DiskFull`].
    pub fn sync(&self) -> Result<(), OutputError> {
        replace::sync(&self.path)
    }

    /// Steps in the file.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn rows(&self, location: Location) -> usize {
        match location {
            Location::Point => self.points,
            Location::Cell => self.cells,
        }
    }

    fn write(&self, file: &File, time: f64, values: &[Values<'_>]) -> hdf5::Result<()> {
        let root = file.group("VTKHDF")?;
        let steps = root.group("Steps")?;
        let n = self.steps;
        for (field, &values) in self.fields.iter().zip(values) {
            let row = n * self.rows(field.location);
            put_values(&root.group(field.location.group())?, &field.name, row, values)?;
            let row = i64::try_from(row).map_err(|e| e.to_string())?;
            put(&steps.group(field.location.offsets())?, &field.name, n, &[row])?;
        }
        for (name, value, _) in STEP_CONSTANTS {
            put(&steps, name, n, &[value])?;
        }
        put(&steps, "Values", n, &[time])?;
        // Only a step that is complete in the file counts.
        file.flush()?;
        set_steps(&steps, n + 1)
    }
}

pub(super) fn set_steps(steps: &Group, n: usize) -> hdf5::Result<()> {
    let n = i64::try_from(n).map_err(|e| e.to_string())?;
    steps.attr("NSteps")?.write_scalar(&n)
}

/// Checks the file against the fields, cuts it, and tells how many points and cells it has.
fn reopen(
    path: &Path,
    file: &File,
    fields: &[FieldSpec],
    steps: usize,
) -> Result<(usize, usize), OutputError> {
    let unusable = |e: hdf5::Error| {
        OutputError::unusable(path, format!("not a VTKHDF file with time steps ({e})"))
    };
    let root = file.group("VTKHDF").map_err(unusable)?;
    let (counts, have) = shape(&root).map_err(unusable)?;
    if have < steps {
        let message = format!("has {have} steps, but the run to go on with had written {steps}");
        return Err(OutputError::mismatch(path, message));
    }
    for field in fields {
        if !fits(&root, field).map_err(|e| OutputError::hdf5(path, "reopening", e))? {
            let message = format!("was written with other fields: no such `{}`", field.name);
            return Err(OutputError::mismatch(path, message));
        }
    }
    truncate(&root, file, counts, fields, steps)
        .map_err(|e| OutputError::hdf5(path, "reopening", e))?;
    Ok(counts)
}

/// Points, cells and steps of a file.
fn shape(root: &Group) -> hdf5::Result<((usize, usize), usize)> {
    let number = |name: &str| -> hdf5::Result<usize> {
        let values = root.dataset(name)?.read_raw::<i64>()?;
        let first = values.first().copied().ok_or_else(|| format!("{name} is empty"))?;
        usize::try_from(first).map_err(|e| format!("{name}: {e}").into())
    };
    let steps = root.group("Steps")?.attr("NSteps")?.read_scalar::<i64>()?;
    let steps = usize::try_from(steps).map_err(|e| format!("NSteps: {e}"))?;
    Ok(((number("NumberOfPoints")?, number("NumberOfCells")?), steps))
}

pub(super) fn fits(root: &Group, field: &FieldSpec) -> hdf5::Result<bool> {
    let group = root.group(field.location.group())?;
    let offsets = root.group("Steps")?.group(field.location.offsets())?;
    if !group.link_exists(&field.name) || !offsets.link_exists(&field.name) {
        return Ok(false);
    }
    let dataset = group.dataset(&field.name)?;
    let columns = dataset.get_shape()?.get(1).copied().unwrap_or(1);
    let kind = dataset.dtype()?;
    let same = match field.kind {
        Kind::F64 => kind.is::<f64>(),
        Kind::I32 => kind.is::<i32>(),
        Kind::U8 => kind.is::<u8>(),
    };
    Ok(same && columns == field.components)
}

fn truncate(
    root: &Group,
    file: &File,
    (points, cells): (usize, usize),
    fields: &[FieldSpec],
    steps: usize,
) -> hdf5::Result<()> {
    let index = root.group("Steps")?;
    // The number first: a step that counts is a step that is there.
    set_steps(&index, steps)?;
    file.flush()?;
    for field in fields {
        let rows = match field.location {
            Location::Point => points,
            Location::Cell => cells,
        };
        cut(&root.group(field.location.group())?, &field.name, steps * rows)?;
        cut(&index.group(field.location.offsets())?, &field.name, steps)?;
    }
    for (name, ..) in STEP_CONSTANTS {
        cut(&index, name, steps)?;
    }
    cut(&index, "Values", steps)
}
