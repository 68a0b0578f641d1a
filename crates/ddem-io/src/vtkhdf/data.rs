//! Meshes and values as they are handed to the writer.

use std::path::Path;

use crate::output_error::OutputError;

/// A mesh: points and the cells between them, counted from zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Coordinates `[m]`.
    pub points: Vec<[f64; 3]>,
    /// Cells of one kind.
    pub cells: Cells,
}

/// The cells of a [`Grid`], as point numbers in VTK's order.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Eight points each: the lower face around, then the upper one (VTK type 12).
    Hexahedra(Vec<[u32; 8]>),
    /// Four points each, around (VTK type 9).
    Quads(Vec<[u32; 4]>),
}

impl Cells {
    /// How many cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Hexahedra(cells) => cells.len(),
            Self::Quads(cells) => cells.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Points of one cell.
    pub(crate) fn corners(&self) -> usize {
        match self {
            Self::Hexahedra(_) => 8,
            Self::Quads(_) => 4,
        }
    }

    /// The number VTK knows this kind of cell by.
    pub(crate) fn vtk_type(&self) -> u8 {
        match self {
            Self::Hexahedra(_) => 12,
            Self::Quads(_) => 9,
        }
    }

    /// Point numbers, cell after cell.
    pub(crate) fn connectivity(&self) -> &[u32] {
        match self {
            Self::Hexahedra(cells) => cells.as_flattened(),
            Self::Quads(cells) => cells.as_flattened(),
        }
    }
}

/// Where values live.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Location {
    /// One row for each point of the mesh.
    Point,
    /// One row for each cell of the mesh.
    Cell,
}

impl Location {
    /// The group of the arrays.
    pub(crate) fn group(self) -> &'static str {
        match self {
            Self::Point => "PointData",
            Self::Cell => "CellData",
        }
    }

    /// The group, under `Steps`, of the rows at which the steps of an array begin.
    pub(crate) fn offsets(self) -> &'static str {
        match self {
            Self::Point => "PointDataOffsets",
            Self::Cell => "CellDataOffsets",
        }
    }
}

/// The type numbers are stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
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
    /// Where the values live.
    pub location: Location,
    /// Numbers per point or cell.
    pub components: usize,
    /// The type they are stored as.
    pub kind: Kind,
}

impl FieldSpec {
    /// A field of doubles on the points.
    pub fn point(name: impl Into<String>, components: usize) -> Self {
        Self { name: name.into(), location: Location::Point, components, kind: Kind::F64 }
    }

    /// A field of doubles on the cells.
    pub fn cell(name: impl Into<String>, components: usize) -> Self {
        Self { location: Location::Cell, ..Self::point(name, components) }
    }

    /// The same field with another type of numbers.
    #[must_use]
    pub fn kind(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }
}

/// Borrowed numbers, row after row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values<'a> {
    /// Double precision.
    F64(&'a [f64]),
    /// Signed integers, 32 bits.
    I32(&'a [i32]),
    /// Unsigned integers, 8 bits.
    U8(&'a [u8]),
}

impl Values<'_> {
    /// How many numbers, in all rows together.
    pub fn len(&self) -> usize {
        match self {
            Self::F64(values) => values.len(),
            Self::I32(values) => values.len(),
            Self::U8(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The type of the numbers.
    pub fn kind(&self) -> Kind {
        match self {
            Self::F64(_) => Kind::F64,
            Self::I32(_) => Kind::I32,
            Self::U8(_) => Kind::U8,
        }
    }
}

/// A scalar that does not change with time, such as the block a cell belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant<'a> {
    /// Name shown in viewers.
    pub name: &'a str,
    /// Where the values live.
    pub location: Location,
    /// One number for each point or cell.
    pub values: Values<'a>,
}

/// Refuses what would make a file that viewers misread.
pub(crate) fn check(
    path: &Path,
    grid: &Grid,
    constants: &[Constant<'_>],
    fields: &[FieldSpec],
) -> Result<(), OutputError> {
    let points = grid.points.len();
    if let Some(id) = grid.cells.connectivity().iter().find(|&&id| id as usize >= points) {
        let message = format!("a cell names point {id}, but there are {points} points");
        return Err(OutputError::mismatch(path, message));
    }
    for constant in constants {
        let rows = match constant.location {
            Location::Point => points,
            Location::Cell => grid.cells.len(),
        };
        if constant.values.len() != rows {
            let (name, have) = (constant.name, constant.values.len());
            let message = format!("`{name}` has {have} values instead of {rows}");
            return Err(OutputError::mismatch(path, message));
        }
    }
    check_names(path, constants, fields)
}

/// Refuses values of a step that are not those of the fields.
pub(crate) fn check_values(
    path: &Path,
    fields: &[FieldSpec],
    values: &[Values<'_>],
    rows: impl Fn(Location) -> usize,
) -> Result<(), OutputError> {
    let mismatch = |message| Err(OutputError::mismatch(path, message));
    if values.len() != fields.len() {
        let (have, want) = (values.len(), fields.len());
        return mismatch(format!("values of {have} fields were given instead of {want}"));
    }
    for (field, values) in fields.iter().zip(values) {
        let (name, want) = (&field.name, rows(field.location) * field.components);
        if values.len() != want {
            let have = values.len();
            return mismatch(format!("`{name}` has {have} values instead of {want}"));
        }
        if values.kind() != field.kind {
            let (have, want) = (values.kind(), field.kind);
            return mismatch(format!("`{name}` has values of type {have:?}, not {want:?}"));
        }
    }
    Ok(())
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
            "is not a name for an array"
        } else if names[..i].contains(&(location, name)) {
            "is the name of two arrays"
        } else {
            continue;
        };
        return Err(OutputError::mismatch(path, format!("`{name}` {fault}")));
    }
    match fields.iter().find(|f| f.components == 0) {
        Some(f) => Err(OutputError::mismatch(path, format!("`{}` has no components", f.name))),
        None => Ok(()),
    }
}
