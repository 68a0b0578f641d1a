//! Damping of the bodies that slide, with the velocities that a step is about to give them.
//!
//! Forces of the velocity of before, half a step old, would make the critical step shorter.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use super::Context;
use crate::element::corotation::Frame;
use crate::force::{damping, shares, support};
use crate::lanes::{Lanes, load, splat};
use crate::motion::Update;
use crate::scratch::Part;

/// Slows the deformation of the bodies of a pack: `f −= α/(1 + α Δt) M (v* − v̄*)` with the `v*` that (M2) gives under
/// the forces of all others, so that `α M (v⁺ − v̄⁺)` is what acts; in the first half step of a stage with
/// the velocities at its start.
#[simd]
pub(super) fn slow_down<S: Simd>(
    simd: S,
    context: Context<'_>,
    index: usize,
    alpha: Lanes,
    (u, v, frame): (&[Lanes], &[Lanes], &Frame),
    part: &mut Part<'_>,
) {
    let Context { model, motion, .. } = context;
    let time_step = if motion.start { 0.0 } else { motion.time_step };
    part.room.clear();
    part.room.extend_from_slice(v);
    if !motion.start {
        let class = context.coefficients(index);
        let update = Update::new(simd, motion);
        for (at, (ahead, f)) in part.room.iter_mut().zip(&*part.f).enumerate() {
            let abc = [&class.a, &class.b, &class.c].map(|numbers| numbers[at].load(simd));
            let (ahead_now, _) = update.velocity(abc, ahead.load(simd), f.load(simd));
            *ahead = Lanes::from(ahead_now);
        }
        let held = &context.active.supports[context.active.supports_of(index)];
        let first = 3 * model.packs.packs[index].start;
        support::enforce(held, context.velocities, first, part.room);
    }
    let rate = alpha.load(simd) / (alpha.load(simd) * time_step + splat(simd, 1.0));
    let whose = (&model.packs, &model.assembly);
    let turning = model.corotational().then_some(frame);
    if motion.stiffness == 0.0 {
        part.viscous.fill(Lanes::ZERO);
    }
    let motions = (Lanes::from(rate), u, &part.room[..]);
    let torque = damping::damp(simd, whose, index, turning, motions, (part.f, part.viscous));
    if let Some(frame) = turning {
        shares::spread_torque(simd, whose, index, frame, load(simd, &torque), part.f);
    }
}
