//! One explicit step, t → t + Δt (§6). Read this first.
//!
//! The paper's two passes run over packs of four blocks. [`forces`] is the loop over blocks and
//! joints. It computes forces from displacements, and pairs fail there. [`second_pass`] sums the
//! forces at each node in one order and moves the nodes, unless it only evaluates them.
//! [`move_pack`] shows the order of physics inside a pack.

mod bodies;
pub(crate) mod clustered;
mod context;
mod driving;
mod first;
pub(crate) mod frames;
mod nodes;
pub(crate) mod preconditioner;
mod relaxing;
mod rigid;
mod rigid_modes;
pub(crate) mod scratch;
mod sliding;
mod sliding_cells;
mod sweep;
#[cfg(test)]
mod tests;
pub(crate) mod timestep;

use std::ops::Range;

use fearless_simd::{Simd, dispatch};
use fearless_simd_macros::simd;

use crate::force::neighbour_forces::NeighbourForces;
use crate::model::Model;
use crate::state::State;
use crate::state::profile::Phase;
use crate::step::scratch::{
    Access, PackFields, PackForces, Scratch, SecondPass, StateMotion, StepFields,
};
use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::Contacts;
use ddem_joint::losses::Losses;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::rigid::SpatialVector;
use ddem_mesh::parallel::spread;

pub(crate) use bodies::BodyStep;
pub(crate) use context::Context;
use context::PackContext;
pub(crate) use driving::apply_support_displacements;
pub(crate) use first::{FirstPass, forces, input, internal_forces};
pub(crate) use relaxing::advance_relaxing;
pub(crate) use rigid::{Poses, present, set_corner_velocities};
use sliding_cells::PartMoments;

/// Forces on a pack from others: those of the joints at its lower sides, of contacts, and of the other
/// parts of rigid bodies.
#[derive(Clone, Copy)]
struct ForcesOfOthers<'a> {
    joints: NeighbourForces<'a>,
    contacts: &'a Contacts,
    bodies: &'a [BodyStep],
    /// Sums of the complete forces on tied nodes; empty without ties.
    tied: &'a [[f64; 3]],
    /// Rigid motions of the sliding cells.
    cells: &'a [SpatialVector],
}

/// Fields of the second pass, of a run of packs.
pub(crate) type SecondPassFields<'a> = (PackForces<'a>, SecondPass<'a>);

/// Evaluation of forces without motion: joints and contacts advance as in a step.
pub(crate) struct EvaluationStep<'a> {
    pub(crate) u: &'a [Lanes],
    pub(crate) v: &'a [Lanes],
    pub(crate) poses: &'a [Poses],
    pub(crate) broken_joints: &'a mut BrokenJoints,
    pub(crate) contacts: &'a mut Contacts,
}

/// Takes one explicit step, eq. (2) in the form (M2). Returns the sums over all nodes at time t and
/// the losses of the joints up to then. If a pair fails in a step that waits for failure, it
/// returns nothing and nothing moves.
#[doc(alias = "eq 2")]
pub(crate) fn step(
    context: Context<'_>,
    state: &mut State,
    scratch: &mut Scratch,
) -> Option<(StepSums, Losses)> {
    let State { u, v, poses, broken_joints, contacts, .. } = &mut *state;
    let (sums, losses) = if let Some(slabs) = scratch.slabs(context) {
        let moved =
            StateMotion { u: Access::Write(u), v: Access::Write(v), poses: Access::Write(poses) };
        sweep::sweep(context, &slabs, moved, broken_joints, contacts, scratch)
    } else {
        let losses = forces(context.pass(u, v, poses), broken_joints, Some(contacts), scratch);
        if context.waits && losses.failed != [0; 2] {
            return None;
        }
        let moved =
            StateMotion { u: Access::Write(u), v: Access::Write(v), poses: Access::Write(poses) };
        (second_pass(context, moved, contacts, scratch), losses)
    };
    scratch.add_travel(contacts, context.motion.time_step);
    state.count_step(context.motion.time_step);
    Some((sums, losses))
}

/// Computes forces, reactions and sums at time t, and strain energies if the context requests them.
pub(crate) fn balance(
    context: Context<'_>,
    evaluation: EvaluationStep<'_>,
    scratch: &mut Scratch,
) -> (StepSums, Losses) {
    let EvaluationStep { u, v, poses, broken_joints, contacts } = evaluation;
    let losses = forces(context.pass(u, v, poses), broken_joints, Some(contacts), scratch);
    let motion = StateMotion { u: Access::Read(u), v: Access::Read(v), poses: Access::Read(poses) };
    (second_pass(context, motion, contacts, scratch), losses)
}

/// Runs the second pass: sums the forces at the nodes and moves the nodes.
fn second_pass(
    context: Context<'_>,
    motions: StateMotion<'_>,
    contacts: &Contacts,
    scratch: &mut Scratch,
) -> StepSums {
    let span = scratch.profiler.begin();
    let level = scratch.level;
    if context.model.has_shared_motion() {
        spread_second(context, motions.read(), contacts, scratch, &|others, run, fields| {
            dispatch!(level, simd => run_collect(simd, context, others, run, fields));
        });
        scratch.step_bodies(context, motions.poses.get());
        scratch.sum_ties(context.model);
        if context.slides_cells() {
            damp_cells(context, &motions, contacts, scratch);
        }
    } else {
        // Those of bodies that have been removed.
        scratch.bodies.clear();
    }
    spread_second(context, motions, contacts, scratch, &|others, run, fields| {
        dispatch!(level, simd => run_second(simd, context, others, run, fields));
    });
    let sums = StepSums::total(&scratch.sums);
    scratch.profiler.end(span, Phase::Nodes);
    sums
}

/// Damps the deformation of the sliding cells, under complete forces.
fn damp_cells(
    context: Context<'_>,
    motions: &StateMotion<'_>,
    contacts: &Contacts,
    scratch: &mut Scratch,
) {
    let level = scratch.level;
    scratch.moments.resize(context.model.packs.packs.len(), PartMoments::default());
    spread_second(context, motions.read(), contacts, scratch, &|others, run, fields| {
        dispatch!(level, simd => run_cells::<_, false>(simd, context, others, run, fields));
    });
    sliding_cells::find_motions(context, &scratch.moments, &mut scratch.cell_motions);
    spread_second(context, motions.read(), contacts, scratch, &|others, run, fields| {
        dispatch!(level, simd => run_cells::<_, true>(simd, context, others, run, fields));
    });
    scratch.sum_ties(context.model);
}

/// Calls `op` with the runs of packs and their fields of the second pass.
fn spread_second(
    context: Context<'_>,
    motions: StateMotion<'_>,
    contacts: &Contacts,
    scratch: &mut Scratch,
    op: &(impl Fn(ForcesOfOthers<'_>, Range<usize>, &mut SecondPassFields<'_>) + Sync),
) {
    let StepFields { forces, on_neighbours, second, bodies, tied, cells, runs, .. } =
        scratch.second(context.view, context.has_viscous(), motions, &mut []);
    let joints = NeighbourForces::all(on_neighbours);
    let others = ForcesOfOthers { joints, contacts, bodies, tied, cells };
    let fields = (forces, second);
    spread(&context.model.packs, runs, fields, &|run, mut fields: SecondPassFields<'_>| {
        op(others, run, &mut fields);
    });
}

/// Completes the forces on some packs.
#[simd]
fn run_collect<S: Simd>(
    simd: S,
    context: Context<'_>,
    others: ForcesOfOthers<'_>,
    run: Range<usize>,
    (forces, second): &mut SecondPassFields<'_>,
) {
    for index in run {
        let pack = PackContext::new(context, index);
        let viscous = context.is_viscous(index);
        let mut part = second.pack(forces, &context.model.packs, index, viscous);
        nodes::collect(simd, &pack, others, &mut part);
        nodes::find_loads(simd, &pack, &mut part);
        nodes::add_loads(simd, &pack, &mut part);
        if pack.is_rigid() {
            rigid::sum_forces(simd, &pack, &mut part);
        }
    }
}

/// Finds the moments of the sliding cells in some packs, or `DAMPS` their deformation.
#[simd]
fn run_cells<S: Simd, const DAMPS: bool>(
    simd: S,
    context: Context<'_>,
    others: ForcesOfOthers<'_>,
    run: Range<usize>,
    (forces, second): &mut SecondPassFields<'_>,
) {
    let Model { packs, sliding, .. } = context.model;
    let slides = |&index: &usize| sliding.cells.has(index) && context.slides(index).is_some();
    for index in run.filter(slides) {
        let pack = PackContext::new(context, index);
        let mut part = second.pack(forces, packs, index, true);
        match DAMPS {
            true => sliding_cells::damp(simd, &pack, others, &mut part),
            false => sliding_cells::find_moments(simd, &pack, others, &mut part),
        }
    }
}

/// Completes the forces on some packs and moves them.
#[simd]
fn run_second<S: Simd>(
    simd: S,
    context: Context<'_>,
    others: ForcesOfOthers<'_>,
    run: Range<usize>,
    (forces, second): &mut SecondPassFields<'_>,
) {
    for index in run {
        let pack = PackContext::new(context, index);
        let viscous = context.is_viscous(index);
        let part = second.pack(forces, &context.model.packs, index, viscous);
        move_pack(simd, &pack, others, part);
    }
}

/// Runs the order of physics: `F = Q − f_body − f_joint + R` at the nodes of a pack, then (M2).
#[simd]
fn move_pack<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    others: ForcesOfOthers<'_>,
    mut part: PackFields<'_>,
) {
    // If others move with its blocks, the forces are complete already.
    let complete = pack.step.model.has_shared_motion();
    if !complete {
        nodes::collect(simd, pack, others, &mut part);
    } else if !others.tied.is_empty() {
        let (ties, first) = (&pack.step.model.ties, 3 * pack.pack.start);
        ties.share(pack.index, others.tied, first, part.f);
    }
    nodes::find_loads(simd, pack, &mut part);
    if !complete {
        nodes::add_loads(simd, pack, &mut part);
    }
    let mut wrenches = [SpatialVector::default(); LANES];
    if pack.is_rigid() {
        if !complete {
            rigid::sum_forces(simd, pack, &mut part);
        }
        wrenches = rigid::react(simd, pack, &mut part, others.bodies);
    } else {
        sliding::damp_deformation(simd, pack, &mut part);
        nodes::add_dashpot_forces(pack, &mut part);
        nodes::react(pack, &mut part);
    }
    let loads = part.loaded.then_some(&*part.q);
    part.sums.applied = pack.supports.applied(loads, part.reactions);
    match (pack.is_rigid(), pack.step.motion.fictitious) {
        (true, true) => rigid::relaxation_sums(pack, &mut part),
        (true, false) => rigid::advance(simd, pack, &mut part, others.bodies, &wrenches),
        (false, true) => nodes::relaxation_sums(simd, pack, &mut part),
        (false, false) => nodes::advance(simd, pack, &mut part),
    }
}
