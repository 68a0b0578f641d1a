//! Damping of sliding blocks, with the velocities at the end of a step.
//!
//! Damping forces of the former velocities, half a step old, would reduce the critical step.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use super::PackContext;
use crate::force::{damping, neighbour_forces};
use crate::model::Model;
use crate::state::motion::{Motion, advanced};
use crate::step::scratch::PackFields;
use ddem_mechanics::math::lanes::{Lanes, load, splat};

/// Computes the velocities `v*` that (M2) gives under all other forces in `part.buffer`. `tied` has the
/// sums of the forces on tied nodes, or nothing if the forces are these sums already.
#[inline(always)]
pub(super) fn look_ahead<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    tied: &[[f64; 3]],
    part: &mut PackFields<'_>,
) {
    let PackFields { blocks, buffer, f, .. } = part;
    buffer.clear();
    buffer.extend_from_slice(f);
    if !tied.is_empty() {
        pack.step.model.ties.share(pack.index, tied, 3 * pack.pack.start, buffer);
    }
    for (at, (ahead, v)) in buffer.iter_mut().zip(blocks.v.get()).enumerate() {
        let [a, b, _] = pack.class.load(simd, at);
        *ahead = Lanes::from(advanced([a, b], v.load(simd), ahead.load(simd)));
    }
    pack.supports.enforce(buffer);
}

/// Rate `α/(1 + α h)` that acts on the velocities `v*` `[1/s]`.
#[inline(always)]
pub(super) fn damping_rate<S: Simd>(simd: S, alpha: Lanes, motion: &Motion) -> f64x4<S> {
    let alpha = alpha.load(simd);
    alpha / (alpha * motion.interval + splat(simd, 1.0))
}

/// Damps the deformation of the blocks of a pack: `f −= α/(1 + α h) M (v* − v̄*)` with the `v*`
/// that (M2) gives under all other forces. The force that acts is then `α M (v⁺ − v̄⁺)`. The forces on
/// cells are complete already.
#[simd]
pub(super) fn damp_deformation<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    part: &mut PackFields<'_>,
) {
    let Some(alpha) = pack.step.slides(pack.index) else { return };
    let (model, motion) = (pack.step.model, pack.step.motion);
    if model.sliding.cells.has(pack.index) {
        return;
    }
    look_ahead(simd, pack, &[], part);
    let PackFields { blocks, buffer, f, viscous, .. } = part;
    let Model { packs, assembly, .. } = model;
    let frame = model.corotational().then_some(&blocks.frames.get()[0]);
    if motion.stiffness == 0.0 {
        viscous.fill(Lanes::ZERO);
    }
    let (index, alpha) = (pack.index, Lanes::from(damping_rate(simd, alpha, motion)));
    let slides = damping::SlidingPack { packs, assembly, index, frame, alpha };
    let torque = damping::damp(simd, slides, blocks.u.get(), buffer, f, viscous);
    if let Some(frame) = frame {
        let torque = load(simd, &torque);
        neighbour_forces::spread_torque(simd, packs, assembly, index, frame, torque, None, f);
    }
}
