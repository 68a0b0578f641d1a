//! Requests for the memory of the next broken lattices. Each has several allocations, one known from
//! another, so that the processor cannot foresee them.

use std::slice::from_ref;

use prefetch_index::prefetch_index;

use super::points::SpringLanes;
use super::{BrokenLattice, BrokenLattices};

/// Pairs of a lattice that are requested; the processor follows long fields by itself.
const PAIRS: usize = 4;

/// Requests the memory of the lattices of pack `next`, and on the way to it that of the two packs
/// after it.
pub fn prefetch(packs: &[BrokenLattices], next: usize) {
    if let Some(Some(lattices)) = packs.get(next + 2) {
        line(&lattices[0]);
        line(&lattices[7]);
    }
    if let Some(Some(lattices)) = packs.get(next + 1) {
        lattices.iter().flatten().for_each(|lattice| lattice.prefetch());
    }
    if let Some(Some(lattices)) = packs.get(next) {
        for lattice in [1, 2, 4].into_iter().filter_map(|offset| lattices[offset].as_deref()) {
            lattice.points.prefetch();
        }
    }
}

/// Requests the cache line of a value.
fn line<T>(value: &T) {
    prefetch_index(from_ref(value), 0);
}

impl BrokenLattice {
    fn prefetch(&self) {
        line(&self.points.springs);
        line(&self.points.failed);
        line(&self.moved);
        line(&self.failed);
        line(&self.any_alive);
    }
}

impl super::LatticePoints {
    fn prefetch(&self) {
        if let Some(modes) = self.modes.first() {
            line(modes);
        }
        for SpringLanes { area, origin, traction, gap } in self.springs.iter().take(PAIRS) {
            line(area);
            line(&origin[1]);
            line(&traction[0]);
            line(gap);
        }
        for failed in self.failed.iter().take(PAIRS) {
            line(&failed.slip);
            line(&failed.dilation);
            line(&failed.applied_dilation);
            line(&failed.energy_excess);
        }
    }
}
