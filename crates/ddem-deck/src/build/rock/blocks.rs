//! Blocks of a run from the cells of regions.
//!
//! Each vertex of a cell gives a part: a lattice of one cell with a general shape. The parts of a cell
//! are tied at their common nodes, and so are those of cells that `join` keeps together. Faces of other
//! cells get joints between the parts that face each other.

use std::sync::Arc;

use ddem_core::problem::{Geometry, Lattice, PartShape, Set, Sets, Vec3, bounds_of, distorted};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::{CellPart, CommonFace, PlaneSource};

use super::CutRock;
use super::assigned::{AssignedRock, JointOrigins, face_pair};
use crate::build::geometry::{Cut, Names, Selector, nothing, stages};
use crate::schema::{Deck, SmallKind};

/// Corners in VTK's order, by the numbers of corners by bits.
pub(super) const VTK: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Cells of a deck that become blocks.
pub(super) struct RockBlocks<'a> {
    pub(super) deck: &'a Deck,
    pub(super) names: &'a Names,
    pub(super) rock: &'a CutRock,
    sets: Sets,
    /// Parts of each cell; none if it is removed.
    pub(super) parts: Vec<Vec<CellPart>>,
    /// Block of the first part of each cell.
    pub(super) first: Vec<usize>,
}

/// Geometry of the regions of a deck at the start.
pub(in crate::build) fn cut(deck: &Deck, names: &Names) -> Result<Cut, Vec<Fault>> {
    let rock = deck.cut_regions().map_err(|error| error.faults)?;
    let faults = rock.thick_joints();
    if !faults.is_empty() {
        return Err(faults);
    }
    let sets = sets(deck, &rock);
    let parts = vec![Vec::new(); rock.properties.len()];
    let mut blocks = RockBlocks { deck, names, rock: &rock, sets, parts, first: Vec::new() };
    let mut faults = blocks.find_parts();
    if faults.is_empty() {
        faults.extend(blocks.unjoined_regions());
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let (mut geometry, origins) = blocks.geometry()?;
    let joints = blocks.stiff_joints(&geometry.nonconforming_joints);
    let sets = blocks.sets;
    let assigned = AssignedRock { deck, names, sets: &sets, rock: &rock, origins };
    let faults = assigned.assign(&mut geometry, 0);
    if !faults.is_empty() {
        return Err(faults);
    }
    let (stages, selections) = stages((deck, names), Arc::new(geometry), &sets, Some(&assigned))?;
    Ok(Cut { stages, sets, selections, joints })
}

/// Sets of a deck: its regions, with the boxes around them.
pub(super) fn sets(deck: &Deck, rock: &CutRock) -> Sets {
    let set = |region: usize| {
        let cells = rock.cells_of(region).iter().map(|&cell| &rock.complex.cells()[cell]);
        let corners = cells.flat_map(|cell| cell.vertices());
        let points: Vec<Vec3> =
            corners.map(|corner| rock.complex.points()[corner as usize]).collect();
        let [low, high] = bounds_of(&points);
        let end = |d: usize, k: usize| if k >> d & 1 == 1 { high[d] } else { low[d] };
        let corner = |k: usize| Vec3::from([0, 1, 2].map(|d| end(d, k)));
        Set {
            name: deck.region[region].name.clone(),
            label: rock.region_name(region),
            ends: [0, 1, 2].map(|d| (Vec3::ith(d, 1.0), [low[d], high[d]])),
            corners: std::array::from_fn(corner),
        }
    };
    let list: Vec<Set> = (0..deck.region.len()).map(set).collect();
    Sets { bounds: bounds_of(&list.iter().flat_map(|set| set.corners).collect::<Vec<_>>()), list }
}

impl RockBlocks<'_> {
    fn centroid(&self, cell: usize) -> Vec3 {
        self.rock.properties[cell].centroid
    }

    pub(super) fn region(&self, cell: usize) -> usize {
        self.rock.complex.cells()[cell].region as usize
    }

    /// Finds the parts of all cells that are not removed at the start. Returns faults.
    fn find_parts(&mut self) -> Vec<Fault> {
        let (mut faults, mut removed) = (Vec::new(), vec![false; self.parts.len()]);
        for (index, entry) in self.deck.remove.iter().enumerate() {
            if entry.from.is_some() {
                continue;
            }
            let selector = Selector::new(&entry.r#where, &self.sets);
            let chosen: Vec<usize> =
                (0..self.parts.len()).filter(|&cell| self.rock.selects(&selector, cell)).collect();
            if chosen.is_empty() {
                faults.push(nothing(format!("remove[{index}].where"), "no block"));
            }
            chosen.into_iter().for_each(|cell| removed[cell] = true);
        }
        for (cell, removed) in removed.into_iter().enumerate() {
            let small = self.rock.treatment(cell);
            if removed || small == Some(SmallKind::Removed) {
                continue;
            }
            self.parts[cell] = self.rock.parts(cell);
        }
        if faults.is_empty() && self.parts.iter().all(Vec::is_empty) {
            let message = "all blocks are removed";
            faults.push(Fault::new(ErrorCode::EmptyModel, "remove", message));
        }
        faults
    }

    /// Fault of regions that share a face, across which no joint is given.
    fn unjoined_regions(&self) -> Option<Fault> {
        let shared = self.rock.common.iter().find(|face| {
            let plane = &self.rock.complex.planes()[face.plane as usize];
            let between = plane.source == PlaneSource::Region && !plane.joined;
            between && self.rock.file_joint(face).is_none() && self.both_exist(face)
        })?;
        let regions = shared.cells.map(|cell| self.region(cell as usize));
        let [a, b] = [regions[0].min(regions[1]), regions[0].max(regions[1])];
        let names = [a, b].map(|region| self.rock.region_name(region));
        let message = format!(
            "regions `{}` and `{}` touch: joints between regions cannot be run yet",
            names[0], names[1]
        );
        let help = "make one region of both, as a `prism` for example";
        Some(Fault::new(ErrorCode::NotSupported, format!("region[{b}]"), message).help(help))
    }

    pub(super) fn both_exist(&self, face: &CommonFace) -> bool {
        face.cells.iter().all(|&cell| !self.parts[cell as usize].is_empty())
    }

    /// Blocks and joints before anything is assigned, with the origins of the joints.
    fn geometry(&mut self) -> Result<(Geometry, JointOrigins), Vec<Fault>> {
        let mut lattices: Vec<Arc<Lattice>> = Vec::new();
        for cell in 0..self.parts.len() {
            self.first.push(lattices.len());
            let material = &self.rock.region(cell).material;
            let material = self.names.material(material).unwrap_or_default();
            let (set, n) = (self.region(cell), self.rock.divisions(cell));
            let parts = &self.parts[cell];
            for (part, [inertia, _]) in parts.iter().zip(self.rock.inertia(cell, parts)) {
                let shape = self.shape(cell, part, inertia);
                if distorted(&shape, n) {
                    return Err(vec![twisted(cell, self.region(cell))]);
                }
                let lattice = shape.lattice(set, material, n);
                lattices.push(Arc::new(Lattice { rigid: self.rock.is_rigid(cell), ..lattice }));
            }
        }
        let mut geometry = Geometry::new(lattices, self.sets.bounds);
        geometry.ties = Arc::new(self.ties(&geometry));
        let joints = self.joints(&geometry);
        let origins = joints.iter().map(|(joint, origin)| (face_pair(joint), *origin)).collect();
        geometry.join(joints.into_iter().map(|(joint, _)| joint).collect());
        Ok((geometry, origins))
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
