//! Ties: nodes of several blocks at one place that move as one (§1).

use rayon::prelude::*;

use crate::Geometry;
use crate::pack::Packs;
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// Groups of tied nodes of one task.
const TOGETHER: usize = 512;

/// Groups of tied nodes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ties {
    /// Nodes of all groups, in increasing order in each.
    nodes: Vec<u32>,
    /// First node of each group, shape `(groups + 1)`.
    starts: Vec<u32>,
    /// Nodes in increasing order, each with its group.
    group_of: Vec<(u32, u32)>,
}

impl Ties {
    /// Ties of groups of nodes. Groups of one node are left out. No node may be in two groups.
    #[must_use]
    pub fn new(groups: impl IntoIterator<Item = Vec<u32>>) -> Self {
        let mut groups: Vec<Vec<u32>> =
            groups.into_iter().filter(|group| group.len() > 1).collect();
        groups.iter_mut().for_each(|group| group.sort_unstable());
        groups.sort_unstable();
        let mut ties = Self { starts: vec![0], ..Self::default() };
        for (number, group) in groups.iter().enumerate() {
            ties.group_of.extend(group.iter().map(|&node| (node, number as u32)));
            ties.nodes.extend(group);
            ties.starts.push(ties.nodes.len() as u32);
        }
        ties.group_of.sort_unstable();
        ties
    }

    /// True if no nodes are tied.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Number of groups.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Groups of tied nodes.
    pub fn groups(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|range| &self.nodes[range[0] as usize..range[1] as usize])
    }

    /// Nodes tied to a node, itself included; none if it is not tied.
    #[must_use]
    pub fn with(&self, node: u32) -> &[u32] {
        let Ok(at) = self.group_of.binary_search_by_key(&node, |(node, _)| *node) else {
            return &[];
        };
        let group = self.group_of[at].1 as usize;
        &self.nodes[self.starts[group] as usize..self.starts[group + 1] as usize]
    }

    /// Memory in use `[bytes]`.
    #[must_use]
    pub fn bytes(&self) -> usize {
        4 * (self.nodes.len() + self.starts.len()) + 8 * self.group_of.len()
    }
}

impl Geometry {
    /// Groups of tied nodes of blocks that have not been removed.
    pub fn tied(&self) -> impl Iterator<Item = Vec<u32>> {
        self.ties.groups().filter_map(|group| self.left_of(group))
    }

    /// Tied nodes of a group whose blocks have not been removed, if they are several.
    fn left_of(&self, group: &[u32]) -> Option<Vec<u32>> {
        let exists = |node: &&u32| !self.is_removed(self.block_of(**node as usize));
        let left: Vec<u32> = group.iter().filter(exists).copied().collect();
        (left.len() > 1).then_some(left)
    }

    /// Groups of tied nodes of deformable blocks, whose forces are summed; rigid bodies sum their
    /// wrenches.
    pub fn tied_deformable(&self) -> impl Iterator<Item = Vec<u32>> {
        // The nodes of a group are all of rigid blocks, or all of deformable ones.
        let is_deformable = |group: &&[u32]| !self.is_rigid(self.block_of(group[0] as usize));
        self.ties.groups().filter(is_deformable).filter_map(|group| self.left_of(group))
    }

    /// Mass of each node and its three diagonal stiffnesses, summed over the nodes that it is tied to;
    /// empty without ties.
    pub(crate) fn summed_over_ties(&self, nodes: &[[f64; 4]]) -> Vec<[f64; 4]> {
        let mut groups = self.tied_deformable().peekable();
        if groups.peek().is_none() {
            return Vec::new();
        }
        let mut tied = nodes.to_vec();
        for group in groups {
            let mut sum = [0.0; 4];
            for &node in &group {
                (0..4).for_each(|k| sum[k] += nodes[node as usize][k]);
            }
            group.iter().for_each(|&node| tied[node as usize] = sum);
        }
        tied
    }
}

/// Ties of the blocks that exist, by their slots in the nodal fields. The copies of a node get the sum
/// over all of them, in one order, and so have equal bits.
#[derive(Clone, Debug, Default)]
pub struct TiedSlots {
    /// Copies, group after group.
    copies: Vec<Slot>,
    /// First copy of each group, shape `(groups + 1)`.
    starts: Vec<u32>,
    /// Copies of each pack, with their groups.
    own: Vec<(Slot, u32)>,
    /// First of these copies of each pack, shape `(packs + 1)`.
    pack_starts: Vec<u32>,
}

/// Copy of a tied node: index of its x component in a nodal field, times [`LANES`], plus its lane.
type Slot = u32;

/// Index of the x component of a copy, and its lane.
#[inline(always)]
fn at(slot: Slot) -> (usize, usize) {
    (slot as usize / LANES, slot as usize % LANES)
}

impl TiedSlots {
    /// Ties of a geometry.
    #[must_use]
    pub fn new(geometry: &Geometry, packs: &Packs) -> Self {
        if geometry.ties.is_empty() {
            return Self::default();
        }
        let mut slots = Self { starts: vec![0], ..Self::default() };
        let mut of_pack = Vec::new();
        for (group, nodes) in geometry.tied_deformable().enumerate() {
            for node in nodes {
                let slot = packs.node_slot(geometry, node as usize);
                let copy = slot.at * LANES as u32 + u32::from(slot.lane);
                of_pack.push((slot.pack, copy, group as u32));
                slots.copies.push(copy);
            }
            slots.starts.push(slots.copies.len() as u32);
        }
        of_pack.sort_unstable();
        let start = |pack: usize| of_pack.partition_point(|(own, ..)| *own < pack) as u32;
        slots.pack_starts = (0..=packs.packs.len()).map(start).collect();
        slots.own = of_pack.into_iter().map(|(_, copy, group)| (copy, group)).collect();
        slots
    }

    /// True if no nodes are tied.
    #[inline]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.copies.is_empty()
    }

    /// Computes the sums of a nodal field over the copies of each tied node, shape `(groups, 3)`.
    pub fn sum(&self, field: &[Lanes], sums: &mut Vec<[f64; 3]>) {
        let groups = (1..self.starts.len()).into_par_iter().with_min_len(TOGETHER);
        let sum = groups.map(|end| {
            let copies = self.starts[end - 1] as usize..self.starts[end] as usize;
            let mut sum = [0.0; 3];
            for &copy in &self.copies[copies] {
                let (at, lane) = at(copy);
                let node = &field[at..at + 3];
                (0..3).for_each(|c| sum[c] += node[c].0[lane]);
            }
            sum
        });
        sum.collect_into_vec(sums);
    }

    /// Sets the tied nodes of a pack in a nodal field, which begins at index `first`, to their sums.
    pub fn share(&self, pack: usize, sums: &[[f64; 3]], first: usize, own: &mut [Lanes]) {
        let [from, to] = [pack, pack + 1].map(|at| self.pack_starts[at] as usize);
        for &(copy, group) in &self.own[from..to] {
            let (at, lane) = at(copy);
            let (node, sum) = (&mut own[at - first..at - first + 3], sums[group as usize]);
            (0..3).for_each(|c| node[c].0[lane] = sum[c]);
        }
    }

    /// Memory in use `[bytes]`.
    #[must_use]
    pub fn bytes(&self) -> usize {
        4 * (self.copies.len() + self.starts.len() + self.pack_starts.len()) + 8 * self.own.len()
    }
}
