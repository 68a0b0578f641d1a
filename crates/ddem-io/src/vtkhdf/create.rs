//! Creation of a file before its first step: mesh, constants, and the empty arrays of the fields.

use hdf5::{File, Group, Result};

use super::data::{Constant, FieldSpec, Grid, Location, NumberType};
use crate::hdf::{Storage, growable, origin, put, scalar_attribute, word_attribute, write};

/// Storage of scalars per step: each is a chunk of its own, which is never written again.
const INDEX: Storage = Storage { chunk: 1, deflate: None, checksum: true };

/// Deflate level. Most fields that are compressed repeat one value, for which the lowest level is enough.
const DEFLATE: u8 = 1;

/// Storage of points whose number changes. Compression makes the empty end of the last chunk of a step small.
pub(super) const CLOUD: Storage = Storage { chunk: 1024, deflate: Some(DEFLATE), checksum: true };

/// Storage of the offsets of such points. VTK wants one more of them for each step, so that steps share chunks.
pub(super) const CLOUD_OFFSETS: Storage = Storage { chunk: 4096, deflate: None, checksum: false };

/// Sizes of the mesh of a step.
pub(super) const COUNTS: [&str; 3] = ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"];

/// Arrays of `Steps` with one entry for each step. All entries are the given number if the mesh is
/// stored once; for a cloud `PointOffsets` and similar arrays differ. The flag marks the arrays
/// that VTK requires as a table with one column.
pub(super) const STEP_CONSTANTS: [(&str, i64, bool); 5] = [
    ("PartOffsets", 0, false),
    ("NumberOfParts", 1, false),
    ("PointOffsets", 0, false),
    ("CellOffsets", 0, true),
    ("ConnectivityIdOffsets", 0, true),
];

/// Creates the arrays of a file without steps: with the mesh of all steps and its constants, or
/// with room for the points of each step.
pub(super) fn create(
    file: &File,
    mesh: Option<(&Grid, &[Constant<'_>])>,
    fields: &[FieldSpec],
) -> Result<()> {
    origin(file)?;
    let root = file.create_group("VTKHDF")?;
    root.new_attr::<i64>().shape(2).create("Version")?.write_raw(&[2_i64, 2])?;
    word_attribute(&root, "Type", b"UnstructuredGrid")?;
    let of = |rows: usize| mesh.map_or(CLOUD, |_| storage(rows));
    let (points, cells, corners) = mesh
        .map_or((0, 0, 0), |(grid, _)| (grid.points.len(), grid.cells.len(), grid.cells.shape().0));
    for name in COUNTS {
        growable::<i64>(&root, name, None, INDEX)?;
    }
    growable::<f64>(&root, "Points", Some(3), of(points))?;
    growable::<i64>(&root, "Connectivity", None, of(corners * cells))?;
    growable::<i64>(&root, "Offsets", None, mesh.map_or(CLOUD_OFFSETS, |_| storage(cells + 1)))?;
    growable::<u8>(&root, "Types", None, of(cells))?;
    let steps = begin(&root)?;
    if let Some((grid, constants)) = mesh {
        put_mesh(&root, grid, 0, 0)?;
        for Constant { name, location, values } in constants {
            let group = root.group(location.group())?;
            growable::<i32>(&group, name, None, of(values.len()))?;
            write(&group, name, 0..values.len(), |at, out| out.copy_from_slice(&values[at]))?;
        }
    }
    for field in fields {
        let rows = mesh.map_or(0, |(grid, _)| grid.rows(field.location));
        changing((&root, &steps), field, of(rows))?;
    }
    Ok(())
}

/// Bytes that a file without steps takes at most.
pub(super) fn room(mesh: Option<(&Grid, &[Constant<'_>])>, n_fields: usize) -> u64 {
    let (points, cells, corners, constants) = mesh.map_or((0, 0, 0, 0), |(grid, constants)| {
        let values = constants.iter().map(|constant| constant.values.len()).sum::<usize>();
        (grid.points.len(), grid.cells.len(), grid.cells.shape().0, values)
    });
    let numbers = 3 * points + (corners + 2) * cells + constants;
    let arrays = COUNTS.len() + STEP_CONSTANTS.len() + ARRAYS + 2 * n_fields;
    // The last chunk of an array may be in part empty.
    (2 * size_of::<f64>() * numbers + ARRAY_BYTES * arrays) as u64
}

/// Number of arrays and groups of a file beside those of its fields, and bytes of the description of each.
const ARRAYS: usize = 16;
const ARRAY_BYTES: usize = 16 * 1024;

/// Creates the groups of the arrays and the index of the steps; returns the group `Steps`.
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

/// Adds an array that changes with time.
fn changing((root, steps): (&Group, &Group), field: &FieldSpec, of: Storage) -> Result<()> {
    let of = Storage { deflate: of.deflate.filter(|_| field.compressed), ..of };
    let group = root.group(field.location.group())?;
    let columns = (field.components > 1).then_some(field.components);
    match field.kind {
        NumberType::F64 => growable::<f64>(&group, &field.name, columns, of),
        NumberType::I32 => growable::<i32>(&group, &field.name, columns, of),
        NumberType::U8 => growable::<u8>(&group, &field.name, columns, of),
    }?;
    growable::<i64>(&steps.group(field.location.offsets())?, &field.name, None, INDEX)
}

/// Writes a mesh after `part` others, which have `row` points, as many cells and as many corners.
pub(super) fn put_mesh(root: &Group, grid: &Grid, part: usize, row: usize) -> Result<()> {
    let Grid { points, cells } = grid;
    let (corners, kind) = cells.shape();
    let sizes = [points.len(), cells.len(), corners * cells.len()];
    for (name, n) in COUNTS.into_iter().zip(sizes) {
        put(root, name, part, n as i64)?;
    }
    let rows = sizes.map(|n| row..row + n);
    write(root, "Points", rows[0].clone(), |at, out| {
        out.copy_from_slice(points[at].as_flattened());
    })?;
    write(root, "Connectivity", rows[2].clone(), |at, out: &mut [i64]| {
        out.iter_mut().zip(at).for_each(|(out, at)| *out = cells.point(at) as i64);
    })?;
    // Each part has one offset more than it has cells: the end of its last cell.
    write(root, "Offsets", row + part..row + part + cells.len() + 1, |at, out: &mut [i64]| {
        out.iter_mut().zip(at).for_each(|(out, at)| *out = (corners * at) as i64);
    })?;
    write(root, "Types", rows[1].clone(), |_, out| out.fill(kind))
}

fn storage(rows: usize) -> Storage {
    Storage { chunk: chunk(rows), deflate: Some(DEFLATE), checksum: true }
}

/// Number of rows of one chunk, for arrays that grow by `rows` in each step: all, or those of a large step divided almost
/// evenly.
pub(super) fn chunk(rows: usize) -> usize {
    const LARGEST: usize = 64 * 1024;
    rows.div_ceil(rows.div_ceil(LARGEST).max(1)).max(1)
}

/// Number of rows from one step to the next: no chunk is written in two steps.
pub(super) fn stride(rows: usize) -> usize {
    rows.next_multiple_of(chunk(rows))
}

/// The same after a step of a cloud.
pub(super) fn cloud_stride(points: usize) -> usize {
    points.next_multiple_of(CLOUD.chunk)
}
