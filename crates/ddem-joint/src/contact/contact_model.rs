//! Constant data of contacts: the faces of all blocks.

use super::configuration::{ContactBlock, contact_block};
use super::surfaces::ContactSurfaces;
use ddem_mechanics::law::Laws;
use ddem_mesh::Geometry;
use ddem_mesh::connected::is_connected;
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::Properties;

/// Width of a cell that is a sliver, as a fraction of the median width.
const THIN: f64 = 0.2;
/// Margin of the boxes in the search, as a fraction of the median block edge.
const MARGIN: f64 = 0.1;

/// Constant data of contacts for all blocks.
#[derive(Debug)]
pub struct ContactModel {
    /// Stiffness and friction of all faces.
    pub surfaces: ContactSurfaces,
    /// Blocks at rest.
    pub blocks: Vec<ContactBlock>,
    /// Least [depth](Self::depth) of a block `[m]`.
    pub shortest: f64,
    /// Width of cells below which they count as thicker, since others may press into them `[m]`.
    thinnest: f64,
    /// Distance that blocks may travel before their boxes are sorted again `[m]`.
    pub(super) margin: f64,
    /// True if blocks may meet before any joint has failed.
    pub from_start: bool,
    /// True if there are nonconforming joints.
    pub has_nonconforming_joints: bool,
    /// True if contacts are searched for.
    pub search: bool,
}

/// Shortest edge of a block, or width of its cell `[m]`.
fn edge(geometry: &Geometry, block: usize) -> f64 {
    geometry.part(block).map_or_else(|| geometry.shortest_edge(block), |part| part.width)
}

/// Shortest edge of a block, or width of its cell, but at least `thinnest` `[m]`.
fn depth(geometry: &Geometry, block: usize, thinnest: f64) -> f64 {
    let least = if geometry.part(block).is_some() { thinnest } else { 0.0 };
    edge(geometry, block).max(least)
}

impl ContactModel {
    /// Contact data of a model's blocks.
    pub fn new(properties: &Properties, laws: &Laws, geometry: &Geometry, packs: &Packs) -> Self {
        let mut edges: Vec<f64> =
            (0..geometry.blocks.len()).map(|block| edge(geometry, block)).collect();
        edges.sort_unstable_by(f64::total_cmp);
        let median = edges.get(edges.len() / 2).copied().unwrap_or_default();
        let thinnest = THIN * median;
        let shortest = (0..geometry.blocks.len())
            .map(|block| depth(geometry, block, thinnest))
            .fold(f64::INFINITY, f64::min);
        // Connected blocks cannot meet before one of their joints has failed.
        let can_fail = properties.joints.iter().any(|joint| joint.law.is_some());
        let from_start = !(can_fail && is_connected(geometry));
        Self {
            surfaces: ContactSurfaces::new(properties, laws, geometry),
            blocks: contact_block(geometry, packs),
            shortest,
            thinnest,
            margin: MARGIN * median,
            from_start,
            has_nonconforming_joints: geometry.joined().next().is_some(),
            search: properties.contact.search,
        }
    }
    /// Shortest edge of a block, or width of its cell, but not that of a sliver `[m]`.
    #[must_use]
    pub fn depth(&self, geometry: &Geometry, block: usize) -> f64 {
        depth(geometry, block, self.thinnest)
    }

    /// First block of the cell of each block; empty without cells.
    #[must_use]
    pub fn bodies(&self) -> Vec<u32> {
        if !self.blocks.iter().any(ContactBlock::is_part) {
            return Vec::new();
        }
        let numbered = self.blocks.iter().enumerate();
        numbered.map(|(block, contact_block)| contact_block.body(block as u32)).collect()
    }

    /// Shortest element edge of two blocks `[m]`.
    pub fn spacing(&self, [a, b]: [u32; 2]) -> f64 {
        self.blocks[a as usize].spacing.min(self.blocks[b as usize].spacing)
    }
}
