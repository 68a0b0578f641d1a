//! Contact forces on the nodes of a pack (§9).

use ddem_joint::contact::{ContactBlock, Contacts};
use ddem_mechanics::math::lanes::Lanes;

/// Adds the forces of all contacts and nonconforming joints to the forces of a pack, and their couples to
/// its torques.
pub(crate) fn collect(
    contacts: &Contacts,
    contact_blocks: &[ContactBlock],
    blocks: &[u32],
    f: &mut [Lanes],
    torque: &mut [Lanes; 3],
) {
    for &block in blocks {
        contacts.collect(block as usize, &contact_blocks[block as usize], f, torque);
    }
}
