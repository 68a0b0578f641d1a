//! Files with the rock of a region: a closed surface as STL, cells as OBJ, or Neper's `.tess`.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use ddem_core::problem::{Vec3, bounds_of};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::{MOST_CELLS, Polyhedron, ShapeError, first_overlap};

use super::files::triangles;
use super::{obj, tess};
use crate::check::remedy;
use crate::schema::{FileCells, RockFile, welded};

/// Largest size of a file `[bytes]`.
const MOST_BYTES: u64 = 4_000_000_000;

/// Largest difference of the volume of all cells from that of their domain, relative to it.
const FILLED: f64 = 1e-6;

const FORMATS: &str = "a region is in an STL or OBJ file, or in a `.tess` file of Neper";

/// Advice on faces of tessellations that are not flat.
const FLAT: &str = "faces are flat without regularization: `neper -T … -regularization 0`";

/// Cells of a file as it gives them.
#[derive(Debug, Default)]
pub(super) struct ReadCells {
    /// Positions of the corners `[m]`.
    pub(super) points: Vec<[f64; 3]>,
    pub(super) cells: Vec<ReadCell>,
    /// Volume of the domain of the cells `[m³]`, if the file has one.
    pub(super) domain: Option<f64>,
}

/// Cell of a file.
#[derive(Debug, Default)]
pub(super) struct ReadCell {
    pub(super) name: String,
    /// Numbers of the corners of each face.
    pub(super) faces: Vec<Vec<u32>>,
}

/// End of the name of a file, in small letters.
fn end(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// True if the rock of a file with this name is a surface.
pub(super) fn is_surface(path: &str) -> bool {
    end(Path::new(path)) == "stl"
}

/// Rock of a file, by the end of its name.
pub(super) fn rock(path: &Path, file: File) -> Result<RockFile, Fault> {
    match end(path).as_str() {
        "stl" => Ok(RockFile::Surface(triangles(file)?)),
        "obj" => cells(obj::cells(&text(file)?)?, true).map(RockFile::Cells),
        "tess" => cells(tess::cells(&text(file)?)?, false).map(RockFile::Cells),
        _ => Err(wrong("the name does not end in `.stl`, `.obj` or `.tess`").help(FORMATS)),
    }
}

pub(super) fn wrong(message: impl Into<String>) -> Fault {
    Fault::new(ErrorCode::InvalidFile, "", message)
}

fn text(file: File) -> Result<String, Fault> {
    let size = file.metadata().map_or(0, |of| of.len());
    if size > MOST_BYTES {
        let message = format!("the file has {size} bytes; at most {MOST_BYTES} are possible");
        let help = "make larger cells, or several regions of parts of the file";
        return Err(Fault::new(ErrorCode::TooLarge, "", message).help(help));
    }
    let mut text = String::new();
    let read = file.take(MOST_BYTES).read_to_string(&mut text);
    read.map_err(|error| wrong(format!("this is not text: {error}")).help(FORMATS))?;
    Ok(text)
}

/// Cells with equal corners where they meet, each of which is convex. With `merge` parts of a face in
/// one plane, such as triangles, are one face.
fn cells(read: ReadCells, merge: bool) -> Result<FileCells, Fault> {
    if read.cells.len() > MOST_CELLS {
        let message =
            format!("there would be {} cells; at most {MOST_CELLS} are possible", read.cells.len());
        return Err(Fault::new(ErrorCode::TooLarge, "", message).help("make larger cells"));
    }
    let (points, numbers) = welded(&read.points);
    let points: Vec<Vec3> = points.into_iter().map(Vec3::from).collect();
    let [low, high] = bounds_of(&points);
    let same = Polyhedron::tolerance((high - low).norm());
    let mut cells = Vec::with_capacity(read.cells.len());
    for cell in &read.cells {
        let local = part(&cell.faces, &numbers, &points);
        let whole = |part: Polyhedron| if merge { part.with_whole_faces(same) } else { part };
        // Only closed faces can be made whole.
        let checked = local.check_closed().map(|()| whole(local)).and_then(|part| {
            part.check(same)?;
            Ok(part)
        });
        cells.push(checked.map_err(|error| {
            let help = match error {
                ShapeError::NotPlanar { .. } if !merge => FLAT,
                _ => remedy(&error),
            };
            wrong(format!("cell `{}`: {error}", cell.name)).help(help)
        })?);
    }
    if let Some([one, other]) = first_overlap(&cells, 2.0 * same) {
        let names = [one, other].map(|cell| &read.cells[cell].name);
        let message = format!("cells `{}` and `{}` overlap", names[0], names[1]);
        return Err(wrong(message).help("cells may share faces, but no rock"));
    }
    if let Some(domain) = read.domain {
        fills(&cells, domain)?;
    }
    Ok(FileCells::checked(cells))
}

/// Polyhedron of some faces, without corners that follow themselves.
fn part(faces: &[Vec<u32>], numbers: &[u32], points: &[Vec3]) -> Polyhedron {
    let mut known = HashMap::new();
    let mut own = Vec::new();
    let mut number = |corner: &u32| {
        let corner = numbers[*corner as usize];
        *known.entry(corner).or_insert_with(|| {
            own.push(points[corner as usize]);
            own.len() - 1
        })
    };
    let mut local: Vec<Vec<usize>> = Vec::with_capacity(faces.len());
    for face in faces {
        let mut corners: Vec<usize> = face.iter().map(&mut number).collect();
        corners.dedup();
        while corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        // Welding closes faces that are smaller than its distance.
        if corners.len() > 2 {
            local.push(corners);
        }
    }
    Polyhedron { points: own, faces: local }
}

/// Checks that cells fill their domain.
fn fills(cells: &[Polyhedron], domain: f64) -> Result<(), Fault> {
    let sum: f64 = cells.iter().map(Polyhedron::volume).sum();
    if (sum - domain).abs() <= FILLED * domain {
        return Ok(());
    }
    let message = format!(
        "the cells have {sum:.6e} m³, but their domain has {domain:.6e} m³: they leave gaps or overlap"
    );
    Err(wrong(message).help("write the file again, with all cells of the domain"))
}
