//! Contact forces on the nodes of a pack (§9).

use ddem_joint::contact::{ContactBlock, Contacts};
use ddem_mechanics::math::lanes::Lanes;

/// Adds the forces of all contacts to the forces of a pack, and their couples to its torques. The
/// fixed order of patches and points gives every node one order of summation.
pub(crate) fn collect(
    contacts: &Contacts,
    contact_blocks: &[ContactBlock],
    blocks: &[u32],
    f: &mut [Lanes],
    torque: &mut [Lanes; 3],
) {
    for &block in blocks {
        let block = block as usize;
        for (patch, side) in contacts.of(block) {
            patch.add_forces(side, block, &contact_blocks[block], f, torque);
        }
    }
}
