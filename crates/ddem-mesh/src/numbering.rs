//! Numbering of the nodes of blocks with n divisions, and of the joint lattices at their upper
//! sides.

use crate::moved_to;

/// Node of a joint lattice: its block (offset bits) and its indices there.
#[derive(Clone, Copy, Debug)]
pub struct JointNode {
    /// Offset bits of the block: 0 is the owner.
    pub offset: usize,
    /// Local node number in that block.
    pub local: usize,
}

/// Nodes that a joint lattice has in one of its blocks, or all nodes of a block: a grid with up to
/// three axes. Axes across the joint come last and have one node.
#[derive(Clone, Debug)]
pub struct BlockPart {
    /// Offset bits of the block: 0 is the owner.
    pub offset: usize,
    /// Number of nodes along each axis.
    pub count: [usize; 3],
    /// Direction of each axis.
    pub axes: [usize; 3],
    /// Position of the first node from the centre of the lattice, in elements along each direction.
    pub start: [f64; 3],
    /// Slots of the nodes in the block.
    pub in_block: Slots,
    /// Slots of the nodes in the lattice.
    pub in_lattice: Slots,
    /// Slots of the nodes in the owner's neighbour forces; without meaning for the owner.
    pub in_neighbour_forces: Slots,
}

/// Slots of a grid of nodes in a list of nodes.
#[derive(Clone, Copy, Debug)]
pub struct Slots {
    /// Place of the first node.
    pub first: usize,
    /// Distance between slots along each axis.
    pub step: [usize; 3],
}

impl Slots {
    /// Place of the first node of a row.
    #[inline(always)]
    pub fn row(&self, j: usize, k: usize) -> usize {
        self.first + j * self.step[1] + k * self.step[2]
    }
}

impl BlockPart {
    /// Nodes of `lattice` in the block at `offset`.
    fn new(divisions: usize, lattice: usize, offset: usize, first_force: usize) -> Self {
        let n = divisions + 1;
        let across = |d: usize| lattice & (1 << d) != 0;
        let upper = |d: usize| offset & (1 << d) != 0;
        // Strides of a grid with `lines` lines along each direction.
        let strides = |lines: [usize; 3]| [1, lines[0], lines[0] * lines[1]];
        let mut axes = [0, 1, 2];
        axes.sort_by_key(|&d| across(d));
        let slots = |at: [usize; 3], strides: [usize; 3]| Slots {
            first: (0..3).map(|d| at[d] * strides[d]).sum(),
            step: axes.map(|d| strides[d]),
        };
        // Along the lattice's directions, line 0 is the owner's last one and line 1 the
        // neighbour's first.
        let on_block = [0, 1, 2].map(|d| if across(d) && !upper(d) { divisions } else { 0 });
        let on_lattice = [0, 1, 2].map(|d| usize::from(across(d) && upper(d)));
        // Neighbour forces are in the order of the neighbour's grid, which is flat along its
        // offset.
        let flat = strides([0, 1, 2].map(|d| if upper(d) { 1 } else { n }));
        let mut in_neighbour_forces = slots(on_block, flat);
        in_neighbour_forces.first += first_force;
        Self {
            offset,
            count: axes.map(|d| if across(d) { 1 } else { n }),
            axes,
            start: [0, 1, 2].map(|d| match (across(d), upper(d)) {
                (false, _) => -0.5 * divisions as f64,
                (true, false) => -0.5,
                (true, true) => 0.5,
            }),
            in_block: slots(on_block, strides([n; 3])),
            in_lattice: slots(
                on_lattice,
                strides([0, 1, 2].map(|d| if across(d) { 2 } else { n })),
            ),
            in_neighbour_forces,
        }
    }

    /// Rows of its grid: their numbers along the second and the third axis.
    #[inline(always)]
    pub fn rows(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [_, rows, planes] = self.count;
        (0..planes).flat_map(move |k| (0..rows).map(move |j| [j, k]))
    }
}

/// Two facing nodes of a face joint.
#[derive(Clone, Copy, Debug)]
pub struct NodePair {
    /// Indices of the nodes on sides a and b in the joint lattice.
    pub sides: [usize; 2],
    /// Numbers of these nodes in their blocks.
    pub in_blocks: [usize; 2],
    /// Slot of the force on side b in the owner's neighbour forces.
    pub in_neighbour_forces: usize,
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
    pub fn inverse_count(&self) -> f64 {
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
    /// Parts of each joint lattice in its blocks, by offset; offset 0 is the block itself. The last
    /// part is that of the neighbour at the offset of the lattice.
    pub parts: [Vec<BlockPart>; 8],
    /// Pairs of the face joints by direction; the next direction, cyclically, runs fastest.
    pub pairs: [Vec<NodePair>; 3],
    /// Number of neighbour forces: one for each touched node, then seven torques.
    pub neighbour_forces: usize,
}

impl BlockNumbering {
    /// Numbering for a number of elements along each edge.
    pub fn new(divisions: usize) -> Self {
        let n = divisions + 1;
        // Each offset has as many neighbour forces as nodes of its flat grid.
        let before = |end: usize| (1..end).map(|o| n.pow(3 - o.count_ones())).sum::<usize>();
        let parts: [Vec<BlockPart>; 8] = std::array::from_fn(|lattice| {
            let offsets = (0..8).filter(|offset| offset & !lattice == 0);
            offsets
                .map(|offset| BlockPart::new(divisions, lattice, offset, before(offset)))
                .collect()
        });
        let joints = std::array::from_fn(|lattice| joint_nodes(&parts[lattice]));
        Self {
            divisions,
            nodes: n * n * n,
            joints,
            pairs: [0, 1, 2].map(|d| pair_places(divisions, d, &parts[1 << d])),
            parts,
            neighbour_forces: before(8) + 7,
        }
    }

    /// Elements of a joint lattice along the three edges; offset 0 is the block itself.
    pub fn dims(&self, offset: usize) -> [usize; 3] {
        [0, 1, 2].map(|d| if offset & (1 << d) == 0 { self.divisions } else { 1 })
    }

    /// Nodes of a joint lattice in the neighbour at its offset.
    #[inline(always)]
    pub fn upper_part(&self, offset: usize) -> &BlockPart {
        &self.parts[offset][self.parts[offset].len() - 1]
    }

    /// Index of the torque on an upper neighbour in the neighbour forces.
    pub fn torque(&self, offset: usize) -> usize {
        self.neighbour_forces - 8 + offset
    }
}

/// Nodes of a part of a lattice: their slots in the lattice, in the block and in the neighbour
/// forces.
fn slots(part: &BlockPart) -> impl Iterator<Item = [usize; 3]> {
    let all = [part.in_lattice, part.in_block, part.in_neighbour_forces];
    part.rows().flat_map(move |[j, k]| {
        (0..part.count[0]).map(move |i| all.map(|slots| slots.row(j, k) + i * slots.step[0]))
    })
}

/// Nodes of a joint lattice, x fastest.
fn joint_nodes(parts: &[BlockPart]) -> Vec<JointNode> {
    let nodes = parts.iter().map(|part| part.count.iter().product::<usize>()).sum();
    let mut list = vec![JointNode { offset: 0, local: 0 }; nodes];
    for part in parts {
        for [slot, local, _] in slots(part) {
            list[slot] = JointNode { offset: part.offset, local };
        }
    }
    list
}

/// Pairs of the face joint across a direction, whose nodes lie in two `parts`.
fn pair_places(divisions: usize, d: usize, parts: &[BlockPart]) -> Vec<NodePair> {
    let [e, f] = [(d + 1) % 3, (d + 2) % 3];
    let dims = [0, 1, 2].map(|axis| if axis == d { 1 } else { divisions });
    let node = |at: [usize; 3]| at[0] + (dims[0] + 1) * (at[1] + (dims[1] + 1) * at[2]);
    let element = |at: [usize; 3]| at[0] + dims[0] * (at[1] + dims[1] * at[2]);
    let pair = |i: usize, k: usize| {
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
        let sides = [node(at), node(moved_to(at, d, 1))];
        let in_block = |side: usize| {
            let found = slots(&parts[side]).find(|[slot, ..]| *slot == sides[side]);
            found.unwrap_or_default()
        };
        let ([_, own, _], [_, other, force]) = (in_block(0), in_block(1));
        NodePair {
            sides,
            in_blocks: [own, other],
            in_neighbour_forces: force,
            elements,
            count: count as u8,
        }
    };
    let lines = 0..=divisions;
    lines
        .clone()
        .flat_map(|k| lines.clone().map(move |i| (i, k)))
        .map(|(i, k)| pair(i, k))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs name the same nodes as their lattice, and every neighbour force of a face once.
    #[test]
    fn pairs_have_the_slots_of_their_nodes() {
        for (divisions, d) in (1..=4).flat_map(|n| (0..3).map(move |d| (n, d))) {
            let numbering = BlockNumbering::new(divisions);
            let nodes = &numbering.joints[1 << d];
            for pair in &numbering.pairs[d] {
                let found = pair.sides.map(|side| (nodes[side].offset, nodes[side].local));
                assert_eq!(found, [(0, pair.in_blocks[0]), (1 << d, pair.in_blocks[1])]);
            }
            let mut forces: Vec<_> =
                numbering.pairs[d].iter().map(|pair| pair.in_neighbour_forces).collect();
            forces.sort_unstable();
            let first = numbering.upper_part(1 << d).in_neighbour_forces.first;
            assert_eq!(forces, Vec::from_iter(first..first + (divisions + 1).pow(2)));
        }
    }
}
