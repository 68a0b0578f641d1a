//! Displacement of supports at once, between two equilibria.

use super::rigid::{follow_corners, held_increments};
use super::{Context, PackContext};
use crate::state::State;
use ddem_mechanics::math::lanes::LANES;
use ddem_mesh::parallel::node_start;

/// Moves supported nodes by the displacement increments `[m]` that the context has as velocities of
/// its supports. A rigid block follows the common motion of its supports. The velocities, zero
/// before, become these increments.
pub(crate) fn apply_support_displacements(context: Context<'_>, state: &mut State) {
    let packs = &context.model.packs;
    for (index, pack) in packs.packs.iter().enumerate() {
        let own = PackContext::new(context, index);
        let supports = own.supports.list;
        let increment =
            |fix: u32, axis: u8| context.view.velocities[fix as usize][usize::from(axis)];
        if supports.iter().all(|support| increment(support.fix, support.axis) == 0.0) {
            continue;
        }
        let nodes = node_start(packs, index)..node_start(packs, index + 1);
        let (u, support_increments) = (&mut state.u[nodes.clone()], &mut state.v[nodes]);
        if pack.rigid {
            let poses = &mut state.poses[pack.rigid_start];
            held_increments(&own, poses, support_increments);
            follow_corners(context.model, index, poses, u, support_increments);
        } else {
            for support in supports {
                let at = support.at as usize - 3 * pack.start;
                let lane = usize::from(support.lane);
                support_increments[at].0[lane] = increment(support.fix, support.axis);
            }
            for (u, increment) in u.iter_mut().zip(&*support_increments) {
                (0..LANES).for_each(|lane| u.0[lane] += increment.0[lane]);
            }
        }
        // The length of an increment is at most √3 times its largest component.
        let far = |lane: usize| {
            support_increments.iter().map(|increment| increment.0[lane].abs()).fold(0.0, f64::max)
        };
        state.contacts.add_travel(index, std::array::from_fn(|lane| 1.733 * far(lane)));
    }
}
