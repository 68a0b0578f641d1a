//! The sets of blocks, to which the sides and the tolerance of a `where` refer.

use ddem_core::problem::{Lattice, Set, Sets, Vec3, bounds, bounds_of};

use super::region::Flat;
use crate::schema::{Deck, Side};

/// The sets of a deck, from their lattices before any is refined.
pub(super) fn sets(deck: &Deck, lattices: &[Lattice]) -> Sets {
    let set = |lattice: &Lattice| {
        let end = |d: usize| {
            let normal = lattice.normal(d);
            let (start, along) = (normal.dot(&lattice.origin), normal.dot(&lattice.axes[d]));
            let cuts = &lattice.cuts[d];
            let ends = [cuts.first(), cuts.last()].map(|cut| cut.copied().unwrap_or(0.0));
            (normal, ends.map(|cut| start + along * cut))
        };
        Set {
            name: deck.blocks[lattice.set].name.clone(),
            label: deck.set_name(lattice.set),
            ends: [0, 1, 2].map(end),
            corners: lattice.corners(),
        }
    };
    Sets { bounds: bounds(lattices), list: lattices.iter().map(set).collect() }
}

/// Corners of the box around some sets.
pub(super) fn bounds_of_sets(sets: &Sets, wanted: impl Fn(usize) -> bool) -> [Vec3; 2] {
    let sets = sets.list.iter().enumerate().filter(|(set, _)| wanted(*set));
    bounds_of(&sets.flat_map(|(_, set)| set.corners).collect::<Vec<_>>())
}

/// Normal of a side of a set, and its position along that `[m]`.
pub(super) fn side(set: &Set, side: Side) -> (Vec3, f64) {
    let (d, upper) = side.end();
    let (normal, ends) = set.ends[d];
    (normal, ends[usize::from(upper)])
}

/// Planes of the six sides of a set, normals outward.
pub(super) fn sides(set: &Set) -> [Flat; 6] {
    std::array::from_fn(|k| {
        let (normal, ends) = set.ends[k / 2];
        let out = if k % 2 == 0 { -1.0 } else { 1.0 };
        Flat { normal: normal * out, at: ends[k % 2] * out, tolerance: 0.0 }
    })
}
