//! What columns have of the model that they stand behind: its supports, and the damping of its nodes, where
//! blocks have been taken out, too.

use super::outside::{held, place};
use super::{Column, Made};
use crate::mesh::assembly::Assembly;
use crate::mesh::inertia::Inertia;
use crate::model::conditions::{Active, Conditions};

impl Column {
    /// Fixes that hold the axes of the nodes it stands behind.
    pub(super) fn held(
        &self,
        made: Made<'_>,
        (conditions, stage, active): (&Conditions, usize, &Active),
    ) -> Vec<[Option<usize>; 3]> {
        let of = |node: &u32| {
            let gone = made.geometry.is_gone(made.geometry.locate(*node as usize).0);
            // The ground goes on as it was held.
            let fixes = match gone {
                true => conditions.holds(*node, stage),
                false => held(active, place(made, *node)),
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
        self.nodes.iter().map(|&node| dug(start.locate(node as usize).0)).collect()
    }

    pub(super) fn note_ground(&mut self, made: Made<'_>, assembly: &Assembly) {
        let packs = made.packs;
        self.places = self.nodes.iter().map(|&node| place(made, node)).collect();
        let square = |&(pack, at, lane): &(usize, u32, u8)| {
            let Inertia { mass, diagonal, .. } =
                &assembly.inertia[assembly.pack_inertia[pack] as usize];
            let (at, lane) = (at as usize - 3 * packs.packs[pack].start, usize::from(lane));
            [0, 1, 2].map(|c| diagonal[at + c].0[lane] / mass[at / 3].0[lane])
        };
        self.squares = self.places.iter().map(square).collect();
    }
}
