//! Properties that a column takes from the model in front of it: supports, and damping of its
//! nodes. They remain where blocks have been removed.

use super::active::held;
use super::{Column, StageGeometry};
use crate::model::conditions::{ActiveConditions, Conditions};
use ddem_mesh::assembly::Assembly;
use ddem_mesh::inertia::Inertia;
use ddem_mesh::slot::NodeSlot;

impl Column {
    /// Numbers of the fixes that hold the axes of the nodes in front of the column.
    pub(super) fn held(
        &self,
        geometries: StageGeometry<'_>,
        conditions: &Conditions,
        stage: usize,
        active: &ActiveConditions,
    ) -> Vec<[Option<usize>; 3]> {
        let of = |node: &u32| {
            let removed = geometries.now.is_removed(geometries.now.block_of(*node as usize));
            // The column keeps the supports of removed ground.
            let fixes = match removed {
                true => conditions.fixes_of(*node, stage),
                false => held(active, geometries.packs.node_slot(geometries.now, *node as usize)),
            };
            fixes.map(|fix| fix.map(|f| f as usize))
        };
        self.nodes.iter().map(of).collect()
    }

    /// True for levels at removed blocks and at their neighbours, whose mass and stiffness have
    /// changed.
    pub(super) fn excavated(&self, geometries: StageGeometry<'_>) -> Vec<bool> {
        let StageGeometry { now, start, .. } = geometries;
        if std::ptr::eq(now, start) {
            return vec![false; self.nodes.len()];
        }
        let around = |i: i32| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
        let excavated = |block: usize| {
            let lost = |o: [i32; 3]| start.neighbour(block, o) != now.neighbour(block, o);
            now.is_removed(block) || (0..27).map(around).any(lost)
        };
        self.nodes.iter().map(|&node| excavated(start.block_of(node as usize))).collect()
    }

    pub(super) fn note_damping(&mut self, geometries: StageGeometry<'_>, assembly: &Assembly) {
        let slot = |&node: &u32| geometries.packs.node_slot(geometries.now, node as usize);
        self.slots = self.nodes.iter().map(slot).collect();
        let square = |slot: &NodeSlot| {
            let class = assembly.pack_inertia[slot.pack] as usize;
            let Inertia { mass, diagonal, .. } = &assembly.inertia[class];
            let (local, lane) = (slot.local(geometries.packs), slot.lane());
            [0, 1, 2].map(|c| diagonal[3 * local + c].0[lane] / mass[local].0[lane])
        };
        self.squares = self.slots.iter().map(square).collect();
    }
}
