//! Volume, centroid, inertia and width of cells.

use nalgebra::{Matrix3, Vector3};

use crate::cell::{self, CellFace};
use crate::plane::{CutPlane, PlaneSource, unit};

/// Sizes of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellProperties {
    /// Volume `[m³]`.
    pub volume: f64,
    /// Centroid `[m]`.
    pub centroid: Vector3<f64>,
    /// Inertia tensor about the centroid for a density of 1 `[m⁵]`, 3×3.
    pub inertia: Matrix3<f64>,
    /// Width `[m]`: the least over the faces of the largest distance of a vertex from the face.
    pub width: f64,
}

/// Sums over the tetrahedra between an inner point and the triangles of the faces.
#[derive(Debug)]
struct TetrahedronSums {
    volume: f64,
    /// ∫x dV `[m⁴]`.
    first: Vector3<f64>,
    /// ∫x xᵀ dV `[m⁵]`, 3×3.
    second: Matrix3<f64>,
}

/// Mean of the corners of all faces `[m]`.
fn middle(points: &[Vector3<f64>], faces: &[CellFace]) -> Vector3<f64> {
    let corners = || faces.iter().flat_map(|face| &face.corners);
    let sum = corners().fold(Vector3::zeros(), |sum, &corner| sum + points[corner as usize]);
    sum / corners().count() as f64
}

fn sums(points: &[Vector3<f64>], faces: &[CellFace], origin: &Vector3<f64>) -> TetrahedronSums {
    let mut sums =
        TetrahedronSums { volume: 0.0, first: Vector3::zeros(), second: Matrix3::zeros() };
    for face in faces {
        // Both sides of a face take the same triangles, even if its corners are slightly off a plane:
        // the volumes of all cells then sum to that of the region.
        let n = face.corners.len();
        let first = (0..n).min_by_key(|&i| face.corners[i]).unwrap_or(0);
        let at = |i: usize| points[face.corners[(first + i) % n] as usize] - origin;
        for i in 2..n {
            let corners = [at(0), at(i - 1), at(i)];
            let volume = corners[0].cross(&corners[1]).dot(&corners[2]) / 6.0;
            let sum = corners[0] + corners[1] + corners[2];
            sums.volume += volume;
            sums.first += sum * (volume / 4.0);
            let mut squares = sum * sum.transpose();
            for corner in corners {
                squares += corner * corner.transpose();
            }
            sums.second += squares * (volume / 20.0);
        }
    }
    sums
}

pub(crate) fn properties(
    points: &[Vector3<f64>],
    planes: &[CutPlane],
    faces: &[CellFace],
) -> CellProperties {
    let origin = middle(points, faces);
    let TetrahedronSums { volume, first, second } = sums(points, faces, &origin);
    let offset = if volume > 0.0 { first / volume } else { Vector3::zeros() };
    let second = second - offset * offset.transpose() * volume;
    CellProperties {
        volume,
        centroid: origin + offset,
        inertia: Matrix3::identity() * second.trace() - second,
        width: width(points, planes, faces),
    }
}

pub(crate) fn volume(points: &[Vector3<f64>], faces: &[CellFace]) -> f64 {
    sums(points, faces, &middle(points, faces)).volume
}

pub(crate) fn centroid(points: &[Vector3<f64>], faces: &[CellFace]) -> Vector3<f64> {
    let origin = middle(points, faces);
    let sums = sums(points, faces, &origin);
    if sums.volume > 0.0 { origin + sums.first / sums.volume } else { origin }
}

fn width(points: &[Vector3<f64>], planes: &[CutPlane], faces: &[CellFace]) -> f64 {
    let vertices = cell::vertices(faces);
    let distance = |face: &CellFace| {
        let plane = &planes[face.plane as usize];
        vertices
            .iter()
            .map(|&vertex| plane.height(&points[vertex as usize]).abs())
            .fold(0.0, f64::max)
    };
    faces.iter().map(distance).fold(f64::INFINITY, f64::min)
}

/// Plane of a face of a region, with the outward normal, through the mean of its corners.
pub(crate) fn plane_of(face: &CellFace, points: &[Vector3<f64>]) -> CutPlane {
    let normal = unit(face.area(points)).unwrap_or_else(Vector3::zeros);
    let offsets = face.corners.iter().map(|&corner| normal.dot(&points[corner as usize]));
    let offset = offsets.sum::<f64>() / face.corners.len() as f64;
    CutPlane { normal, offset, source: PlaneSource::Region, joined: false }
}
