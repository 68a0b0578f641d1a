//! Cells whose contact is left to joints.

use std::collections::HashMap;

use super::{Configuration, Contacts, JointStatus};

/// Joints between cells.
pub(super) struct JoinedCells<'a> {
    configuration: Configuration<'a>,
    /// Pairs of cells with joints that no contact has replaced, sorted.
    held: Vec<[u32; 2]>,
    /// Pairs of cells whose joints contacts have replaced, sorted.
    released: Vec<[u32; 2]>,
    /// Whole blocks beside each whole block, with joints in place between them.
    in_place: HashMap<u32, Vec<u32>>,
}

impl<'a> JoinedCells<'a> {
    pub(super) fn new(contacts: &Contacts, configuration: &Configuration<'a>) -> Self {
        let mut joined = Self {
            configuration: *configuration,
            held: Vec::new(),
            released: Vec::new(),
            in_place: HashMap::new(),
        };
        if contacts.bodies.is_empty() {
            return joined;
        }
        for patch in &contacts.patches {
            let Some(bond) = patch.bond else { continue };
            joined.held.push(patch.blocks.map(|block| contacts.body(block)));
            let [a, b] = patch.blocks.map(|block| joined.whole(block));
            if bond.status == JointStatus::InPlace {
                joined.in_place.entry(a).or_default().push(b);
                joined.in_place.entry(b).or_default().push(a);
            }
        }
        let of_ended = contacts.ended.iter().map(|ended| ended.blocks);
        joined.released = of_ended.map(|pair| pair.map(|block| contacts.body(block))).collect();
        for pairs in [&mut joined.held, &mut joined.released] {
            pairs.sort_unstable();
            pairs.dedup();
        }
        joined.in_place.values_mut().for_each(|beside| {
            beside.sort_unstable();
            beside.dedup();
        });
        joined
    }

    /// First block of the whole block that a block belongs to.
    fn whole(&self, block: u32) -> u32 {
        self.configuration.cell_of(block).map_or(block, |cell| cell.whole)
    }

    fn beside(&self, whole: u32) -> &[u32] {
        self.in_place.get(&whole).map_or(&[], Vec::as_slice)
    }

    /// True if two bodies, of which at least one is a cell, have joints between them, or are
    /// connected by at most three joints in place one after the other. Cells of one whole block meet
    /// only where a joint between them, a slit in the block, has been released.
    pub(super) fn are_left_to_joints(&self, bodies: [u32; 2]) -> bool {
        if bodies.iter().all(|&body| self.configuration.cell_of(body).is_none()) {
            return false;
        }
        let [a, b] = bodies.map(|body| self.whole(body));
        if self.held.binary_search(&bodies).is_ok() {
            return true;
        }
        if a == b {
            return self.released.binary_search(&bodies).is_err();
        }
        let of_b = self.beside(b);
        let reaches = |whole: &u32| of_b.binary_search(whole).is_ok();
        let of_a = self.beside(a);
        of_a.binary_search(&b).is_ok()
            || of_a.iter().any(reaches)
            || of_a.iter().any(|&next| self.beside(next).iter().any(reaches))
    }
}
