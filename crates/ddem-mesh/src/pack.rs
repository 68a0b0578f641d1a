//! Packs of four blocks side by side, one per SIMD lane, and their neighbours.
//!
//! A pack owns the joint cells at the upper sides of its blocks: three faces, three strips and a
//! corner, one for each of the seven upper neighbours. With the bits 1 = x, 2 = y, 4 = z of an
//! offset, lattice `o` joins the blocks whose offsets are the subsets of `o`:
//!
//! | offset | 1, 2, 4 | 3, 5, 6 | 7 |
//! |---|---|---|---|
//! | cells | face joint, n×n×1 | strip, n×1×1 | corner, 1×1×1 |
//! | blocks | 2 | 4 | 8 |
//!
//! The forces of these cells on the upper neighbours go to the pack's *neighbour forces*: one entry
//! for each touched node of a neighbour, and one for its torque. The neighbours collect them later.
//! Every number is therefore written by one task and summed in one order.

use std::sync::Arc;

use crate::numbering::BlockNumbering;
use crate::{Geometry, Lattice};
use ddem_mechanics::math::lanes::{LANES, Vector, mask_of, shifted};
use fearless_simd::{Simd, mask64x4};

/// Marker for a lane without a neighbour.
const NOBODY: u32 = u32::MAX;

/// Neighbours at one offset: pack and lane for each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    slots: [u32; LANES],
    in_order: Option<LaneRun>,
}

/// Four lanes in order, from one pack or from two that follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneRun {
    /// Packs of the first and the last lane. A pack without any of the lanes is replaced by the
    /// other one.
    packs: [u32; 2],
    /// Lane of the first pack with which the run begins.
    pub shift: u8,
    /// Lanes that have a neighbour.
    pub present: [bool; LANES],
}

impl LaneRun {
    /// All lanes of a pack.
    pub fn of(pack: usize) -> Self {
        Self { packs: [pack as u32; 2], shift: 0, present: [true; LANES] }
    }

    /// Packs of the first and the last lane.
    #[inline(always)]
    pub fn packs(&self) -> [usize; 2] {
        self.packs.map(|pack| pack as usize)
    }

    /// Vectors of the four lanes, from those of the first and the last pack.
    #[inline(always)]
    pub fn vectors<S: Simd>(&self, low: Vector<S>, high: Vector<S>) -> Vector<S> {
        match self.shift {
            0 => low,
            1 => shifted::<S, 1>(low, high),
            2 => shifted::<S, 2>(low, high),
            _ => shifted::<S, 3>(low, high),
        }
    }

    /// True in the lanes that have a neighbour.
    #[inline(always)]
    pub fn mask<S: Simd>(&self, simd: S) -> mask64x4<S> {
        mask_of(simd, self.present)
    }

    /// Run of which `slots` are those present, if they follow each other.
    fn new(slots: [u32; LANES]) -> Option<Self> {
        let lanes = LANES as i64;
        let first = |lane: usize| i64::from(slots[lane]) - lane as i64;
        let mut present = (0..LANES).filter(|&lane| slots[lane] != NOBODY);
        let start = first(present.next()?);
        if present.any(|lane| first(lane) != start) {
            return None;
        }
        let present = slots.map(|slot| slot != NOBODY);
        let (low, shift) = (start.div_euclid(lanes), start.rem_euclid(lanes));
        let in_low = (0..LANES).any(|lane| present[lane] && lane as i64 + shift < lanes);
        let in_high = (0..LANES).any(|lane| present[lane] && lane as i64 + shift >= lanes);
        let packs = [if in_low { low } else { low + 1 }, if in_high { low + 1 } else { low }];
        Some(Self { packs: packs.map(|pack| pack as u32), shift: shift as u8, present })
    }
}

impl Neighbours {
    const NONE: Self = Self { slots: [NOBODY; LANES], in_order: None };

    fn new(slots: [u32; LANES]) -> Self {
        Self { slots, in_order: LaneRun::new(slots) }
    }

    /// Pack and lane of a lane's neighbour.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Option<(usize, usize)> {
        match self.slots[lane] {
            NOBODY => None,
            slot => Some((slot as usize / LANES, slot as usize % LANES)),
        }
    }

    /// Run of lanes, if the neighbours follow each other; then whole vectors load.
    #[inline(always)]
    pub fn in_order(&self) -> Option<&LaneRun> {
        self.in_order.as_ref()
    }

    /// Pack of the last neighbour.
    pub fn last_pack(&self) -> Option<usize> {
        (0..LANES).filter_map(|lane| self.at(lane)).map(|(pack, _)| pack).max()
    }

    /// True if no lane has a neighbour.
    #[inline(always)]
    pub fn is_none(&self) -> bool {
        self.slots == [NOBODY; LANES]
    }
}

/// Blocks of a lattice in the order of the lanes. Lanes run along an edge whose count is a multiple
/// of four, if there is one. The neighbours across it are then whole packs.
fn in_order(lattice: &Lattice) -> Vec<u32> {
    let first = (0..3).find(|&d| lattice.count[d].is_multiple_of(LANES)).unwrap_or(0);
    let order = [first, (first + 1) % 3, (first + 2) % 3];
    let count = order.map(|d| lattice.count[d]);
    let mut blocks = Vec::new();
    for (k, j, i) in (0..count[2])
        .flat_map(|k| (0..count[1]).flat_map(move |j| (0..count[0]).map(move |i| (k, j, i))))
    {
        let mut cell = [0; 3];
        (cell[order[0]], cell[order[1]], cell[order[2]]) = (i, j, k);
        let index = lattice.index(cell);
        if lattice.has_block(index) {
            blocks.push(lattice.block[index]);
        }
    }
    blocks
}

/// Four blocks of one set, or of sets of one block each. Lanes beyond `filled` repeat the first
/// block with zero weight.
#[derive(Clone, Debug)]
pub struct Pack {
    /// Block of each lane.
    pub blocks: [u32; LANES],
    /// Number of lanes with a block of their own.
    pub filled: usize,
    /// Index of the numbering in the numberings.
    pub(super) numbering: usize,
    /// First node in the nodal fields, in nodes.
    pub start: usize,
    /// Index of the first neighbour force.
    pub neighbour_force_start: usize,
    /// True if its blocks do not deform.
    pub rigid: bool,
    /// Number of rigid packs before it.
    pub rigid_start: usize,
    /// Neighbours at the upper offsets 1…7 (0 unused).
    pub upper: [Neighbours; 8],
    /// Neighbours at the lower offsets −1…−7, which own the joints between.
    pub lower: [Neighbours; 8],
}

/// All packs, and the location of each block.
#[derive(Clone, Debug)]
pub struct Packs {
    pub(super) numberings: Vec<BlockNumbering>,
    /// Packs in the order of the blocks.
    pub packs: Vec<Pack>,
    /// Location of each block: `LANES` × pack + lane.
    slots: Vec<u32>,
    /// Nodes in the nodal fields; four lanes count as one.
    pub nodes: usize,
    /// Number of neighbour forces.
    pub neighbour_forces: usize,
    /// Number of rigid packs.
    pub rigid: usize,
    /// First nodes and neighbour forces of the packs, and their ends. Neighbours look them up, so
    /// they lie close together.
    pub(super) starts: [Vec<u32>; 2],
}

impl Packs {
    /// Packs of the blocks of a geometry.
    pub fn new(geometry: &Geometry) -> Self {
        let mut packs = Self {
            numberings: Vec::new(),
            packs: Vec::new(),
            slots: vec![NOBODY; geometry.blocks.len()],
            nodes: 0,
            neighbour_forces: 0,
            rigid: 0,
            starts: [vec![0], vec![0]],
        };
        let mut first = 0;
        while first < geometry.lattices.len() {
            let end = first + packs.alike(&geometry.lattices[first..]);
            let blocks = geometry.lattices[first..end].iter().flat_map(|lattice| in_order(lattice));
            packs.add(&geometry.lattices[first], blocks.collect());
            first = end;
        }
        packs.link(geometry);
        packs
    }

    /// Number of lattices at the start of a list whose blocks share packs: lattices of one block each,
    /// with equal divisions and of the same kind; otherwise 1.
    fn alike(&self, lattices: &[Arc<Lattice>]) -> usize {
        let kind = |lattice: &Lattice| {
            (
                lattice.divisions,
                lattice.rigid,
                lattice.part.is_some() || lattice.is_box(),
                lattice.part.is_some(),
            )
        };
        let first = &lattices[0];
        let like =
            |lattice: &&Arc<Lattice>| lattice.block.len() == 1 && kind(lattice) == kind(first);
        lattices.iter().take_while(like).count().max(1)
    }

    /// Finds the neighbours of all packs.
    pub fn link(&mut self, geometry: &Geometry) {
        for index in 0..self.packs.len() {
            for offset in 1..8 {
                let pack = &self.packs[index];
                let step = [0, 1, 2].map(|d| i32::from(offset & (1 << d) != 0));
                let upper = self.neighbours(geometry, pack, step);
                let lower = self.neighbours(geometry, pack, step.map(|d| -d));
                let pack = &mut self.packs[index];
                (pack.upper[offset], pack.lower[offset]) = (upper, lower);
            }
        }
    }

    /// Adds packs of the blocks of similar lattices.
    fn add(&mut self, lattice: &Lattice, blocks: Vec<u32>) {
        let numbering = self.numbering(lattice.divisions);
        for four in blocks.chunks(LANES) {
            let index = self.packs.len() * LANES;
            for (lane, &block) in four.iter().enumerate() {
                self.slots[block as usize] = (index + lane) as u32;
            }
            self.packs.push(Pack {
                blocks: std::array::from_fn(|lane| *four.get(lane).unwrap_or(&four[0])),
                filled: four.len(),
                numbering,
                start: self.nodes,
                neighbour_force_start: self.neighbour_forces,
                rigid: lattice.rigid,
                rigid_start: self.rigid,
                upper: [Neighbours::NONE; 8],
                lower: [Neighbours::NONE; 8],
            });
            self.nodes += self.numberings[numbering].nodes;
            self.neighbour_forces += self.numberings[numbering].neighbour_forces;
            self.rigid += usize::from(lattice.rigid);
            self.starts[0].push(self.nodes as u32);
            self.starts[1].push(self.neighbour_forces as u32);
        }
    }

    fn numbering(&mut self, divisions: usize) -> usize {
        let known = self.numberings.iter().position(|numbering| numbering.divisions == divisions);
        known.unwrap_or_else(|| {
            self.numberings.push(BlockNumbering::new(divisions));
            self.numberings.len() - 1
        })
    }

    /// Blocks at an offset in cells from those of a pack.
    pub fn neighbours(&self, geometry: &Geometry, pack: &Pack, step: [i32; 3]) -> Neighbours {
        Neighbours::new(std::array::from_fn(|lane| {
            let block = (lane < pack.filled).then_some(pack.blocks[lane] as usize);
            // A removed block still counts at offset 0.
            let other = match step {
                [0, 0, 0] => block,
                _ => block.and_then(|block| geometry.neighbour(block, step)),
            };
            other.map_or(NOBODY, |other| self.slots[other])
        }))
    }

    /// Pack and lane of a block.
    pub fn slot(&self, block: usize) -> (usize, usize) {
        let slot = self.slots[block] as usize;
        (slot / LANES, slot % LANES)
    }

    /// Numbering of the blocks of a pack.
    pub fn numbering_of(&self, pack: &Pack) -> &BlockNumbering {
        &self.numberings[pack.numbering]
    }
}

/// Joint lattice: the joints of one kind at the upper sides of the blocks of a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct JointLattice {
    /// Number of the pack.
    pub pack: usize,
    /// Directions that it lies across, as bits: 1, 2 and 4 are face joints, 3, 5 and 6 strips, 7 is
    /// a corner.
    pub offset: usize,
}

impl JointLattice {
    /// Number of its nodes.
    pub fn nodes(self, packs: &Packs) -> usize {
        packs.numbering_of(&packs.packs[self.pack]).joints[self.offset].len()
    }
}
