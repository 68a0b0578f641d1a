//! In which cells of a lattice points lie.

use std::ops::Range;

use super::{Lattice, Vec3};

impl Lattice {
    /// The cell that a point lies in.
    pub(crate) fn cell_at(&self, x: &Vec3) -> Option<[usize; 3]> {
        let mut cell = [0; 3];
        for (d, at) in cell.iter_mut().enumerate() {
            *at = self.cuts_below(d, x).checked_sub(1).filter(|&at| at < self.count[d])?;
        }
        Some(cell)
    }

    /// Cuts of an edge up to a point.
    fn cuts_below(&self, d: usize, x: &Vec3) -> usize {
        let normal = self.normal(d);
        let along = (x - self.origin).dot(&normal) / normal.dot(&self.axes[d]);
        self.cuts[d].partition_point(|cut| *cut <= along)
    }

    /// Cells along each edge that may lie among some points, those beside them included.
    pub(crate) fn cells_among(&self, points: &[Vec3]) -> [Range<usize>; 3] {
        [0, 1, 2].map(|d| {
            let below = || points.iter().map(|x| self.cuts_below(d, x));
            let (first, last) = (below().min().unwrap_or(0), below().max().unwrap_or(0));
            first.saturating_sub(2)..(last + 1).min(self.count[d])
        })
    }
}
