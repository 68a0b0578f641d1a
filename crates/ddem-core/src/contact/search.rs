//! Which blocks are near each other, at any time.
//!
//! The boxes of the blocks are sorted into a grid only when a block may have gone further than their
//! margin; pairs of blocks in between are looked at only when they may have come within reach.
//! All of this can be forgotten at any time: what it finds depends on where the blocks are alone.

use rayon::prelude::*;

use super::fit::Fitting;
use super::heirs::Old;
use super::release::{Places, Release};
use super::{Contacts, Patch, Placed, Placing, Skins, act, release};
use crate::breaks::{Breaks, Losses};
use crate::geometry::Geometry;
use crate::grid;
use crate::lanes::{LANES, Lanes};

/// Margin of the boxes, as a part of the edges of the blocks.
const MARGIN: f64 = 0.1;
/// Pairs that one task looks at.
const TOGETHER: usize = 256;

/// Two blocks that may meet.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    blocks: [u32; 2],
    /// Travel of both together before which they need not be looked at `[m]`; 0 once they had a patch,
    /// whose loss no one says here.
    until: f64,
}

/// What is known of where blocks are, until it is forgotten.
#[derive(Debug, Default)]
pub(crate) struct Search {
    candidates: Vec<Candidate>,
    /// How far the bodies of each pack have gone since the boxes were sorted, at most `[m]`.
    pub(crate) travel: Vec<Lanes>,
    margin: f64,
    known: bool,
}

/// What is fixed in a search.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    pub(crate) places: Places<'a>,
    pub(crate) skins: &'a Skins,
    pub(crate) held: &'a [[bool; LANES]],
}

impl Search {
    /// Looks anew before the next step.
    pub(crate) fn forget(&mut self) {
        self.known = false;
    }

    /// Memory in use `[bytes]`.
    pub(crate) fn bytes(&self) -> usize {
        self.candidates.len() * size_of::<Candidate>() + self.travel.len() * size_of::<Lanes>()
    }

    fn travelled(&self, placing: &Placing<'_>, block: u32) -> f64 {
        let placed = &placing.blocks[block as usize];
        self.travel[placed.pack].0[placed.lane]
    }

    /// Sorts the boxes of all blocks if any may have left its own.
    fn sort(&mut self, ground: &Ground<'_>, placing: &Placing<'_>, contacts: &Contacts) {
        let gone = self.travel.iter().flat_map(|lanes| lanes.0).fold(0.0, f64::max);
        if self.known && gone <= self.margin {
            return;
        }
        self.known = true;
        self.travel.clear();
        self.travel.resize(ground.places.packs.packs.len(), Lanes::ZERO);
        self.margin = MARGIN * median_edge(ground.places.geometry);
        let margin = self.margin + ground.skins.thickest;
        let bounds =
            |block: &Placed| block.bounds(placing.u, margin + 0.5 * super::REACH * block.spacing());
        let boxes: Vec<_> = placing.blocks.par_iter().map(bounds).collect();
        let pairs = grid::meeting(&boxes).into_iter();
        let free =
            pairs.filter(|&[a, b]| !joined(ground.places.geometry, &contacts.joints, [a, b]));
        self.candidates.clear();
        self.candidates.extend(free.map(|blocks| Candidate { blocks, until: 0.0 }));
    }

    /// Patches of blocks that have come within reach.
    fn new_patches(&mut self, fitting: &Fitting<'_>, contacts: &Contacts) -> Vec<Patch> {
        let travelled: &Self = self;
        let look = |candidate: &Candidate| -> (f64, Option<Patch>) {
            let [a, b] = candidate.blocks;
            let gone =
                travelled.travelled(&fitting.placing, a) + travelled.travelled(&fitting.placing, b);
            if gone < candidate.until || contacts.place(candidate.blocks).is_ok() {
                return (candidate.until, None);
            }
            let free = fitting.free(candidate.blocks);
            if free > 0.0 {
                return (gone + free, None);
            }
            (0.0, fitting.patch(candidate.blocks, None))
        };
        let found: Vec<(f64, Option<Patch>)> = if self.candidates.len() < TOGETHER {
            self.candidates.iter().map(look).collect()
        } else {
            self.candidates.par_iter().with_min_len(TOGETHER).map(look).collect()
        };
        let mut patches = Vec::new();
        for (candidate, (until, patch)) in self.candidates.iter_mut().zip(found) {
            candidate.until = until;
            patches.extend(patch);
        }
        patches
    }
}

/// Before joints act: those that are due are let go. Returns the energy that is lost on the way `[J]`.
pub(crate) fn let_go(
    ground: Ground<'_>,
    placing: Placing<'_>,
    breaks: &mut Breaks,
    contacts: &mut Contacts,
    search: &mut Search,
) -> f64 {
    if contacts.joints.iter().flatten().all(|joint| *joint != Release::Due) {
        return 0.0;
    }
    let fitting = Fitting { placing, skins: ground.skins, held: ground.held };
    let make = |blocks: [u32; 2]| fitting.patch(blocks, None);
    search.forget();
    release((ground.places, &placing), breaks, contacts, &make).unwrap_or(0.0)
}

/// Contacts at the present positions: patches are made, renewed and dropped; then what they exert.
pub(crate) fn find(
    ground: Ground<'_>,
    placing: Placing<'_>,
    contacts: &mut Contacts,
    search: &mut Search,
) -> Losses {
    let fitting = Fitting { placing, skins: ground.skins, held: ground.held };
    search.sort(&ground, &placing, contacts);
    let mut losses = renew(&fitting, contacts);
    let more = search.new_patches(&fitting, contacts);
    contacts.renew(more);
    losses.add(&act(placing, contacts));
    losses
}

/// Makes the points of patches anew whose blocks have moved. Their springs follow to where the blocks
/// are first; what these and the bank keep then and the new ones do not is lost.
fn renew(fitting: &Fitting<'_>, contacts: &mut Contacts) -> Losses {
    let each = |patch: &mut Patch| -> Losses {
        if !fitting.has_moved(patch) {
            return Losses::default();
        }
        let (old, mut losses) = Old::new(std::mem::take(patch), &fitting.placing);
        let blocks = old.patch.blocks;
        let gone = Patch { blocks, ..Patch::default() };
        *patch = fitting.patch(blocks, Some(&old)).unwrap_or(gone);
        losses.contact += old.kept() - patch.kept(&fitting.placing);
        losses
    };
    let patches = &mut contacts.patches;
    let lost: Vec<Losses> = patches.par_iter_mut().with_min_len(TOGETHER).map(each).collect();
    Losses::total(&lost)
}

/// Whether two blocks are left to their joints: neighbours in a lattice that are connected by joints
/// which have not moved, or by their own.
fn joined(geometry: &Geometry, joints: &[[Release; 3]], [a, b]: [u32; 2]) -> bool {
    let (a, b) = (a as usize, b as usize);
    let (body_a, body_b) = (&geometry.bodies[a], &geometry.bodies[b]);
    if body_a.set != body_b.set {
        return false;
    }
    let step = [0, 1, 2].map(|d| i64::from(body_b.cell[d]) - i64::from(body_a.cell[d]));
    if step.iter().any(|step| step.abs() > 1) {
        return false;
    }
    let ways: Vec<usize> = (0..3).filter(|&d| step[d] != 0).collect();
    if let [d] = ways[..] {
        let owner = if step[d] > 0 { a } else { b };
        return joints[owner][d] < Release::Done;
    }
    connected(geometry, joints, a, (&ways, step))
}

/// Whether a block is connected with the one some steps away, one direction after the other, by joints
/// that hold.
fn connected(
    geometry: &Geometry,
    joints: &[[Release; 3]],
    from: usize,
    (ways, step): (&[usize], [i64; 3]),
) -> bool {
    if ways.is_empty() {
        return true;
    }
    (0..ways.len()).any(|first| {
        let d = ways[first];
        let mut offset = [0; 3];
        offset[d] = step[d] as i32;
        let Some(next) = geometry.neighbour(from, offset) else { return false };
        let owner = if step[d] > 0 { from } else { next };
        let rest: Vec<usize> = ways.iter().copied().filter(|&way| way != d).collect();
        joints[owner][d] == Release::Holds && connected(geometry, joints, next, (&rest, step))
    })
}

fn median_edge(geometry: &Geometry) -> f64 {
    let mut edges: Vec<f64> =
        (0..geometry.bodies.len()).map(|body| geometry.shortest_edge(body)).collect();
    let middle = edges.len() / 2;
    let (_, median, _) = edges.select_nth_unstable_by(middle, f64::total_cmp);
    *median
}
