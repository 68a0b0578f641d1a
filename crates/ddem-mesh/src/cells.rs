//! Cells of a lattice and nodes: lookup by position, and neighbours.

use std::ops::Range;

use super::{Geometry, Lattice, Vec3};
use ddem_mechanics::collide::FaceId;

/// Cell or node with another number along an axis.
///
/// Rust 1.95 loses a number that is written into the copy of an array, if its index is known at run
/// time only. The tests search the source for that pattern.
pub fn moved_to(cell: [usize; 3], axis: usize, number: usize) -> [usize; 3] {
    std::array::from_fn(|k| if k == axis { number } else { cell[k] })
}

impl Lattice {
    /// Cell that contains a point.
    pub fn cell_at(&self, x: &Vec3) -> Option<[usize; 3]> {
        let mut cell = [0; 3];
        for (d, at) in cell.iter_mut().enumerate() {
            *at = self.cuts_below(d, x).checked_sub(1).filter(|&at| at < self.count[d])?;
        }
        Some(cell)
    }

    /// Number of cuts of an edge up to a point.
    fn cuts_below(&self, d: usize, x: &Vec3) -> usize {
        let normal = self.normal(d);
        let along = (x - self.origin).dot(&normal) / normal.dot(&self.axes[d]);
        self.cuts[d].partition_point(|cut| *cut <= along)
    }

    /// Cells along each edge that may lie among some points, including adjacent cells.
    pub fn cells_among(&self, points: &[Vec3]) -> [Range<usize>; 3] {
        [0, 1, 2].map(|d| {
            let below = || points.iter().map(|x| self.cuts_below(d, x));
            let (first, last) = (below().min().unwrap_or(0), below().max().unwrap_or(0));
            first.saturating_sub(2)..(last + 1).min(self.count[d])
        })
    }
}

impl Geometry {
    /// Facing node across the gap along d, if the node lies at an end of its block along d.
    pub fn partner(&self, block: usize, at: [usize; 3], d: usize) -> Option<(usize, [usize; 3])> {
        let n = self.topology(block).divisions();
        let side = match at[d] {
            0 => -1,
            i if i == n => 1,
            _ => return None,
        };
        self.step(block, at, d, side)
    }

    /// Next node along d, in the same block or across a gap.
    pub fn step(
        &self,
        block: usize,
        at: [usize; 3],
        d: usize,
        side: i32,
    ) -> Option<(usize, [usize; 3])> {
        let n = self.topology(block).divisions();
        let in_block = if side < 0 { at[d] > 0 } else { at[d] < n };
        if in_block {
            let next = if side < 0 { at[d] - 1 } else { at[d] + 1 };
            return Some((block, moved_to(at, d, next)));
        }
        let face = FaceId { direction: d, upper: side > 0 };
        let next = if side < 0 { n } else { 0 };
        Some((self.beyond(block, face)?, moved_to(at, d, next)))
    }
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    use super::moved_to;

    /// Neighbours of two cells, found by code in which the compiler may copy arrays wrongly.
    #[inline(never)]
    fn neighbours(n: usize) -> Vec<[usize; 3]> {
        let upper = |c: [usize; 3], d: usize| (c[d] + 1 < n).then(|| moved_to(c, d, c[d] + 1));
        let lower = |c: [usize; 3], d: usize| (c[d] > 0).then(|| moved_to(c, d, c[d] - 1));
        let mut found = Vec::new();
        for c in [[6, 3, 3], [7, 0, 11]] {
            for d in 0..3 {
                found.extend(upper(c, d));
                found.extend(lower(c, d));
            }
        }
        found
    }

    #[test]
    fn cell_neighbours_are_right_in_this_profile() {
        let first = [[7, 3, 3], [5, 3, 3], [6, 4, 3], [6, 2, 3], [6, 3, 4], [6, 3, 2]];
        let second = [[8, 0, 11], [6, 0, 11], [7, 1, 11], [7, 0, 10]];
        assert_eq!(neighbours(black_box(12)), [&first[..], &second[..]].concat());
    }
}
