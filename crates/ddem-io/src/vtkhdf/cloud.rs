//! Points whose number is another at each step.

use std::path::{Path, PathBuf};

use hdf5::{File, Group, OpenMode};

use super::create::{self, STEP_CONSTANTS, put_values};
use super::data::{self, Cells, FieldSpec, Grid, Location, Values};
use super::writer::{fits, set_steps};
use crate::hdf::{cut, put, with_file};
use crate::output_error::OutputError;
use crate::replace;

/// VTK's number of a cell that is one point.
const VERTEX: u8 = 1;
/// How many points a step has, and so how many cells.
const COUNTS: [&str; 3] = ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"];

/// Writes one VTKHDF file, step by step, in which every step has points of its own, each of them a
/// cell, so that viewers draw it.
///
/// As with [`Writer`](super::Writer) nothing is held open between the steps.
#[derive(Debug)]
pub struct Cloud {
    path: PathBuf,
    fields: Vec<FieldSpec>,
    steps: usize,
    /// Points of all steps so far.
    rows: usize,
}

impl Cloud {
    /// Creates the file with no step yet. Fields are those of points.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if names do not fit together or a field is one of cells, others if
    /// the file cannot be written.
    pub fn create(path: impl Into<PathBuf>, fields: &[FieldSpec]) -> Result<Self, OutputError> {
        let path = path.into();
        data::check(
            &path,
            &Grid { points: Vec::new(), cells: Cells::Quads(Vec::new()) },
            &[],
            fields,
        )?;
        if let Some(field) = fields.iter().find(|field| field.location != Location::Point) {
            let message =
                format!("`{}` is a field of cells, but there are points alone", field.name);
            return Err(OutputError::mismatch(&path, message));
        }
        with_file(&path, OpenMode::Create, "writing", |file| {
            create::cloud(file, fields).map_err(|e| OutputError::hdf5(&path, "writing", e))
        })?;
        Ok(Self { path, fields: fields.to_vec(), steps: 0, rows: 0 })
    }

    /// Goes on with a file after its first `steps` steps and forgets those behind.
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
        let rows = replace::unless_busy(&path, || {
            with_file(&path, OpenMode::ReadWrite, "reopening", |file| {
                reopen(&path, file, fields, steps)
            })
        })?;
        Ok(Self { path, fields: fields.to_vec(), steps, rows })
    }

    /// Adds one step at `time` `[s]`: its points `[m]`, and the values of every field, in the order
    /// of the fields.
    ///
    /// When it fails, the file still has the steps before, unless the disk itself is damaged, and
    /// the same step can be appended again.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if number, type or length of the values are not those of the
    /// fields, others if the file cannot be written.
    pub fn append(
        &mut self,
        time: f64,
        points: &[[f64; 3]],
        values: &[Values<'_>],
    ) -> Result<(), OutputError> {
        data::check_values(&self.path, &self.fields, values, |_| points.len())?;
        replace::unless_busy(&self.path, || {
            with_file(&self.path, OpenMode::ReadWrite, "writing", |file| {
                self.write(file, time, points, values)
                    .map_err(|e| OutputError::hdf5(&self.path, "writing", e))
            })
        })?;
        self.steps += 1;
        self.rows += points.len();
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

    fn write(
        &self,
        file: &File,
        time: f64,
        points: &[[f64; 3]],
        values: &[Values<'_>],
    ) -> hdf5::Result<()> {
        let root = file.group("VTKHDF")?;
        let steps = root.group("Steps")?;
        let (step, row, n) = (self.steps, self.rows, points.len());
        put(&root, "Points", row, points.as_flattened())?;
        let numbers: Vec<i64> = (0..).take(n + 1).collect();
        put(&root, "Connectivity", row, &numbers[..n])?;
        // One more for each step: where its last cell ends.
        put(&root, "Offsets", row + step, &numbers)?;
        put(&root, "Types", row, &vec![VERTEX; n])?;
        for (field, &values) in self.fields.iter().zip(values) {
            put_values(&root.group(Location::Point.group())?, &field.name, row, values)?;
            let offsets = steps.group(Location::Point.offsets())?;
            put(&offsets, &field.name, step, &[whole(row)?])?;
        }
        for name in COUNTS {
            put(&root, name, step, &[whole(n)?])?;
        }
        for (name, constant, _) in STEP_CONSTANTS {
            let value = match name {
                "NumberOfParts" => constant,
                "PartOffsets" => whole(step)?,
                _ => whole(row)?,
            };
            put(&steps, name, step, &[value])?;
        }
        put(&steps, "Values", step, &[time])?;
        // Only a step that is complete in the file counts.
        file.flush()?;
        set_steps(&steps, step + 1)
    }
}

fn whole(n: usize) -> hdf5::Result<i64> {
    i64::try_from(n).map_err(|e| e.to_string().into())
}

/// Checks the file against the fields, cuts it, and tells how many points are left.
fn reopen(
    path: &Path,
    file: &File,
    fields: &[FieldSpec],
    steps: usize,
) -> Result<usize, OutputError> {
    let unusable = |e: hdf5::Error| {
        OutputError::unusable(path, format!("not a VTKHDF file with time steps ({e})"))
    };
    let root = file.group("VTKHDF").map_err(unusable)?;
    let counts = counts(&root).map_err(unusable)?;
    let have = counts.len();
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
    let rows = counts.iter().take(steps).sum();
    truncate(&root, file, fields, (steps, rows))
        .map_err(|e| OutputError::hdf5(path, "reopening", e))?;
    Ok(rows)
}

/// Points of each step that counts.
fn counts(root: &Group) -> hdf5::Result<Vec<usize>> {
    let steps = root.group("Steps")?.attr("NSteps")?.read_scalar::<i64>()?;
    let steps = usize::try_from(steps).map_err(|e| format!("NSteps: {e}"))?;
    let counts = root.dataset("NumberOfPoints")?.read_raw::<i64>()?;
    if counts.len() < steps {
        return Err(format!("{} numbers of points in {steps} steps", counts.len()).into());
    }
    let count = |n: &i64| usize::try_from(*n).map_err(|e| format!("NumberOfPoints: {e}").into());
    counts.iter().take(steps).map(count).collect()
}

fn truncate(
    root: &Group,
    file: &File,
    fields: &[FieldSpec],
    (steps, rows): (usize, usize),
) -> hdf5::Result<()> {
    let index = root.group("Steps")?;
    // The number first: a step that counts is a step that is there.
    set_steps(&index, steps)?;
    file.flush()?;
    ["Points", "Connectivity", "Types"].iter().try_for_each(|name| cut(root, name, rows))?;
    cut(root, "Offsets", rows + steps)?;
    for field in fields {
        cut(&root.group(Location::Point.group())?, &field.name, rows)?;
        cut(&index.group(Location::Point.offsets())?, &field.name, steps)?;
    }
    COUNTS.iter().try_for_each(|name| cut(root, name, steps))?;
    STEP_CONSTANTS.iter().try_for_each(|(name, ..)| cut(&index, name, steps))?;
    cut(&index, "Values", steps)
}
