//! Contact forces on the nodes of a pack (§9).

use ddem_joint::contact::{ContactBlock, Contacts};
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// Adds the forces of all contacts to the forces of a pack, and their couples to its torques. The
/// fixed order of patches and points gives every node one order of summation.
pub(crate) fn collect(
    contacts: &Contacts,
    contact_blocks: &[ContactBlock],
    blocks: &[u32],
    f: &mut [Lanes],
    torque: &mut [Lanes; 3],
) {
    for (lane, &block) in blocks.iter().enumerate().take(LANES) {
        for (patch, side) in contacts.of(block as usize) {
            patch.add_forces(side, block as usize, &contact_blocks[block as usize], f);
            if usize::from(patch.reference) == side && patch.blocks[side] == block {
                (0..3).for_each(|c| torque[c].0[lane] += patch.couple[c]);
            }
        }
    }
}
