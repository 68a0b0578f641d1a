//! The file before its first step: mesh, constants, and the empty arrays of the fields.

use std::path::Path;

use hdf5::{File, Group, OpenMode, Result};

use super::data::{Cells, Constant, FieldSpec, Grid, Kind, Location, Values};
use crate::hdf::{Storage, growable, put, scalar_attribute, with_file, word_attribute};
use crate::output_error::OutputError;

/// Per-step scalars: small chunks, not deflated, so that rewriting the last one never moves it.
const INDEX: Storage = Storage { chunk: 128, deflate: None };

/// On a million points levels 1 to 4 differ by a few percent in time and in size: the low bits of
/// results are noise to any of them.
const DEFLATE: u8 = 1;

/// Of points whose number changes: a chunk is shared by steps, so it is not deflated and stays
/// where it is.
const CLOUD: Storage = Storage { chunk: 4096, deflate: None };

/// Arrays of `Steps` with one entry for each step, all of them the same number because the mesh
/// is stored once. The flag tells the ones that VTK wants as a table with one column.
pub(super) const STEP_CONSTANTS: [(&str, i64, bool); 5] = [
    ("PartOffsets", 0, false),
    ("NumberOfParts", 1, false),
    ("PointOffsets", 0, false),
    ("CellOffsets", 0, true),
    ("ConnectivityIdOffsets", 0, true),
];

pub(super) fn create(
    path: &Path,
    grid: &Grid,
    constants: &[Constant<'_>],
    fields: &[FieldSpec],
) -> std::result::Result<(), OutputError> {
    with_file(path, OpenMode::Create, "writing", |file| {
        fill(file, grid, constants, fields).map_err(|e| OutputError::hdf5(path, "writing", e))
    })
}

fn fill(file: &File, grid: &Grid, constants: &[Constant<'_>], fields: &[FieldSpec]) -> Result<()> {
    let root = root(file)?;
    mesh(&root, grid)?;
    let steps = begin(&root)?;
    for constant in constants {
        let group = root.group(constant.location.group())?;
        let values = constant.values;
        array(&group, constant.name, (values.kind(), 1), storage(values.len()))?;
        put_values(&group, constant.name, 0, values)?;
    }
    for field in fields {
        let rows = match field.location {
            Location::Point => grid.points.len(),
            Location::Cell => grid.cells.len(),
        };
        changing((&root, &steps), field, storage(rows))?;
    }
    Ok(())
}

/// The arrays of points whose number is another at each step, with no step yet.
pub(super) fn cloud(file: &File, fields: &[FieldSpec]) -> Result<()> {
    let root = root(file)?;
    for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"] {
        growable::<i64>(&root, name, None, INDEX)?;
    }
    growable::<f64>(&root, "Points", Some(3), CLOUD)?;
    growable::<i64>(&root, "Connectivity", None, CLOUD)?;
    growable::<i64>(&root, "Offsets", None, CLOUD)?;
    growable::<u8>(&root, "Types", None, CLOUD)?;
    let steps = begin(&root)?;
    fields.iter().try_for_each(|field| changing((&root, &steps), field, CLOUD))
}

fn root(file: &File) -> Result<Group> {
    let root = file.create_group("VTKHDF")?;
    root.new_attr::<i64>().shape(2).create("Version")?.write_raw(&[2_i64, 2])?;
    word_attribute(&root, "Type", b"UnstructuredGrid")?;
    Ok(root)
}

/// The groups of the arrays, and what tells the steps apart.
fn begin(root: &Group) -> Result<Group> {
    let steps = root.create_group("Steps")?;
    scalar_attribute(&steps, "NSteps", &0_i64)?;
    growable::<f64>(&steps, "Values", None, INDEX)?;
    for (name, _, table) in STEP_CONSTANTS {
        growable::<i64>(&steps, name, table.then_some(1), INDEX)?;
    }
    root.create_group("FieldData")?;
    for location in [Location::Point, Location::Cell] {
        root.create_group(location.group())?;
        steps.create_group(location.offsets())?;
    }
    Ok(steps)
}

/// An array that changes with time.
fn changing((root, steps): (&Group, &Group), field: &FieldSpec, storage: Storage) -> Result<()> {
    let group = root.group(field.location.group())?;
    array(&group, &field.name, (field.kind, field.components), storage)?;
    growable::<i64>(&steps.group(field.location.offsets())?, &field.name, None, INDEX)
}

fn mesh(root: &Group, grid: &Grid) -> Result<()> {
    let Grid { points, cells } = grid;
    let count = |n: usize| i64::try_from(n).map_err(|e| hdf5::Error::from(e.to_string()));
    let numbers = [
        ("NumberOfPoints", points.len()),
        ("NumberOfCells", cells.len()),
        ("NumberOfConnectivityIds", cells.connectivity().len()),
    ];
    for (name, n) in numbers {
        growable::<i64>(root, name, None, INDEX)?;
        put(root, name, 0, &[count(n)?])?;
    }
    growable::<f64>(root, "Points", Some(3), storage(points.len()))?;
    put(root, "Points", 0, points.as_flattened())?;
    topology(root, cells)
}

fn topology(root: &Group, cells: &Cells) -> Result<()> {
    growable::<i64>(root, "Connectivity", None, storage(cells.connectivity().len()))?;
    // HDF5 widens the numbers piece by piece.
    put(root, "Connectivity", 0, cells.connectivity())?;
    let offsets: Vec<i64> = (0..).step_by(cells.corners()).take(cells.len() + 1).collect();
    growable::<i64>(root, "Offsets", None, storage(offsets.len()))?;
    put(root, "Offsets", 0, &offsets)?;
    growable::<u8>(root, "Types", None, storage(cells.len()))?;
    put(root, "Types", 0, &vec![cells.vtk_type(); cells.len()])
}

fn array(group: &Group, name: &str, (kind, components): (Kind, usize), of: Storage) -> Result<()> {
    let columns = (components > 1).then_some(components);
    match kind {
        Kind::F64 => growable::<f64>(group, name, columns, of),
        Kind::I32 => growable::<i32>(group, name, columns, of),
        Kind::U8 => growable::<u8>(group, name, columns, of),
    }
}

/// Writes whole rows from `row` on; the array ends behind them.
pub(super) fn put_values(group: &Group, name: &str, row: usize, values: Values<'_>) -> Result<()> {
    match values {
        Values::F64(values) => put(group, name, row, values),
        Values::I32(values) => put(group, name, row, values),
        Values::U8(values) => put(group, name, row, values),
    }
}

fn storage(rows: usize) -> Storage {
    Storage { chunk: chunk(rows), deflate: Some(DEFLATE) }
}

/// Rows of one chunk, for arrays which grow by `rows` each step.
///
/// A step should fill its chunks: a chunk shared with the next step is read, inflated, written
/// once more, and leaves a hole where it was. So small steps are one chunk, and large ones are
/// split evenly if that is possible.
pub(super) fn chunk(rows: usize) -> usize {
    const SMALLEST: usize = 16 * 1024;
    const LARGEST: usize = 64 * 1024;
    if rows <= LARGEST {
        return rows.max(1);
    }
    let even = (SMALLEST..=LARGEST).rev().find(|chunk| rows.is_multiple_of(*chunk));
    even.unwrap_or_else(|| rows.div_ceil(rows.div_ceil(LARGEST)))
}
