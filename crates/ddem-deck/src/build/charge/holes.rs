//! Empty cells of the lattices of a geometry, and the block faces around them.

use std::ops::Range;
use std::sync::Arc;

use super::super::geometry::Selector;
use ddem_core::problem::{BlockFace, FaceId, Geometry, Lattice, NONE, Vec3, bounds_of, moved_to};

pub(super) type CellIndex = [usize; 3];

/// Wall, given by the cell of the cavity in front of it, the direction of its normal and the side
/// of the cell.
pub(super) type Wall = (CellIndex, usize, i32);

/// Neighbour on one side of a cell, if the lattice has it.
pub(super) fn beside(lattice: &Lattice, cell: CellIndex, d: usize, side: i32) -> Option<CellIndex> {
    let next = cell[d].checked_add_signed(side as isize).filter(|next| *next < lattice.count[d])?;
    Some(moved_to(cell, d, next))
}

fn block_at(lattice: &Lattice, cell: CellIndex) -> Option<usize> {
    let index = lattice.index(cell);
    lattice.has_block(index).then(|| lattice.block[index] as usize)
}

/// Block face behind a side of an empty cell, if there is a block.
pub(super) fn face(lattice: &Lattice, (cell, normal, side): Wall) -> Option<BlockFace> {
    let block = block_at(lattice, beside(lattice, cell, normal, side)?)?;
    Some(BlockFace { block, face: FaceId { direction: normal, upper: side < 0 } })
}

/// Fraction of a lattice's size by which its box is enlarged: more than the rounding errors.
const MARGIN: f64 = 1e-6;

/// Lattices of a geometry with their empty cells, found once for all charges there.
pub(in crate::build) struct Holes<'a> {
    pub(in crate::build) geometry: &'a Geometry,
    all: Vec<LatticeHoles<'a>>,
}

struct LatticeHoles<'a> {
    lattice: &'a Lattice,
    /// Empty cells in the order of their indices.
    empty: Vec<CellIndex>,
    /// Box around the lattice `[m]`.
    bounds: [Vec3; 2],
}

impl<'a> Holes<'a> {
    pub(in crate::build) fn new(geometry: &'a Geometry) -> Self {
        let hollow = |lattice: &'a Arc<Lattice>| {
            let empty = (0..lattice.block.len()).filter(|&i| lattice.block[i] == NONE);
            let [low, high] = bounds_of(&lattice.corners());
            let margin = MARGIN * (high - low).norm();
            LatticeHoles {
                lattice,
                empty: empty.map(|i| lattice.cell(i)).collect(),
                bounds: [low.add_scalar(-margin), high.add_scalar(margin)],
            }
        };
        Self { geometry, all: geometry.lattices.iter().map(hollow).collect() }
    }

    /// Lattices of the sets of a selector, with their empty cells.
    pub(super) fn of(
        &self,
        selector: &Selector,
    ) -> impl Iterator<Item = (&'a Lattice, &[CellIndex])> {
        let own = self.all.iter().filter(|hollow| selector.has_set(hollow.lattice.set));
        own.map(|hollow| (hollow.lattice, &hollow.empty[..]))
    }

    /// Lattices near a selector, with the ranges of cells there.
    fn near(
        &self,
        selector: &Selector,
    ) -> impl Iterator<Item = (&LatticeHoles<'a>, [Range<usize>; 3])> {
        let own = self.all.iter().filter(|hollow| selector.has_set(hollow.lattice.set));
        own.filter_map(|hollow| {
            let ends = selector.part_of(&hollow.bounds)?;
            let corner = |k: usize| Vec3::from([0, 1, 2].map(|d| ends[k >> d & 1][d]));
            let corners: [Vec3; 8] = std::array::from_fn(corner);
            Some((hollow, hollow.lattice.cells_among(&corners)))
        })
    }

    /// Lattices near a selector, with the empty cells there.
    pub(super) fn empty_near(
        &self,
        selector: &Selector,
    ) -> impl Iterator<Item = (&'a Lattice, Vec<CellIndex>)> {
        self.near(selector).map(|(LatticeHoles { lattice, empty, .. }, [x, y, z])| {
            let from = empty.partition_point(|cell| cell[2] < z.start);
            let to = empty.partition_point(|cell| cell[2] < z.end);
            let there = |cell: &&CellIndex| x.contains(&cell[0]) && y.contains(&cell[1]);
            (*lattice, empty[from..to].iter().filter(there).copied().collect())
        })
    }

    /// Blocks near a selector, in order.
    pub(super) fn blocks_near(&self, selector: &Selector) -> impl Iterator<Item = usize> {
        self.near(selector).flat_map(|(hollow, cells)| blocks_in(hollow.lattice, cells))
    }

    /// Lattices whose boxes meet a box.
    pub(super) fn overlapping(&self, [low, high]: [Vec3; 2]) -> Vec<&'a Lattice> {
        let meets = |hollow: &&LatticeHoles<'_>| {
            let [from, to] = &hollow.bounds;
            (0..3).all(|d| from[d] <= high[d] && low[d] <= to[d])
        };
        self.all.iter().filter(meets).map(|hollow| hollow.lattice).collect()
    }
}

/// Blocks in a range of cells.
pub(super) fn blocks_in(
    lattice: &Lattice,
    [x, y, z]: [Range<usize>; 3],
) -> impl Iterator<Item = usize> {
    let rows = z.flat_map(move |k| y.clone().map(move |j| (j, k)));
    let cells = rows.flat_map(move |(j, k)| x.clone().map(move |i| [i, j, k]));
    cells.filter_map(|cell| block_at(lattice, cell))
}

/// Walls of the cavities that consist of these empty cells.
pub(super) fn walls(
    lattice: &Lattice,
    empty: &[CellIndex],
) -> impl Iterator<Item = (Wall, BlockFace)> {
    let sides = |cell| (0..3).flat_map(move |d| [(cell, d, -1), (cell, d, 1)]);
    let walls = empty.iter().copied().flat_map(sides);
    walls.filter_map(|wall| Some((wall, face(lattice, wall)?)))
}

/// True if a face of a block is a wall of a cavity.
pub(in crate::build) fn is_wall(geometry: &Geometry, face: &BlockFace) -> bool {
    let lattice = geometry.lattice(face.block);
    let cell = geometry.blocks[face.block].cell.map(|c| c as usize);
    let next = beside(lattice, cell, face.direction(), face.face.side());
    next.is_some_and(|next| lattice.block[lattice.index(next)] == NONE)
}
