//! Groups of connected blocks.

/// Groups of blocks, which merge as connections are found.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    /// Lowest block that each block is known to be connected to.
    roots: Vec<usize>,
}

impl DisjointSets {
    /// Groups of one block each.
    pub fn new(blocks: usize) -> Self {
        Self { roots: (0..blocks).collect() }
    }

    /// Merges the groups of two blocks.
    pub fn join(&mut self, blocks: [usize; 2]) {
        let [a, b] = blocks.map(|block| self.lowest(block));
        self.roots[a.max(b)] = a.min(b);
    }

    /// Lowest block of the group of a block.
    pub fn lowest(&mut self, mut block: usize) -> usize {
        while self.roots[block] != block {
            self.roots[block] = self.roots[self.roots[block]];
            block = self.roots[block];
        }
        block
    }
}
