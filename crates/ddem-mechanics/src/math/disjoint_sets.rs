//! Groups of blocks that hang together.

/// Blocks in groups, which grow as links are found.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    /// The lowest block that each one is known to hang together with.
    roots: Vec<usize>,
}

impl DisjointSets {
    /// Each block alone.
    pub fn new(blocks: usize) -> Self {
        Self { roots: (0..blocks).collect() }
    }

    /// Puts the groups of two blocks together.
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
