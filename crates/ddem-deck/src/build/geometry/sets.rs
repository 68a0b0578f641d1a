//! Sets of blocks, to which the sides and the tolerance of a `where` refer.

use std::sync::Arc;

use ddem_core::problem::{Lattice, Set, Sets, Vec3, bounds_of};

use super::selector::PlaneEquation;
use crate::schema::{BlockSet, Deck, Side};

/// Sets of a deck: its regions, and its sets of blocks from their lattices before refinement.
pub(super) fn sets(deck: &Deck, regions: Vec<Set>, lattices: &[Arc<Lattice>]) -> Sets {
    let set = |(index, entry): (usize, &BlockSet)| {
        let number = deck.set_number(index);
        let [from, to] =
            [number, number + 1].map(|set| lattices.partition_point(|lattice| lattice.set < set));
        let (ends, corners) = match &lattices[from..to] {
            [lattice] if entry.mesh.is_none() => (ends_of(lattice), lattice.corners()),
            own => box_around(own),
        };
        Set { name: entry.name.clone(), label: deck.set_name(number), ends, corners }
    };
    let list = regions.into_iter().chain(deck.blocks.iter().enumerate().map(set)).collect();
    let mut sets = Sets { bounds: [Vec3::zeros(); 2], list };
    sets.bounds = bounds_of_sets(&sets, |_| true);
    sets
}

/// Unit normals of the sides of a set, and positions of its two ends along them.
pub(in crate::build) type Ends = [(Vec3, [f64; 2]); 3];

fn ends_of(lattice: &Lattice) -> Ends {
    [0, 1, 2].map(|d| {
        let normal = lattice.normal(d);
        let (start, along) = (normal.dot(&lattice.origin), normal.dot(&lattice.axes[d]));
        let cuts = &lattice.cuts[d];
        let ends = [cuts.first(), cuts.last()].map(|cut| cut.copied().unwrap_or(0.0));
        (normal, ends.map(|cut| start + along * cut))
    })
}

/// Sides and corners of the box along the coordinate axes around the blocks of a mesh.
fn box_around(lattices: &[Arc<Lattice>]) -> (Ends, [Vec3; 8]) {
    box_of(&lattices.iter().flat_map(|lattice| lattice.corners()).collect::<Vec<_>>())
}

/// Sides and corners of the box along the coordinate axes around points.
pub(in crate::build) fn box_of(points: &[Vec3]) -> (Ends, [Vec3; 8]) {
    let [low, high] = bounds_of(points);
    let end = |d: usize, k: usize| if k >> d & 1 == 1 { high[d] } else { low[d] };
    let corner = |k: usize| Vec3::from([0, 1, 2].map(|d| end(d, k)));
    let ends = [0, 1, 2].map(|d| (Vec3::ith(d, 1.0), [low[d], high[d]]));
    (ends, std::array::from_fn(corner))
}

/// Corners of the box around some sets.
pub(super) fn bounds_of_sets(sets: &Sets, wanted: impl Fn(usize) -> bool) -> [Vec3; 2] {
    let sets = sets.list.iter().enumerate().filter(|(set, _)| wanted(*set));
    bounds_of(&sets.flat_map(|(_, set)| set.corners).collect::<Vec<_>>())
}

/// Normal of a side of a set, and the position of the side along the normal `[m]`.
pub(super) fn side(set: &Set, side: Side) -> (Vec3, f64) {
    let (d, upper) = side.end();
    let (normal, ends) = set.ends[d];
    (normal, ends[usize::from(upper)])
}

/// Planes of the six sides of a set, with outward normals.
pub(super) fn sides(set: &Set) -> [PlaneEquation; 6] {
    std::array::from_fn(|k| {
        let (normal, ends) = set.ends[k / 2];
        let out = if k % 2 == 0 { -1.0 } else { 1.0 };
        PlaneEquation { normal: normal * out, at: ends[k % 2] * out, tolerance: 0.0 }
    })
}
