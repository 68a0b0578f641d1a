//! Storage locations of nodes.

use super::Geometry;
use super::pack::Packs;

/// Storage location of a node. The order is by pack, index and lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NodeSlot {
    /// Number of the pack.
    pub pack: usize,
    /// Index of the x component in a nodal field.
    pub at: u32,
    /// Lane in the pack.
    pub lane: u8,
}

impl NodeSlot {
    /// Lane in the pack.
    #[inline]
    pub fn lane(self) -> usize {
        self.lane.into()
    }

    /// Indices of the three components in a nodal field.
    #[inline]
    pub fn components(self) -> [usize; 3] {
        [0, 1, 2].map(|c| self.at as usize + c)
    }

    /// Number of the node among those of its block.
    #[inline]
    pub fn local(self, packs: &Packs) -> usize {
        self.at as usize / 3 - packs.packs[self.pack].start
    }
}

impl Packs {
    /// Storage location of a node, by its number.
    #[inline]
    pub fn node_slot(&self, geometry: &Geometry, node: usize) -> NodeSlot {
        let block = geometry.block_of(node);
        let (pack, lane) = self.slot(block);
        let local = node - geometry.blocks[block].first_node as usize;
        NodeSlot { pack, at: 3 * (self.packs[pack].start + local) as u32, lane: lane as u8 }
    }
}
