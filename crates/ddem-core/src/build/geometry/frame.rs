//! Reference of a `where`: the box around everything, and the sets.

use super::region::Flat;
use crate::deck::{Deck, Side};
use crate::geometry::{Lattice, Vec3, bounds, bounds_of};

/// The box around everything, and the sets of blocks.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// Corners of the box.
    pub(crate) bounds: [Vec3; 2],
    pub(super) sets: Vec<Set>,
}

/// One set of blocks.
#[derive(Clone, Debug)]
pub(super) struct Set {
    pub(super) name: Option<String>,
    /// Unit normals of the planes that cut its edges, and where along them its two ends are `[m]`.
    ends: [(Vec3, [f64; 2]); 3],
    corners: [Vec3; 8],
}

impl Frame {
    /// Of the lattices before any is refined.
    pub(super) fn new(deck: &Deck, lattices: &[Lattice]) -> Self {
        let set = |lattice: &Lattice| {
            let end = |d: usize| {
                let normal = lattice.normal(d);
                let (start, along) = (normal.dot(&lattice.origin), normal.dot(&lattice.axes[d]));
                let cuts = &lattice.cuts[d];
                let ends = [cuts.first(), cuts.last()].map(|cut| cut.copied().unwrap_or(0.0));
                (normal, ends.map(|cut| start + along * cut))
            };
            let (ends, corners) = ([0, 1, 2].map(end), lattice.corners());
            Set { name: deck.blocks[lattice.set].name.clone(), ends, corners }
        };
        Self { bounds: bounds(lattices), sets: lattices.iter().map(set).collect() }
    }

    /// Corners of the box around some sets.
    pub(super) fn bounds_of(&self, wanted: impl Fn(usize) -> bool) -> [Vec3; 2] {
        let sets = self.sets.iter().enumerate().filter(|(set, _)| wanted(*set));
        bounds_of(&sets.flat_map(|(_, set)| set.corners).collect::<Vec<_>>())
    }
}

impl Set {
    /// Normal of a side, and where it is along that `[m]`.
    pub(super) fn side(&self, side: Side) -> (Vec3, f64) {
        let (d, upper) = side.end();
        let (normal, ends) = self.ends[d];
        (normal, ends[usize::from(upper)])
    }

    /// The planes of its six sides, normals outward.
    pub(super) fn sides(&self) -> [Flat; 6] {
        std::array::from_fn(|k| {
            let (normal, ends) = self.ends[k / 2];
            let out = if k % 2 == 0 { -1.0 } else { 1.0 };
            Flat { normal: normal * out, at: ends[k % 2] * out, tolerance: 0.0 }
        })
    }

    /// Its corners, numbered by bits.
    pub(super) fn corners(&self) -> &[Vec3; 8] {
        &self.corners
    }
}
