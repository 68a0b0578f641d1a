//! Blocks of a run from the cells of regions.
//!
//! Each vertex of a cell gives a part: a lattice of one cell with a general shape. The parts of a cell
//! are tied at their common nodes, and so are those of cells that `join` keeps together. Faces of other
//! cells get joints between the parts that face each other.

use std::sync::Arc;

use ddem_core::problem::{Lattice, NO_JOINT, PartShape, Set, Sets, Vec3, bounds_of, distorted};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::{CellPart, CommonFace};

use super::CutRock;
use crate::build::geometry::{Names, Selector, box_of};
use crate::schema::{Deck, SmallKind};

/// Corners in VTK's order, by the numbers of corners by bits.
pub(super) const VTK: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Cells of a deck that become blocks; none in a deck without regions.
pub(in crate::build) struct RockBlocks<'a> {
    pub(in crate::build) deck: &'a Deck,
    pub(in crate::build) names: &'a Names,
    pub(super) rock: &'a CutRock,
    /// Cells that do not become blocks.
    removed: Vec<bool>,
    /// Parts of each cell; none if it is removed.
    pub(super) parts: Vec<Vec<CellPart>>,
    /// Block of the first part of each cell.
    pub(super) first: Vec<usize>,
}

impl CutRock {
    /// Regions as sets from which a `where` selects.
    pub(super) fn selectable(&self) -> Sets {
        let list = self.sets();
        let bounds = bounds_of(&list.iter().flat_map(|set| set.corners).collect::<Vec<_>>());
        Sets { bounds, list }
    }

    /// Regions as sets, with the boxes around them.
    pub(in crate::build) fn sets(&self) -> Vec<Set> {
        let set = |region: usize| {
            let cells = self.cells_of(region).iter().map(|&cell| &self.complex.cells()[cell]);
            let corners = cells.flat_map(|cell| cell.vertices());
            let points: Vec<Vec3> =
                corners.map(|corner| self.complex.points()[corner as usize]).collect();
            let (ends, corners) = box_of(&points);
            let name = self.regions()[region].name.clone();
            Set { name, label: self.region_name(region), ends, corners }
        };
        (0..self.regions().len()).map(set).collect()
    }
}

impl<'a> RockBlocks<'a> {
    /// Cells of regions but for those that are too thin.
    pub(in crate::build) fn new(deck: &'a Deck, names: &'a Names, rock: &'a CutRock) -> Self {
        let n = rock.properties.len();
        let too_thin = |cell| rock.treatment(cell) == Some(SmallKind::Removed);
        let removed = (0..n).map(too_thin).collect();
        Self { deck, names, rock, removed, parts: vec![Vec::new(); n], first: Vec::new() }
    }
}

impl RockBlocks<'_> {
    fn centroid(&self, cell: usize) -> Vec3 {
        self.rock.properties[cell].centroid
    }

    pub(super) fn region(&self, cell: usize) -> usize {
        self.rock.complex.cells()[cell].region as usize
    }

    /// Cells that become blocks.
    pub(super) fn left(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.removed.len()).filter(|&cell| !self.removed[cell])
    }

    /// Removes the cells of a selector. Returns false if it has none.
    pub(in crate::build) fn remove(&mut self, selector: &Selector) -> bool {
        let mut found = false;
        for (cell, removed) in self.removed.iter_mut().enumerate() {
            if self.rock.selects(selector, cell) {
                (*removed, found) = (true, true);
            }
        }
        found
    }

    /// Lattices of one cell, one for each part of the cells that are left.
    pub(in crate::build) fn lattices(&mut self) -> Result<Vec<Arc<Lattice>>, Vec<Fault>> {
        let mut lattices: Vec<Arc<Lattice>> = Vec::new();
        for cell in self.left().collect::<Vec<_>>() {
            self.parts[cell] = self.rock.parts(cell);
        }
        for cell in 0..self.parts.len() {
            self.first.push(lattices.len());
            let entry = self.rock.region(cell);
            let material = self.names.material(&entry.material).unwrap_or_default();
            let joint = entry.joint.as_ref().and_then(|name| self.names.joint(name));
            let own_joint = [joint.unwrap_or(NO_JOINT); 3];
            let (set, n) = (self.region(cell), self.rock.divisions(cell));
            let parts = &self.parts[cell];
            for (part, [inertia, _]) in parts.iter().zip(self.rock.inertia(cell, parts)) {
                let shape = self.shape(cell, part, inertia);
                if distorted(&shape, n) {
                    return Err(vec![twisted(cell, self.region(cell))]);
                }
                let rigid = self.rock.is_rigid(cell);
                let lattice = shape.lattice(set, material, n);
                lattices.push(Arc::new(Lattice { rigid, own_joint, ..lattice }));
            }
        }
        Ok(lattices)
    }

    pub(super) fn both_exist(&self, face: &CommonFace) -> bool {
        face.cells.iter().all(|&cell| !self.parts[cell as usize].is_empty())
    }

    fn shape(&self, cell: usize, part: &CellPart, inertia: f64) -> PartShape {
        PartShape {
            corners: VTK.map(|corner| part.corners[corner]),
            block: self.rock.blocks[cell],
            cell: cell as u32,
            vertex: part.vertex,
            ends: part.ends,
            faces: part.faces,
            width: self.rock.properties[cell].width,
            centroid: self.centroid(cell),
            inertia,
        }
    }
}

/// Fault of a cell of a region whose elements have no volume.
fn twisted(cell: usize, region: usize) -> Fault {
    let message = format!("cell {cell} is so distorted that its elements have no volume");
    let help = "move the planes that cut it a little; `ddem cut` lists them";
    Fault::new(ErrorCode::InvalidGeometry, format!("region[{region}]"), message).help(help)
}

#[cfg(test)]
mod tests {
    use super::twisted;

    #[test]
    fn distorted_cells_are_named() {
        insta::assert_snapshot!(twisted(17, 0).to_string());
    }
}
