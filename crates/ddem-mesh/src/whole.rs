//! Whole blocks: in messages and results the parts of a cell, and of cells that are joined, are one.

use super::{Geometry, PartShape};

/// Parts of cells, which are the first blocks of a model, and the whole blocks that they form.
#[derive(Clone, Copy, Debug)]
pub struct CellCount {
    parts: usize,
    whole: usize,
}

impl CellCount {
    /// Count of the cells of a geometry.
    #[must_use]
    pub fn new(geometry: &Geometry) -> Self {
        let parts = (0..geometry.blocks.len()).map_while(|block| geometry.part(block));
        let more = |count: Self, part: &PartShape| Self {
            parts: count.parts + 1,
            whole: count.whole.max(part.block as usize + 1),
        };
        parts.fold(Self { parts: 0, whole: 0 }, more)
    }

    /// Number of a block in messages and results. It is that of its cell, or of the cells that are
    /// joined to a block, as `ddem cut` numbers them. Blocks of sets have the numbers after those of
    /// cells.
    #[must_use]
    pub fn whole_block(&self, geometry: &Geometry, block: usize) -> usize {
        let part = geometry.part(block);
        part.map_or_else(|| self.whole + block - self.parts, |part| part.block as usize)
    }
}
