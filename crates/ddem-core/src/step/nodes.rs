//! Second pass over the nodes of a pack of deformable blocks (§6).

use fearless_simd::{Simd, SimdBase};
use fearless_simd_macros::simd;

use super::{NeighbourForces, PackContext};
use crate::force::external::{self, External};
use crate::force::{contact, neighbour_forces};
use crate::model::Model;
use crate::state::motion::{advanced, local_of_four};
use crate::step::frames::fit_pack;
use crate::step::scratch::{Access, PackFields};
use ddem_mechanics::math::lanes::{Lanes, load, splat};
use ddem_mechanics::math::sums::{StepSums, SumsByRow};

/// Adds the forces of others: of joints at the lower sides, of contacts, and those due to the
/// derivative of R.
#[simd]
pub(super) fn collect<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    others: NeighbourForces<'_>,
    part: &mut PackFields<'_>,
) {
    let (model, index) = (pack.step.model, pack.index);
    neighbour_forces::collect(
        simd,
        &model.packs,
        index,
        others.neighbour_forces,
        part.f,
        part.torque,
    );
    if let Some(contact_model) = &model.contact {
        let blocks = &pack.pack.blocks[..pack.pack.filled];
        contact::collect(others.contacts, &contact_model.blocks, blocks, part.f, part.torque);
    }
    if model.corotational() && !pack.is_rigid() {
        let torque = load(simd, part.torque);
        let (frame, Model { packs, assembly, .. }) = (&part.blocks.frames.get()[0], model);
        neighbour_forces::spread_torque(simd, packs, assembly, index, frame, torque, part.f);
    }
}

/// Adds loads, and boundary forces that do not depend on the motion.
#[simd]
pub(super) fn add_loads<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let external = External {
        gravity: pack.step.gravity,
        loads: pack.step.view.conditions.loads_of(pack.index),
        factors: &pack.step.view.factors,
    };
    part.loaded = external::apply(simd, external, pack.mass, pack.supports.first, part.q);
    if !pack.dashpots.list.is_empty() {
        if !part.loaded {
            part.q.fill(Lanes::ZERO);
        }
        pack.dashpots.push(part.q);
        part.loaded = true;
    }
    if part.loaded {
        external::add_to(simd, part.f, part.q);
    }
}

/// Adds the forces of boundary dashpots.
pub(super) fn resist(pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let v = part.blocks.v.get();
    pack.dashpots.resist(pack.step.motion, pack.class, v, part.f, part.drags);
}

/// Adds the reactions of supports.
pub(super) fn react(pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let v = part.blocks.v.get();
    pack.supports.react(pack.step.motion, pack.class, v, part.f, part.reactions);
}

/// Computes the sums of a relaxation, which moves the nodes by a pass of its own.
#[simd]
pub(super) fn relaxation_sums<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let v = part.blocks.v.get();
    let mut tally = SumsByRow::new(simd, pack.divisions);
    let row = pack.row();
    for (number, (f, v)) in part.f.chunks(row).zip(v.chunks(row)).enumerate() {
        for (at, (f, v)) in (number * row..).zip(f.iter().zip(v)) {
            let v = v.load(simd);
            tally.relaxed(f.load(simd), v);
            if part.loaded {
                tally.loaded(part.q[at].load(simd), v, v);
            }
        }
        tally.end_row(simd);
    }
    let mut sums = StepSums { applied: part.sums.applied, ..StepSums::default() };
    tally.give(&mut sums);
    sums.supports[0] = pack.supports.power(v, part.reactions);
    *part.sums = sums;
}

/// Advances velocities by (M2), then displacements. A trial computes the sums only, including those
/// of energy.
#[simd]
pub(super) fn advance<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let motion = pack.step.motion;
    let damped = motion.is_damped() || part.is_viscous();
    let PackFields { blocks, f, viscous, sums, reactions, drags, q, loaded, room, .. } = part;
    let trial = matches!(blocks.v, Access::Read(_));
    let v = match &mut blocks.v {
        Access::Write(v) => &mut **v,
        Access::Read(v) => {
            room.clear();
            room.extend_from_slice(v);
            &mut room[..]
        }
    };
    let mut own = StepSums { applied: sums.applied, ..StepSums::default() };
    own.supports[0] = pack.supports.power(v, reactions);
    let drawn = pack.dashpots.power(v, drags);
    // The kinetic energy uses a velocity as far after the present time as `old` is before it.
    let ratio = splat(simd, motion.previous_step_ratio());
    let changes = motion.before != motion.time_step;
    let mut tally = SumsByRow::new(simd, pack.divisions);
    let row = pack.row();
    for (number, (f, v)) in f.chunks(row).zip(v.chunks_mut(row)).enumerate() {
        for (at, (f, v)) in (number * row..).zip(f.iter().zip(v)) {
            let numbers = pack.class.load(simd, at);
            let (old, force) = (v.load(simd), f.load(simd));
            let local = local_of_four(simd, motion.local, force, old);
            let new = advanced(numbers, old, force - local);
            tally.force(force);
            if *loaded {
                tally.loaded(q[at].load(simd), old, new);
            }
            if damped {
                let viscous = viscous.get(at).map_or(splat(simd, 0.0), |lanes| lanes.load(simd));
                tally.damped(local + numbers[2] * ((old + new) * 0.5) + viscous, old, new);
            }
            if trial || changes {
                let mass = pack.mass[at / 3].load(simd);
                tally.kinetic(mass, old, if changes { old + ratio * (new - old) } else { new });
                if changes {
                    tally.change(mass, old, new - old);
                }
            }
            *v = Lanes::from(new);
        }
        tally.end_row(simd);
    }
    pack.supports.enforce(v);
    tally.give(&mut own);
    own.supports[1] = pack.supports.power(v, reactions);
    own.damping[0] += drawn;
    own.damping[1] += pack.dashpots.power(v, drags);
    if let Some(u) = blocks.u.get_mut() {
        own.fastest = displace(simd, motion.time_step, v, u);
        if pack.step.model.corotational() {
            let frame = fit_pack(simd, pack.step.model, pack.index, u);
            blocks.frames.get_mut().into_iter().for_each(|frames| frames[0] = frame);
        }
    }
    **sums = own;
}

/// Moves the nodes, `u⁺ = u + Δt v⁺`; returns the largest velocity component `[m/s]`.
#[inline(always)]
fn displace<S: Simd>(simd: S, time_step: f64, v: &[Lanes], u: &mut [Lanes]) -> Lanes {
    let time_step = splat(simd, time_step);
    let mut fastest = splat(simd, 0.0);
    for (u, v) in u.iter_mut().zip(v) {
        let v = v.load(simd);
        *u = Lanes::from(u.load(simd) + time_step * v);
        fastest = fastest.max(v.abs());
    }
    Lanes::from(fastest)
}
