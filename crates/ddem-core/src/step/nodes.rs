//! Second pass over the nodes of a pack of deformable blocks (§6).

use fearless_simd::{Simd, SimdBase, f64x4};
use fearless_simd_macros::simd;

use super::{ForcesOfOthers, PackContext};
use crate::force::external::{self, External};
use crate::force::neighbour_forces;
use crate::model::Model;
use crate::state::motion::{Motion, advanced};
use crate::step::frames::FirstMoments;
use crate::step::scratch::{Access, PackFields};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{Lanes, add, load, scale, splat, zero};
use ddem_mechanics::math::leapfrog::local_damping;
use ddem_mechanics::math::sums::{NodeSums, StepSums, Sum};

/// Adds the forces and torques of others: of joints at the lower sides, and of contacts.
#[simd]
pub(super) fn collect<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    others: ForcesOfOthers<'_>,
    part: &mut PackFields<'_>,
) {
    let (model, index) = (pack.step.model, pack.index);
    neighbour_forces::collect(
        simd,
        &model.packs,
        &model.assembly,
        index,
        others.joints,
        part.f,
        &mut part.wrench.angular,
    );
    if let Some(contact_model) = &model.contact {
        for &block in &pack.pack.blocks[..pack.pack.filled] {
            let (block, torque) = (block as usize, &mut part.wrench.angular);
            others.contacts.collect(block, &contact_model.blocks[block], part.f, torque);
        }
    }
}

/// Finds the loads on the nodes, and boundary forces that do not depend on the motion.
#[simd]
pub(super) fn find_loads<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let external = External {
        gravity: pack.step.gravity,
        weight: pack.weight,
        loads: pack.step.view.conditions.loads_of(pack.index),
        factors: &pack.step.view.factors,
    };
    part.loaded = external::apply(simd, external, pack.mass, pack.supports.first, part.q);
    if !pack.dashpots.list.is_empty() {
        if !part.loaded {
            part.q.fill(Lanes::ZERO);
        }
        pack.dashpots.add_boundary_forces(part.q);
        part.loaded = true;
    }
}

/// Adds the loads, and the forces due to the derivative of R, which balance the torque.
#[simd]
pub(super) fn add_loads<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let loads = part.loaded.then_some(&*part.q);
    let (model, index) = (pack.step.model, pack.index);
    if model.corotational() && !pack.is_rigid() {
        let torque = load(simd, &part.wrench.angular);
        let (frame, Model { packs, assembly, .. }) = (&part.blocks.frames.get()[0], model);
        neighbour_forces::spread_torque(simd, packs, assembly, index, frame, torque, loads, part.f);
    } else if let Some(loads) = loads {
        external::add_to(simd, part.f, loads);
    }
}

/// Adds the forces of boundary dashpots.
pub(super) fn add_dashpot_forces(pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let v = part.blocks.v.get();
    pack.dashpots.add_dashpot_forces(pack.step.motion, pack.class, v, part.f, part.dashpot_forces);
}

/// Adds the reactions of supports.
pub(super) fn react(pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let v = part.blocks.v.get();
    pack.supports.react(pack.step.motion, pack.class, v, part.f, part.reactions);
}

/// Computes the sums of a relaxation, which moves the nodes by a pass of its own.
#[simd]
pub(super) fn relaxation_sums<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let mut sums = StepSums { applied: part.sums.applied, ..StepSums::default() };
    match pack.share {
        Some(_) => relaxation_tally::<S, true>(simd, pack, part, &mut sums),
        None => relaxation_tally::<S, false>(simd, pack, part, &mut sums),
    }
    sums.supports[0] = pack.supports.power(part.blocks.v.get(), part.reactions);
    *part.sums = sums;
}

/// Adds the sums over the nodes of a pack, `TIED` if some of them are.
#[inline(always)]
fn relaxation_tally<S: Simd, const TIED: bool>(
    simd: S,
    pack: &PackContext<'_>,
    part: &PackFields<'_>,
    sums: &mut StepSums,
) {
    const N: usize = Sum::Power as usize + 1;
    let v = part.blocks.v.get();
    let mut tally = NodeSums::<S, N>::new(simd);
    let row = pack.side();
    let (nodes, velocities) = (part.f.as_chunks::<3>().0, v.as_chunks::<3>().0);
    for (number, (f, v)) in nodes.chunks(row).zip(velocities.chunks(row)).enumerate() {
        for (node, (f, v)) in (number * row..).zip(f.iter().zip(v)) {
            for c in 0..3 {
                let (f, v) = (f[c].load(simd), v[c].load(simd));
                let shared = if TIED { f * share_of(simd, pack.share, node) } else { f };
                tally.add(Sum::Free, c, f * shared);
                tally.add(Sum::Power, c, shared * v);
                if part.loaded {
                    let power = part.q[3 * node + c].load(simd) * v;
                    tally.add(Sum::LoadsBefore, c, power);
                    tally.add(Sum::LoadsAfter, c, power);
                }
            }
        }
        tally.end_row(simd);
    }
    tally.give(sums);
}

/// Part of a node in the sums over its tied nodes; 1 without ties.
#[inline(always)]
fn share_of<S: Simd>(simd: S, shares: Option<&[Lanes]>, node: usize) -> f64x4<S> {
    shares.map_or(splat(simd, 1.0), |shares| shares[node].load(simd))
}

/// Advances velocities by (M2), then displacements. An evaluation computes the sums only, including
/// those of energy.
#[simd]
pub(super) fn advance<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let motion = pack.step.motion;
    let kind = match part.blocks.v {
        Access::Read(_) => NodeLoop::Energy,
        _ if motion.changes() => NodeLoop::Energy,
        _ if motion.local != 0.0 || part.is_viscous() => NodeLoop::Unusual,
        _ if part.loaded => NodeLoop::Loaded,
        _ if motion.is_damped() => NodeLoop::Damped,
        _ => NodeLoop::Free,
    };
    let PackFields {
        blocks, f, viscous, sums, reactions, dashpot_forces, q, buffer, loaded, ..
    } = part;
    let v = match &mut blocks.v {
        Access::Write(v) => &mut **v,
        Access::Read(v) => {
            buffer.clear();
            buffer.extend_from_slice(v);
            &mut buffer[..]
        }
    };
    let mut own = StepSums { applied: sums.applied, ..StepSums::default() };
    own.supports[0] = pack.supports.power(v, reactions);
    let drawn = pack.dashpots.power(v, dashpot_forces);
    let forces = NodeForces { all: f, loads: loaded.then_some(&**q), viscous };
    match pack.share {
        Some(_) => kind.accelerate::<S, true>(simd, pack, forces, v, &mut own),
        None => kind.accelerate::<S, false>(simd, pack, forces, v, &mut own),
    }
    pack.supports.enforce(v);
    own.supports[1] = pack.supports.power(v, reactions);
    own.damping[0] += drawn;
    own.damping[1] += pack.dashpots.power(v, dashpot_forces);
    if let Some(u) = blocks.u.get_mut() {
        let (fastest, frame) = displace(simd, pack, v, u);
        own.fastest = fastest;
        if let Some(frame) = frame {
            blocks.frames.get_mut().into_iter().for_each(|frames| frames[0] = frame);
        }
    }
    **sums = own;
}

/// Number of sums of nodes that are neither damped nor loaded, that are damped, and that are
/// loaded.
const FREE: usize = Sum::Free as usize + 1;
const DAMPED: usize = Sum::DampingAfter as usize + 1;
const LOADED: usize = Sum::LoadsAfter as usize + 1;
const ALL: usize = Sum::COUNT;

/// Forces on the nodes of a pack `[N]`.
#[derive(Clone, Copy)]
struct NodeForces<'a> {
    /// Sums of all forces.
    all: &'a [Lanes],
    /// Loads, if there are any.
    loads: Option<&'a [Lanes]>,
    /// Viscous forces, against the motion; empty if blocks are not viscous.
    viscous: &'a [Lanes],
}

/// Loop over the nodes of a pack that computes no more than it must.
#[derive(Clone, Copy)]
enum NodeLoop {
    /// Neither damping nor loads.
    Free,
    /// Damping.
    Damped,
    /// Damping and loads.
    Loaded,
    /// Damping of any kind, and loads.
    Unusual,
    /// All sums, including those of energy.
    Energy,
}

impl NodeLoop {
    /// Advances the velocities of the nodes of a pack, and takes the sums over them.
    #[inline(always)]
    fn accelerate<S: Simd, const TIED: bool>(
        self,
        simd: S,
        pack: &PackContext<'_>,
        forces: NodeForces<'_>,
        v: &mut [Lanes],
        sums: &mut StepSums,
    ) {
        match self {
            Self::Free => accelerate::<S, FREE, false, TIED>(simd, pack, forces, v, sums),
            Self::Damped => accelerate::<S, DAMPED, false, TIED>(simd, pack, forces, v, sums),
            Self::Loaded => accelerate::<S, LOADED, false, TIED>(simd, pack, forces, v, sums),
            Self::Unusual => accelerate::<S, LOADED, true, TIED>(simd, pack, forces, v, sums),
            Self::Energy => accelerate::<S, ALL, true, TIED>(simd, pack, forces, v, sums),
        }
    }
}

/// Advances the velocities of the nodes of a pack, and takes the first `N` sums over them; all sums
/// are those of energy. `UNUSUAL` damping is local or viscous.
#[inline(always)]
fn accelerate<S: Simd, const N: usize, const UNUSUAL: bool, const TIED: bool>(
    simd: S,
    pack: &PackContext<'_>,
    forces: NodeForces<'_>,
    v: &mut [Lanes],
    sums: &mut StepSums,
) {
    let motion = pack.step.motion;
    let [a, b, damping] = pack.class.fields();
    let mut tally = NodeSums::<S, N>::new(simd);
    // Rows of blocks of one division are too short to be summed one by one.
    let row = 3 * if pack.side() == 2 { 8 } else { pack.side() };
    for (number, v) in v.chunks_exact_mut(row).enumerate() {
        let of = |field| nodes_of_row(field, number * row, row);
        let (f, a, b, damping) = (of(forces.all), of(a), of(b), of(damping));
        let loads = forces.loads.filter(|_| N >= LOADED).map(of);
        let viscous = (UNUSUAL && !forces.viscous.is_empty()).then(|| of(forces.viscous));
        for (node, v) in v.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let mut share = splat(simd, 1.0);
            if TIED {
                share = share_of(simd, pack.share, number * row / 3 + node);
            }
            for c in 0..3 {
                let (old, force) = (v[c].load(simd), f[node][c].load(simd));
                let mut damping_force = splat(simd, 0.0);
                if UNUSUAL && motion.local != 0.0 {
                    damping_force = local_damping(motion.local, force, old);
                }
                let numbers = [a[node][c].load(simd), b[node][c].load(simd)];
                let new = advanced(numbers, old, force - damping_force);
                v[c] = Lanes::from(new);
                tally.add(Sum::Free, c, if TIED { force * force * share } else { force * force });
                if N >= DAMPED {
                    damping_force += damping[node][c].load(simd) * ((old + new) * 0.5);
                    if TIED {
                        damping_force *= share;
                    }
                    if let Some(viscous) = viscous {
                        damping_force += viscous[node][c].load(simd);
                    }
                    tally.add(Sum::DampingBefore, c, damping_force * old);
                    tally.add(Sum::DampingAfter, c, damping_force * new);
                }
                if let Some(loads) = loads {
                    let load = loads[node][c].load(simd);
                    tally.add(Sum::LoadsBefore, c, load * old);
                    tally.add(Sum::LoadsAfter, c, load * new);
                }
                if N == ALL {
                    let mass = pack.mass[number * row / 3 + node].load(simd);
                    kinetic_energy(simd, motion, c, mass, [old, new], &mut tally);
                }
            }
        }
        tally.end_row(simd);
    }
    tally.give(sums);
}

/// Nodes of a row of a nodal field.
#[inline(always)]
fn nodes_of_row(field: &[Lanes], at: usize, row: usize) -> &[[Lanes; 3]] {
    field[at..at + row].as_chunks::<3>().0
}

/// Adds the kinetic energies `½ m v⁻ v⁺` of a component, and the terms of its change if the step
/// changes.
#[inline(always)]
fn kinetic_energy<S: Simd, const N: usize>(
    simd: S,
    motion: &Motion,
    component: usize,
    mass: f64x4<S>,
    [old, new]: [f64x4<S>; 2],
    tally: &mut NodeSums<S, N>,
) {
    let mut after = new;
    if motion.changes() {
        // The energy uses a velocity as far after the present time as `old` is before it.
        let change = new - old;
        after = old + splat(simd, motion.previous_step_ratio()) * change;
        tally.add(Sum::Power, component, mass * old * change);
        tally.add(Sum::Change, component, mass * change * change * 0.5);
    }
    tally.add(Sum::Kinetic, component, mass * old * after * 0.5);
}

/// Moves the nodes, `u⁺ = u + Δt v⁺`. Returns the largest velocity component `[m/s]`, and the new
/// frame of the blocks; `None` for small displacements.
#[inline(always)]
fn displace<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    v: &[Lanes],
    u: &mut [Lanes],
) -> (Lanes, Option<Frame>) {
    let time_step = splat(simd, pack.step.motion.time_step);
    let corotational = pack.step.model.corotational();
    let mut fastest = zero(simd);
    let mut moments = FirstMoments::new(simd, pack.divisions);
    let row = pack.side();
    let (rows, velocities) = (u.as_chunks_mut::<3>().0, v.as_chunks::<3>().0);
    for (u, v) in rows.chunks_exact_mut(row).zip(velocities.chunks_exact(row)) {
        for (u, v) in u.iter_mut().zip(v) {
            let v = load(simd, v);
            let new = add(load(simd, u), scale(v, time_step));
            *u = new.map(Lanes::from);
            for c in 0..3 {
                fastest[c] = fastest[c].max(v[c].abs());
            }
            if corotational {
                moments.add_node(new);
            }
        }
        moments.end_row(simd);
    }
    let fastest = fastest[0].max(fastest[1]).max(fastest[2]);
    let frame = corotational.then(|| moments.frame(simd, pack.step.model, pack.index));
    (Lanes::from(fastest), frame)
}
