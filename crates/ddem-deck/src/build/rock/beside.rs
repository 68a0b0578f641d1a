//! Sets of blocks beside regions: neither may reach into the other.

use std::sync::Arc;

use ddem_core::problem::{Lattice, MISSES, Vec3, bounds_of, overlapping_pairs};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::Polyhedron;

use super::blocks::RockBlocks;

/// Numbers of the corners of each face of a parallelepiped, which are numbered by bits.
const FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Block of a set: its lattice, its cell there, and its corners.
struct SetBlock<'a> {
    lattice: &'a Lattice,
    cell: [usize; 3],
    corners: [Vec3; 8],
}

impl RockBlocks<'_> {
    /// Faults of sets whose blocks reach into cells, one for each set. A set may fill the place of
    /// removed cells.
    pub(in crate::build) fn overlaps(&self, lattices: &[Arc<Lattice>]) -> Vec<Fault> {
        let cells: Vec<usize> = self.left().collect();
        if cells.is_empty() {
            return Vec::new();
        }
        let blocks: Vec<SetBlock<'_>> = lattices.iter().flat_map(|set| blocks_of(set)).collect();
        let of_cells =
            cells.iter().map(|&cell| bounds_of(&self.rock.complex.polyhedron(cell).points));
        let of_blocks = blocks.iter().map(|block| bounds_of(&block.corners));
        let boxes: Vec<[Vec3; 2]> = of_cells.chain(of_blocks).collect();
        let mut faults: Vec<Fault> = Vec::new();
        for [a, b] in overlapping_pairs(&boxes).into_iter().map(|pair| pair.map(|at| at as usize)) {
            // Cells come first.
            if a >= cells.len() || b < cells.len() {
                continue;
            }
            let (cell, SetBlock { lattice, cell: at, corners }) =
                (cells[a], &blocks[b - cells.len()]);
            let place = format!("{}.origin", self.deck.set_place(lattice.set));
            if faults.iter().any(|known| known.place == place) {
                continue;
            }
            let faces = FACES.iter().map(|face| face.to_vec()).collect();
            let block = Polyhedron { points: corners.to_vec(), faces };
            let allowed = MISSES * lattice.shortest();
            if self.rock.complex.polyhedron(cell).overlaps(&block, allowed) {
                let [set, region] =
                    [lattice.set, self.region(cell)].map(|set| self.deck.set_name(set));
                let message = format!("block {at:?} of `{set}` overlaps cell {cell} of `{region}`");
                let help = "move the set, or remove the cells in its place: sets may touch regions, but \
                            share no rock with them; blocks are counted along x, y, z from 0";
                faults.push(Fault::new(ErrorCode::OverlappingBlocks, place, message).help(help));
            }
        }
        faults
    }
}

fn blocks_of(lattice: &Lattice) -> impl Iterator<Item = SetBlock<'_>> {
    let there = (0..lattice.block.len()).filter(|&at| lattice.has_block(at));
    there.map(|at| {
        let cell = lattice.cell(at);
        SetBlock { lattice, cell, corners: lattice.corners_of(cell, cell.map(|i| i + 1)) }
    })
}
