//! Ties: nodes of several blocks at one place that move as one (§1).

use crate::Geometry;
use crate::pack::Packs;
use ddem_mechanics::math::lanes::{LANES, Lanes};

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
        self.ties.groups().filter_map(|group| {
            let exists = |node: &&u32| !self.is_removed(self.block_of(**node as usize));
            let left: Vec<u32> = group.iter().filter(exists).copied().collect();
            (left.len() > 1).then_some(left)
        })
    }

    /// Groups of tied nodes of deformable blocks, whose forces are summed; rigid bodies sum their
    /// wrenches.
    pub fn tied_deformable(&self) -> impl Iterator<Item = Vec<u32>> {
        self.tied().filter(|group| !self.is_rigid(self.block_of(group[0] as usize)))
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

/// Copy of a tied node in the nodal fields.
#[derive(Clone, Copy, Debug)]
struct TiedCopy {
    /// Index of the x component in a nodal field.
    at: u32,
    lane: u32,
    /// Number of its group.
    group: u32,
}

/// Ties of the blocks that exist, by their slots in the nodal fields. The copies of a node sum
/// the forces of all of them in one order, and so have equal bits.
#[derive(Clone, Debug, Default)]
pub struct TiedSlots {
    /// Copies, group after group.
    copies: Vec<TiedCopy>,
    /// First copy of each group, shape `(groups + 1)`.
    starts: Vec<u32>,
    /// Numbers of the copies of each pack.
    own: Vec<u32>,
    /// First of these numbers of each pack, shape `(packs + 1)`.
    pack_starts: Vec<u32>,
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
                of_pack.push((slot.pack, slots.copies.len() as u32));
                let (at, lane) = (slot.at, u32::from(slot.lane));
                slots.copies.push(TiedCopy { at, lane, group: group as u32 });
            }
            slots.starts.push(slots.copies.len() as u32);
        }
        of_pack.sort_unstable();
        let start = |pack: usize| of_pack.partition_point(|(own, _)| *own < pack) as u32;
        slots.pack_starts = (0..=packs.packs.len()).map(start).collect();
        slots.own = of_pack.into_iter().map(|(_, copy)| copy).collect();
        slots
    }

    /// True if no nodes are tied.
    #[inline]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.copies.is_empty()
    }

    /// Numbers of the copies of each group.
    fn group(&self, group: u32) -> &[TiedCopy] {
        let [from, to] = [group, group + 1].map(|at| self.starts[at as usize] as usize);
        &self.copies[from..to]
    }

    /// Sets `own` to the values of a nodal field `all` in a pack, which begin at index `first`. Tied nodes
    /// get the sums over all copies.
    pub fn sum(&self, pack: usize, all: &[Lanes], first: usize, own: &mut [Lanes]) {
        own.copy_from_slice(&all[first..first + own.len()]);
        let [from, to] = [pack, pack + 1].map(|at| self.pack_starts[at] as usize);
        for &number in &self.own[from..to] {
            let TiedCopy { at, lane, group } = self.copies[number as usize];
            for c in 0..3 {
                let copies = self.group(group).iter();
                let value =
                    |copy: &TiedCopy| all[copy.at as usize + c].0[copy.lane as usize % LANES];
                own[at as usize + c - first].0[lane as usize % LANES] =
                    copies.map(value).fold(0.0, |sum, value| sum + value);
            }
        }
    }

    /// Memory in use `[bytes]`.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.copies.len() * size_of::<TiedCopy>()
            + 4 * (self.starts.len() + self.own.len() + self.pack_starts.len())
    }
}
