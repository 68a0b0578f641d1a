//! Removal of the strip and corner elements that touch a failed pair.

use super::{BrokenJoints, BrokenLattice};
use ddem_mechanics::math::lanes::LANES;
use ddem_mesh::assembly::{Assembly, NO_TABLE};
use ddem_mesh::pack::{JointLattice, Packs};

/// An element of a strip or a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct StripElement {
    /// Lattice of the strip or corner.
    pub lattice: JointLattice,
    /// Number of the element in the lattice.
    pub element: usize,
    /// Lane of the pack.
    pub lane: usize,
}

impl BrokenJoints {
    /// Live strip and corner elements around the pairs that failed since the last call, sorted and
    /// without duplicates.
    pub fn strips_around_failures(
        &mut self,
        packs: &Packs,
        assembly: &Assembly,
    ) -> Vec<StripElement> {
        let mut cells = Vec::new();
        for (index, lattices) in self.packs.iter_mut().enumerate() {
            let Some(lattices) = lattices else { continue };
            for d in 0..3 {
                let Some(lattice) = &mut lattices[1 << d] else { continue };
                for (pair, lane) in lattice.newly_failed.drain(..) {
                    around(packs, index, d, pair as usize, lane as usize, &mut cells);
                }
            }
        }
        cells.retain(|&StripElement { lattice: JointLattice { pack, offset }, element, lane }| {
            let table = assembly.pack_tables[pack][offset];
            table != NO_TABLE
                && assembly.tables[table as usize].elements[lane].is_some()
                && self.get(pack, offset).is_none_or(|l| l.alive[element].0[lane] != 0.0)
        });
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Removes elements of strip and corner lattices.
    pub fn remove(&mut self, packs: &Packs, assembly: &Assembly, cells: &[StripElement]) {
        for &StripElement { lattice: JointLattice { pack, offset }, element, lane } in cells {
            let tables = assembly.pack_tables[pack];
            let lattice = self.at(pack)[offset].get_or_insert_with(|| {
                Box::new(BrokenLattice::intact(packs, &packs.packs[pack], tables, offset))
            });
            lattice.alive[element].0[lane] = 0.0;
            let elements = assembly.tables[tables[offset] as usize].elements;
            lattice.any_alive = (0..LANES).any(|lane| {
                elements[lane].is_some() && lattice.alive.iter().any(|alive| alive.0[lane] != 0.0)
            });
        }
    }
}

/// Adds the strip and corner elements across the joint of direction `d` that hold both nodes of a
/// pair.
fn around(
    packs: &Packs,
    index: usize,
    d: usize,
    pair: usize,
    lane: usize,
    cells: &mut Vec<StripElement>,
) {
    let pack = &packs.packs[index];
    let n = packs.numbering_of(pack).divisions;
    let [e, f] = [(d + 1) % 3, (d + 2) % 3];
    let at = [pair % (n + 1), pair / (n + 1)];
    // Directions at whose ends the pair lies, as bits.
    let ends = |want: usize| -> usize {
        [(e, at[0]), (f, at[1])].iter().filter(|(_, i)| *i == want).map(|(axis, _)| 1 << axis).sum()
    };
    let (upper, lower) = (ends(n), ends(0));
    for crossed in [1 << e, 1 << f, 1 << e | 1 << f] {
        if crossed & !(upper | lower) != 0 {
            continue;
        }
        // The block on the lower side owns the cells.
        let owner = match crossed & lower {
            0 => Some((index, lane)),
            down => pack.lower[down].at(lane),
        };
        let Some((owner, lane)) = owner else { continue };
        let offset = 1 << d | crossed;
        // The pair touches the strip elements on both sides of its line.
        let along = if crossed == 1 << e { at[1] } else { at[0] };
        let elements = if offset == 7 { 0..1 } else { along.saturating_sub(1)..(along + 1).min(n) };
        let lattice = JointLattice { pack: owner, offset };
        cells.extend(elements.map(|element| StripElement { lattice, element, lane }));
    }
}
