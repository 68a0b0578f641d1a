//! Contact forces on the nodes of a pack (§9).

use ddem_joint::contact::{ContactBlock, ContactPoint, Contacts};
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// Adds the forces of all contacts to the forces of a pack, and their couples to its torques. The
/// fixed order of patches and points gives every node one order of summation.
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
            let (contact_block, first) = (&contact_block[block as usize], patch.blocks[side]);
            let is_own = |point: &&ContactPoint| point.points[side].block(first) == block as usize;
            let own = patch.points.iter().filter(is_own);
            for point in own.filter(|point| patch.may_carry_force(point)) {
                let force = patch.force(point) * sign;
                for (node, weight) in contact_block.weights(&point.points[side]) {
                    for c in 0..3 {
                        f[3 * node + c].0[lane] += weight * force[c];
                    }
                }
            }
            if usize::from(patch.reference) == side && first == block {
                (0..3).for_each(|c| torque[c].0[lane] += patch.couple[c]);
            }
        }
    }
}
