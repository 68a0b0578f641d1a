//! Second pass of relaxation (§7).

use std::ops::Range;

use fearless_simd::{Simd, SimdBase, dispatch, f64x4};
use fearless_simd_macros::simd;

use super::bodies;
use super::rigid::{follow_bodies, follow_corners};
use crate::model::Model;
use crate::state::State;
use crate::state::profile::Phase;
use crate::step::frames::{fit_pack, frame_of};
use crate::step::preconditioner::{self, Preconditioner, Present};
use crate::step::scratch::{Relaxing, Scratch};
use ddem_mechanics::math::lanes::{Lanes, splat};
use ddem_mechanics::math::sums::{NodeSums, StepSums, Sum};
use ddem_mechanics::rigid::{SpatialLanes, resultants};
use ddem_mesh::parallel::{each_pack, node_start, rigid_start, spread};

/// Runs the second pass of relaxation: `v⁺ = a v + b M⁻¹F`, `u⁺ = u + v⁺`, with M coupled across
/// the gaps. The sums contain `Σ F·v⁺` and `Σ v⁺·v⁺`.
pub(crate) fn advance_relaxing(
    model: &Model,
    preconditioner: &mut Preconditioner,
    [a, b]: [f64; 2],
    state: &mut State,
    scratch: &mut Scratch,
) -> StepSums {
    let span = scratch.profiler.begin();
    let Scratch { f, bodies, frames, level, .. } = &*scratch;
    let rotated = model.corotational().then_some((&state.u[..], &frames[..]));
    preconditioner.respond(model, &state.poses, f, bodies, rotated, *level);
    let preconditioner = &*preconditioner;
    let (fields, f, runs, level) = scratch.relaxing(state);
    spread(&model.packs, runs, fields, &|run, mut fields: Relaxing<'_>| {
        dispatch!(level, simd => run_relaxing(simd, model, preconditioner, [a, b], f, &run, &mut fields));
    });
    move_bodies(model, state, scratch);
    scratch.add_travel(&mut state.contacts, 1.0);
    let sums = StepSums::total(&scratch.sums);
    scratch.profiler.end(span, Phase::Relaxation);
    sums
}

/// Moves the rigid bodies of several blocks as the corners of all their parts have moved.
pub(super) fn move_bodies(model: &Model, state: &mut State, scratch: &mut Scratch) {
    if model.assembly.bodies.is_empty() {
        return;
    }
    let level = scratch.level;
    // The wrenches have served their purpose; the next first pass sets them again.
    let Scratch { wrenches: sums, frames, .. } = &mut *scratch;
    each_pack(&model.packs, [&mut state.v], sums, |index, [v], sums| {
        let pack = &model.packs.packs[index];
        if pack.rigid {
            let arms = &model.assembly.arms[pack.rigid_start];
            *sums = dispatch!(level, simd => {
                resultants(simd, arms, &frames[index].matrix(simd), v)
            });
        }
    });
    let next = bodies::followed(model, &state.poses, sums);
    sums.fill(SpatialLanes::default());
    let (fields, _, runs, _) = scratch.relaxing(state);
    spread(&model.packs, runs, fields, &|run, fields: Relaxing<'_>| {
        let packs = &model.packs;
        let (first, first_rigid) = (node_start(packs, run.start), rigid_start(packs, run.start));
        for index in run.clone().filter(|&index| packs.packs[index].rigid) {
            let nodes = node_start(packs, index) - first..node_start(packs, index + 1) - first;
            let poses = &mut fields.poses[packs.packs[index].rigid_start - first_rigid];
            let u = &mut fields.u[nodes];
            dispatch!(level, simd => follow_bodies(simd, model, index, poses, u, &next));
            fields.frames[index - run.start] = frame_of(poses);
        }
    });
}

#[simd]
fn run_relaxing<S: Simd>(
    simd: S,
    model: &Model,
    preconditioner: &Preconditioner,
    [a, b]: [f64; 2],
    f: &[Lanes],
    run: &Range<usize>,
    fields: &mut Relaxing<'_>,
) {
    let packs = &model.packs;
    let first = node_start(packs, run.start);
    let first_rigid = rigid_start(packs, run.start);
    let (a, b) = (splat(simd, a), splat(simd, b));
    for index in run.clone() {
        let nodes = node_start(packs, index)..node_start(packs, index + 1);
        let own = nodes.start - first..nodes.end - first;
        let (u, v) = (&mut fields.u[own.clone()], &mut fields.v[own.clone()]);
        let q = &mut fields.workspaces[0].q;
        q.resize(q.len().max(u.len()), Lanes::ZERO);
        let pack = &packs.packs[index];
        let poses = pack.rigid.then(|| &fields.poses[pack.rigid_start - first_rigid]);
        let q = &mut q[..u.len()];
        let present = Present { poses, u: model.corotational().then_some(&*u) };
        preconditioner::accelerations(simd, model, present, preconditioner, index, f, q);
        let row = packs.numbering_of(pack).divisions + 1;
        let shares = model.assembly.shares(index);
        let nodes = RelaxingNodes { row, start: nodes.start, f, q, shares };
        let sums = match shares {
            Some(_) => move_nodes::<S, true>(simd, [a, b], nodes, u, v),
            None => move_nodes::<S, false>(simd, [a, b], nodes, u, v),
        };
        fields.sums[index - run.start] = sums;
        if pack.rigid {
            let poses = &mut fields.poses[pack.rigid_start - first_rigid];
            follow_corners(simd, model, index, poses, u, v);
            fields.frames[index - run.start] = frame_of(poses);
        } else if model.corotational() {
            fields.frames[index - run.start] = fit_pack(simd, model, index, u);
        }
    }
}

/// Nodes of a pack in a relaxation.
struct RelaxingNodes<'a> {
    /// Nodes of a row.
    row: usize,
    /// Index of the first value in a nodal field.
    start: usize,
    /// Forces on the nodes of all packs `[N]`.
    f: &'a [Lanes],
    /// Accelerations.
    q: &'a [Lanes],
    /// Parts of the nodes in the sums over tied nodes, if there are any.
    shares: Option<&'a [Lanes]>,
}

/// Moves the nodes of a pack, `TIED` if some of them are. Returns the sums.
#[inline(always)]
fn move_nodes<S: Simd, const TIED: bool>(
    simd: S,
    [a, b]: [f64x4<S>; 2],
    RelaxingNodes { row, start, f, q, shares }: RelaxingNodes<'_>,
    u: &mut [Lanes],
    v: &mut [Lanes],
) -> StepSums {
    let mut tally = NodeSums::<S, { Sum::Moved as usize + 1 }>::new(simd);
    let mut fastest = splat(simd, 0.0);
    let rows = u.as_chunks_mut::<3>().0.chunks_mut(row);
    let velocities = v.as_chunks_mut::<3>().0.chunks_mut(row);
    for (number, (u, v)) in rows.zip(velocities).enumerate() {
        for (node, (u, v)) in (number * row..).zip(u.iter_mut().zip(v)) {
            for c in 0..3 {
                let at = 3 * node + c;
                let new = a * v[c].load(simd) + b * q[at].load(simd);
                let mut shared = new;
                if TIED && let Some(shares) = shares {
                    shared *= shares[node].load(simd);
                }
                tally.add(Sum::Power, c, f[start + at].load(simd) * shared);
                tally.add(Sum::Moved, c, new * shared);
                fastest = fastest.max(new.abs());
                v[c] = Lanes::from(new);
                u[c] = Lanes::from(u[c].load(simd) + new);
            }
        }
        tally.end_row(simd);
    }
    let mut sums = StepSums { fastest: Lanes::from(fastest), ..StepSums::default() };
    tally.give(&mut sums);
    sums
}
