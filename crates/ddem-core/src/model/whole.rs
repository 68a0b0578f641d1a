//! Whole blocks: in messages and results the parts of a cell, and of cells that are joined, are one.

use super::Model;

impl Model {
    /// Number of a block in messages and results. It is that of its cell, or of the cells that are
    /// joined to a block, as `ddem cut` numbers them; without cells it is the block's own.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn whole_block(&self, block: usize) -> usize {
        self.geometry.has_block(block);
        self.geometry.part(block).map_or(block, |part| part.block as usize)
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
