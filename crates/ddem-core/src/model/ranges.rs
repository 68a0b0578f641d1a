//! Values of nodes, elements and pairs in ranges of their numbers.

use std::ops::Range;

use rayon::prelude::*;

use crate::model::Model;
use ddem_mechanics::math::lanes::Lanes;

/// Smallest number of values that several threads share.
const FEWEST: usize = 4096;

/// Fills a range of values of `N` numbers each. Owners (blocks or joints) are consecutive from
/// `first` on, and `span` gives the range of values of each owner. `of` gives the values of an
/// owner by their numbers within it.
fn fill<const N: usize, F: Fn(usize) -> [f64; N]>(
    range: Range<usize>,
    out: &mut [f64],
    (first, span): (usize, impl Fn(usize) -> Range<usize>),
    of: impl Fn(usize) -> F + Sync,
) {
    let (few, mut parts) = (range.len() < FEWEST, Vec::new());
    let (mut owner, mut at, mut rest) = (first, range.start, out.as_chunks_mut::<N>().0);
    while at < range.end {
        let span = span(owner);
        let end = span.end.min(range.end);
        let (own, others) = rest.split_at_mut(end - at);
        // Springs within whole rock have no pairs.
        if end > at {
            parts.push((owner, at - span.start, own));
        }
        (owner, at, rest) = (owner + 1, end, others);
    }
    let fill = |(owner, first, own): (usize, usize, &mut [[f64; N]])| {
        let value = of(owner);
        own.iter_mut().zip(first..).for_each(|(own, at)| *own = value(at));
    };
    if few { parts.into_iter().for_each(fill) } else { parts.into_par_iter().for_each(fill) }
}

impl Model {
    /// Blocks that have nodes in a range.
    pub(crate) fn blocks_of(&self, nodes: Range<usize>) -> Range<usize> {
        let at = |node| self.geometry.blocks.partition_point(|b| b.first_node as usize <= node);
        let end = if nodes.is_empty() { 0 } else { at(nodes.end - 1) };
        at(nodes.start).saturating_sub(1)..end
    }

    /// Fills the values of a range of nodes. `of` gives the values of a block by node, x fastest.
    pub(crate) fn fill_nodes<const N: usize, F: Fn(usize) -> [f64; N]>(
        &self,
        range: Range<usize>,
        out: &mut [f64],
        of: impl Fn(usize) -> F + Sync,
    ) {
        let first = self.blocks_of(range.clone()).start;
        fill(range, out, (first, |block| self.nodes_of(block)), of);
    }

    /// Fills the values of a range of elements. `of` gives the values of a block by element, x
    /// fastest.
    pub(crate) fn fill_elements<const N: usize, F: Fn(usize) -> [f64; N]>(
        &self,
        range: Range<usize>,
        out: &mut [f64],
        of: impl Fn(usize) -> F + Sync,
    ) {
        let blocks = &self.geometry.blocks;
        let after = blocks.partition_point(|block| block.first_element as usize <= range.start);
        fill(range, out, (after.saturating_sub(1), |block| self.elements_of(block)), of);
    }

    /// Fills the values of a range of pairs. `of` gives the values of a joint by pair.
    pub(crate) fn fill_pairs<const N: usize, F: Fn(usize) -> [f64; N]>(
        &self,
        range: Range<usize>,
        out: &mut [f64],
        of: impl Fn(usize) -> F + Sync,
    ) {
        let first = self.joint_of(range.start);
        fill(range, out, (first, |joint| self.pairs_of(joint)), of);
    }

    /// A nodal field in the order of the nodes, shape `(n_nodes, 3)`.
    pub(crate) fn plain(&self, field: &[Lanes]) -> Vec<[f64; 3]> {
        let mut plain = vec![[0.0; 3]; self.n_nodes()];
        self.fill_nodal(field, 0..self.n_nodes(), plain.as_flattened_mut());
        plain
    }

    /// Fills the values of a range of nodes from a nodal field.
    pub(crate) fn fill_nodal(&self, field: &[Lanes], range: Range<usize>, out: &mut [f64]) {
        self.fill_nodes(range, out, |block| {
            let (pack, lane) = self.packs.slot(block);
            let field = &field[3 * self.packs.packs[pack].start..];
            move |node| [0, 1, 2].map(|c| field[3 * node + c].0[lane])
        });
    }
}
