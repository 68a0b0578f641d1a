//! Separation of convex bodies.

use nalgebra::Vector3;

use crate::cell::{self, CellFace};
use crate::plane::unit;
use crate::polyhedron::Polyhedron;

/// Convex hull for the test of separation: points, and directions of normals and edges.
#[derive(Debug)]
pub(crate) struct Hull {
    points: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    edges: Vec<Vector3<f64>>,
}

impl Hull {
    pub(crate) fn of_cell(points: &[Vector3<f64>], faces: &[CellFace]) -> Self {
        let at = |corner: u32| points[corner as usize];
        let edges = faces.iter().flat_map(CellFace::edges).filter(|(a, b)| a < b);
        Self {
            points: cell::vertices(faces).into_iter().map(at).collect(),
            normals: faces.iter().filter_map(|face| unit(face.area(points))).collect(),
            edges: edges.filter_map(|(a, b)| unit(at(b) - at(a))).collect(),
        }
    }

    pub(crate) fn of_part(part: &Polyhedron) -> Self {
        let edges = part.faces.iter().flat_map(|corners| {
            let next = corners.iter().cycle().skip(1);
            corners.iter().zip(next).filter(|(a, b)| a < b)
        });
        Self {
            points: part.points.clone(),
            normals: part.planes().into_iter().map(|(normal, _)| normal).collect(),
            edges: edges.filter_map(|(&a, &b)| unit(part.points[b] - part.points[a])).collect(),
        }
    }

    /// True if no more than a layer of thickness `margin` belongs to both.
    pub(crate) fn apart(&self, other: &Self, margin: f64) -> bool {
        let separates = |axis: &Vector3<f64>| {
            let ([a, b], [c, d]) = (self.range(axis), other.range(axis));
            b.min(d) - a.max(c) <= margin
        };
        if self.normals.iter().chain(&other.normals).any(separates) {
            return true;
        }
        self.edges.iter().any(|one| {
            other.edges.iter().any(|two| {
                let axis = one.cross(two);
                // Of nearly parallel edges the normals of faces decide.
                axis.norm() > 1e-6 && separates(&axis.normalize())
            })
        })
    }

    fn range(&self, axis: &Vector3<f64>) -> [f64; 2] {
        self.points
            .iter()
            .map(|x| axis.dot(x))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
    }
}
