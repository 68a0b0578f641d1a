//! Number of cells to expect, before anything is cut.

use nalgebra::Vector3;

use crate::joint_set::JointSet;
use crate::polyhedron::Polyhedron;

/// Number of cells that planes of several sets make of a convex body, on average over all positions
/// of the planes: 1, and one more for each plane, each line of two planes and each point of three
/// that the body contains. Joints of one set count as parallel.
#[must_use]
pub fn expected_cells(body: &Polyhedron, sets: &[JointSet]) -> f64 {
    let frequency = |set: &JointSet| set.normal / set.spacing.mean();
    let normals: Vec<Vector3<f64>> = sets.iter().map(frequency).collect();
    let volume = body.volume();
    let mut cells = 1.0;
    for (i, a) in normals.iter().enumerate() {
        cells += extent(body, a);
        for (j, b) in normals.iter().enumerate().skip(i + 1) {
            let line = a.cross(b);
            cells += shadow(body, &line);
            cells += normals[j + 1..].iter().map(|c| volume * line.dot(c).abs()).sum::<f64>();
        }
    }
    cells
}

/// Extent of a body along a vector, times the length of the vector.
fn extent(body: &Polyhedron, along: &Vector3<f64>) -> f64 {
    let heights = body.points.iter().map(|point| along.dot(point));
    let [low, high] = heights
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
    high - low
}

/// Area of the shadow of a convex body along a vector, times the length of the vector.
fn shadow(body: &Polyhedron, along: &Vector3<f64>) -> f64 {
    (0..body.faces.len()).map(|face| body.area(face).dot(along).abs() / 2.0).sum()
}
