//! §6: one explicit step, t → t + Δt. Read this first.
//!
//! The paper's two passes, each over packs of four blocks. [`forces`]: the loop over bodies and
//! joints, forces from displacements; pairs fail there. [`advance`]: what meets at a node is added up, in one
//! order, and the nodes move. The order of physics inside a pack is read in [`balance_pack`] and
//! [`advance_pack`].

mod context;
mod driving;
mod first;
mod powers;
mod relaxing;
mod rigid;
mod sliding;

use std::ops::Range;

use fearless_simd::{Simd, SimdBase, dispatch};
use fearless_simd_macros::simd;

use crate::breaks::{Breaks, Losses};
use crate::contact::Contacts;
use crate::element::corotation::Frame;
use crate::force::boundary;
use crate::force::contact;
use crate::force::external::{self, External};
use crate::force::shares;
use crate::force::support;
use crate::frames::{fit_pack, frame_of};
use crate::lanes::{Lanes, load, splat};
use crate::motion::{Update, local_damping};
use crate::parallel::{node_start, rigid_start, spread};
use crate::scratch::{Balancing, Moving, Part, Scratch};
use crate::state::State;
use crate::sums::{Sums, Tally};

use powers::{applied, drag_power, support_power};

pub(crate) use context::Context;
pub(crate) use driving::shift;
pub(crate) use first::{Pass, forces, input, internal_forces};
pub(crate) use relaxing::advance_relaxing;
pub(crate) use rigid::{Poses, before, carry, present};

/// What others do to the nodes of a pack: joint shares, and contacts.
type Others<'a> = (&'a [Lanes], &'a Contacts);

/// One explicit step, eq. (2) in the form (M2). Returns the sums over all nodes at time t and what
/// the joints lost on the way there; nothing, and nothing moves, where it waits for failure.
#[doc(alias = "eq 2")]
pub(crate) fn step(
    context: Context<'_>,
    state: &mut State,
    scratch: &mut Scratch,
) -> Option<(Sums, Losses)> {
    let State { u, v, breaks, contacts, .. } = &mut *state;
    let losses = forces(context.pass((u, v), false), breaks, Some(contacts), scratch);
    if context.waits && losses.failed != [0; 2] {
        return None;
    }
    let sums = advance(context, state, scratch);
    state.steps += 1;
    let (time, step) = state.origin;
    state.time = time + (state.steps - step) as f64 * context.motion.time_step;
    state.whole = false;
    Some((sums, losses))
}

/// What a step from this state would do, without moving: forces, reactions and sums at time t,
/// and strain energies if they are asked for. `breaks` goes where the step would take it.
pub(crate) fn balance(
    context: Context<'_>,
    (u, v, poses): (&[Lanes], &[Lanes], &[Poses]),
    (breaks, contacts): (&mut Breaks, &mut Contacts),
    scratch: &mut Scratch,
    energies: bool,
) -> (Sums, Losses) {
    let losses = forces(context.pass((u, v), energies), breaks, Some(contacts), scratch);
    let (fields, frames, shares, runs, level) =
        scratch.balancing((context.active, context.outside), context.has_viscous());
    let others = (shares, &*contacts);
    let fixed = (&*frames, others, poses);
    spread(&context.model.packs, runs, fields, &|run, mut fields: Balancing<'_>| {
        dispatch!(level, simd => run_balance(simd, context, (u, v), fixed, &run, &mut fields));
    });
    (Sums::total(&scratch.sums), losses)
}

/// Second pass: forces meet at the nodes, and the nodes move.
fn advance(context: Context<'_>, state: &mut State, scratch: &mut Scratch) -> Sums {
    let State { u, v, poses, contacts, .. } = state;
    let (fields, shares, runs, level) =
        scratch.moving((context.active, context.outside), context.has_viscous(), (u, v, poses));
    let others = (shares, &*contacts);
    spread(&context.model.packs, runs, fields, &|run, mut fields: Moving<'_>| {
        dispatch!(level, simd => run_advance(simd, context, others, &run, &mut fields));
    });
    scratch.travel(contacts, context.motion.time_step);
    Sums::total(&scratch.sums)
}

#[simd]
fn run_advance<S: Simd>(
    simd: S,
    context: Context<'_>,
    others: Others<'_>,
    run: &Range<usize>,
    fields: &mut Moving<'_>,
) {
    let packs = &context.model.packs;
    let (first_node, first_rigid) = (node_start(packs, run.start), rigid_start(packs, run.start));
    for index in run.clone() {
        let nodes =
            node_start(packs, index) - first_node..node_start(packs, index + 1) - first_node;
        let frame = &mut fields.frames[index - run.start];
        let (u, v) = (&mut fields.u[nodes.clone()], &mut fields.v[nodes]);
        let mut part = fields.balancing.pack(
            context.active,
            packs,
            (run.start, index),
            context.is_viscous(index),
        );
        let pack = &packs.packs[index];
        if pack.rigid {
            let poses = &mut fields.poses[pack.rigid_start - first_rigid];
            balance_pack(simd, context, index, (u, v, frame), (others, Some(poses)), &mut part);
            let power =
                |v: &[Lanes], part: &Part<'_>| support_power(context, index, v, part.reactions);
            let before = power(v, &part);
            rigid::advance(context, index, &mut part, (poses, u, v));
            part.sums.supports = [before, power(v, &part)];
            *frame = frame_of(poses);
            continue;
        }
        balance_pack(simd, context, index, (u, v, frame), (others, None), &mut part);
        advance_pack(simd, context, index, &mut part, (u, v));
        if context.model.corotational() {
            *frame = fit_pack(simd, context.model, index, u);
        }
    }
}

#[simd]
fn run_balance<S: Simd>(
    simd: S,
    context: Context<'_>,
    (u, v): (&[Lanes], &[Lanes]),
    (frames, others, poses): (&[Frame], Others<'_>, &[Poses]),
    run: &Range<usize>,
    fields: &mut Balancing<'_>,
) {
    let packs = &context.model.packs;
    for index in run.clone() {
        let nodes = node_start(packs, index)..node_start(packs, index + 1);
        let (u, v) = (&u[nodes.clone()], &v[nodes]);
        let mut part =
            fields.pack(context.active, packs, (run.start, index), context.is_viscous(index));
        let pack = &packs.packs[index];
        let poses = if pack.rigid { poses.get(pack.rigid_start) } else { None };
        balance_pack(simd, context, index, (u, v, &frames[index]), (others, poses), &mut part);
        if let Some(poses) = poses {
            rigid::weigh(context, index, (v, poses), &mut part);
            part.sums.supports[0] = support_power(context, index, v, part.reactions);
            continue;
        }
        let class = context.coefficients(index);
        let mass = &context.model.assembly.inertia[context.inertia(index)].mass;
        let update = Update::new(simd, context.motion);
        let divisions = packs.shape_of(pack).divisions;
        let mut tally = Tally::new(simd, divisions);
        let damped = context.motion.damped || part.is_viscous();
        for (at, (f, v)) in part.f.iter().zip(v).enumerate() {
            if at > 0 && at % (3 * (divisions + 1)) == 0 {
                tally.end_row(simd);
            }
            let abc = [class.a[at].load(simd), class.b[at].load(simd), class.c[at].load(simd)];
            let (old, force) = (v.load(simd), f.load(simd));
            if context.motion.fictitious {
                tally.relaxed(force, old);
                if part.loaded {
                    tally.loaded(part.q[at].load(simd), old, old);
                }
                continue;
            }
            let local = local_damping(simd, context.motion.local, force, old);
            let (new, c) = update.velocity(abc, old, force - local);
            let mass = mass[at / 3].load(simd);
            let start = context.motion.start;
            tally.force(force);
            if part.loaded {
                tally.loaded(part.q[at].load(simd), old, new);
            }
            if start {
                tally.whole(mass, old, new);
            } else {
                tally.kinetic(mass, old, new);
            }
            if damped {
                let mean = if start { old } else { (old + new) * 0.5 };
                tally.damped(local + c * mean + part.viscous(simd, at), old, new);
            }
        }
        tally.end_row(simd);
        tally.give(part.sums);
        part.sums.supports[0] = support_power(context, index, v, part.reactions);
        part.sums.damping[0] += drag_power(context, index, v, part.drags);
    }
}

/// Adds up the forces at the nodes of a pack: `F = Q − f_body − f_joint + R`.
#[simd]
fn balance_pack<S: Simd>(
    simd: S,
    context: Context<'_>,
    index: usize,
    (u, v, frame): (&[Lanes], &[Lanes], &Frame),
    ((shares, contacts), poses): (Others<'_>, Option<&Poses>),
    part: &mut Part<'_>,
) {
    let model = context.model;
    let pack = &model.packs.packs[index];
    let first = 3 * pack.start;
    // What the joints at the lower sides do, and what the derivative of R adds.
    shares::collect(simd, &model.packs, index, shares, part.f, part.torque);
    if let Some(surfaces) = &model.contact {
        let own = (&surfaces.blocks[..], &pack.bodies[..pack.filled]);
        contact::collect(contacts, own, part.f, part.torque);
    }
    if model.corotational() && poses.is_none() {
        let torque = load(simd, part.torque);
        shares::spread_torque(simd, (&model.packs, &model.assembly), index, frame, torque, part.f);
    }
    // Loads.
    let n = part.f.len();
    if part.q.len() < n {
        part.q.resize(n, Lanes::ZERO);
    }
    let q = &mut part.q[..n];
    let external = External {
        gravity: context.gravity,
        loads: context.active.loads_of(index),
        factors: context.factors,
    };
    let mass = &model.assembly.inertia[context.inertia(index)].mass;
    let mut loaded = external::apply(simd, external, mass, first, q);
    let (dashpots, pushes) = (context.dashpots(index), context.pushes(index));
    if !dashpots.is_empty() {
        boundary::push(dashpots, pushes, first, (q, loaded));
        loaded = true;
    }
    if loaded {
        external::add_to(simd, part.f, q);
    }
    if let Some(alpha) = context.slides(index).filter(|_| poses.is_none()) {
        sliding::slow_down(simd, context, index, alpha, (u, v, frame), part);
    }
    // Supports answer with what is missing.
    let supports = &context.active.supports[context.active.supports_of(index)];
    let class = context.coefficients(index);
    if let Some(poses) = poses {
        rigid::react(context, index, poses, part);
    } else {
        if !dashpots.is_empty() {
            let fields = (first, v, &mut *part.f);
            let (motion, velocities) = (context.motion, context.velocities);
            let dashpots = (dashpots, pushes);
            boundary::resist(motion, class, dashpots, velocities, fields, part.drags);
        }
        let fields = (first, v, &mut *part.f);
        support::react(context.motion, class, supports, context.velocities, fields, part.reactions);
    }
    let q = loaded.then_some(&part.q[..n]);
    part.sums.applied = applied(q, supports, part.reactions, first);
    part.loaded = loaded;
}

/// Moves the nodes of a pack: velocities (M2), then displacements.
#[simd]
fn advance_pack<S: Simd>(
    simd: S,
    context: Context<'_>,
    index: usize,
    part: &mut Part<'_>,
    (u, v): (&mut [Lanes], &mut [Lanes]),
) {
    let motion = context.motion;
    let class = context.coefficients(index);
    let first = 3 * context.model.packs.packs[index].start;
    let update = Update::new(simd, motion);
    let divisions = context.model.packs.shape_of(&context.model.packs.packs[index]).divisions;
    let mut tally = Tally::new(simd, divisions);
    let damped = motion.damped || part.is_viscous();
    let mut sums = Sums { applied: part.sums.applied, ..Sums::default() };
    sums.supports[0] = support_power(context, index, v, part.reactions);
    let drawn = drag_power(context, index, v, part.drags);
    let row = 3 * (divisions + 1);
    for (number, (f, v)) in part.f.chunks(row).zip(v.chunks_mut(row)).enumerate() {
        for (at, (f, v)) in (number * row..).zip(f.iter().zip(v)) {
            let abc = [class.a[at].load(simd), class.b[at].load(simd), class.c[at].load(simd)];
            let (old, force) = (v.load(simd), f.load(simd));
            let local = local_damping(simd, motion.local, force, old);
            let (new, c) = update.velocity(abc, old, force - local);
            tally.force(force);
            if part.loaded {
                tally.loaded(part.q[at].load(simd), old, new);
            }
            if damped {
                let mean = if motion.start { old } else { (old + new) * 0.5 };
                tally.damped(local + c * mean + part.viscous(simd, at), old, new);
            }
            *v = Lanes::from(new);
        }
        tally.end_row(simd);
    }
    let held = &context.active.supports[context.active.supports_of(index)];
    support::enforce(held, context.velocities, first, v);
    let time_step = splat(simd, motion.time_step);
    let mut fastest = splat(simd, 0.0);
    for (u, v) in u.iter_mut().zip(&*v) {
        let v = v.load(simd);
        *u = Lanes::from(u.load(simd) + time_step * v);
        fastest = fastest.max(v.abs());
    }
    sums.fastest = Lanes::from(fastest);
    tally.give(&mut sums);
    sums.supports[1] = support_power(context, index, v, part.reactions);
    sums.damping[0] += drawn;
    sums.damping[1] += drag_power(context, index, v, part.drags);
    *part.sums = sums;
}
