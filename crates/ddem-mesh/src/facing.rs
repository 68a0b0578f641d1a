//! Faces of two blocks that lie on each other.

use super::grid::overlapping_pairs;
use super::{BlockFace, Geometry, RestFace, bounds_of};
use ddem_mechanics::collide::overlap;

/// Distance within which faces count as lying on each other, as a fraction of a block edge.
pub const MISSES: f64 = 1e-4;
/// Largest square of the sine of the angle between faces that lie on each other.
const PARALLEL: f64 = 1e-8;
/// Least fraction of the smaller face that must lie over the other.
pub const SLIVER: f64 = 1e-6;

/// Overlap of two faces that face each other.
#[derive(Clone, Copy, Debug)]
pub struct FaceOverlap {
    /// Distance of the faces, negative if they penetrate each other `[m]`.
    pub gap: f64,
    /// Area in which the faces of their cells lie on each other, surrounding gaps included `[m²]`.
    pub area: f64,
}

impl Geometry {
    /// Positions of two faces at rest; `None` if they do not face each other.
    #[must_use]
    pub fn opposed(&self, faces: [BlockFace; 2]) -> Option<[RestFace; 2]> {
        let normals = faces.map(|face| face.outward(self));
        let opposed = normals[0].dot(&normals[1]) <= 0.0
            && normals[0].cross(&normals[1]).norm_squared() <= PARALLEL;
        opposed.then(|| faces.map(|face| face.at_rest(self)))
    }

    /// Tolerance of the distance of faces of two blocks that lie on each other `[m]`.
    #[must_use]
    pub fn misses(&self, blocks: [usize; 2]) -> f64 {
        let edges = blocks.map(|block| self.shortest_edge(block));
        MISSES * edges.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Overlap of two faces; `None` if their distance is outside a range or their overlap is below
    /// [`SLIVER`].
    #[must_use]
    pub fn face_overlap(
        &self,
        blocks: [usize; 2],
        faces: &[RestFace; 2],
        [least, most]: [f64; 2],
    ) -> Option<FaceOverlap> {
        let [own, other] = faces;
        let gap = (other.centre() - own.centre()).dot(&own.normal);
        let misses = self.misses(blocks);
        if gap < least - misses || gap > most + misses {
            return None;
        }
        // View along the normal.
        let along = (own.corners[1] - own.corners[0]).normalize();
        let across = own.normal.cross(&along);
        let flat = |corners: &[super::Vec3; 4]| corners.map(|x| [along.dot(&x), across.dot(&x)]);
        let over = |a: &[super::Vec3; 4], b: &[super::Vec3; 4]| -> f64 {
            overlap(&flat(a), &flat(b)).as_slice().iter().map(|v| v.area).sum()
        };
        let some = over(&own.corners, &other.corners) > SLIVER * own.area.min(other.area);
        some.then(|| FaceOverlap { gap, area: over(&own.whole, &other.whole) })
    }

    /// Pairs of blocks whose faces lie on each other without a gap.
    pub fn in_touch(&self) -> Vec<(usize, usize)> {
        let around = |block: usize| {
            let [low, high] = bounds_of(&self.corners(block));
            let margin = self.misses([block; 2]);
            [low.add_scalar(-margin), high.add_scalar(margin)]
        };
        let boxes: Vec<_> = (0..self.blocks.len()).map(around).collect();
        let touch = |&[a, b]: &[u32; 2]| {
            let blocks = [a as usize, b as usize];
            BlockFace::pairs(self, blocks).any(|faces| {
                let rest = self.opposed(faces);
                rest.is_some_and(|rest| self.face_overlap(blocks, &rest, [0.0; 2]).is_some())
            })
        };
        overlapping_pairs(&boxes)
            .into_iter()
            .filter(touch)
            .map(|[a, b]| (a as usize, b as usize))
            .collect()
    }
}
