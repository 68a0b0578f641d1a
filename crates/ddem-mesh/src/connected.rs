//! Groups of blocks connected by joints and contacts.

use std::collections::HashSet;

use super::Geometry;
use ddem_mechanics::math::disjoint_sets::DisjointSets;

/// True if joints connect all blocks.
pub fn is_connected(geometry: &Geometry) -> bool {
    connected(geometry, false).iter().all(|&group| group == 0)
}

/// Group of each block, in the order of their first blocks. Blocks with a joint between them are in
/// one group; with `contacts` so are blocks of sets that touch.
pub fn connected(geometry: &Geometry, contacts: bool) -> Vec<usize> {
    let n = geometry.blocks.len();
    let existing = || (0..n).filter(|&block| !geometry.is_removed(block));
    // The lattices have numbers after the blocks.
    let mut groups = DisjointSets::new(n + geometry.lattices.len());
    for block in existing() {
        let neighbours = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(|at| geometry.neighbour(block, at));
        neighbours.into_iter().flatten().for_each(|neighbour| groups.join([block, neighbour]));
    }
    for joint_pair in geometry.joined() {
        groups.join(joint_pair.blocks.map(|block| block as usize));
    }
    for nodes in geometry.tied() {
        let first = geometry.block_of(nodes[0] as usize);
        nodes.iter().for_each(|&node| groups.join([first, geometry.block_of(node as usize)]));
    }
    if contacts {
        let touching = || geometry.touching.iter().map(|&(a, b)| [a, b]);
        touching().for_each(|lattices| groups.join(lattices.map(|lattice| n + lattice)));
        let touches: HashSet<usize> = touching().flatten().collect();
        for block in existing() {
            let lattice = geometry.blocks[block].lattice as usize;
            if touches.contains(&lattice) {
                groups.join([block, n + lattice]);
            }
        }
    }
    number(&mut groups, n, existing())
}

/// Group number of each block. Removed blocks count to the first group, so that they need no
/// support.
fn number(groups: &mut DisjointSets, n: usize, blocks: impl Iterator<Item = usize>) -> Vec<usize> {
    let (mut numbers, mut count) = (vec![0; n], 0);
    for block in blocks {
        let lowest = groups.lowest(block);
        if lowest == block {
            numbers[block] = count;
            count += 1;
        } else {
            numbers[block] = numbers[lowest];
        }
    }
    numbers
}
