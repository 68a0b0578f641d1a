//! What columns have of the model that they stand behind: its supports, and the damping of its nodes, where
//! blocks have been taken out, too.

use super::outside::held;
use super::{Column, Made};
use crate::model::conditions::{Active, Conditions};
use ddem_mesh::assembly::Assembly;
use ddem_mesh::inertia::Inertia;
use ddem_mesh::slot::NodeSlot;

impl Column {
    /// Fixes that hold the axes of the nodes it stands behind.
    pub(super) fn held(
        &self,
        made: Made<'_>,
        conditions: &Conditions,
        stage: usize,
        active: &Active,
    ) -> Vec<[Option<usize>; 3]> {
        let of = |node: &u32| {
            let gone = made.geometry.is_gone(made.geometry.block_of(*node as usize));
            // The ground goes on as it was held.
            let fixes = match gone {
                true => conditions.holds(*node, stage),
                false => held(active, made.packs.node_slot(made.geometry, *node as usize)),
            };
            fixes.map(|fix| fix.map(|f| f as usize))
        };
        self.nodes.iter().map(of).collect()
    }

    /// Levels at blocks that have been taken out, and at those beside them, whose mass and stiffness that
    /// changes.
    pub(super) fn dug(&self, made: Made<'_>) -> Vec<bool> {
        let Made { geometry: now, start, .. } = made;
        if std::ptr::eq(now, start) {
            return vec![false; self.nodes.len()];
        }
        let around = |i: i32| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
        let dug = |body: usize| {
            let lost = |o: [i32; 3]| start.neighbour(body, o) != now.neighbour(body, o);
            now.is_gone(body) || (0..27).map(around).any(lost)
        };
        self.nodes.iter().map(|&node| dug(start.block_of(node as usize))).collect()
    }

    pub(super) fn note_ground(&mut self, made: Made<'_>, assembly: &Assembly) {
        let slot = |&node: &u32| made.packs.node_slot(made.geometry, node as usize);
        self.slots = self.nodes.iter().map(slot).collect();
        let square = |slot: &NodeSlot| {
            let class = assembly.pack_inertia[slot.pack] as usize;
            let Inertia { mass, diagonal, .. } = &assembly.inertia[class];
            let (local, lane) = (slot.local(made.packs), slot.lane());
            [0, 1, 2].map(|c| diagonal[3 * local + c].0[lane] / mass[local].0[lane])
        };
        self.squares = self.slots.iter().map(square).collect();
    }
}
