//! Patches of each block, and their forces on it.

use super::bond_groups::BondGroups;
use super::{ContactBlock, Contacts, Patch};
use ddem_mechanics::math::lanes::Lanes;

impl Contacts {
    /// Patches of the body of a block, and the side of the body in each: 0 for a, 1 for b. Only some
    /// points of the patch of a cell are on the block, or none.
    #[inline]
    pub fn of(&self, block: usize) -> impl Iterator<Item = (&Patch, usize)> {
        let (from, to) = match self.starts.get(block..block + 2) {
            Some(&[from, to]) => (from as usize, to as usize),
            _ => (0, 0),
        };
        let entries = self.entries[from..to].iter();
        entries.map(|&entry| (&self.patches[entry as usize / 2], entry as usize % 2))
    }

    /// Adds the forces of all patches on a block to those of its pack, `f`, and their couples to the torque
    /// on the block. The fixed order of patches and points gives every node one order of summation. The
    /// list that a block without contacts has is in this order, too.
    pub fn collect(
        &self,
        block: usize,
        on: &ContactBlock,
        f: &mut [Lanes],
        torque: &mut [Lanes; 3],
    ) {
        if !on.rigid && !self.has_contacts[block] {
            self.joint_forces.add_to(block, [on.pack_start(), on.lane], f, torque);
            return;
        }
        for (patch, side) in self.of(block) {
            patch.add_forces(side, block, on, f, torque);
        }
    }

    /// Indexes the patches of each block. A joint is between two blocks, a contact between two bodies.
    pub fn index(&mut self) {
        self.patches.iter_mut().for_each(Patch::note_parts);
        let (patches, bodies, blocks) = (&self.patches, &self.bodies, self.joints.len());
        let mut counts = vec![0_u32; blocks + 1];
        let each = || {
            patches.iter().enumerate().flat_map(|(i, patch)| {
                [0, 1].into_iter().flat_map(move |side| {
                    // The blocks of a body follow each other.
                    let first = patch.blocks[side] as usize;
                    let is_own = |body: &&u32| patch.bond.is_none() && **body as usize == first;
                    let others = bodies.iter().skip(first + 1).take_while(is_own).count();
                    (first..=first + others).map(move |block| (i, side, block))
                })
            })
        };
        each().for_each(|(_, _, block)| counts[block + 1] += 1);
        for block in 0..blocks {
            counts[block + 1] += counts[block];
        }
        let mut next = counts.clone();
        let mut entries = vec![0; counts[blocks] as usize];
        let mut has_contacts = vec![false; blocks];
        for (patch, side, block) in each() {
            entries[next[block] as usize] = (2 * patch + side) as u32;
            next[block] += 1;
            has_contacts[block] |= patches[patch].bond.is_none();
        }
        (self.starts, self.entries, self.has_contacts) = (counts, entries, has_contacts);
        self.bond_groups = BondGroups::new(self);
        self.joint_forces.renew(&self.patches, blocks);
    }
}
