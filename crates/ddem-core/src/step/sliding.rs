//! Damping of sliding blocks, with the velocities at the end of a step.
//!
//! Damping forces of the former velocities, half a step old, would reduce the critical step.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use super::PackContext;
use crate::force::{damping, neighbour_forces};
use crate::model::Model;
use crate::state::motion::advanced;
use crate::step::scratch::PackFields;
use ddem_mechanics::math::lanes::{Lanes, load, splat};

/// Damps the deformation of the blocks of a pack: `f −= α/(1 + α h) M (v* − v̄*)` with the `v*`
/// that (M2) gives under all other forces. The force that acts is then `α M (v⁺ − v̄⁺)`.
#[simd]
pub(super) fn damp_deformation<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    part: &mut PackFields<'_>,
) {
    let Some(alpha) = pack.step.slides(pack.index) else { return };
    let (model, motion) = (pack.step.model, pack.step.motion);
    let PackFields { blocks, buffer, f, viscous, .. } = part;
    buffer.clear();
    buffer.extend_from_slice(blocks.v.get());
    for (at, (ahead, f)) in buffer.iter_mut().zip(&**f).enumerate() {
        let [a, b, _] = pack.class.load(simd, at);
        *ahead = Lanes::from(advanced([a, b], ahead.load(simd), f.load(simd)));
    }
    pack.supports.enforce(buffer);
    let alpha = alpha.load(simd);
    let rate = alpha / (alpha * motion.interval + splat(simd, 1.0));
    let Model { packs, assembly, .. } = model;
    let frame = model.corotational().then_some(&blocks.frames.get()[0]);
    if motion.stiffness == 0.0 {
        viscous.fill(Lanes::ZERO);
    }
    let (index, alpha) = (pack.index, Lanes::from(rate));
    let slides = damping::SlidingPack { packs, assembly, index, frame, alpha };
    let torque = damping::damp(simd, slides, blocks.u.get(), buffer, f, viscous);
    if let Some(frame) = frame {
        let torque = load(simd, &torque);
        neighbour_forces::spread_torque(simd, packs, assembly, index, frame, torque, None, f);
    }
}
