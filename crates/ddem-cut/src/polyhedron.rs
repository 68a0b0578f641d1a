//! Shapes of regions: boxes, prisms, and polyhedra given by their faces.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::hull::Hull;
use crate::outline::Outline;

/// Distance relative to the size of a shape within which points are one, or lie on a plane.
const SAME: f64 = 1e-6;

/// Convex polyhedron.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Corners `[m]`.
    pub points: Vec<Vector3<f64>>,
    /// Numbers of the corners of each face, counter-clockwise seen from outside.
    pub faces: Vec<Vec<usize>>,
}

/// Fault of a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// Outline without area.
    #[error("the outline encloses no area")]
    NoArea,
    /// Outline that crosses itself.
    #[error("two sides of the outline cross or touch")]
    Crossing,
    /// Shape without volume.
    #[error("the shape encloses no volume")]
    NoVolume,
    /// Face with fewer than three different corners.
    #[error("face {0} has fewer than three different corners")]
    FewCorners(usize),
    /// Face whose corners do not lie in one plane.
    #[error("the corners of face {face} do not lie in one plane: one is {off:.3e} m off it")]
    NotPlanar {
        /// Number of the face, from 0.
        face: usize,
        /// Distance of the corner from the plane `[m]`.
        off: f64,
    },
    /// Edge without another face.
    #[error(
        "the faces do not close: the edge from {} to {} of face {face} belongs to {}",
        shown(from), shown(to), times(*n)
    )]
    Open {
        /// Number of the face, from 0.
        face: usize,
        /// Start of the edge `[m]`.
        from: Vector3<f64>,
        /// End of the edge `[m]`.
        to: Vector3<f64>,
        /// Number of other faces in which the edge has the opposite direction.
        n: usize,
    },
    /// Faces that point inward.
    #[error("the faces are turned inside out")]
    InsideOut,
    /// Closed surface whose convex parts do not fill it.
    #[error(
        "the surface encloses {volume:.6e} m³, but the cells that its triangles cut have {parts:.6e} m³"
    )]
    Undivided {
        /// Volume within the surface `[m³]`.
        volume: f64,
        /// Volume of the cells `[m³]`.
        parts: f64,
    },
    /// Corner outside of a face.
    #[error("the shape is not convex: {} lies {off:.3e} m outside of face {face}", shown(corner))]
    NotConvex {
        /// Number of the face, from 0.
        face: usize,
        /// Corner `[m]`.
        corner: Vector3<f64>,
        /// Distance from the face `[m]`.
        off: f64,
    },
}

fn shown(point: &Vector3<f64>) -> String {
    format!("[{}, {}, {}]", point.x, point.y, point.z)
}

fn times(n: usize) -> String {
    match n {
        0 => "no other face in the opposite direction".to_owned(),
        n => format!("{n} other faces"),
    }
}

impl Polyhedron {
    /// Box along the axes.
    ///
    /// # Errors
    ///
    /// If an edge has no length.
    pub fn brick(from: Vector3<f64>, to: Vector3<f64>) -> Result<Self, ShapeError> {
        let outline =
            Outline::new(&[[from.x, from.y], [to.x, from.y], [to.x, to.y], [from.x, to.y]])
                .map_err(|_| ShapeError::NoVolume)?;
        let along = |[x, y]: [f64; 2], z: f64| Vector3::new(x, y, z);
        let mut parts = prism(&outline, [from.z, to.z], along)?;
        parts.pop().ok_or(ShapeError::NoVolume)
    }

    /// Convex polyhedron with given faces, of any number of corners, counter-clockwise seen from
    /// outside.
    ///
    /// # Errors
    ///
    /// If faces are not planar, do not close, point inward, or the shape is not convex.
    pub fn from_faces(faces: &[Vec<Vector3<f64>>]) -> Result<Self, ShapeError> {
        let all = || faces.iter().flatten();
        let far = Vector3::repeat(f64::INFINITY);
        let (low, high) = all().fold((far, -far), |(low, high), x| (low.inf(x), high.sup(x)));
        let same = SAME * (high - low).norm();
        let mut points: Vec<Vector3<f64>> = Vec::new();
        let mut number = |x: &Vector3<f64>| {
            points.iter().position(|known| (known - x).norm() <= same).unwrap_or_else(|| {
                points.push(*x);
                points.len() - 1
            })
        };
        let mut numbered = Vec::with_capacity(faces.len());
        for (face, corners) in faces.iter().enumerate() {
            let mut corners: Vec<usize> = corners.iter().map(&mut number).collect();
            corners.dedup();
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            if corners.len() < 3 {
                return Err(ShapeError::FewCorners(face));
            }
            numbered.push(corners);
        }
        let shape = Self { points, faces: numbered };
        shape.check(same)?;
        Ok(shape)
    }

    /// Distance within which points of shapes are one, or lie on a plane, by the diagonal of the box around
    /// them `[m]`.
    #[must_use]
    pub fn tolerance(diagonal: f64) -> f64 {
        SAME * diagonal
    }

    /// True if two polyhedra have more than a layer of thickness `margin` `[m]` in common.
    #[must_use]
    pub fn overlaps(&self, other: &Self, margin: f64) -> bool {
        !Hull::of_part(self).apart(&Hull::of_part(other), margin)
    }

    /// Outward area vector of a face `[m²]`.
    pub(crate) fn area(&self, face: usize) -> Vector3<f64> {
        let corners = &self.faces[face];
        let at = |i: usize| self.points[corners[i]] - self.points[corners[0]];
        (2..corners.len())
            .map(|i| at(i - 1).cross(&at(i)) / 2.0)
            .fold(Vector3::zeros(), |sum, part| sum + part)
    }

    /// Outward unit normals and offsets of the faces.
    pub(crate) fn planes(&self) -> Vec<(Vector3<f64>, f64)> {
        let plane = |face: usize| {
            let normal = self.area(face).normalize();
            (normal, normal.dot(&self.points[self.faces[face][0]]))
        };
        (0..self.faces.len()).map(plane).collect()
    }

    /// Volume `[m³]`, negative if the faces point inward.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let Some(&origin) = self.points.first() else { return 0.0 };
        let cone =
            |face: usize| self.area(face).dot(&(self.points[self.faces[face][0]] - origin)) / 3.0;
        (0..self.faces.len()).map(cone).sum()
    }

    /// Checks that the faces are planar, close, point outward, and bound a convex body. Points within
    /// the distance `same` of a plane lie in it `[m]`.
    ///
    /// # Errors
    ///
    /// The first fault.
    pub fn check(&self, same: f64) -> Result<(), ShapeError> {
        if let Some(face) = self.faces.iter().position(|corners| corners.len() < 3) {
            return Err(ShapeError::FewCorners(face));
        }
        self.check_closed()?;
        for (face, (normal, offset)) in self.planes().into_iter().enumerate() {
            if !offset.is_finite() {
                return Err(ShapeError::FewCorners(face));
            }
            for &corner in &self.faces[face] {
                let off = (normal.dot(&self.points[corner]) - offset).abs();
                if off > same {
                    return Err(ShapeError::NotPlanar { face, off });
                }
            }
        }
        let volume = self.volume();
        let size = same / SAME;
        if volume.abs() <= SAME * size * size * size * SAME {
            return Err(ShapeError::NoVolume);
        }
        if volume < 0.0 {
            return Err(ShapeError::InsideOut);
        }
        for (face, (normal, offset)) in self.planes().into_iter().enumerate() {
            for corner in &self.points {
                let off = normal.dot(corner) - offset;
                if off > same {
                    return Err(ShapeError::NotConvex { face, corner: *corner, off });
                }
            }
        }
        Ok(())
    }

    /// Checks that each edge belongs to two faces, in opposite directions.
    ///
    /// # Errors
    ///
    /// The first edge that does not.
    pub fn check_closed(&self) -> Result<(), ShapeError> {
        let mut edges: HashMap<(usize, usize), usize> = HashMap::new();
        let sides = |corners: &[usize]| {
            let n = corners.len();
            (0..n).map(|i| (corners[i], corners[(i + 1) % n])).collect::<Vec<_>>()
        };
        for corners in &self.faces {
            for edge in sides(corners) {
                *edges.entry(edge).or_default() += 1;
            }
        }
        let count = |edge: (usize, usize)| edges.get(&edge).copied().unwrap_or(0);
        for (face, corners) in self.faces.iter().enumerate() {
            for (a, b) in sides(corners) {
                let (same, opposite) = (count((a, b)), count((b, a)));
                if (same, opposite) != (1, 1) {
                    let [from, to] = [a, b].map(|i| self.points[i]);
                    let n = if opposite == 0 { 0 } else { same + opposite - 1 };
                    return Err(ShapeError::Open { face, from, to, n });
                }
            }
        }
        Ok(())
    }
}

/// Convex parts of a prism: an outline at two distances along an axis. `point_at` gives the point at a
/// position in the outline and a distance; with it the three directions are right-handed.
///
/// # Errors
///
/// If the distances are equal.
pub fn prism(
    outline: &Outline,
    ends: [f64; 2],
    point_at: impl Fn([f64; 2], f64) -> Vector3<f64>,
) -> Result<Vec<Polyhedron>, ShapeError> {
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let size = outline.corners().iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    // Too thin for the tolerance of the cuts.
    if high - low <= 1e-12 * size.max(low.abs()).max(high.abs()) || !(high - low).is_finite() {
        return Err(ShapeError::NoVolume);
    }
    let part = |corners: &Vec<usize>| {
        let n = corners.len();
        let at = |end: f64| corners.iter().map(move |&i| (outline.corners()[i], end));
        let points = at(low).chain(at(high)).map(|(corner, end)| point_at(corner, end)).collect();
        let mut faces = vec![(0..n).rev().collect::<Vec<_>>(), (n..2 * n).collect()];
        faces.extend((0..n).map(|i| vec![i, (i + 1) % n, n + (i + 1) % n, n + i]));
        Polyhedron { points, faces }
    };
    Ok(outline.convex_parts().iter().map(part).collect())
}
