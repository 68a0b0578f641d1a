//! Reading of VTKHDF files.

use std::path::{Path, PathBuf};

use ddem_core::counted;
use hdf5::{Dataset, Group, OpenMode};

use super::data::Location;
use super::index;
use crate::hdf::with_file;
use crate::output_error::OutputError;

/// The steps of one VTKHDF file written by this program.
///
/// Each call opens and closes the file, so a run that writes it continues undisturbed.
#[derive(Clone, Debug)]
pub struct Results {
    path: PathBuf,
}

/// The values of a field at one step.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldValues {
    /// Location of the values.
    pub location: Location,
    /// Numbers per point or cell.
    pub components: usize,
    /// The numbers, row after row.
    pub values: Vec<f64>,
}

impl Results {
    /// Names the file and checks that it is one of this kind.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if it is not.
    pub fn open(path: impl Into<PathBuf>) -> Result<Self, OutputError> {
        let results = Self { path: path.into() };
        results.read(|root| {
            root.dataset("NumberOfPoints")?;
            steps(root)
        })?;
        Ok(results)
    }

    /// Times of the steps `[s]`.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn times(&self) -> Result<Vec<f64>, OutputError> {
        self.read(|root| {
            let steps = steps(root)?;
            let values = root.group("Steps")?.dataset("Values")?;
            rows(&values, 0, steps)
        })
    }

    /// Points at a step, counted from zero `[m]`.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if there is no such step.
    pub fn points(&self, step: usize) -> Result<Vec<[f64; 3]>, OutputError> {
        self.read(|root| {
            let n = count(root, "NumberOfPoints", step)?;
            let first = number(&root.group("Steps")?, "PointOffsets", step)?;
            let flat = rows(&root.dataset("Points")?, first, n)?;
            let (points, _) = flat.as_chunks::<3>();
            Ok(points.to_vec())
        })
    }

    /// Names of the arrays, both constant and changing with time.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn names(&self, location: Location) -> Result<Vec<String>, OutputError> {
        self.read(|root| root.group(location.group())?.member_names())
    }

    /// Array at a step, counted from zero. If points and cells both have an array of that name, it
    /// is that of the points. Whole numbers are returned as doubles.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if there is no such array or step.
    pub fn field(&self, name: &str, step: usize) -> Result<FieldValues, OutputError> {
        self.read(|root| {
            let sizes = [(Location::Point, "NumberOfPoints"), (Location::Cell, "NumberOfCells")];
            for (location, size) in sizes {
                let n = count(root, size, step)?;
                let group = root.group(location.group())?;
                if !group.link_exists(name) {
                    continue;
                }
                let first = first_row(root, location, name, step)?;
                let dataset = group.dataset(name)?;
                let components = dataset.get_shape()?.get(1).copied().unwrap_or(1);
                return Ok(FieldValues { location, components, values: rows(&dataset, first, n)? });
            }
            let names = |group: &str| root.group(group)?.member_names();
            let known = [names("PointData")?, names("CellData")?].concat().join("`, `");
            let known = if known.is_empty() { "none".to_owned() } else { format!("`{known}`") };
            Err(format!("there is no array `{name}`: the file has {known}").into())
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn read<T>(&self, work: impl FnOnce(&Group) -> hdf5::Result<T>) -> Result<T, OutputError> {
        with_file(&self.path, OpenMode::Read, "reading", |file| {
            let root = file.group("VTKHDF");
            root.and_then(|root| work(&root)).map_err(|error| {
                let message = match error {
                    hdf5::Error::Internal(message) => message,
                    error => format!(
                        "the file is damaged, or has no results ({error}): restore it, or run the deck again"
                    ),
                };
                OutputError::unusable(&self.path, message)
            })
        })
    }
}

fn steps(root: &Group) -> hdf5::Result<usize> {
    index::steps(root).map_err(|error| match error {
        hdf5::Error::Internal(message) => {
            format!("the file is damaged ({message}): restore it, or run the deck again").into()
        }
        error => error,
    })
}

/// Number of points or cells at a step; the mesh may be the same at all steps or differ at each.
fn count(root: &Group, name: &str, step: usize) -> hdf5::Result<usize> {
    let steps = steps(root)?;
    if step >= steps {
        let steps = counted(steps, "step");
        return Err(
            format!("there is no step {step}: the file has {steps}, numbered from 0").into()
        );
    }
    number(root, name, number(&root.group("Steps")?, "PartOffsets", step)?)
}

/// One number of an array.
fn number(group: &Group, name: &str, at: usize) -> hdf5::Result<usize> {
    let found = group.dataset(name)?.read_slice_1d::<i64, _>(at..=at)?;
    let found = found.first().copied().unwrap_or(-1);
    usize::try_from(found).map_err(|e| format!("`{name}`: {e}").into())
}

/// Row at which a step of an array begins; the first row if the array does not change.
fn first_row(root: &Group, location: Location, name: &str, step: usize) -> hdf5::Result<usize> {
    let offsets = root.group("Steps")?.group(location.offsets())?;
    if offsets.link_exists(name) { number(&offsets, name, step) } else { Ok(0) }
}

/// `n` rows from `first` on, with any number of columns.
fn rows(dataset: &Dataset, first: usize, n: usize) -> hdf5::Result<Vec<f64>> {
    let shape = dataset.get_shape()?;
    if shape.first().is_none_or(|&have| have < first.saturating_add(n)) {
        let (name, last) = (dataset.name(), first.saturating_add(n));
        return Err(format!(
            "`{name}` ends before row {last}: restore the file, or run the deck again"
        )
        .into());
    }
    if n == 0 {
        return Ok(Vec::new());
    }
    let (values, _) = match shape[..] {
        [_] => dataset.read_slice_1d::<f64, _>(first..first + n)?.into_raw_vec_and_offset(),
        _ => dataset.read_slice_2d::<f64, _>((first..first + n, ..))?.into_raw_vec_and_offset(),
    };
    Ok(values)
}
