//! Faces of two blocks that lie on each other.

use super::{Geometry, Vec3};
use crate::collide::{FaceOf, overlap};

/// Part of a block's edge by which faces that lie on each other may miss.
pub const MISSES: f64 = 1e-4;
/// Square of the sine of the angle between faces that lie on each other, at most.
const PARALLEL: f64 = 1e-8;
/// Part of the smaller face that is over the other at least.
pub const SLIVER: f64 = 1e-6;

/// A face of a block at rest.
#[derive(Clone, Copy, Debug)]
pub struct RestFace {
    /// Outward unit normal.
    pub normal: Vec3,
    /// Corners, in order around the face `[m]`.
    pub corners: [Vec3; 4],
    /// Area `[m²]`.
    pub area: f64,
    /// Corners of the face of its cell, up to the middle of the gaps around `[m]`.
    pub whole: [Vec3; 4],
}

impl RestFace {
    /// Centre of its corners `[m]`.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 4.0
    }
}

/// Overlap of two faces that look at each other.
#[derive(Clone, Copy, Debug)]
pub struct FaceOverlap {
    /// Distance of the faces, negative where they are in each other `[m]`.
    pub gap: f64,
    /// Area of their cells' faces that lie on each other, gaps around included `[m²]`.
    pub area: f64,
}

impl Geometry {
    /// A face of a block at rest.
    #[must_use]
    pub fn rest_face(&self, body: usize, face: FaceOf) -> RestFace {
        let corners = self.corners(body);
        let (d, e, f) = (face.direction, (face.direction + 1) % 3, (face.direction + 2) % 3);
        let low = usize::from(face.upper) << d;
        let corners = [0, 1 << e, (1 << e) | (1 << f), 1 << f].map(|k| corners[low | k]);
        let out = if face.upper { 1.0 } else { -1.0 };
        let cross = (corners[1] - corners[0]).cross(&(corners[3] - corners[0]));
        let lattice = self.lattice(body);
        let cell = self.bodies[body].cell.map(|c| c as usize);
        let [a, b, c, opposite] = lattice.faces(cell, d)[usize::from(face.upper)];
        let normal = lattice.normal(d) * out;
        RestFace { normal, corners, area: cross.norm(), whole: [a, b, opposite, c] }
    }

    /// Two faces of blocks, if they look at each other.
    #[must_use]
    pub fn opposed(&self, bodies: [usize; 2], faces: [FaceOf; 2]) -> Option<[RestFace; 2]> {
        let normals = [0, 1].map(|side| {
            let out = if faces[side].upper { 1.0 } else { -1.0 };
            self.lattice(bodies[side]).normal(faces[side].direction) * out
        });
        let opposed = normals[0].dot(&normals[1]) <= 0.0
            && normals[0].cross(&normals[1]).norm_squared() <= PARALLEL;
        opposed.then(|| [0, 1].map(|side| self.rest_face(bodies[side], faces[side])))
    }

    /// Distance by which faces of two blocks that lie on each other may miss `[m]`.
    #[must_use]
    pub fn misses(&self, bodies: [usize; 2]) -> f64 {
        let edges = bodies.map(|body| self.shortest_edge(body));
        MISSES * edges.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Overlap of two faces whose distance is in a range.
    #[must_use]
    pub fn face_overlap(
        &self,
        bodies: [usize; 2],
        faces: &[RestFace; 2],
        [least, most]: [f64; 2],
    ) -> Option<FaceOverlap> {
        let [own, other] = faces;
        let gap = (other.centre() - own.centre()).dot(&own.normal);
        let misses = self.misses(bodies);
        if gap < least - misses || gap > most + misses {
            return None;
        }
        // Seen along the normal.
        let along = (own.corners[1] - own.corners[0]).normalize();
        let across = own.normal.cross(&along);
        let flat = |corners: &[Vec3; 4]| corners.map(|x| [along.dot(&x), across.dot(&x)]);
        let over = |a: &[Vec3; 4], b: &[Vec3; 4]| -> f64 {
            overlap(&flat(a), &flat(b)).as_slice().iter().map(|v| v.area).sum()
        };
        let some = over(&own.corners, &other.corners) > SLIVER * own.area.min(other.area);
        some.then(|| FaceOverlap { gap, area: over(&own.whole, &other.whole) })
    }
}
