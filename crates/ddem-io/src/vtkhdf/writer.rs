//! Writing of VTKHDF files, step by step.

use std::ops::Range;
use std::path::{Path, PathBuf};

use hdf5::{File, Group, OpenMode};

use super::create::{self, CLOUD, CLOUD_OFFSETS, COUNTS, STEP_CONSTANTS, put_mesh};
use super::data::{self, Cells, Constant, FieldSpec, Grid, Location, NumberType};
use super::index;
use crate::hdf::{Savepoint, append, put, with_file, write};
use crate::output_error::OutputError;
use crate::replace;
use crate::room;

/// Numbers of a point of a cloud: its place, connectivity, offset and type.
const POINT_NUMBERS: usize = 6;
/// Arrays of these numbers.
const POINT_ARRAYS: usize = 4;
/// Bytes that a chunk takes at most beside its numbers: its checksum, the space up to the next page, and its part of a
/// node of the index, which is a page for at least 32 chunks.
const CHUNK_BYTES: usize = 4096 + 256;
/// Bytes that a step takes at most for the index of each array.
const INDEX_BYTES: usize = 32 * 1024;

/// Writer of one VTKHDF file, step by step.
///
/// No file stays open between the steps, so the writer need not be closed.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    fields: Vec<FieldSpec>,
    mesh: MeshRows,
    steps: usize,
}

/// Steps of a file before one more was appended.
#[derive(Clone, Debug)]
pub struct EarlierSteps {
    file: Savepoint,
    mesh: MeshRows,
    steps: usize,
}

/// Owner of the points of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointOwner {
    /// The mesh, whose points are stored once.
    Mesh,
    /// The step, with a cell for each of its points, so that viewers draw them.
    Step,
}

/// Numbers of rows of the arrays of a file.
#[derive(Clone, Copy, Debug)]
enum MeshRows {
    /// Rows of each step.
    Fixed { points: usize, cells: usize },
    /// Row at which the next step begins.
    Cloud { next: usize },
}

/// Function that writes the values of some rows of a field, one row after another; field and rows
/// are counted from 0. Whole numbers are stored as such.
pub type WriteRows<'a> = &'a (dyn Fn(usize, Range<usize>, &mut [f64]) + Sync);

impl Writer {
    /// Creates the file with its mesh, its constants and no step yet.
    ///
    /// A mesh without points and cells is allowed; VTK opens it as an empty one.
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
        let (path, fixed) = (path.into(), Some((grid, constants)));
        data::check(&path, grid, constants, fields)?;
        let mesh = MeshRows::Fixed { points: grid.points.len(), cells: grid.cells.len() };
        Self { path, fields: fields.to_vec(), mesh, steps: 0 }.created(fixed)
    }

    /// Creates a file in which every step has points of its own, with no step yet.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if names do not fit together or a field is on cells, others if the
    /// file cannot be written.
    pub fn create_cloud(
        path: impl Into<PathBuf>,
        fields: &[FieldSpec],
    ) -> Result<Self, OutputError> {
        let path = path.into();
        let nothing = Grid { points: Vec::new(), cells: Cells::Vertices(0) };
        data::check(&path, &nothing, &[], fields)?;
        if let Some(field) = fields.iter().find(|field| field.location != Location::Point) {
            let message = format!(
                "`{}` is a field of cells, but the file has points only: make it a field of points",
                field.name
            );
            return Err(OutputError::mismatch(&path, message));
        }
        let mesh = MeshRows::Cloud { next: 0 };
        Self { path, fields: fields.to_vec(), mesh, steps: 0 }.created(None)
    }

    fn created(self, mesh: Option<(&Grid, &[Constant<'_>])>) -> Result<Self, OutputError> {
        // A process that is killed now must not leave half a file under the name of the results.
        replace::replace(&self.path, |part| {
            room::check(part, &self.path, create::room(mesh, self.fields.len()))?;
            with_file(part, OpenMode::Create, "writing", |file| {
                create::create(file, mesh, &self.fields)
                    .map_err(|e| OutputError::hdf5(&self.path, "writing", e))
            })
        })?;
        Ok(self)
    }

    /// Continues a file at a savepoint of it and removes the later steps.
    ///
    /// `points` and `fields` are those with which the file was created, in the order of the later
    /// values.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if the file has other fields, ends before the savepoint, is damaged, or is
    /// not the file of the savepoint.
    pub fn reopen(
        path: impl Into<PathBuf>,
        points: PointOwner,
        fields: &[FieldSpec],
        savepoint: &Savepoint,
    ) -> Result<Self, OutputError> {
        let path = path.into();
        replace::unless_busy(&path, || savepoint.roll_back(&path))?;
        let (mesh, steps) = with_file(&path, OpenMode::Read, "reopening", |file| {
            verify(&path, file, points, fields)
        })?;
        Ok(Self { path, fields: fields.to_vec(), mesh, steps })
    }

    /// Savepoint after the steps so far.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`], or [`OutputError::Unusable`] if the file is damaged.
    pub fn savepoint(&self) -> Result<Savepoint, OutputError> {
        Savepoint::of(&self.path)
    }

    /// Adds one step at `time` `[s]`: its points `[m]`, if the step has points of its own, and the
    /// values of every field, which `fill` writes piece by piece, in order.
    ///
    /// If it fails, the file keeps the earlier steps, unless the disk itself is damaged. The same
    /// step can be appended again. Returns the way back to the earlier steps.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if points are missing, or are given although the mesh has them;
    /// others if the file cannot be written.
    pub fn append(
        &mut self,
        time: f64,
        points: Option<Vec<[f64; 3]>>,
        fill: WriteRows<'_>,
    ) -> Result<EarlierSteps, OutputError> {
        let cloud = points.map(|points| Grid { cells: Cells::Vertices(points.len()), points });
        if cloud.is_some() != matches!(self.mesh, MeshRows::Cloud { .. }) {
            let message = match self.mesh {
                MeshRows::Fixed { .. } => "the mesh has the points: append steps without points",
                MeshRows::Cloud { .. } => "each step has points of its own: append it with them",
            };
            return Err(OutputError::mismatch(&self.path, message));
        }
        let room = self.room(cloud.as_ref());
        let file = replace::unless_busy(&self.path, || {
            append(&self.path, room, |file| self.write(file, time, cloud.as_ref(), fill))
        })?;
        let earlier = EarlierSteps { file, mesh: self.mesh, steps: self.steps };
        self.steps += 1;
        if let (MeshRows::Cloud { next }, Some(cloud)) = (&mut self.mesh, cloud) {
            *next += create::cloud_stride(cloud.points.len());
        }
        Ok(earlier)
    }

    /// Removes the steps after the earlier ones.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`], or [`OutputError::Unusable`] if the file is damaged.
    pub fn go_back(&mut self, earlier: &EarlierSteps) -> Result<(), OutputError> {
        replace::unless_busy(&self.path, || earlier.file.roll_back(&self.path))?;
        (self.mesh, self.steps) = (earlier.mesh, earlier.steps);
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

    /// Number of steps in the file.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes that one more step takes at most.
    fn room(&self, cloud: Option<&Grid>) -> u64 {
        // Bytes of some arrays with some columns in all. The last chunk may be in part empty.
        let bytes = |columns: usize, arrays: usize, location| {
            let rows = self.mesh.rows(location, cloud);
            let (rows, chunk) = match self.mesh {
                MeshRows::Fixed { .. } => (create::stride(rows), create::chunk(rows)),
                MeshRows::Cloud { .. } => (rows + CLOUD_OFFSETS.chunk, CLOUD.chunk),
            };
            size_of::<f64>() * columns * rows + CHUNK_BYTES * arrays * rows.div_ceil(chunk)
        };
        let fields = self.fields.iter().map(|field| bytes(field.components, 1, field.location));
        let points = cloud.map_or(0, |_| bytes(POINT_NUMBERS, POINT_ARRAYS, Location::Point));
        let indices = INDEX_BYTES * (self.fields.len() + COUNTS.len() + STEP_CONSTANTS.len());
        (fields.sum::<usize>() + points + indices) as u64
    }

    fn write(
        &self,
        file: &File,
        time: f64,
        cloud: Option<&Grid>,
        fill: WriteRows<'_>,
    ) -> hdf5::Result<()> {
        let root = file.group("VTKHDF")?;
        let steps = root.group("Steps")?;
        let n = self.steps;
        if let Some(cloud) = cloud {
            put_mesh(&root, cloud, n, self.mesh.first_row(Location::Point, n))?;
        }
        for (at, field) in self.fields.iter().enumerate() {
            let first = self.mesh.first_row(field.location, n);
            let rows = self.mesh.rows(field.location, cloud);
            put_field(&root, field, first..first + rows, &|rows, out| fill(at, rows, out))?;
            put(&steps.group(field.location.offsets())?, &field.name, n, first as i64)?;
        }
        for (name, constant, _) in STEP_CONSTANTS {
            let value = match (self.mesh, name) {
                (MeshRows::Fixed { .. }, _) | (_, "NumberOfParts") => constant,
                (_, "PartOffsets") => n as i64,
                (MeshRows::Cloud { next }, _) => next as i64,
            };
            put(&steps, name, n, value)?;
        }
        put(&steps, "Values", n, time)?;
        steps.attr("NSteps")?.write_scalar(&(n as i64 + 1))
    }
}

impl MeshRows {
    /// Row at which the next step begins after a number of steps.
    fn first_row(self, location: Location, steps: usize) -> usize {
        match self {
            Self::Fixed { .. } => steps * create::stride(self.rows(location, None)),
            Self::Cloud { next } => next,
        }
    }

    /// Rows of a step.
    fn rows(self, location: Location, cloud: Option<&Grid>) -> usize {
        match (self, location) {
            (Self::Fixed { points, .. }, Location::Point) => points,
            (Self::Fixed { cells, .. }, Location::Cell) => cells,
            (Self::Cloud { .. }, _) => cloud.map_or(0, |cloud| cloud.points.len()),
        }
    }
}

/// Writes some rows of a field in the type of its array.
fn put_field(
    root: &Group,
    field: &FieldSpec,
    rows: Range<usize>,
    fill: &(dyn Fn(Range<usize>, &mut [f64]) + Sync),
) -> hdf5::Result<()> {
    let (group, name) = (root.group(field.location.group())?, &field.name);
    match field.kind {
        NumberType::F64 => write(&group, name, rows, fill),
        NumberType::I32 => write(&group, name, rows, converted(fill, |x| x as i32)),
        NumberType::U8 => write(&group, name, rows, converted(fill, |x| x as u8)),
    }
}

/// Function that writes the numbers of `fill` in another type.
fn converted<T>(
    fill: &(dyn Fn(Range<usize>, &mut [f64]) + Sync),
    convert: fn(f64) -> T,
) -> impl Fn(Range<usize>, &mut [T]) + Sync {
    move |rows, out| {
        let mut numbers = vec![0.0; out.len()];
        fill(rows, &mut numbers);
        out.iter_mut().zip(&numbers).for_each(|(out, &x)| *out = convert(x));
    }
}

/// Checks the file against the fields. Returns its rows and the number of its steps.
fn verify(
    path: &Path,
    file: &File,
    points: PointOwner,
    fields: &[FieldSpec],
) -> Result<(MeshRows, usize), OutputError> {
    let unusable = |e: hdf5::Error| {
        let message = format!(
            "the file is damaged, or no VTKHDF file with time steps ({e}): restore it, or run from the start"
        );
        OutputError::unusable(path, message)
    };
    let root = file.group("VTKHDF").map_err(unusable)?;
    let steps = index::steps(&root).map_err(unusable)?;
    index::verify(&root, steps).map_err(unusable)?;
    let mesh = mesh(&root, points, steps).map_err(unusable)?;
    for field in fields {
        if !matches(&root, field).map_err(|e| OutputError::hdf5(path, "reopening", e))? {
            let message = format!(
                "the file has no field `{}` like that of the run: restore it, or run from the start",
                field.name
            );
            return Err(OutputError::unusable(path, message));
        }
    }
    Ok((mesh, steps))
}

/// Rows of a file after a number of steps.
fn mesh(root: &Group, points: PointOwner, steps: usize) -> hdf5::Result<MeshRows> {
    let counts = |name: &str, parts: usize| -> hdf5::Result<Vec<usize>> {
        let counts = index::first_rows::<i64>(&root.dataset(name)?, parts)?;
        let count = |n: i64| usize::try_from(n).map_err(|e| format!("{name}: {e}").into());
        counts.into_iter().map(count).collect()
    };
    Ok(match points {
        PointOwner::Mesh => MeshRows::Fixed {
            points: counts("NumberOfPoints", 1)?.iter().sum(),
            cells: counts("NumberOfCells", 1)?.iter().sum(),
        },
        PointOwner::Step => {
            let counts = counts("NumberOfPoints", steps)?;
            MeshRows::Cloud { next: counts.into_iter().map(create::cloud_stride).sum() }
        }
    })
}

fn matches(root: &Group, field: &FieldSpec) -> hdf5::Result<bool> {
    let group = root.group(field.location.group())?;
    let offsets = root.group("Steps")?.group(field.location.offsets())?;
    if !group.link_exists(&field.name) || !offsets.link_exists(&field.name) {
        return Ok(false);
    }
    let dataset = group.dataset(&field.name)?;
    let columns = dataset.get_shape()?.get(1).copied().unwrap_or(1);
    let kind = dataset.dtype()?;
    let same = match field.kind {
        NumberType::F64 => kind.is::<f64>(),
        NumberType::I32 => kind.is::<i32>(),
        NumberType::U8 => kind.is::<u8>(),
    };
    Ok(same && columns == field.components)
}
