//! Elements of blocks.

use std::ops::Range;

use super::Model;
use ddem_mechanics::element::hexahedron::scaled_jacobian;
use ddem_mesh::Vec3;

/// Element of a cell or of a slanted block that is most distorted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstShape {
    /// Number of the block.
    pub block: usize,
    /// Least scaled Jacobian at its corners.
    pub scaled_jacobian: f64,
    /// Mean of the corners `[m]`.
    pub point: [f64; 3],
}

impl Model {
    /// Element with the least scaled Jacobian at its corners; `None` if all blocks are boxes.
    #[must_use]
    pub fn worst_element(&self) -> Option<WorstShape> {
        let geometry = &self.geometry;
        let mut worst: Option<WorstShape> = None;
        let counts = |&block: &usize| !geometry.is_removed(block) && !geometry.is_box(block);
        for block in (0..self.n_blocks()).filter(counts) {
            for element in 0..geometry.topology(block).elements() {
                let corners = geometry.element_corners(block, element);
                let scaled_jacobian = scaled_jacobian(&corners);
                if worst.is_none_or(|worst| scaled_jacobian < worst.scaled_jacobian) {
                    let point = (corners.iter().sum::<Vec3>() / 8.0).into();
                    worst = Some(WorstShape { block, scaled_jacobian, point });
                }
            }
        }
        worst
    }

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
