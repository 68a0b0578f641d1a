//! Displacement of supports at once, between two equilibria.

use fearless_simd::dispatch;

use super::relaxing::move_bodies;
use super::rigid::{follow_corners, held_increments};
use super::{Context, PackContext, bodies};
use crate::state::State;
use crate::step::scratch::Scratch;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::parallel::node_start;

/// Moves supported nodes by the displacement increments `[m]` that the context has as velocities of
/// its supports. A rigid block follows the common motion of its supports. The velocities, zero
/// before, become these increments.
pub(crate) fn apply_support_displacements(
    context: Context<'_>,
    state: &mut State,
    scratch: &mut Scratch,
) {
    let packs = &context.model.packs;
    let increment = |fix: u32, axis: u8| context.view.velocities[fix as usize][usize::from(axis)];
    bodies::held_increments(context, &state.poses, &mut state.v);
    for (index, pack) in packs.packs.iter().enumerate() {
        let own = PackContext::new(context, index);
        let nodes = node_start(packs, index)..node_start(packs, index + 1);
        let (u, increments) = (&mut state.u[nodes.clone()], &mut state.v[nodes]);
        if pack.rigid {
            held_increments(&own, &state.poses[pack.rigid_start], increments);
        } else {
            for support in own.supports.list {
                let at = support.at as usize - 3 * pack.start;
                increments[at].0[usize::from(support.lane)] = increment(support.fix, support.axis);
            }
        }
        if increments.iter().all(|increment| *increment == Lanes::ZERO) {
            continue;
        }
        if pack.rigid {
            let poses = &mut state.poses[pack.rigid_start];
            dispatch!(scratch.level, simd => {
                follow_corners(simd, context.model, index, poses, u, increments)
            });
        } else {
            for (u, increment) in u.iter_mut().zip(&*increments) {
                (0..LANES).for_each(|lane| u.0[lane] += increment.0[lane]);
            }
        }
        // The length of an increment is at most √3 times its largest component.
        let far = |lane: usize| {
            increments.iter().map(|increment| increment.0[lane].abs()).fold(0.0, f64::max)
        };
        state.contacts.add_travel(index, std::array::from_fn(|lane| 1.733 * far(lane)));
    }
    move_bodies(context.model, state, scratch);
}
