//! Elements by place.

use std::cmp::Reverse;

use super::Model;
use crate::geometry::{ON_FACE, Vec3};

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
        let cells: usize = self.packs.shape_of(&self.packs.packs[pack]).dims(0).iter().product();
        let table = &self.assembly.tables[self.assembly.pack_tables[pack][0] as usize];
        let element = table.elements[lane].map(|element| &self.assembly.elements[element as usize]);
        element.map_or(0.0, |element| cells as f64 * element.volume)
    }

    /// The node nearest to a reference position; on a tie that of a block that is not taken out, or later,
    /// and of these the lower number.
    ///
    /// # Panics
    ///
    /// If a coordinate is not a finite number.
    #[must_use]
    pub fn nearest_node(&self, at: [f64; 3]) -> usize {
        assert!(at.iter().all(|x| x.is_finite()), "no node is nearest to {at:?}: it is no place");
        let at = Vec3::from(at);
        let tie = 1e-12 * (self.geometry.bounds[1] - self.geometry.bounds[0]).norm();
        let distance = |node: usize| (Vec3::from(self.point(node)) - at).norm();
        let nearest = (0..self.n_nodes()).map(distance).fold(f64::INFINITY, f64::min);
        let near = (0..self.n_nodes()).filter(|&node| distance(node) <= nearest + tie);
        let best = near.min_by_key(|&node| (Reverse(self.stays(self.block_of(node))), node));
        best.unwrap_or(0)
    }

    /// The element that a reference position lies in, as block and lattice steps; on faces between
    /// elements the lower one, on faces between blocks that of the one that is not taken out, or later, or
    /// the lower one, and where no block is the one nearest to it among the elements that have the
    /// nearest node.
    ///
    /// # Panics
    ///
    /// If a coordinate is not a finite number.
    #[must_use]
    pub fn element_at(&self, point: [f64; 3]) -> (usize, [usize; 3]) {
        assert!(point.iter().all(|x| x.is_finite()), "no element is at {point:?}: it is no place");
        let at = Vec3::from(point);
        let mut most: Option<(f64, (usize, [usize; 3]))> = None;
        for block in 0..self.n_blocks() {
            let (inside, element) = self.geometry.inside(block, &at);
            // Blocks of sets that reach into each other: the one it is deeper in.
            let better = |(other, (before, _)): (f64, (usize, _))| {
                let as_deep = inside >= other - ON_FACE;
                inside > other + ON_FACE || (as_deep && self.stays(block) > self.stays(before))
            };
            if inside >= -ON_FACE && most.is_none_or(better) {
                most = Some((inside, (block, element)));
            }
        }
        if let Some((_, element)) = most {
            return element;
        }
        let centre = |&(block, at): &(usize, [usize; 3])| {
            let far = self.geometry.position(block, at.map(|i| i + 1));
            ((self.geometry.position(block, at) + far) / 2.0 - Vec3::from(point)).norm()
        };
        let beside = self.elements_at(&[self.nearest_node(point) as u32]);
        let nearest = beside.into_iter().min_by(|a, b| centre(a).total_cmp(&centre(b)));
        nearest.unwrap_or_default()
    }

    /// The elements that have one of some nodes, as block and lattice steps.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn elements_at(&self, nodes: &[u32]) -> Vec<(usize, [usize; 3])> {
        let mut elements = Vec::new();
        for &node in nodes {
            let (block, at) = self.geometry.locate(node as usize);
            let n = self.geometry.lattice(block).divisions;
            for corner in 0..8 {
                let lower = [0, 1, 2].map(|d| at[d].checked_sub(corner >> d & 1));
                if let [Some(x), Some(y), Some(z)] = lower
                    && [x, y, z].iter().all(|&i| i < n)
                {
                    elements.push((block, [x, y, z]));
                }
            }
        }
        elements.sort_unstable();
        elements.dedup();
        elements
    }
}
