//! Meshes and values for the writer.

use std::path::Path;

use ddem_core::counted;

use crate::output_error::OutputError;

/// A mesh: points and the cells between them, counted from zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Coordinates `[m]`.
    pub points: Vec<[f64; 3]>,
    /// Cells of one kind.
    pub cells: Cells,
}

impl Grid {
    /// Number of points or cells.
    pub(crate) fn rows(&self, location: Location) -> usize {
        match location {
            Location::Point => self.points.len(),
            Location::Cell => self.cells.len(),
        }
    }
}

/// The cells of a [`Grid`], as point numbers in VTK's order.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Eight points each: around the lower face, then around the upper one (VTK type 12).
    Hexahedra(Vec<[u32; 8]>),
    /// Four points each, around the cell (VTK type 9).
    Quads(Vec<[u32; 4]>),
    /// Number of points, each of which is a cell, so that viewers draw it (VTK type 1).
    Vertices(usize),
}

impl Cells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Hexahedra(cells) => cells.len(),
            Self::Quads(cells) => cells.len(),
            Self::Vertices(n) => *n,
        }
    }

    /// True if there are no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of points of one cell, and VTK's number for this kind of cell.
    pub(crate) fn shape(&self) -> (usize, u8) {
        match self {
            Self::Hexahedra(_) => (8, 12),
            Self::Quads(_) => (4, 9),
            Self::Vertices(_) => (1, 1),
        }
    }

    /// Point number at a position of the list of all cells' points, cell after cell.
    pub(crate) fn point(&self, at: usize) -> usize {
        match self {
            Self::Hexahedra(cells) => cells[at / 8][at % 8] as usize,
            Self::Quads(cells) => cells[at / 4][at % 4] as usize,
            Self::Vertices(_) => at,
        }
    }
}

/// Location of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Location {
    /// One row for each point of the mesh.
    Point,
    /// One row for each cell of the mesh.
    Cell,
}

impl Location {
    /// Group of the arrays.
    pub(crate) fn group(self) -> &'static str {
        match self {
            Self::Point => "PointData",
            Self::Cell => "CellData",
        }
    }

    /// Group, under `Steps`, of the rows at which the steps of an array begin.
    pub(crate) fn offsets(self) -> &'static str {
        match self {
            Self::Point => "PointDataOffsets",
            Self::Cell => "CellDataOffsets",
        }
    }
}

/// Type in which numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NumberType {
    /// Double precision.
    F64,
    /// Signed integers, 32 bits.
    I32,
    /// Unsigned integers, 8 bits.
    U8,
}

/// A field that changes with time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldSpec {
    /// Name shown in viewers.
    pub name: String,
    /// Location of the values.
    pub location: Location,
    /// Numbers per point or cell.
    pub components: usize,
    /// Type in which the numbers are stored.
    pub kind: NumberType,
    /// True if the numbers are compressed.
    pub compressed: bool,
}

impl FieldSpec {
    /// A field of doubles on the points.
    pub fn point(name: impl Into<String>, components: usize) -> Self {
        Self {
            name: name.into(),
            location: Location::Point,
            components,
            kind: NumberType::F64,
            compressed: true,
        }
    }

    /// A field of doubles on the cells.
    pub fn cell(name: impl Into<String>, components: usize) -> Self {
        Self { location: Location::Cell, ..Self::point(name, components) }
    }

    /// The field with another number type.
    #[must_use]
    pub fn kind(self, kind: NumberType) -> Self {
        Self { kind, ..self }
    }

    /// The field without compression.
    #[must_use]
    pub fn uncompressed(self) -> Self {
        Self { compressed: false, ..self }
    }
}

/// A whole number that does not change with time, such as the block a cell belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant<'a> {
    /// Name shown in viewers.
    pub name: &'a str,
    /// Location of the values.
    pub location: Location,
    /// One number for each point or cell.
    pub values: &'a [i32],
}

/// Refuses data that would make a file that viewers misread.
pub(crate) fn check(
    path: &Path,
    grid: &Grid,
    constants: &[Constant<'_>],
    fields: &[FieldSpec],
) -> Result<(), OutputError> {
    let (points, cells) = (grid.points.len(), &grid.cells);
    let mut named = (0..cells.shape().0 * cells.len()).map(|at| cells.point(at));
    if let Some(id) = named.find(|&id| id >= points) {
        let message = format!("a cell names point {id}: there are {points} points, from 0");
        return Err(OutputError::mismatch(path, message));
    }
    for Constant { name, location, values } in constants {
        let (have, rows) = (values.len(), grid.rows(*location));
        if have != rows {
            let message = format!(
                "`{name}` has {} instead of {rows}: give one for each point or cell",
                counted(have, "value")
            );
            return Err(OutputError::mismatch(path, message));
        }
    }
    check_names(path, constants, fields)
}

fn check_names(
    path: &Path,
    constants: &[Constant<'_>],
    fields: &[FieldSpec],
) -> Result<(), OutputError> {
    let mut names: Vec<(Location, &str)> = constants.iter().map(|c| (c.location, c.name)).collect();
    names.extend(fields.iter().map(|f| (f.location, f.name.as_str())));
    for (i, &(location, name)) in names.iter().enumerate() {
        let fault = if name.is_empty() || name == "." || name.contains(['/', '\0']) {
            "cannot be the name of an array: use another one, without `/`"
        } else if names[..i].contains(&(location, name)) {
            "is the name of two arrays: use two names"
        } else {
            continue;
        };
        return Err(OutputError::mismatch(path, format!("`{name}` {fault}")));
    }
    match fields.iter().find(|f| f.components == 0) {
        Some(f) => Err(OutputError::mismatch(
            path,
            format!("`{}` has no components: give it one or more", f.name),
        )),
        None => Ok(()),
    }
}
