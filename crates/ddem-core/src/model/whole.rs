//! Whole blocks: in messages and results the parts of a cell, and of cells that are joined, are one.

use std::collections::BTreeSet;

use super::Model;
use ddem_joint::contact::BondedPatch;

impl Model {
    /// Number of a block in messages and results. It is that of its cell, or of the cells that are
    /// joined to a block, as `ddem cut` numbers them. Blocks of sets have the numbers after those of
    /// cells.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn whole_block(&self, block: usize) -> usize {
        self.geometry.has_block(block);
        self.cell_count.whole_block(&self.geometry, block)
    }

    /// Number of blocks as messages and results count them.
    #[must_use]
    pub fn n_whole_blocks(&self) -> usize {
        let mut whole: Vec<usize> =
            (0..self.n_blocks()).map(|block| self.whole_block(block)).collect();
        whole.sort_unstable();
        whole.dedup();
        whole.len()
    }

    /// Number of joint faces between whole blocks: two cells of which several parts have joints have
    /// one.
    #[must_use]
    pub fn n_whole_joints(&self) -> usize {
        self.faces.len() + self.whole_joints(|_| true)
    }

    /// Number of joint faces among which a joint has a property.
    pub(super) fn whole_joints(&self, wanted: impl Fn(&BondedPatch) -> bool) -> usize {
        let cell = |block: u32| {
            let part = self.geometry.part(block as usize);
            part.map_or((false, block), |part| (true, part.cell))
        };
        let others = self.nonconforming_joints().filter(|joint| wanted(joint));
        let pairs: BTreeSet<_> = others.map(|joint| joint.patch.blocks.map(cell)).collect();
        pairs.len()
    }

    /// Pairs of blocks with tied nodes, some of them several times.
    pub(crate) fn tied_blocks(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.geometry.tied().flat_map(|nodes| {
            let blocks: Vec<usize> =
                nodes.iter().map(|&node| self.geometry.block_of(node as usize)).collect();
            let pairs: Vec<[usize; 2]> = blocks.windows(2).map(|pair| [pair[0], pair[1]]).collect();
            pairs
        })
    }
}
