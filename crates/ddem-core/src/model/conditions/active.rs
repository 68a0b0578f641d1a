//! Conditions in force in one stage, by pack.

use std::collections::BTreeMap;
use std::ops::Range;

use super::Conditions;
use ddem_mechanics::math::lanes::LANES;
use ddem_mesh::Geometry;
use ddem_mesh::pack::Packs;
use ddem_mesh::slot::NodeSlot;

/// One supported degree of freedom.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SupportedAxis {
    /// Place in a nodal field.
    pub(crate) at: u32,
    pub(crate) lane: u8,
    pub(crate) axis: u8,
    /// Number of the fix that prescribes its velocity.
    pub(crate) fix: u32,
    pub(crate) node: u32,
    /// Part of the reaction that the node has: tied nodes share it evenly.
    pub(crate) share: f64,
}

/// Forces that programs apply to nodes `[N]`, by node.
pub(crate) type AppliedForces = BTreeMap<u32, [f64; 3]>;

/// One load on one node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodalLoad {
    /// Place of the x component in a nodal field.
    pub(crate) at: u32,
    pub(crate) lane: u8,
    pub(crate) load: u32,
    pub(crate) force: [f64; 3],
}

/// Conditions in force in one stage, sorted by pack.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveConditions {
    pub(crate) supports: Vec<SupportedAxis>,
    pub(super) loads: Vec<NodalLoad>,
    support_start: Vec<u32>,
    load_start: Vec<u32>,
    /// True for blocks with supports along all three axes, by pack and lane.
    pub(crate) held_blocks: Vec<[bool; LANES]>,
}

/// Storage of the nodes that exist in a stage.
#[derive(Clone, Copy)]
struct NodeSlots<'a> {
    geometry: &'a Geometry,
    packs: &'a Packs,
}

impl NodeSlots<'_> {
    /// Storage of a node; `None` if its block has been removed.
    fn of(&self, node: u32) -> Option<NodeSlot> {
        let exists = !self.geometry.is_removed(self.geometry.block_of(node as usize));
        exists.then(|| self.packs.node_slot(self.geometry, node as usize))
    }

    /// Nodes with those that are tied to them.
    fn with_ties<'b>(&'b self, nodes: &'b [u32]) -> impl Iterator<Item = u32> + 'b {
        nodes.iter().flat_map(|&node| {
            let tied = self.geometry.ties.with(node);
            tied.iter().copied().chain(tied.is_empty().then_some(node))
        })
    }

    /// Number of existing nodes that move with a node, itself included.
    fn copies(&self, node: u32) -> f64 {
        let exists = |&&node: &&u32| self.of(node).is_some();
        self.geometry.ties.with(node).iter().filter(exists).count().max(1) as f64
    }

    /// Supports of a stage with their packs, sorted. The later one of two supports of a degree of
    /// freedom applies.
    fn supports(&self, conditions: &Conditions, stage: usize) -> Vec<(usize, SupportedAxis)> {
        let mut supports = Vec::new();
        let fixed = conditions.fixed.iter().enumerate();
        for (fix, entry) in fixed.filter(|(_, entry)| entry.in_force.has(stage)) {
            for node in self.with_ties(&entry.nodes) {
                let Some(NodeSlot { pack, at, lane }) = self.of(node) else { continue };
                let share = 1.0 / self.copies(node);
                for axis in (0..3u8).filter(|&axis| entry.axes[axis as usize]) {
                    let (at, fix) = (at + u32::from(axis), fix as u32);
                    supports.push((pack, SupportedAxis { at, lane, axis, fix, node, share }));
                }
            }
        }
        supports.sort_by_key(|(pack, s)| (*pack, s.at, s.lane, std::cmp::Reverse(s.fix)));
        supports.dedup_by_key(|(_, s)| (s.at, s.lane));
        supports
    }

    /// Loads on nodes in a stage with their packs, sorted.
    fn loads(
        &self,
        conditions: &Conditions,
        stage: usize,
        applied: &AppliedForces,
    ) -> Vec<(usize, NodalLoad)> {
        let mut loads = Vec::new();
        let mut add = |node: u32, load: usize, force: [f64; 3]| {
            if let Some(NodeSlot { pack, at, lane }) = self.of(node) {
                loads.push((pack, NodalLoad { at, lane, load: load as u32, force }));
            }
        };
        let loaded = conditions.loaded.iter().enumerate();
        for (index, entry) in loaded.filter(|(_, entry)| entry.in_force.has(stage)) {
            entry.forces.iter().for_each(|&(node, force)| add(node, index, force.into()));
        }
        let charged = conditions.charged.iter().enumerate();
        for (index, entry) in charged.filter(|(_, entry)| entry.in_force.has(stage)) {
            // The forces follow from the present positions and are set before each step.
            let load = conditions.loaded.len() + index;
            entry.charge.nodes.iter().for_each(|&node| add(node, load, [0.0; 3]));
        }
        let load = conditions.applied_factor();
        applied.iter().for_each(|(&node, &force)| add(node, load, force));
        loads.sort_by_key(|(pack, l)| (*pack, l.at, l.lane, l.load));
        loads
    }
}

impl ActiveConditions {
    pub(crate) fn new(
        conditions: &Conditions,
        geometry: &Geometry,
        packs: &Packs,
        stage: usize,
        applied: &AppliedForces,
    ) -> Self {
        let slots = NodeSlots { geometry, packs };
        let supports = slots.supports(conditions, stage);
        let loads = slots.loads(conditions, stage, applied);
        let n = packs.packs.len();
        let mut held_axes = vec![[[false; 3]; LANES]; n];
        for (pack, support) in &supports {
            held_axes[*pack][support.lane as usize][support.axis as usize] = true;
        }
        let held = |axes: [bool; 3]| axes == [true; 3];
        let held_blocks = held_axes.into_iter().map(|lanes| lanes.map(held)).collect();
        Self {
            held_blocks,
            support_start: starts(n, supports.iter().map(|s| s.0)),
            load_start: starts(n, loads.iter().map(|l| l.0)),
            supports: supports.into_iter().map(|s| s.1).collect(),
            loads: loads.into_iter().map(|l| l.1).collect(),
        }
    }

    /// Index range of the supports of a pack.
    pub(crate) fn supports_of(&self, pack: usize) -> Range<usize> {
        self.support_start[pack] as usize..self.support_start[pack + 1] as usize
    }

    /// Index of the first support of a pack; `pack` may be one past the last.
    pub(crate) fn first_support(&self, pack: usize) -> usize {
        self.support_start[pack] as usize
    }

    pub(crate) fn loads_of(&self, pack: usize) -> &[NodalLoad] {
        &self.loads[self.load_start[pack] as usize..self.load_start[pack + 1] as usize]
    }

    /// Force of a load on a node; `None` if the load does not act there.
    pub(crate) fn force_mut(&mut self, slot: NodeSlot, load: u32) -> Option<&mut [f64; 3]> {
        let NodeSlot { pack, at, lane } = slot;
        let range = self.load_start[pack] as usize..self.load_start[pack + 1] as usize;
        let loads = &mut self.loads[range];
        let found = loads.binary_search_by_key(&(at, lane, load), |l| (l.at, l.lane, l.load));
        found.ok().map(|found| &mut loads[found].force)
    }

    /// Index of the support of a node along an axis.
    pub(crate) fn support_at(&self, slot: NodeSlot, axis: u32) -> Option<usize> {
        let (range, at, lane) = (self.supports_of(slot.pack), slot.at + axis, slot.lane);
        let key = |s: &SupportedAxis| (s.at, s.lane);
        let found = self.supports[range.clone()].binary_search_by_key(&(at, lane), key);
        found.ok().map(|found| range.start + found)
    }

    /// Supported nodes and axes.
    pub(crate) fn held(&self) -> impl Iterator<Item = (u32, usize)> + '_ {
        self.supports.iter().map(|s| (s.node, s.axis as usize))
    }
}

impl Conditions {
    /// Fixes that hold the axes of a node in a stage. A node of a removed block keeps its fixes.
    pub(crate) fn fixes_of(&self, node: u32, stage: usize) -> [Option<u32>; 3] {
        let mut held = [None; 3];
        for (index, fix) in self.fixed.iter().enumerate().filter(|(_, f)| f.in_force.has(stage)) {
            if [&fix.nodes, &fix.removed].iter().any(|nodes| nodes.binary_search(&node).is_ok()) {
                // The later fix applies, as among supports.
                let axes = held.iter_mut().zip(fix.axes).filter(|(_, axis)| *axis);
                axes.for_each(|(held, _)| *held = Some(index as u32));
            }
        }
        held
    }
}

/// Index of each pack's first entry in a list sorted by pack, shape `(n + 1)`.
pub(crate) fn starts(n: usize, packs: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut starts = vec![0; n + 1];
    packs.for_each(|pack| starts[pack + 1] += 1);
    for pack in 0..n {
        starts[pack + 1] += starts[pack];
    }
    starts
}
