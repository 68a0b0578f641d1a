//! Size of a model.

use super::Deck;

/// Size of a deck's model, from its numbers alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Size {
    /// Number of blocks, including removed ones.
    pub blocks: f64,
    /// Number of nodes.
    pub nodes: f64,
    /// Peak memory for building and running the model `[bytes]`.
    pub bytes: f64,
}

impl Size {
    /// Size of the model that a deck describes; nothing is allocated.
    #[must_use]
    pub fn of(deck: &Deck) -> Self {
        let mut size = Self::default();
        let mut joints = deck.joints.values();
        let can_fail = joints.any(|joint| joint.can_fail() || joint.normal_stiffness.is_some());
        for set in &deck.blocks {
            let edges = set.edges.as_ref();
            let count = |d: usize| {
                let cuts = edges.and_then(|e| [&e.x, &e.y, &e.z][d].as_ref());
                cuts.map_or(f64::from(set.count()[d]), |c| c.len() as f64 - 1.0)
            };
            let mut blocks = count(0) * count(1) * count(2);
            let mut n = f64::from(set.elements_along_edge()) + 1.0;
            if let Some(mesh) = &set.mesh {
                let last = mesh.blocks.iter().max();
                blocks =
                    last.map_or(0.0, |last| f64::from(*last) + 1.0).min(mesh.hexes.len() as f64);
                n = (mesh.nodes.len() as f64 / blocks.max(1.0)).cbrt();
            }
            size.blocks += blocks;
            size.nodes += blocks * n.powi(3);
            // State, forces and a frame of output for each node; forces on neighbours and their
            // numbers for each block.
            let neighbour_forces = 3.0 * n * n + 3.0 * n + 8.0;
            // Uneven blocks do not share the tables of their elements and nodes.
            let own = if edges.is_some() { 40e3 + n.powi(3) * 300.0 } else { 0.0 };
            // Blocks are stored in groups of four.
            let blocks = (blocks / 4.0).ceil() * 4.0;
            // History of the pairs, in the state and in a measurement of it.
            let pairs = if can_fail { 3.0 * n * n * 104.0 * 2.0 } else { 0.0 };
            size.bytes +=
                blocks * (n.powi(3) * 190.0 + neighbour_forces * 24.0 + 900.0 + own + pairs);
        }
        size
    }

    /// Size of a model of regions, whose blocks are known only once they have been cut, from the
    /// numbers of their parts, nodes, elements, and pairs of their joints.
    #[must_use]
    pub fn of_parts(blocks: f64, nodes: f64, elements: f64, pairs: f64) -> Self {
        // The shape, the patches of the joints and the smooth motions of a relaxation; state, forces and a
        // frame of output; the table of each element; and the pairs in the model, in the state and in a
        // measurement of it.
        let bytes = blocks * 16e3 + nodes * 340.0 + elements * 700.0 + pairs * 900.0;
        Self { blocks, nodes, bytes }
    }

    /// Size of a model of regions before they are cut, from the expected number of cells. A cell
    /// between planes of three joint sets has eight corners, and a part at each of them with half of
    /// the elements along its edges; three of its faces lie on those of other cells.
    #[must_use]
    pub fn of_cells(cells: f64, divisions: f64) -> Self {
        let (parts, n) = (8.0 * cells, 0.5 * divisions);
        let nodes_of_face = (n + 1.0).powi(2);
        let pairs = 0.5 * 3.0 * nodes_of_face * parts;
        Self::of_parts(parts, parts * (n + 1.0).powi(3), parts * n.powi(3), pairs)
    }
}
