//! Faces of cells that lie in one plane without the same corners, as those of bricks in a wall.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::complex::CellComplex;

/// Largest difference of the cosine of the angle between two faces in one plane from 1: the distance of
/// their corners from the plane decides.
const PARALLEL: f64 = 1e-4;

/// Largest difference of a part of their normals: √(2 · 10⁻⁴) and a little more.
const BESIDE: f64 = 0.02;

/// Face that no other one matches.
#[derive(Clone, Copy)]
struct SingleFace {
    cell: usize,
    face: usize,
    /// Outward unit normal.
    normal: Vector3<f64>,
}

/// Gives faces of the cells from `first` on that lie in one plane, on both sides of it, the same plane.
pub(crate) fn unite(complex: &mut CellComplex, first: usize, distance: f64, joined: bool) {
    let mut singles = singles(complex, first);
    // Both sides of a plane have the same number.
    let key = |single: &SingleFace| single.normal.x.abs();
    singles.sort_by(|a, b| key(a).total_cmp(&key(b)).then((a.cell, a.face).cmp(&(b.cell, b.face))));
    // Faces of each plane, the first of which gives it.
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut recent = 0;
    for (number, single) in singles.iter().enumerate() {
        let near = |group: &Vec<usize>| key(&singles[group[0]]) >= key(single) - BESIDE;
        recent += groups[recent..].iter().take_while(|group| !near(group)).count();
        let own = groups[recent..]
            .iter()
            .position(|group| in_plane(complex, &singles[group[0]], single, distance));
        match own {
            Some(at) => groups[recent + at].push(number),
            None => groups.push(vec![number]),
        }
    }
    for group in groups {
        let normal = singles[group[0]].normal;
        if group.iter().all(|&number| singles[number].normal.dot(&normal) > 0.0) {
            continue;
        }
        let of = |number: usize| (singles[number].cell, singles[number].face);
        let (cell, face) = of(group[0]);
        let plane = complex.cells[cell].faces[face].plane;
        complex.planes[plane as usize].joined = joined;
        for (cell, face) in group.into_iter().map(of) {
            complex.cells[cell].faces[face].plane = plane;
        }
    }
}

/// Faces of the cells from `first` on whose planes have no other face.
fn singles(complex: &CellComplex, first: usize) -> Vec<SingleFace> {
    let mut uses: HashMap<u32, usize> = HashMap::new();
    for face in complex.cells[first..].iter().flat_map(|cell| &cell.faces) {
        *uses.entry(face.plane).or_default() += 1;
    }
    let mut singles = Vec::new();
    for (cell, of) in complex.cells.iter().enumerate().skip(first) {
        for (face, of) in of.faces.iter().enumerate().filter(|(_, face)| uses[&face.plane] == 1) {
            singles.push(SingleFace { cell, face, normal: complex.plane(of).normal });
        }
    }
    singles
}

/// True if a face lies in the plane of another.
fn in_plane(complex: &CellComplex, of: &SingleFace, other: &SingleFace, distance: f64) -> bool {
    let plane = complex.plane(&complex.cells[of.cell].faces[of.face]);
    let corners = &complex.cells[other.cell].faces[other.face].corners;
    1.0 - of.normal.dot(&other.normal).abs() <= PARALLEL
        && corners.iter().all(|&x| plane.height(&complex.points[x as usize]).abs() <= distance)
}
