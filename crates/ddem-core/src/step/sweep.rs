//! Both passes of a step in one sweep over the packs, for models that do not fit into the caches.
//!
//! All joints of a pack lead to itself or to packs that come after it. A pack can therefore move as
//! soon as its own forces are known: no other pack needs its former position any more. Forces and
//! their order of summation are those of the two passes, and so are the bits of the results.
//!
//! Each task sweeps over a *slab*, a run of packs. The packs with joints to a later slab are at its
//! upper *edge*. Their forces are computed before anything moves.

use std::ops::Range;
use std::sync::Arc;

use fearless_simd::{Simd, dispatch};
use fearless_simd_macros::simd;

use super::first::{pack_forces, run_forces};
use super::{Context, ForcesOfOthers, PackContext, input, move_pack};
use crate::force::neighbour_forces::NeighbourForces;
use crate::state::profile::Phase;
use crate::step::scratch::{
    NeighbourForcesMut, PackForces, PackJoints, Scratch, SecondPass, StateMotion, StepFields,
};
use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::Contacts;
use ddem_joint::losses::{LossSums, Losses};
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::sums::StepSums;
use ddem_mesh::pack::{Neighbours, Pack, Packs};
use ddem_mesh::parallel::{Split, cut, neighbour_force_start, spread};

/// Least number of nodes for which a sweep is faster than two passes.
const FEWEST_NODES: usize = 300_000;
/// Number of slabs for each thread. With more than one a slow thread leaves slabs to the others.
const SLABS_PER_THREAD: usize = 2;

/// Packs of one task.
#[derive(Clone, Debug)]
pub(super) struct Slab {
    pub(super) packs: Range<usize>,
    /// First pack of the upper edge.
    edge: usize,
}

/// Number of slabs for some threads; `None` if two passes are faster.
pub(super) fn slab_count(packs: &Packs, threads: usize) -> Option<usize> {
    let large = packs.nodes * LANES >= FEWEST_NODES;
    let count = if threads == 1 { 1 } else { SLABS_PER_THREAD * threads };
    large.then_some(count.min(packs.packs.len()))
}

/// Slabs of about equal work.
pub(super) fn slabs(packs: &Packs, count: usize) -> Arc<[Slab]> {
    let all = packs.packs.len();
    let slab = |i: usize| {
        let (start, end) = (all * i / count, all * (i + 1) / count);
        let beyond = |pack: &Pack| {
            pack.upper.iter().filter_map(Neighbours::last_pack).any(|pack| pack >= end)
        };
        let edge = (start..end).find(|&index| beyond(&packs.packs[index])).unwrap_or(end);
        Slab { packs: start..end, edge }
    };
    (0..count).map(slab).collect()
}

/// Takes one step in a sweep. Returns the sums over all nodes and the losses of the joints.
pub(super) fn sweep(
    context: Context<'_>,
    slabs: &[Slab],
    moved: StateMotion<'_>,
    broken_joints: &mut BrokenJoints,
    contacts: &Contacts,
    scratch: &mut Scratch,
) -> (StepSums, Losses) {
    let (packs, level) = (&context.model.packs, scratch.level);
    let span = scratch.profiler.begin();
    let runs: Vec<_> = slabs.iter().map(|slab| slab.packs.clone()).collect();
    let slab_of = |run: &Range<usize>| slabs.iter().find(|slab| slab.packs == *run);
    let pass = context.pass(moved.u.get(), moved.v.get(), &[]);
    let (fields, frames, _) = scratch.forces(broken_joints, false, pass.viscous.is_some());
    let input = input(pass, frames);
    spread(packs, &runs, fields, &|run: Range<usize>, mut fields| {
        let Some(slab) = slab_of(&run) else { return };
        dispatch!(level, simd => run_forces(simd, &input, slab.edge..run.end, &mut fields));
    });
    let viscous = context.has_viscous();
    let StepFields { forces, joints, on_neighbours, second, .. } =
        scratch.second(context.view, viscous, moved, &mut broken_joints.packs);
    let (mut inner, edges) = parts(packs, slabs, on_neighbours);
    let fields = (forces, (joints, (InnerForces(&mut inner), second)));
    spread(packs, &runs, fields, &|run, fields: SweepFields<'_, '_>| {
        let Some(slab) = slab_of(&run) else { return };
        let joints = NeighbourForces { first: run.start, forces: &[], others: &edges };
        let others = ForcesOfOthers { joints, contacts, bodies: &[], tied: &[], cells: &[] };
        dispatch!(level, simd => run_sweep(simd, context, slab, others, fields));
    });
    let totals = (StepSums::total(&scratch.sums), LossSums::from_iter(&scratch.losses).total());
    scratch.end_tasks(span);
    totals
}

/// Fields of a sweep over a slab.
type SweepFields<'a, 'b> =
    (PackForces<'a>, (PackJoints<'a>, (InnerForces<'a, 'b>, SecondPass<'a>)));

/// Forces of some packs on neighbours, with the numbers of the packs.
type EdgeForces<'a> = (Range<usize>, &'a [Lanes]);

/// Forces of the packs before the upper edges on neighbours, one part for each slab.
struct InnerForces<'a, 'b>(&'a mut [NeighbourForcesMut<'b>]);

impl Split for InnerForces<'_, '_> {
    fn split(self, _: &Packs, _: usize, _: usize, low_runs: usize) -> (Self, Self) {
        let (low, high) = self.0.split_at_mut(low_runs);
        (Self(low), Self(high))
    }
}

/// Forces on neighbours of the packs before the upper edges, and of those at the edges.
fn parts<'a>(
    packs: &Packs,
    slabs: &[Slab],
    mut forces: &'a mut [Lanes],
) -> (Vec<NeighbourForcesMut<'a>>, Vec<EdgeForces<'a>>) {
    let at = |pack: usize| neighbour_force_start(packs, pack);
    let part = |Slab { packs: Range { start, end }, edge }: &Slab| {
        let inner = cut(&mut forces, at(*edge) - at(*start));
        let outer: &[Lanes] = cut(&mut forces, at(*end) - at(*edge));
        (NeighbourForcesMut { first: *start, forces: inner }, (*edge..*end, outer))
    };
    slabs.iter().map(part).unzip()
}

/// Computes the forces of the packs of a slab and moves them, one after the other.
#[simd]
fn run_sweep<S: Simd>(
    simd: S,
    context: Context<'_>,
    slab: &Slab,
    others: ForcesOfOthers<'_>,
    (mut forces, (mut joints, (inner, mut second))): SweepFields<'_, '_>,
) {
    let packs = &context.model.packs;
    let Some(inner) = inner.0.first_mut() else { return };
    let mut f = std::mem::take(&mut forces.workspaces[0].f);
    forces.workspaces[0].elements.stopwatch.start();
    for index in slab.packs.clone() {
        let at_edge = index >= slab.edge;
        let mut own = if at_edge { forces.all() } else { forces.alone(packs, index, &mut f) };
        if !at_edge {
            let (u, v) = (second.blocks.u.get(), second.blocks.v.get());
            let mut pass = context.pass(u, v, &[]);
            pass.first = slab.packs.start;
            let input = input(pass, second.blocks.frames.get());
            pack_forces(simd, &input, index, joints.pack(&mut own, inner, packs, index));
        }
        let mut others = others;
        others.joints.forces = &*inner.forces;
        let pack = PackContext::new(context, index);
        let part = second.pack(&mut own, packs, index, context.is_viscous(index));
        move_pack(simd, &pack, others, part);
        own.workspaces[0].elements.stopwatch.lap(Phase::Nodes);
    }
    forces.workspaces[0].f = f;
}
