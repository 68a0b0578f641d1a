//! Tunnels: an outline along a straight axis.

use nalgebra::Vector3;

use crate::cell::{self, CellFace};
use crate::outline::Outline;
use crate::plane::{Compass, CutPlane, unit};
use crate::polyhedron::{Polyhedron, ShapeError, prism};

/// Sine of the angle to the vertical below which an axis is vertical.
const VERTICAL: f64 = 1e-6;

/// Tunnel or shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct Tunnel {
    /// Planes of its sides and its two ends.
    pub planes: Vec<CutPlane>,
    parts: Vec<Polyhedron>,
}

impl Tunnel {
    /// Tunnel with an outline around the axis between two points. Looking from the first to the
    /// second, the first coordinate of the outline points to the right, level, and the second up;
    /// in a vertical shaft the second points north.
    ///
    /// # Errors
    ///
    /// If the two points are one.
    pub fn new(
        outline: &Outline,
        [from, to]: [Vector3<f64>; 2],
        compass: &Compass,
        cut: u32,
        joined: bool,
    ) -> Result<Self, ShapeError> {
        let axis = unit(to - from).ok_or(ShapeError::NoVolume)?;
        let level = axis.cross(&Vector3::z());
        let right = if level.norm() > VERTICAL { level } else { axis.cross(&compass.north()) };
        let right = unit(right).ok_or(ShapeError::NoVolume)?;
        let up = right.cross(&axis);
        let length = (to - from).norm();
        // Right, up and the backward axis are right-handed.
        let place = |[u, v]: [f64; 2], w: f64| from + right * u + up * v - axis * w;
        let parts = prism(outline, [-length, 0.0], place)?;
        let corners = outline.corners();
        let sides = (0..corners.len()).map(|i| {
            let [a, b] = [corners[i], corners[(i + 1) % corners.len()]];
            let along = right * (b[0] - a[0]) + up * (b[1] - a[1]);
            (along.cross(&axis), place(a, 0.0))
        });
        let planes = [(axis, from), (axis, to)].into_iter().chain(sides);
        let planes: Option<Vec<_>> =
            planes.map(|(normal, point)| CutPlane::new(normal, point, cut, joined)).collect();
        Ok(Self { planes: planes.ok_or(ShapeError::NoVolume)?, parts })
    }

    /// True if a point lies inside or on the surface.
    #[must_use]
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        let inside = |part: &Polyhedron| {
            part.planes().iter().all(|(normal, offset)| normal.dot(x) <= *offset)
        };
        self.parts.iter().any(inside)
    }

    /// True if a convex cell reaches into the tunnel by more than `margin`.
    pub(crate) fn touches(&self, points: &[Vector3<f64>], faces: &[CellFace], margin: f64) -> bool {
        let cell = Hull::of_cell(points, faces);
        self.parts.iter().any(|part| !cell.apart(&Hull::of_part(part), margin))
    }
}

/// Convex hull for the test of separation: points, and directions of normals and edges.
#[derive(Debug)]
struct Hull {
    points: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    edges: Vec<Vector3<f64>>,
}

impl Hull {
    fn of_cell(points: &[Vector3<f64>], faces: &[CellFace]) -> Self {
        let at = |corner: u32| points[corner as usize];
        let edges = faces.iter().flat_map(CellFace::edges).filter(|(a, b)| a < b);
        Self {
            points: cell::vertices(faces).into_iter().map(at).collect(),
            normals: faces.iter().filter_map(|face| unit(face.area(points))).collect(),
            edges: edges.filter_map(|(a, b)| unit(at(b) - at(a))).collect(),
        }
    }

    fn of_part(part: &Polyhedron) -> Self {
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
    fn apart(&self, other: &Self, margin: f64) -> bool {
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
