//! §6: one explicit step, t → t + Δt. Read this first.
//!
//! The paper's two passes, each over packs of four blocks. [`forces`]: the loop over bodies and
//! joints, forces from displacements. [`advance`]: what meets at a node is added up, in one
//! order, and the nodes move. The order of physics inside a pack is read in [`balance_pack`] and
//! [`advance_pack`].

use std::ops::Range;

use fearless_simd::{Simd, SimdBase, SimdFloat, dispatch, f64x4};
use fearless_simd_macros::simd;

use crate::assembly::NO_TABLE;
use crate::breaks::{Breaks, Broken, Look, Losses};
use crate::cluster::{self, Clusters};
use crate::conditions::{Active, Support};
use crate::element::corotation::Frame;
use crate::force::body::body;
use crate::force::external::{self, External};
use crate::force::joint::{cell_energy, joint};
use crate::force::shares;
use crate::force::support;
use crate::frames::fit_pack;
use crate::kinematics::Moved;
use crate::lanes::{LANES, Lanes, load, splat};
use crate::model::Model;
use crate::motion::{Motion, Update};
use crate::parallel::{node_start, share_start, spread};
use crate::pass::{Input, Output, Workspace};
use crate::scratch::{Balancing, Forces, Moving, Part, Relaxing, Scratch};
use crate::state::State;
use crate::sums::{Sums, Tally};

/// What a step needs to know besides the model and the state.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) model: &'a Model,
    pub(crate) active: &'a Active,
    pub(crate) motion: &'a Motion,
    /// Factor of each load at time t.
    pub(crate) factors: &'a [f64],
    /// Gravity times its factor `[m/s²]`.
    pub(crate) gravity: [f64; 3],
    /// Velocity of each fix half a step ahead `[m/s]`.
    pub(crate) velocities: &'a [[f64; 3]],
    /// As in [`Pass`].
    pub(crate) failing: Option<f64>,
    /// Present time `[s]`.
    pub(crate) time: f64,
}

/// What the first pass looks at.
#[derive(Clone, Copy)]
pub(crate) struct Pass<'a> {
    pub(crate) model: &'a Model,
    /// Displacements `[m]`.
    pub(crate) u: &'a [Lanes],
    /// Pairs fail whose traction, divided by this, is still beyond their strength; `None`: none.
    pub(crate) failing: Option<f64>,
    /// Present time `[s]`.
    pub(crate) time: f64,
    /// Velocities of the last half step and its time step, if there was one.
    pub(crate) last: Option<(&'a [Lanes], f64)>,
    /// Bodies by pack and lane that have supports.
    pub(crate) held: &'a [[bool; LANES]],
    /// Without the rotations of the blocks, whatever the kinematics.
    pub(crate) linear: bool,
    pub(crate) energies: bool,
}

impl<'a> Pass<'a> {
    /// The linear model, in which nothing fails.
    pub(crate) fn linear(model: &'a Model, u: &'a [Lanes]) -> Self {
        Self {
            model,
            u,
            failing: None,
            time: 0.0,
            last: None,
            held: &[],
            linear: true,
            energies: false,
        }
    }
}

/// One explicit step, eq. (2) in the form (M2). Returns the sums over all nodes at time t and what
/// the joints lost on the way there.
#[doc(alias = "eq 2")]
pub(crate) fn step(
    context: Context<'_>,
    state: &mut State,
    scratch: &mut Scratch,
) -> (Sums, Losses) {
    let losses = forces(context.pass((&state.u, &state.v), false), &mut state.breaks, scratch);
    let sums = advance(context, state, scratch);
    state.steps += 1;
    let (time, step) = state.origin;
    state.time = time + (state.steps - step) as f64 * context.motion.time_step;
    state.whole = false;
    (sums, losses)
}

/// What a step from this state would do, without moving: forces, reactions and sums at time t,
/// and strain energies if they are asked for. `breaks` goes where the step would take it.
pub(crate) fn balance(
    context: Context<'_>,
    (u, v): (&[Lanes], &[Lanes]),
    breaks: &mut Breaks,
    scratch: &mut Scratch,
    energies: bool,
) -> (Sums, Losses) {
    let losses = forces(context.pass((u, v), energies), breaks, scratch);
    let (fields, frames, shares, runs, level) = scratch.balancing(context.active);
    let fixed = (v, frames, shares);
    spread(&context.model.packs, runs, fields, &|run, mut fields: Balancing<'_>| {
        dispatch!(level, simd => run_balance(simd, context, fixed, &run, &mut fields));
    });
    (Sums::total(&scratch.sums), losses)
}

/// First pass: `f ← −K u` of the bodies, eq. (8), and of the joints, eq. (11) and §5, in each
/// block's frame. Pairs fail, springs slip.
pub(crate) fn forces(pass: Pass<'_>, breaks: &mut Breaks, scratch: &mut Scratch) -> Losses {
    let level = scratch.level;
    let model = pass.model;
    let (fields, frames, runs) = scratch.forces(breaks, pass.energies);
    let input = input(pass, frames);
    spread(&model.packs, runs, fields, &|run, fields: Forces<'_>| {
        dispatch!(level, simd => run_forces(simd, input, &run, fields));
    });
    let mut losses = Losses::total(&scratch.losses);
    if losses.failed != [0; 2] {
        losses.fracture += remove_cells(pass, breaks, scratch);
    }
    losses
}

pub(crate) fn input<'a>(pass: Pass<'a>, frames: &'a [Frame]) -> Input<'a> {
    let Pass { model, u, failing, time, last, held, linear, .. } = pass;
    let frames = (model.corotational() && !linear).then_some(frames);
    Input {
        moved: Moved { packs: &model.packs, u, frames },
        assembly: &model.assembly,
        seams: &model.seams,
        look: Look { failing, time, laws: &model.laws },
        last,
        held,
    }
}

/// Takes out the strips and corners around pairs that have just failed: from the next pass on.
/// Returns the energy that was in them `[J]`.
fn remove_cells(pass: Pass<'_>, breaks: &mut Breaks, scratch: &mut Scratch) -> f64 {
    let Model { packs, assembly, .. } = pass.model;
    let cells = breaks.touched(packs, assembly);
    let mut work = Workspace::default();
    let mut lost = 0.0;
    for cells in cells.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let at = (cells[0].0, cells[0].1);
        let input = input(pass, &scratch.frames);
        let mut energy = |breaks: &Breaks| {
            dispatch!(scratch.level, simd => {
                cell_energy(simd, input, at, breaks.get(at.0, at.1), &mut work)
            })
        };
        lost += energy(breaks);
        breaks.remove(packs, assembly, cells);
        lost -= energy(breaks);
    }
    lost
}

/// `f ← −K u` of the bodies and joints, added up at the nodes, without loads or supports.
pub(crate) fn internal_forces(pass: Pass<'_>, breaks: &mut Breaks, scratch: &mut Scratch) {
    forces(pass, breaks, scratch);
    scratch.collect(pass.model, pass.linear);
}

#[simd]
fn run_forces<S: Simd>(simd: S, input: Input<'_>, run: &Range<usize>, fields: Forces<'_>) {
    let packs = input.moved.packs;
    let (first_node, first_share) = (node_start(packs, run.start), share_start(packs, run.start));
    for pack in run.clone() {
        let nodes = node_start(packs, pack) - first_node..node_start(packs, pack + 1) - first_node;
        let shares =
            share_start(packs, pack) - first_share..share_start(packs, pack + 1) - first_share;
        let mut out = Output {
            f: &mut fields.f[nodes],
            shares: &mut fields.shares[shares],
            torque: &mut fields.torques[pack - run.start],
            energy: fields.energies.get_mut(pack - run.start).map(|energy| {
                *energy = [Lanes::ZERO; 2];
                energy
            }),
            losses: &mut fields.losses[pack - run.start],
        };
        out.shares.fill(Lanes::ZERO);
        *out.losses = Losses::default();
        let work = &mut fields.workspaces[0].elements;
        body(simd, input, pack, &mut out, work);
        let breaks = &mut fields.breaks[pack - run.start];
        let tables = input.assembly.pack_tables[pack];
        for offset in 1..8 {
            let mut broken = breaks.as_mut().and_then(|lattices| lattices[offset].take());
            if broken.as_ref().map_or(tables[offset] != NO_TABLE, Broken::acts) {
                joint(simd, input, (pack, offset), &mut broken, &mut out, work);
            }
            if broken.is_some() {
                breaks.get_or_insert_with(Box::default)[offset] = broken;
            }
        }
    }
}

/// Second pass: forces meet at the nodes, and the nodes move.
fn advance(context: Context<'_>, state: &mut State, scratch: &mut Scratch) -> Sums {
    let (fields, shares, runs, level) = scratch.moving(context.active, state);
    spread(&context.model.packs, runs, fields, &|run, mut fields: Moving<'_>| {
        dispatch!(level, simd => run_advance(simd, context, shares, &run, &mut fields));
    });
    Sums::total(&scratch.sums)
}

#[simd]
fn run_advance<S: Simd>(
    simd: S,
    context: Context<'_>,
    shares: &[Lanes],
    run: &Range<usize>,
    fields: &mut Moving<'_>,
) {
    let packs = &context.model.packs;
    let first_node = node_start(packs, run.start);
    for index in run.clone() {
        let nodes =
            node_start(packs, index) - first_node..node_start(packs, index + 1) - first_node;
        let frame = &mut fields.frames[index - run.start];
        let (u, v) = (&mut fields.u[nodes.clone()], &mut fields.v[nodes]);
        let mut part = fields.balancing.pack(context.active, packs, run.start, index);
        balance_pack(simd, context, index, (v, frame, shares), &mut part);
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
    (v, frames, shares): (&[Lanes], &[Frame], &[Lanes]),
    run: &Range<usize>,
    fields: &mut Balancing<'_>,
) {
    let packs = &context.model.packs;
    for index in run.clone() {
        let v = &v[node_start(packs, index)..node_start(packs, index + 1)];
        let mut part = fields.pack(context.active, packs, run.start, index);
        balance_pack(simd, context, index, (v, &frames[index], shares), &mut part);
        let class = context.coefficients(index);
        let mass = &context.model.assembly.inertia[context.inertia(index)].mass;
        let update = Update::new(simd, context.motion);
        let mut tally = Tally::new(simd);
        for (at, (f, v)) in part.f.iter().zip(v).enumerate() {
            let abc = [class.a[at].load(simd), class.b[at].load(simd), class.c[at].load(simd)];
            let (mut old, force) = (v.load(simd), f.load(simd));
            if context.motion.fictitious {
                tally.relaxed(force, old);
                if part.loaded {
                    tally.loaded(part.q[at].load(simd), old, old);
                }
                continue;
            }
            let local = local_damping(simd, context.motion.local, force, old);
            let (new, c) = update.velocity(abc, old, force - local);
            if context.motion.start {
                // The half step before is the mirror of the one after.
                old = old + old - new;
            }
            tally.force(force);
            if part.loaded {
                tally.loaded(part.q[at].load(simd), old, new);
            }
            tally.kinetic(mass[at / 3].load(simd), old, new);
            if context.motion.damped {
                tally.damped(local + c * (old + new) * 0.5, old, new);
            }
        }
        tally.give(part.sums);
        part.sums.supports[0] = support_power(context, index, v, part.reactions);
    }
}

/// Second pass of relaxation: `v⁺ = a v + b M⁻¹F`, `u⁺ = u + v⁺`, M coupled across the gaps.
/// Leaves `Σ F·v⁺` and `Σ v⁺·v⁺` in the sums.
pub(crate) fn advance_relaxing(
    model: &Model,
    clusters: &Clusters,
    [a, b]: [f64; 2],
    state: &mut State,
    scratch: &mut Scratch,
) -> Sums {
    let (fields, f, runs, level) = scratch.relaxing(state);
    spread(&model.packs, runs, fields, &|run, mut fields: Relaxing<'_>| {
        dispatch!(level, simd => run_relaxing(simd, (model, clusters), [a, b], f, &run, &mut fields));
    });
    Sums::total(&scratch.sums)
}

#[simd]
fn run_relaxing<S: Simd>(
    simd: S,
    (model, clusters): (&Model, &Clusters),
    [a, b]: [f64; 2],
    f: &[Lanes],
    run: &Range<usize>,
    fields: &mut Relaxing<'_>,
) {
    let packs = &model.packs;
    let first = node_start(packs, run.start);
    let (a, b) = (splat(simd, a), splat(simd, b));
    for index in run.clone() {
        let nodes = node_start(packs, index)..node_start(packs, index + 1);
        let own = nodes.start - first..nodes.end - first;
        let (u, v) = (&mut fields.u[own.clone()], &mut fields.v[own.clone()]);
        let q = &mut fields.workspaces[0].q;
        q.resize(q.len().max(u.len()), Lanes::ZERO);
        cluster::accelerations(simd, model, clusters, index, f, &mut q[..u.len()]);
        let mut tally = Tally::new(simd);
        for (at, (u, v)) in u.iter_mut().zip(v.iter_mut()).enumerate() {
            let new = a * v.load(simd) + b * q[at].load(simd);
            tally.moved(f[nodes.start + at].load(simd), new);
            *v = Lanes::from(new);
            *u = Lanes::from(u.load(simd) + new);
        }
        let mut sums = Sums::default();
        tally.give(&mut sums);
        fields.sums[index - run.start] = sums;
        if model.corotational() {
            fields.frames[index - run.start] = fit_pack(simd, model, index, u);
        }
    }
}

/// Adds up the forces at the nodes of a pack: `F = Q − f_body − f_joint + R`.
#[simd]
fn balance_pack<S: Simd>(
    simd: S,
    context: Context<'_>,
    index: usize,
    (v, frame, shares): (&[Lanes], &Frame, &[Lanes]),
    part: &mut Part<'_>,
) {
    let model = context.model;
    let pack = &model.packs.packs[index];
    let first = 3 * pack.start;
    // What the joints at the lower sides do, and what the derivative of R adds.
    shares::collect(simd, &model.packs, index, shares, part.f, part.torque);
    if model.corotational() {
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
    let loaded = external::apply(simd, external, mass, first, q);
    if loaded {
        external::add_to(simd, part.f, q);
    }
    // Supports answer with what is missing.
    let supports = &context.active.supports[context.active.supports_of(index)];
    let class = context.coefficients(index);
    let fields = (first, v, &mut *part.f);
    support::react(context.motion, class, supports, context.velocities, fields, part.reactions);
    part.sums.applied = applied(loaded.then_some(&*q), supports, part.reactions, first);
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
    let mut tally = Tally::new(simd);
    let mut sums = Sums { applied: part.sums.applied, ..Sums::default() };
    sums.supports[0] = support_power(context, index, v, part.reactions);
    for (at, (f, v)) in part.f.iter().zip(v.iter_mut()).enumerate() {
        let abc = [class.a[at].load(simd), class.b[at].load(simd), class.c[at].load(simd)];
        let (old, force) = (v.load(simd), f.load(simd));
        let local = local_damping(simd, motion.local, force, old);
        let (new, c) = update.velocity(abc, old, force - local);
        tally.force(force);
        if part.loaded {
            tally.loaded(part.q[at].load(simd), old, new);
        }
        if motion.damped {
            let mean = if motion.start { old } else { (old + new) * 0.5 };
            tally.damped(local + c * mean, old, new);
        }
        *v = Lanes::from(new);
    }
    let held = &context.active.supports[context.active.supports_of(index)];
    support::enforce(held, context.velocities, first, v);
    let time_step = splat(simd, motion.time_step);
    for (u, v) in u.iter_mut().zip(&*v) {
        *u = Lanes::from(u.load(simd) + time_step * v.load(simd));
    }
    tally.give(&mut sums);
    sums.supports[1] = support_power(context, index, v, part.reactions);
    *part.sums = sums;
}

/// Cundall's local damping `α |F| sign v`, against the motion.
#[inline(always)]
fn local_damping<S: Simd>(simd: S, alpha: f64, force: f64x4<S>, v: f64x4<S>) -> f64x4<S> {
    if alpha == 0.0 {
        return splat(simd, 0.0);
    }
    let size = force.abs() * alpha;
    // No motion, no damping: copysign alone would push against +0.
    let moving = Lanes::from(v).0.map(|v| if v == 0.0 { 0.0 } else { 1.0 });
    size.copysign(v) * Lanes(moving).load(simd)
}

/// Power of the supports with the velocities `v`.
fn support_power(context: Context<'_>, index: usize, v: &[Lanes], reactions: &[f64]) -> f64 {
    let first = 3 * context.model.packs.packs[index].start;
    let supports = &context.active.supports[context.active.supports_of(index)];
    let power = supports.iter().zip(reactions).map(|(support, reaction)| {
        reaction * v[support.at as usize - first].0[support.lane as usize]
    });
    power.sum()
}

/// `Σ (Q + R)²` of a pack.
fn applied(q: Option<&[Lanes]>, supports: &[Support], reactions: &[f64], first: usize) -> f64 {
    let Some(q) = q else { return reactions.iter().map(|r| r * r).sum() };
    let mut held = supports.iter().zip(reactions).peekable();
    let mut sum = 0.0;
    for (at, q) in q.iter().enumerate() {
        let mut all = q.0;
        while let Some((s, r)) = held.next_if(|(s, _)| s.at as usize - first == at) {
            all[s.lane as usize] += r;
        }
        sum += Lanes(all.map(|x| x * x)).sum();
    }
    sum
}

impl<'a> Context<'a> {
    pub(crate) fn pass<'b>(&self, (u, v): (&'b [Lanes], &'b [Lanes]), energies: bool) -> Pass<'b>
    where
        'a: 'b,
    {
        Pass {
            model: self.model,
            u,
            failing: self.failing,
            time: self.time,
            last: (!self.motion.start).then_some((v, self.motion.time_step)),
            held: &self.active.held_bodies,
            linear: false,
            energies,
        }
    }

    fn inertia(&self, pack: usize) -> usize {
        self.model.assembly.pack_inertia[pack] as usize
    }

    fn coefficients(&self, pack: usize) -> &crate::motion::Coefficients {
        &self.motion.classes[self.inertia(pack)]
    }
}
