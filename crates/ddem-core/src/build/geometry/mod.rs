//! Sets of blocks: cut, split, assigned and taken out.

pub(super) mod abut;
mod assign;
mod convex;
mod frame;
pub(super) mod interface;
mod lattice;
mod nothing;
mod orientation;
mod overlap;
mod refine;
mod region;
mod select;
mod solid;
mod stages;
mod taken;
mod terrain;

pub(super) use frame::Frame;
pub use interface::Interface;
use lattice::lattices;
use nothing::no_block;
pub(super) use nothing::{no_node, nothing, place};
pub(super) use region::Region;
pub(super) use stages::stages;
pub use taken::Selection;
pub(super) use terrain::uncovered;

use std::collections::HashMap;
use std::sync::Arc;

use crate::deck::{Assign, Deck, Remove};
use crate::error::Fault;
use crate::geometry::{Geometry, Lattice, abutting};

/// Geometry of a deck at the start, and what its parts of space refer to.
pub(in crate::build) struct Cut {
    pub(in crate::build) geometry: Geometry,
    pub(in crate::build) frame: Frame,
    /// Blocks that curved and slanted shapes have split and taken out.
    pub(in crate::build) taken: Vec<Selection>,
}

/// Cuts the sets, applies `assign` and `remove`, numbers blocks and nodes.
pub(in crate::build) fn cut(deck: &Deck, names: &Names) -> Result<Cut, Vec<Fault>> {
    let Refined { mut lattices, frame, mut taken, mut faults } = refined(deck, names)?;
    let uncovered = |(at, region): (String, _)| uncovered((&at, region), deck, &frame, &lattices);
    let uncovered: Vec<Fault> = deck.regions().into_iter().flat_map(uncovered).collect();
    if !uncovered.is_empty() {
        return Err(uncovered);
    }
    let of = |entry: &Assign| Region::new(&entry.region, &frame);
    let unused = assign::assign(&mut lattices, (deck, names), 0, &of);
    let never = |entry: &&Remove| entry.from.is_none();
    for (index, entry) in deck.remove.iter().enumerate().filter(|(_, e)| never(e)) {
        let region = Region::new(&entry.region, &frame);
        let what = (format!("remove[{index}]"), format!("remove {index}"));
        taken.extend(Selection::new(what, &region, &frame, &lattices));
        let mut found = false;
        for lattice in &mut lattices {
            found |= region.has_set(lattice.set) && region.remove(lattice);
        }
        if !found {
            let fault = nothing(format!("remove[{index}].where"), "no block");
            faults.push(no_block(fault, &region, &lattices));
        }
    }
    for lattice in &mut lattices {
        // Parts that are too small are so along all edges.
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
    let mut geometry = Geometry {
        lattices,
        bodies: Arc::default(),
        n_nodes: 0,
        n_elements: 0,
        abutments: Vec::new(),
        apart: Arc::default(),
        abutting: HashMap::new(),
        bounds: frame.bounds,
        touching: Vec::new(),
    };
    geometry.number();
    if geometry.bodies.is_empty() {
        return Err(vec![Fault::new("remove", "every block is taken out: nothing is left")]);
    }
    geometry.touching = overlap::touching(&geometry.lattices);
    let [joined, apart] = abut::abutments(&geometry, (deck, names, 0), &frame);
    (geometry.abutments, geometry.apart) = (joined, Arc::new(apart));
    geometry.abutting = abutting(&geometry.abutments);
    let faults = assign::unused_faults(&geometry, deck, &unused, &of);
    if !faults.is_empty() {
        return Err(faults);
    }
    Ok(Cut { geometry, frame, taken })
}

impl Region {
    /// Blocks whose centroid lies in a region, or a face of which lies on a plane of it.
    pub(in crate::build) fn blocks(&self, geometry: &Geometry) -> Vec<usize> {
        let inside = |&block: &usize| {
            let cell = geometry.bodies[block].cell.map(|c| c as usize);
            !geometry.is_gone(block)
                && self.has_set(geometry.set(block))
                && self.selects(geometry.lattice(block), cell)
        };
        (0..geometry.bodies.len()).filter(inside).collect()
    }
}

/// The lattices of all sets, refined, before anything is assigned or removed.
struct Refined {
    lattices: Vec<Lattice>,
    frame: Frame,
    taken: Vec<Selection>,
    /// Faults of the refinement.
    faults: Vec<Fault>,
}

fn refined(deck: &Deck, names: &Names) -> Result<Refined, Vec<Fault>> {
    let mut lattices = lattices(deck, names)?;
    let frame = Frame::new(deck, &lattices);
    let (mut taken, mut faults) = (Vec::new(), Vec::new());
    for (index, entry) in deck.refine.iter().enumerate() {
        let region = Region::new(&entry.region, &frame);
        let what = (format!("refine[{index}]"), format!("refine {index}"));
        taken.extend(Selection::new(what, &region, &frame, &lattices));
        faults.extend(refine::refine(&mut lattices, &region, (index, entry.factor))?);
    }
    Ok(Refined { lattices, frame, taken, faults })
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
        self.materials.binary_search_by(|m| m.as_str().cmp(name)).ok().map(|i| i as u16)
    }

    pub(in crate::build) fn joint(&self, name: &str) -> Option<u16> {
        self.joints.binary_search_by(|j| j.as_str().cmp(name)).ok().map(|i| i as u16)
    }

    pub(in crate::build) fn joint_name(&self, joint: u16) -> &str {
        &self.joints[joint as usize]
    }
}
