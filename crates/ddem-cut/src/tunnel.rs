//! Tunnels: an outline along a straight axis.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::cell::CellFace;
use crate::hull::Hull;
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
        let point_at = |[u, v]: [f64; 2], w: f64| from + right * u + up * v - axis * w;
        let parts = prism(outline, [-length, 0.0], point_at)?;
        let corners = outline.corners();
        let sides = (0..corners.len()).map(|i| {
            let [a, b] = [corners[i], corners[(i + 1) % corners.len()]];
            let along = right * (b[0] - a[0]) + up * (b[1] - a[1]);
            (along.cross(&axis), point_at(a, 0.0))
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

    /// Corners of the triangles of the surface, counter-clockwise seen from outside `[m]`.
    #[must_use]
    pub fn triangles(&self) -> Vec<[Vector3<f64>; 3]> {
        let bits = |x: &Vector3<f64>| [x.x, x.y, x.z].map(f64::to_bits);
        let key = |face: &[Vector3<f64>]| {
            let mut key: Vec<[u64; 3]> = face.iter().map(bits).collect();
            key.sort_unstable();
            key
        };
        let corners = |part: &Polyhedron| {
            let of = |face: &Vec<usize>| face.iter().map(|&i| part.points[i]).collect::<Vec<_>>();
            part.faces.iter().map(of).collect::<Vec<_>>()
        };
        let faces: Vec<Vec<Vector3<f64>>> = self.parts.iter().flat_map(corners).collect();
        let mut counts = BTreeMap::new();
        faces.iter().for_each(|face| *counts.entry(key(face)).or_insert(0) += 1);
        // A face that two parts share is inside.
        let outer = faces.iter().filter(|face| counts[&key(face)] == 1);
        let fan = |face: &Vec<Vector3<f64>>| {
            (2..face.len()).map(|i| [face[0], face[i - 1], face[i]]).collect::<Vec<_>>()
        };
        outer.flat_map(fan).collect()
    }

    /// True if a convex cell reaches into the tunnel by more than `margin`.
    pub(crate) fn touches(&self, points: &[Vector3<f64>], faces: &[CellFace], margin: f64) -> bool {
        let cell = Hull::of_cell(points, faces);
        self.parts.iter().any(|part| !cell.apart(&Hull::of_part(part), margin))
    }
}
