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

pub(in crate::build) use assign::in_force;
use empty_selection::no_block;
pub(in crate::build) use empty_selection::{coordinates, nearest_joint, no_face, no_node, nothing};
pub use interface::Interface;
use lattice::lattices;
pub(super) use select::{NodeSearch, free_centres};
pub use selection::Selection;
pub(super) use selector::Selector;
pub(in crate::build) use sets::box_of;
pub(in crate::build) use solid::Solid;
use stages::stages;
pub(super) use terrain::uncovered;
use touching::TouchingFaces;

use std::collections::HashSet;
use std::sync::Arc;

use super::rock::{AssignedRock, CellWalls, RockBlocks};
use super::{BuildPhase, BuildProgress, sound};
use crate::schema::{Assign, Deck, Remove};
use ddem_core::problem::{
    BlockFace, FaceId, Geometry, JointProperties, Lattice, Set, Sets, Stages,
};
use ddem_core::{ErrorCode, Fault};

/// Geometries of the stages of a deck, with the sets to which its selectors refer.
pub(in crate::build) struct Cut {
    pub(in crate::build) stages: Stages,
    pub(in crate::build) sets: Sets,
    /// Blocks that curved and slanted shapes have split or removed.
    pub(in crate::build) selections: Vec<Selection>,
    /// Joints that the deck does not name, which follow those that it names.
    pub(in crate::build) joints: Vec<JointProperties>,
    /// Faces of cells that look into holes.
    pub(in crate::build) walls: CellWalls,
}

/// Cuts regions and sets, applies `assign` and `remove`, numbers blocks and nodes. Blocks of regions may need as much
/// memory as is `available` `[bytes]`.
pub(in crate::build) fn cut(
    deck: &Deck,
    names: &Names,
    available: u64,
    progress: &BuildProgress,
) -> Result<Cut, Vec<Fault>> {
    let rock = deck.cut_checked(available, progress).map_err(|error| error.faults)?;
    sound(rock.thick_joints())?;
    let Refined { mut lattices, sets, mut selections, mut faults } =
        refined(deck, names, rock.sets())?;
    let mut cells = RockBlocks::new(deck, names, &rock);
    let uncovered = |(at, selector): (String, _)| uncovered((&at, selector), &sets, &lattices);
    sound(deck.selectors().into_iter().flat_map(uncovered).collect())?;
    let of = |entry: &Assign| Selector::new(&entry.r#where, &sets);
    let unused = assign::assign(&mut lattices, (deck, names), 0, &of);
    let (removed, empty) = removed(deck, &sets, &mut lattices, &mut cells);
    selections.extend(removed);
    faults.extend(empty);
    for lattice in lattices.iter_mut().map(Arc::make_mut) {
        // Refined blocks that are too small are so along all edges; one fault is enough.
        let most = if lattice.refined.is_some() { 1 } else { usize::MAX };
        faults.extend(lattice::open_gaps(lattice, deck, names).into_iter().take(most));
    }
    if faults.is_empty() {
        faults.extend(lattices.iter().filter_map(|lattice| refine::too_fine(lattice, deck, names)));
    }
    faults.extend(overlap::overlaps(&lattices, deck));
    faults.extend(cells.overlaps(&lattices));
    sound(faults)?;
    let parts = cells.lattices()?;
    let touching = overlap::touching(&lattices).into_iter();
    let touching = touching.map(|(i, j)| (parts.len() + i, parts.len() + j)).collect();
    let mut geometry = Geometry::new(parts.into_iter().chain(lattices).collect(), sets.bounds);
    if geometry.blocks.is_empty() {
        return Err(vec![Fault::new(ErrorCode::EmptyModel, "remove", "all blocks are removed")]);
    }
    progress.enter(BuildPhase::Joints);
    geometry.ties = Arc::new(cells.ties(&geometry));
    let rock = joined(&mut geometry, (&sets, touching), &cells, unused)?;
    let joints = cells.stiff_joints(&geometry.nonconforming_joints);
    let (stages, excavated) = stages(Arc::new(geometry), &rock)?;
    selections.extend(excavated);
    let walls = cells.walls(&stages);
    Ok(Cut { stages, sets, selections, joints, walls })
}

/// Removes blocks and cells at the start. Returns the blocks that curved and slanted shapes remove, and
/// the faults of entries that select nothing.
fn removed(
    deck: &Deck,
    sets: &Sets,
    lattices: &mut [Arc<Lattice>],
    cells: &mut RockBlocks<'_>,
) -> (Vec<Selection>, Vec<Fault>) {
    let (mut selections, mut faults) = (Vec::new(), Vec::new());
    let never = |entry: &&Remove| entry.from.is_none();
    for (index, entry) in deck.remove.iter().enumerate().filter(|(_, e)| never(e)) {
        let selector = Selector::new(&entry.r#where, sets);
        if deck.region.is_empty() {
            let what = (format!("remove[{index}]"), format!("remove {index}"));
            selections.extend(Selection::new(what, &selector, sets, lattices));
        }
        let mut found = cells.remove(&selector);
        for lattice in lattices.iter_mut().map(Arc::make_mut) {
            found |= selector.has_set(lattice.set) && selector.remove(lattice);
        }
        if !found {
            let fault = nothing(format!("remove[{index}].where"), "no block");
            faults.push(no_block(fault, &selector, lattices));
        }
    }
    (selections, faults)
}

/// Joins blocks by the joints at the start. `touching` are the pairs of lattices of sets of blocks that
/// touch, `unused` the entries that assign nothing to these lattices.
fn joined<'a>(
    geometry: &mut Geometry,
    (sets, mut touching): (&'a Sets, Vec<(usize, usize)>),
    cells: &RockBlocks<'a>,
    mut unused: Vec<usize>,
) -> Result<AssignedRock<'a>, Vec<Fault>> {
    let (deck, names) = (cells.deck, cells.names);
    let given = mesh::joints(geometry, deck, names)?;
    let pairs = given.iter().map(|(blocks, (joint, _))| (*blocks, *joint)).collect();
    let of_cuts = cells.joints(geometry);
    let [between, unjoined] =
        touching::nonconforming_joints(geometry, (deck, names, 0), sets, &pairs);
    geometry.join(of_cuts.iter().map(|(joint, _)| *joint).collect());
    assign::join(geometry, between);
    geometry.unjoined_faces = Arc::new(unjoined);
    let rock = AssignedRock::new(cells, sets, &of_cuts);
    let used = rock.assign(geometry, 0);
    unused.retain(|entry| !used.contains(entry));
    touching.extend(TouchingFaces(geometry).beside_regions());
    geometry.touching = Arc::new(touching);
    let of = |entry: &Assign| Selector::new(&entry.r#where, sets);
    let mut faults = assign::unused_faults(geometry, deck, &unused, &of);
    faults.extend(mesh::unmatched_joints(geometry, given));
    sound(faults)?;
    Ok(rock)
}

impl Selector {
    /// Blocks whose centroid lies in the selector, or that have a face on a plane of it, and parts of
    /// the cells for which that holds.
    pub(in crate::build) fn blocks(&self, geometry: &Geometry) -> Vec<usize> {
        let touching = self.cells_on_planes(geometry);
        let inside = |&block: &usize| {
            if geometry.is_removed(block) || !self.has_set(geometry.set(block)) {
                return false;
            }
            match geometry.part(block) {
                Some(part) => {
                    self.in_ranges(&part.centroid)
                        && (self.planes() == 0 || touching.contains(&part.cell))
                }
                None => {
                    let cell = geometry.blocks[block].cell.map(|c| c as usize);
                    self.selects(geometry.lattice(block), cell)
                }
            }
        };
        (0..geometry.blocks.len()).filter(inside).collect()
    }

    /// Cells with a face on each plane.
    fn cells_on_planes(&self, geometry: &Geometry) -> HashSet<u32> {
        if self.planes() == 0 {
            return HashSet::new();
        }
        let on = |block: usize, face: FaceId| {
            let corners = BlockFace { block, face }.corners(geometry);
            corners.iter().all(|x| self.on_planes(x))
        };
        let cell = |block: usize| {
            let part = geometry.part(block).filter(|_| !geometry.is_removed(block))?;
            FaceId::all().any(|face| on(block, face)).then_some(part.cell)
        };
        (0..geometry.blocks.len()).filter_map(cell).collect()
    }
}

/// Lattices of all sets of blocks after refinement, before anything is assigned or removed.
struct Refined {
    lattices: Vec<Arc<Lattice>>,
    /// Regions and sets of blocks.
    sets: Sets,
    selections: Vec<Selection>,
    /// Faults of the refinement.
    faults: Vec<Fault>,
}

fn refined(deck: &Deck, names: &Names, regions: Vec<Set>) -> Result<Refined, Vec<Fault>> {
    let mut lattices = lattices(deck, names)?;
    let sets = sets::sets(deck, regions, &lattices);
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
