//! Geometry of sets of blocks: cutting, splitting, assigning and removing.

mod assign;
mod convex;
mod empty_selection;
pub(super) mod interface;
mod lattice;
mod mesh;
mod orientation;
mod overlap;
mod refine;
mod select;
mod selection;
mod selector;
mod sets;
mod solid;
mod stages;
mod terrain;
pub(super) mod touching;

pub(in crate::build) use assign::{changed, in_force};
use empty_selection::no_block;
pub(in crate::build) use empty_selection::{coordinates, no_face, no_node, nothing};
pub use interface::Interface;
use lattice::lattices;
pub(super) use select::NodeSearch;
pub use selection::Selection;
pub(super) use selector::Selector;
pub(in crate::build) use solid::Solid;
pub(in crate::build) use stages::stages;
pub(super) use terrain::uncovered;

use std::collections::HashSet;
use std::sync::Arc;

use crate::schema::{Assign, Deck, Remove};
use ddem_core::problem::{BlockFace, FaceId, Geometry, JointProperties, Lattice, Sets, Stages};
use ddem_core::{ErrorCode, Fault};

/// Geometries of the stages of a deck, with the sets to which its selectors refer.
pub(in crate::build) struct Cut {
    pub(in crate::build) stages: Stages,
    pub(in crate::build) sets: Sets,
    /// Blocks that curved and slanted shapes have split or removed.
    pub(in crate::build) selections: Vec<Selection>,
    /// Joints that the deck does not name, which follow those that it names.
    pub(in crate::build) joints: Vec<JointProperties>,
}

/// Cuts the sets, applies `assign` and `remove`, numbers blocks and nodes.
pub(in crate::build) fn cut(deck: &Deck, names: &Names) -> Result<Cut, Vec<Fault>> {
    let Refined { mut lattices, sets, mut selections, mut faults } = refined(deck, names)?;
    let uncovered = |(at, selector): (String, _)| uncovered((&at, selector), &sets, &lattices);
    let uncovered: Vec<Fault> = deck.selectors().into_iter().flat_map(uncovered).collect();
    if !uncovered.is_empty() {
        return Err(uncovered);
    }
    let of = |entry: &Assign| Selector::new(&entry.r#where, &sets);
    let unused = assign::assign(&mut lattices, (deck, names), 0, &of);
    let never = |entry: &&Remove| entry.from.is_none();
    for (index, entry) in deck.remove.iter().enumerate().filter(|(_, e)| never(e)) {
        let selector = Selector::new(&entry.r#where, &sets);
        let what = (format!("remove[{index}]"), format!("remove {index}"));
        selections.extend(Selection::new(what, &selector, &sets, &lattices));
        let mut found = false;
        for lattice in lattices.iter_mut().map(Arc::make_mut) {
            found |= selector.has_set(lattice.set) && selector.remove(lattice);
        }
        if !found {
            let fault = nothing(format!("remove[{index}].where"), "no block");
            faults.push(no_block(fault, &selector, &lattices));
        }
    }
    for lattice in lattices.iter_mut().map(Arc::make_mut) {
        // Refined blocks that are too small are so along all edges; one fault is enough.
        let most = if lattice.refined.is_some() { 1 } else { usize::MAX };
        faults.extend(lattice::open_gaps(lattice, deck, names).into_iter().take(most));
    }
    if faults.is_empty() {
        faults.extend(lattices.iter().filter_map(|lattice| refine::too_fine(lattice, deck, names)));
    }
    faults.extend(overlap::overlaps(&lattices, deck));
    if !faults.is_empty() {
        return Err(faults);
    }
    let mut geometry = Geometry::new(lattices, sets.bounds);
    if geometry.blocks.is_empty() {
        return Err(vec![Fault::new(ErrorCode::EmptyModel, "remove", "all blocks are removed")]);
    }
    geometry.touching = Arc::new(overlap::touching(&geometry.lattices));
    let given = mesh::joints(&geometry, deck, names)?;
    let pairs = given.iter().map(|(blocks, (joint, _))| (*blocks, *joint)).collect();
    let [joined, unjoined] =
        touching::nonconforming_joints(&geometry, (deck, names, 0), &sets, &pairs);
    geometry.join(joined);
    geometry.unjoined_faces = Arc::new(unjoined);
    let mut faults = assign::unused_faults(&geometry, deck, &unused, &of);
    faults.extend(mesh::unmatched_joints(&geometry, given));
    if !faults.is_empty() {
        return Err(faults);
    }
    let (stages, excavated) = stages((deck, names), Arc::new(geometry), &sets, None)?;
    selections.extend(excavated);
    Ok(Cut { stages, sets, selections, joints: Vec::new() })
}

impl Selector {
    /// Blocks whose centroid lies in the selector, or that have a face on a plane of it.
    pub(in crate::build) fn blocks(&self, geometry: &Geometry) -> Vec<usize> {
        if geometry.blocks.iter().enumerate().any(|(block, _)| geometry.part(block).is_some()) {
            return self.cells(geometry);
        }
        let inside = |&block: &usize| {
            let cell = geometry.blocks[block].cell.map(|c| c as usize);
            !geometry.is_removed(block)
                && self.has_set(geometry.set(block))
                && self.selects(geometry.lattice(block), cell)
        };
        (0..geometry.blocks.len()).filter(inside).collect()
    }
}

impl Selector {
    /// Parts of the cells whose centroid lies in the selector and which have a face on each plane.
    fn cells(&self, geometry: &Geometry) -> Vec<usize> {
        let all = || (0..geometry.blocks.len()).filter(|&block| !geometry.is_removed(block));
        let mut touching = HashSet::new();
        for block in all().filter(|_| self.planes() > 0) {
            let on = |face: FaceId| {
                let corners = BlockFace { block, face }.corners(geometry);
                corners.iter().all(|x| self.on_planes(x))
            };
            if FaceId::all().any(on) {
                touching.extend(geometry.part(block).map(|part| part.cell));
            }
        }
        let inside = |&block: &usize| {
            geometry.part(block).is_some_and(|part| {
                self.has_set(geometry.set(block))
                    && self.in_ranges(&part.centroid)
                    && (self.planes() == 0 || touching.contains(&part.cell))
            })
        };
        all().filter(inside).collect()
    }
}

/// Lattices of all sets after refinement, before anything is assigned or removed.
struct Refined {
    lattices: Vec<Arc<Lattice>>,
    sets: Sets,
    selections: Vec<Selection>,
    /// Faults of the refinement.
    faults: Vec<Fault>,
}

fn refined(deck: &Deck, names: &Names) -> Result<Refined, Vec<Fault>> {
    let mut lattices = lattices(deck, names)?;
    let sets = sets::sets(deck, &lattices);
    let (mut selections, mut faults) = (Vec::new(), Vec::new());
    for (index, entry) in deck.refine.iter().enumerate() {
        let selector = Selector::new(&entry.r#where, &sets);
        let what = (format!("refine[{index}]"), format!("refine {index}"));
        selections.extend(Selection::new(what, &selector, &sets, &lattices));
        faults.extend(refine::refine(&mut lattices, &selector, (index, entry.factor))?);
    }
    Ok(Refined { lattices, sets, selections, faults })
}

/// Names of materials and joints as indices, in sorted order.
#[derive(Clone, Debug)]
pub(in crate::build) struct Names {
    materials: Vec<String>,
    joints: Vec<String>,
}

impl Names {
    pub(in crate::build) fn new(deck: &Deck) -> Self {
        Self {
            materials: deck.materials.keys().cloned().collect(),
            joints: deck.joints.keys().cloned().collect(),
        }
    }

    pub(in crate::build) fn material(&self, name: &str) -> Option<u16> {
        let at = self.materials.binary_search_by(|m| m.as_str().cmp(name)).ok()?;
        u16::try_from(at).ok()
    }

    pub(in crate::build) fn joint(&self, name: &str) -> Option<u16> {
        let at = self.joints.binary_search_by(|j| j.as_str().cmp(name)).ok()?;
        u16::try_from(at).ok()
    }

    /// Number of a material that a set names; `check` has found the name.
    fn material_of(&self, name: &str) -> u16 {
        self.material(name).unwrap_or_else(|| unreachable!("check() refuses other names"))
    }

    /// Number of a joint that a set names; `check` has found the name.
    fn joint_of(&self, name: &str) -> u16 {
        self.joint(name).unwrap_or_else(|| unreachable!("check() refuses other names"))
    }

    pub(in crate::build) fn joint_name(&self, joint: u16) -> &str {
        &self.joints[joint as usize]
    }
}
