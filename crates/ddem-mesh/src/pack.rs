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
//! The forces of these cells on the upper neighbours go to the pack's *shares*: one entry for each
//! touched node of a neighbour, and one for its torque. The neighbours collect them later. Every
//! number is therefore written by one task and summed in one order.

use std::sync::Arc;

use crate::{Geometry, Lattice, moved_to};
use ddem_mechanics::math::lanes::LANES;

/// Marker for a lane without a neighbour.
const NOBODY: u32 = u32::MAX;

/// Node of a joint lattice: its block (offset bits) and its indices there.
#[derive(Clone, Copy, Debug)]
pub struct JointNode {
    /// Offset bits of the block: 0 is the owner.
    pub offset: usize,
    /// Local node number in that block.
    pub local: usize,
    /// Index in the owner's neighbour forces; without meaning for the owner's own nodes.
    pub neighbour_force: usize,
}

/// Two facing nodes of a face joint.
#[derive(Clone, Copy, Debug)]
pub struct NodePair {
    /// Indices of the nodes on sides a and b in the joint lattice.
    pub sides: [usize; 2],
    /// Elements of the joint lattice that contain the pair; only the first `count` are valid.
    elements: [u32; 4],
    count: u8,
}

impl NodePair {
    /// Elements of the joint lattice that contain the pair.
    #[inline(always)]
    pub fn elements(&self) -> impl ExactSizeIterator<Item = usize> + use<> {
        self.elements.into_iter().take(self.count as usize).map(|e| e as usize)
    }

    /// Inverse of the number of those elements.
    #[inline(always)]
    pub fn share(&self) -> f64 {
        1.0 / f64::from(self.count)
    }
}

/// Node numbering of blocks with n divisions, and of the joint cells around them.
#[derive(Clone, Debug)]
pub struct BlockNumbering {
    /// Elements along each edge.
    pub divisions: usize,
    /// Nodes of a block.
    pub nodes: usize,
    /// Nodes of each joint lattice, x fastest, by offset 1…7 (0 unused).
    pub joints: [Vec<JointNode>; 8],
    /// Pairs of the face joints by direction; the next direction, cyclically, runs fastest.
    pub pairs: [Vec<NodePair>; 3],
    /// Local node numbers of the upper neighbour at each offset, in the order of its shares.
    pub touched: [Vec<usize>; 8],
    /// Index of the first share of each offset.
    pub neighbour_force_start: [usize; 8],
    /// Number of shares: one for each touched node, then seven torques.
    pub(super) neighbour_forces: usize,
}

impl BlockNumbering {
    /// Numbering for a number of elements along each edge.
    pub fn new(divisions: usize) -> Self {
        let n = divisions + 1;
        let local = |at: [usize; 3]| at[0] + n * (at[1] + n * at[2]);
        // Nodes of a grid with `thick` lines along directions in `flat`, and n along the others.
        let grid = |flat: usize, thick: usize| {
            let m = [0, 1, 2].map(|d| if flat & (1 << d) == 0 { n } else { thick });
            (0..m[2])
                .flat_map(move |z| (0..m[1]).flat_map(move |y| (0..m[0]).map(move |x| [x, y, z])))
        };
        let touched: [Vec<usize>; 8] = std::array::from_fn(|offset| {
            if offset == 0 { Vec::new() } else { grid(offset, 1).map(local).collect() }
        });
        let mut neighbour_force_start = [0; 8];
        for offset in 1..8 {
            neighbour_force_start[offset] =
                neighbour_force_start[offset - 1] + touched[offset - 1].len();
        }
        let torques = neighbour_force_start[7] + touched[7].len();
        let joint_node = |lattice: usize, at: [usize; 3]| {
            // Along the offset's directions, line 0 is the owner's last one and line 1 the
            // neighbour's first.
            let crossed = (0..3).filter(|&d| lattice & (1 << d) != 0);
            let offset = crossed.filter(|&d| at[d] == 1).map(|d| 1 << d).sum::<usize>();
            let on_block = [0, 1, 2].map(|d| match (lattice & (1 << d), at[d]) {
                (0, i) => i,
                (_, 0) => divisions,
                _ => 0,
            });
            // Shares are in the order of the neighbour's grid, which is flat along its offset.
            let [mx, my, _] = [0, 1, 2].map(|d| if offset & (1 << d) == 0 { n } else { 1 });
            let place = on_block[0] + mx * (on_block[1] + my * on_block[2]);
            JointNode {
                offset,
                local: local(on_block),
                neighbour_force: neighbour_force_start[offset] + place,
            }
        };
        let joints = std::array::from_fn(|lattice| {
            if lattice == 0 {
                return Vec::new();
            }
            grid(lattice, 2).map(|at| joint_node(lattice, at)).collect()
        });
        let nodes = n * n * n;
        let pairs = [0, 1, 2].map(|d| pair_places(divisions, d));
        Self {
            divisions,
            nodes,
            joints,
            pairs,
            touched,
            neighbour_force_start,
            neighbour_forces: torques + 7,
        }
    }

    /// Elements of a joint lattice along the three edges; offset 0 is the block itself.
    pub fn dims(&self, offset: usize) -> [usize; 3] {
        [0, 1, 2].map(|d| if offset & (1 << d) == 0 { self.divisions } else { 1 })
    }

    /// Index of the torque for an upper neighbour in the shares.
    pub fn torque(&self, offset: usize) -> usize {
        self.neighbour_forces - 8 + offset
    }
}

fn pair_places(divisions: usize, d: usize) -> Vec<NodePair> {
    let [e, f] = [(d + 1) % 3, (d + 2) % 3];
    let dims = [0, 1, 2].map(|axis| if axis == d { 1 } else { divisions });
    let node = |at: [usize; 3]| at[0] + (dims[0] + 1) * (at[1] + (dims[1] + 1) * at[2]);
    let element = |at: [usize; 3]| at[0] + dims[0] * (at[1] + dims[1] * at[2]);
    let place = |i: usize, k: usize| {
        let on_face = |i, k| moved_to(moved_to([0; 3], e, i), f, k);
        let at = on_face(i, k);
        let (mut elements, mut count) = ([0; 4], 0);
        for (i, k) in [(i, k), (i + 1, k), (i, k + 1), (i + 1, k + 1)] {
            // Element above the lines i − 1 and k − 1.
            if (1..=divisions).contains(&i) && (1..=divisions).contains(&k) {
                elements[count] = element(on_face(i - 1, k - 1)) as u32;
                count += 1;
            }
        }
        NodePair { sides: [node(at), node(moved_to(at, d, 1))], elements, count: count as u8 }
    };
    let lines = 0..=divisions;
    lines
        .clone()
        .flat_map(|k| lines.clone().map(move |i| (i, k)))
        .map(|(i, k)| place(i, k))
        .collect()
}

/// Neighbours at one offset: pack and lane for each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours([u32; LANES]);

impl Neighbours {
    const NONE: Self = Self([NOBODY; LANES]);

    /// Pack and lane of a lane's neighbour.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Option<(usize, usize)> {
        match self.0[lane] {
            NOBODY => None,
            slot => Some((slot as usize / LANES, slot as usize % LANES)),
        }
    }

    /// Pack of the four neighbours, if they are its four lanes in order; then whole vectors load.
    #[inline(always)]
    pub fn aligned(&self) -> Option<usize> {
        let first = self.0[0];
        let in_order = (0..LANES as u32).all(|l| self.0[l as usize] == first.wrapping_add(l));
        (first != NOBODY && (first as usize).is_multiple_of(LANES) && in_order)
            .then_some(first as usize / LANES)
    }

    /// True if no lane has a neighbour.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
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
    /// Index of the numbering in the shapes.
    pub(super) shape: usize,
    /// First node in the nodal fields, in nodes.
    pub start: usize,
    /// Index of the first share.
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
    pub(super) shapes: Vec<BlockNumbering>,
    /// Packs in the order of the blocks.
    pub packs: Vec<Pack>,
    /// Location of each block: `LANES` × pack + lane.
    slots: Vec<u32>,
    /// Nodes in the nodal fields; four lanes count as one.
    pub nodes: usize,
    /// Number of shares.
    pub neighbour_forces: usize,
    /// Number of rigid packs.
    pub rigid: usize,
}

impl Packs {
    /// Packs of the blocks of a geometry.
    pub fn new(geometry: &Geometry) -> Self {
        let mut packs = Self {
            shapes: Vec::new(),
            packs: Vec::new(),
            slots: vec![NOBODY; geometry.blocks.len()],
            nodes: 0,
            neighbour_forces: 0,
            rigid: 0,
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

    /// Number of leading lattices whose blocks share packs. Only lattices of a single block share
    /// them, as long as they are alike.
    fn alike(&self, lattices: &[Arc<Lattice>]) -> usize {
        let kind = |lattice: &Lattice| (lattice.divisions, lattice.rigid, lattice.is_box());
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
        let shape = self.shape(lattice.divisions);
        for four in blocks.chunks(LANES) {
            let index = self.packs.len() * LANES;
            for (lane, &block) in four.iter().enumerate() {
                self.slots[block as usize] = (index + lane) as u32;
            }
            self.packs.push(Pack {
                blocks: std::array::from_fn(|lane| *four.get(lane).unwrap_or(&four[0])),
                filled: four.len(),
                shape,
                start: self.nodes,
                neighbour_force_start: self.neighbour_forces,
                rigid: lattice.rigid,
                rigid_start: self.rigid,
                upper: [Neighbours::NONE; 8],
                lower: [Neighbours::NONE; 8],
            });
            self.nodes += self.shapes[shape].nodes;
            self.neighbour_forces += self.shapes[shape].neighbour_forces;
            self.rigid += usize::from(lattice.rigid);
        }
    }

    fn shape(&mut self, divisions: usize) -> usize {
        let known = self.shapes.iter().position(|shape| shape.divisions == divisions);
        known.unwrap_or_else(|| {
            self.shapes.push(BlockNumbering::new(divisions));
            self.shapes.len() - 1
        })
    }

    /// Blocks at an offset in cells from those of a pack.
    pub fn neighbours(&self, geometry: &Geometry, pack: &Pack, step: [i32; 3]) -> Neighbours {
        Neighbours(std::array::from_fn(|lane| {
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
    pub fn shape_of(&self, pack: &Pack) -> &BlockNumbering {
        &self.shapes[pack.shape]
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
        packs.shape_of(&packs.packs[self.pack]).joints[self.offset].len()
    }
}
