//! Parallel work on packs by ownership: each task owns the fields of a run of packs.
//!
//! The runs depend on the model, never on the number of threads, and no task adds to fields that
//! another one owns. Threads therefore cannot change a bit of the results.

use std::ops::Range;

use crate::pack::Packs;
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// Nodes per run below which waking a thread does not pay.
const FEWEST_NODES: usize = 1000;
/// Number of runs of a medium model: enough for many cores, few enough to cost nothing.
const RUNS: usize = 64;
/// Nodes per run in large models; the cost of waking a thread is negligible beside them.
const MANY_NODES: usize = 16_000;

/// Runs of packs of about equal work.
pub fn runs(packs: &Packs) -> Vec<Range<usize>> {
    let (n, nodes) = (packs.packs.len(), packs.nodes * LANES);
    let count = (nodes / FEWEST_NODES).clamp(1, RUNS).max(nodes / MANY_NODES).min(n);
    (0..count).map(|i| n * i / count..n * (i + 1) / count).collect()
}

/// Fields that can be split between two packs.
pub trait Split: Sized + Send {
    /// Splits the fields at pack `at` into those before it and the rest. Fields begin at pack
    /// `first`; `low_runs` runs end before `at`.
    fn split(self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self);
}

impl<A: Split, B: Split> Split for (A, B) {
    fn split(self, packs: &Packs, first: usize, at: usize, low_runs: usize) -> (Self, Self) {
        let (a, b) = self.0.split(packs, first, at, low_runs);
        let (c, d) = self.1.split(packs, first, at, low_runs);
        ((a, c), (b, d))
    }
}

/// Calls `op` with each run and its part of the fields.
pub fn spread<T: Split>(
    packs: &Packs,
    runs: &[Range<usize>],
    fields: T,
    op: &(impl Fn(Range<usize>, T) + Sync),
) {
    match runs {
        [] => {}
        [run] => op(run.clone(), fields),
        _ => {
            let (low, high) = runs.split_at(runs.len() / 2);
            let (first, at) = (low[0].start, high[0].start);
            let (fields_low, fields_high) = fields.split(packs, first, at, low.len());
            rayon::join(
                || spread(packs, low, fields_low, op),
                || spread(packs, high, fields_high, op),
            );
        }
    }
}

/// Calls `op` with each pack, its parts of some nodal fields and its own value.
pub fn each_pack<const N: usize, T: Send>(
    packs: &Packs,
    fields: [&mut [Lanes]; N],
    own: &mut [T],
    op: impl Fn(usize, [&mut [Lanes]; N], &mut T) + Sync,
) {
    spread(packs, &runs(packs), Nodal { fields, own }, &|run, mut nodal| {
        for (pack, own) in run.zip(nodal.own) {
            let nodes = node_start(packs, pack + 1) - node_start(packs, pack);
            op(pack, nodal.fields.each_mut().map(|field| cut(field, nodes)), own);
        }
    });
}

/// Nodal fields, and one value per pack.
struct Nodal<'a, const N: usize, T> {
    fields: [&'a mut [Lanes]; N],
    own: &'a mut [T],
}

impl<const N: usize, T: Send> Split for Nodal<'_, N, T> {
    fn split(mut self, packs: &Packs, first: usize, at: usize, _: usize) -> (Self, Self) {
        let nodes = node_start(packs, at) - node_start(packs, first);
        let fields = self.fields.each_mut().map(|field| cut(field, nodes));
        (Self { fields, own: cut(&mut self.own, at - first) }, self)
    }
}

/// Removes the first `at` values of a field, or all if there are fewer, and returns them.
pub fn cut<'a, T>(field: &mut &'a mut [T], at: usize) -> &'a mut [T] {
    let all = std::mem::take(field);
    let (low, high) = all.split_at_mut(at.min(all.len()));
    *field = high;
    low
}

/// Index of a pack's first number in a field with three components a node. One past the last pack
/// is allowed.
#[inline]
pub fn node_start(packs: &Packs, pack: usize) -> usize {
    3 * packs.starts[0][pack] as usize
}

/// Number of rigid packs before a pack. One past the last pack is allowed.
#[inline]
pub fn rigid_start(packs: &Packs, pack: usize) -> usize {
    packs.packs.get(pack).map_or(packs.rigid, |p| p.rigid_start)
}

/// Index of a pack's first number in the neighbour forces. One past the last pack is allowed.
#[inline]
pub fn neighbour_force_start(packs: &Packs, pack: usize) -> usize {
    3 * packs.starts[1][pack] as usize
}
