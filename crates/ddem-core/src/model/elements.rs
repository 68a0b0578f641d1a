//! Elements of blocks.

use std::ops::Range;

use super::Model;

impl Model {
    /// Volume of a block in its reference position, without the joints around it `[m³]`.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn volume(&self, block: usize) -> f64 {
        self.geometry.has_block(block);
        let (pack, lane) = self.packs.slot(block);
        let cells: usize =
            self.packs.numbering_of(&self.packs.packs[pack]).dims(0).iter().product();
        let table = &self.assembly.tables[self.assembly.pack_tables[pack][0] as usize];
        table.volume(lane, &self.assembly.elements, cells)
    }

    /// Numbers of the hex8 elements of a block.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn elements_of(&self, block: usize) -> Range<usize> {
        self.geometry.has_block(block);
        let first = self.geometry.blocks[block].first_element as usize;
        first..first + self.geometry.topology(block).elements()
    }

    /// Number of the element at lattice steps `at` of a block.
    ///
    /// # Panics
    ///
    /// If the model has no such block, or the block no such element.
    #[must_use]
    pub fn element(&self, block: usize, at: [usize; 3]) -> usize {
        let (elements, topology) = (self.elements_of(block), self.geometry.topology(block));
        let n = topology.divisions();
        assert!(
            at.iter().all(|&step| step < n),
            "block {block} has no element at {at:?}: it has {n} along each edge, from 0"
        );
        elements.start + topology.element(at)
    }

    /// Elements with at least one of the given nodes, as block and lattice steps.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn elements_at(&self, nodes: &[u32]) -> Vec<(usize, [usize; 3])> {
        let mut elements = Vec::new();
        for &node in nodes {
            let block = self.geometry.block_of(node as usize);
            let (topology, first) = (self.geometry.topology(block), self.nodes_of(block).start);
            let around = topology.elements_at(node as usize - first);
            elements.extend(around.map(|element| (block, topology.element_steps(element))));
        }
        elements.sort_unstable();
        elements.dedup();
        elements
    }
}
