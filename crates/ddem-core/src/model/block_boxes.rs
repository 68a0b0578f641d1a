//! Search for nodes and elements by position.

use std::cmp::Reverse;

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{PointDistance, RTree};

use super::Model;
use ddem_mesh::{Geometry, ON_FACE, Vec3, bounds_of};

/// Margin of the box around a block, as a fraction of its longest edge.
const MARGIN: f64 = 1e-8;

/// Boxes around the blocks at rest.
#[derive(Debug)]
pub(super) struct BlockBoxes(RTree<GeomWithData<Rectangle<[f64; 3]>, u32>>);

impl BlockBoxes {
    fn new(geometry: &Geometry) -> Self {
        let around = |block: usize| {
            let margin = MARGIN * geometry.longest_edge(block);
            let [low, high] = bounds_of(&geometry.corners(block));
            let corners = [low.add_scalar(-margin), high.add_scalar(margin)];
            let [low, high] = corners.map(<[f64; 3]>::from);
            GeomWithData::new(Rectangle::from_corners(low, high), block as u32)
        };
        Self(RTree::bulk_load((0..geometry.blocks.len()).map(around).collect()))
    }

    /// Blocks whose boxes contain a point, in ascending order.
    fn with(&self, point: [f64; 3]) -> Vec<usize> {
        let found = self.0.locate_all_at_point(point);
        let mut blocks: Vec<usize> = found.map(|around| around.data as usize).collect();
        blocks.sort_unstable();
        blocks
    }

    /// Blocks and the distances of their boxes from a point `[m]`, the nearest first.
    fn nearest_first(&self, point: [f64; 3]) -> impl Iterator<Item = (usize, f64)> + '_ {
        let near = self.0.nearest_neighbor_iter(point);
        near.map(move |around| (around.data as usize, around.distance_2(&point).sqrt()))
    }
}

impl Model {
    fn boxes(&self) -> &BlockBoxes {
        self.boxes.get_or_init(|| BlockBoxes::new(&self.geometry))
    }

    /// Node nearest to a reference position. In a tie it is a node of the block that is removed
    /// last or never, and of these the one with the lowest number.
    ///
    /// # Panics
    ///
    /// If a coordinate is not a finite number.
    #[must_use]
    pub fn nearest_node(&self, at: [f64; 3]) -> usize {
        assert!(
            at.iter().all(|x| x.is_finite()),
            "no node is nearest to {at:?}: coordinates must be finite"
        );
        let tie = 1e-12 * (self.geometry.bounds[1] - self.geometry.bounds[0]).norm();
        let point = Vec3::from(at);
        let (mut nearest, mut near) = (f64::INFINITY, Vec::new());
        for (block, distance) in self.boxes().nearest_first(at) {
            if distance > nearest + tie {
                break;
            }
            let topology = self.geometry.topology(block);
            for (local, node) in self.nodes_of(block).enumerate() {
                let at = topology.steps(local);
                let distance = (self.geometry.position(block, at) - point).norm();
                nearest = nearest.min(distance);
                if distance <= nearest + tie {
                    near.push((distance, block, node));
                }
            }
        }
        let near = near.into_iter().filter(|(distance, ..)| *distance <= nearest + tie);
        let best = near.min_by_key(|&(_, block, node)| (Reverse(self.stays(block)), node));
        best.map_or(0, |(.., node)| node)
    }

    /// Element that contains a reference position, as block and lattice steps.
    ///
    /// On a face between elements it is the lower one. On a face between blocks it is in the block
    /// that is removed last or never, in a tie in the lower one. Outside of all blocks it is the
    /// element with the nearest centre among those that have the nearest node.
    ///
    /// # Panics
    ///
    /// If a coordinate is not a finite number.
    #[must_use]
    pub fn element_at(&self, point: [f64; 3]) -> (usize, [usize; 3]) {
        assert!(
            point.iter().all(|x| x.is_finite()),
            "no element is at {point:?}: coordinates must be finite"
        );
        let at = Vec3::from(point);
        let mut most: Option<(f64, (usize, [usize; 3]))> = None;
        for block in self.boxes().with(point) {
            let (inside, element) = self.geometry.inside(block, &at);
            // If blocks overlap, the one in which the point is deeper counts.
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
}
