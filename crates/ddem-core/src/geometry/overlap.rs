//! Which sets of blocks overlap, and which touch.

use super::Vec3;
use super::lattice::{Lattice, NONE, bounds_of};
use crate::deck::Deck;
use crate::error::Fault;

/// Sets whose blocks overlap. A set may fill what was removed from another.
pub(super) fn overlaps(lattices: &[Lattice], deck: &Deck) -> Vec<Fault> {
    let name = |i: usize| deck.blocks[i].name.clone().unwrap_or_else(|| format!("blocks[{i}]"));
    let mut faults = Vec::new();
    for (j, b) in lattices.iter().enumerate() {
        for (i, a) in lattices[..j].iter().enumerate() {
            if overlap(a, &a.corners(), b, &b.corners()).is_none() {
                continue;
            }
            let cells_a = a.cells_near(&bounds_of(&b.corners()));
            let cells_b = b.cells_near(&bounds_of(&a.corners()));
            let depths = cells_b.iter().flat_map(|cb| {
                let near = bounds_of(cb);
                let close = cells_a.iter().filter(move |ca| meet(&bounds_of(*ca), &near));
                close.filter_map(|ca| overlap(a, ca, b, cb))
            });
            let depth = depths.fold(0.0, f64::max);
            if depth > 0.0 {
                faults.push(
                    Fault::new(
                        format!("blocks[{j}].origin"),
                        format!(
                            "its blocks overlap those of the set `{}` by {depth:.3e} m",
                            name(i)
                        ),
                    )
                    .help("move one of the sets: sets may touch, not overlap"),
                );
            }
        }
    }
    faults
}

/// Pairs of sets that have no gap between them.
pub(super) fn touching(lattices: &[Lattice]) -> Vec<(usize, usize)> {
    let pairs = (0..lattices.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let touch = |&(i, j): &(usize, usize)| {
        let (a, b) = (&lattices[i], &lattices[j]);
        depth(a, &a.corners(), b, &b.corners()).is_some_and(|(depth, size)| depth >= -1e-9 * size)
    };
    pairs.filter(touch).collect()
}

/// Depth by which two parallelepipeds overlap.
fn overlap(a: &Lattice, in_a: &[Vec3; 8], b: &Lattice, in_b: &[Vec3; 8]) -> Option<f64> {
    depth(a, in_a, b, in_b).filter(|(depth, size)| *depth > 1e-9 * size).map(|(depth, _)| depth)
}

/// Depth (negative: gap, at least this wide) and size of two parallelepipeds, by separating axes.
fn depth(a: &Lattice, in_a: &[Vec3; 8], b: &Lattice, in_b: &[Vec3; 8]) -> Option<(f64, f64)> {
    let normals = (0..3).flat_map(|d| [a.normal(d), b.normal(d)]);
    let crossed = (0..9).map(|k| a.axes[k / 3].cross(&b.axes[k % 3]));
    let mut depth = f64::INFINITY;
    let size = (in_a[7] - in_a[0]).norm() + (in_b[7] - in_b[0]).norm();
    for axis in normals.chain(crossed).filter(|axis| axis.norm() > 1e-9) {
        let axis = axis.normalize();
        let range = |corners: &[Vec3; 8]| {
            let along = corners.iter().map(|x| x.dot(&axis));
            along.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)))
        };
        let ((lo_a, hi_a), (lo_b, hi_b)) = (range(in_a), range(in_b));
        depth = depth.min(hi_a.min(hi_b) - lo_a.max(lo_b));
    }
    depth.is_finite().then_some((depth, size))
}

impl Lattice {
    /// Corners of the cells that have a body and meet a box of space.
    fn cells_near(&self, bounds: &[Vec3; 2]) -> Vec<[Vec3; 8]> {
        let bodies = (0..self.body.len()).filter(|&i| self.body[i] != NONE);
        let cells = bodies.map(|i| self.cell(i)).map(|c| self.corners_of(c, c.map(|i| i + 1)));
        cells.filter(|corners| meet(&bounds_of(corners), bounds)).collect()
    }
}

fn meet(a: &[Vec3; 2], b: &[Vec3; 2]) -> bool {
    (0..3).all(|k| a[0][k] <= b[1][k] && b[0][k] <= a[1][k])
}
