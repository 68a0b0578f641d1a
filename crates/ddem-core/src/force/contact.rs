//! §9: what the contacts of a pack's bodies do to their nodes.

use ddem_joint::contact::{ContactBlock, Contacts};
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// Adds the forces of all contacts to the forces of a pack, and their couples to its torques. Patches
/// and points in order, so that every node has one order of summation.
pub(crate) fn collect(
    contacts: &Contacts,
    contact_block: &[ContactBlock],
    blocks: &[u32],
    f: &mut [Lanes],
    torque: &mut [Lanes; 3],
) {
    for (lane, &block) in blocks.iter().enumerate().take(LANES) {
        for (patch, side) in contacts.of(block as usize) {
            let sign = if side == 0 { 1.0 } else { -1.0 };
            let (contact_block, face) = (&contact_block[block as usize], patch.faces()[side]);
            for point in patch.points.iter().filter(|point| patch.acts(point)) {
                let force = patch.force(point) * sign;
                for (node, weight) in contact_block.weights(face, &point.spots[side]) {
                    for c in 0..3 {
                        f[3 * node + c].0[lane] += weight * force[c];
                    }
                }
            }
            if usize::from(patch.reference) == side {
                (0..3).for_each(|c| torque[c].0[lane] += patch.couple[c]);
            }
        }
    }
}
