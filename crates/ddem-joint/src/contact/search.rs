//! Which blocks are near each other, at any time.
//!
//! The boxes of the blocks are sorted into a grid only when a block may have gone further than their
//! margin; pairs of blocks in between are looked at only when they may have come within reach.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fit::Fitting;
use super::heirs::Old;
use super::release::{Places, Release};
use super::{Contacts, Ended, Patch, Placed, Placing, Surfaces, act, release};
use crate::breaks::Breaks;
use crate::losses::{Losses, Lost};
use crate::point::Look;
use ddem_mechanics::collide::FaceOf;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::Geometry;
use ddem_mesh::grid;

/// Part of their reach after which two blocks that are just beyond it are looked at again.
const SOON: f64 = 0.01;
/// Pairs that one task looks at.
const TOGETHER: usize = 256;

/// Two blocks that may meet and have no patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Near {
    /// The two blocks, the lower number first.
    pub blocks: [u32; 2],
    /// Travel of both together before which they need not be looked at `[m]`.
    pub until: f64,
}

/// What is fixed in a search.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// Blocks and their joints.
    pub places: Places<'a>,
    /// Faces of all blocks.
    pub surfaces: &'a Surfaces,
    /// Blocks that have supports, by pack.
    pub held: &'a [[bool; LANES]],
    /// How pairs are looked at.
    pub look: Look<'a>,
}

impl<'a> Ground<'a> {
    fn fitting(&self, placing: Placing<'a>) -> Fitting<'a> {
        Fitting { placing, skins: &self.surfaces.skins, look: self.look, held: self.held }
    }
}

impl Contacts {
    /// How many pairs of joints between faces that do not match would fail now, in shear and in tension.
    pub fn failing(&self, placing: &Placing<'_>, look: Look<'_>) -> [u64; 2] {
        let patches = self.patches.par_iter().with_min_len(TOGETHER);
        let failing: Vec<[u64; 2]> = patches.map(|patch| patch.failing(placing, look)).collect();
        failing.iter().fold([0; 2], |sum, more| [sum[0] + more[0], sum[1] + more[1]])
    }

    /// Counts how far the bodies of a pack have gone `[m]`.
    pub fn travelled(&mut self, pack: usize, way: [f64; LANES]) {
        if let Some(travel) = self.travel.get_mut(pack) {
            (0..LANES).for_each(|lane| travel.0[lane] += way[lane]);
        }
    }

    /// How far two blocks have gone together since the boxes were sorted `[m]`.
    fn gone(&self, placing: &Placing<'_>, blocks: [u32; 2]) -> f64 {
        let [a, b] = blocks.map(|block| {
            let Placed { pack, lane, .. } = placing.blocks[block as usize];
            self.travel[pack].0[lane]
        });
        a + b
    }

    /// Sorts the boxes of all blocks if any may have left its own.
    fn sort(&mut self, ground: &Ground<'_>, placing: &Placing<'_>) {
        let Ground { places, surfaces, .. } = *ground;
        let gone = self.travel.iter().flat_map(|lanes| lanes.0).fold(0.0, f64::max);
        if !surfaces.search || (self.known && gone <= surfaces.margin) {
            return;
        }
        let margin = surfaces.margin + surfaces.skins.thickest;
        let bounds =
            |block: &Placed| block.bounds(placing.u, margin + 0.5 * super::REACH * block.spacing);
        let boxes: Vec<_> = placing.blocks.par_iter().map(bounds).collect();
        let near = grid::meeting(&boxes)
            .into_par_iter()
            .with_min_len(TOGETHER)
            .filter(|&blocks| self.place(blocks).is_err() && !self.joined(places.geometry, blocks));
        let left = |blocks: [u32; 2]| {
            let known = self.near.binary_search_by_key(&blocks, |near| near.blocks);
            let until = known.map_or(0.0, |at| self.near[at].until);
            Near { blocks, until: until - self.gone(placing, blocks) }
        };
        self.near = near.map(left).collect();
        self.travel.fill(Lanes::ZERO);
        self.known = true;
    }

    /// Makes patches of blocks that have come within reach, and drops those of blocks that no longer
    /// face each other.
    fn meet(&mut self, fitting: &Fitting<'_>) {
        let placing = &fitting.placing;
        let look = |near: &Near| -> Option<Result<Patch, f64>> {
            let gone = self.gone(placing, near.blocks);
            if gone < near.until {
                return None;
            }
            let free = fitting.free(near.blocks);
            if free > 0.0 {
                return Some(Err(gone + free));
            }
            Some(match fitting.patch(near.blocks, None) {
                Some(patch) if patch.points.is_empty() => Err(gone + f64::from(patch.limit)),
                Some(patch) => Ok(patch),
                // Faces that are nearest may have thinner skins than others of the two blocks.
                None => Err(gone + SOON * fitting.reach(near.blocks)),
            })
        };
        let found: Vec<(usize, Result<Patch, f64>)> = if self.near.len() < TOGETHER {
            let each = self.near.iter().enumerate();
            each.filter_map(|(at, near)| Some((at, look(near)?))).collect()
        } else {
            let each = self.near.par_iter().with_min_len(TOGETHER).enumerate();
            each.filter_map(|(at, near)| Some((at, look(near)?))).collect()
        };
        let mut more = Vec::new();
        for (at, found) in found {
            match found {
                Ok(patch) => more.push(patch),
                Err(until) => self.near[at].until = until,
            }
        }
        self.exchange(placing, more);
    }

    /// Takes patches in, and those without points out.
    fn exchange(&mut self, placing: &Placing<'_>, more: Vec<Patch>) {
        let idle = self.patches.iter().filter(|patch| patch.points.is_empty());
        let idle: Vec<Near> = idle
            .map(|&Patch { blocks, limit, .. }| Near {
                blocks,
                until: self.gone(placing, blocks) + f64::from(limit),
            })
            .collect();
        if !more.is_empty() {
            let met = |near: &Near| more.binary_search_by_key(&near.blocks, |p| p.blocks).is_ok();
            self.near.retain(|near| !met(near));
        }
        if !idle.is_empty() {
            self.near.extend(idle);
            self.near.sort_unstable_by_key(|near| near.blocks);
        }
        self.renew(more);
    }
}

/// Before joints act: those that are due are let go. Returns what is lost on the way.
pub fn let_go(
    ground: Ground<'_>,
    placing: Placing<'_>,
    breaks: &mut Breaks,
    contacts: &mut Contacts,
) -> Losses {
    if contacts.joints.iter().flatten().all(|joint| *joint != Release::Due) {
        return Losses::default();
    }
    let fitting = ground.fitting(placing);
    let make = |blocks: [u32; 2]| fitting.patch(blocks, None);
    contacts.known = false;
    let (lost, failed) = release(ground.places, &placing, ground.look, breaks, contacts, &make);
    Losses { failed: [failed, 0], ..of_release(lost, ground.look) }
}

/// Energy that the springs of a joint held and its contact does not: a relaxation damps it as all that is out of
/// equilibrium.
fn of_release(lost: f64, look: Look<'_>) -> Losses {
    if look.relaxing && lost > 0.0 {
        Losses { damping: lost, ..Losses::default() }
    } else {
        Losses { contact: lost, ..Losses::default() }
    }
}

/// Contacts at the present positions: patches are made, renewed and dropped; then what they exert.
pub fn find(ground: Ground<'_>, placing: Placing<'_>, contacts: &mut Contacts) -> Losses {
    let fitting = ground.fitting(placing);
    contacts.sort(&ground, &placing);
    let mut losses = renew(&fitting, ground, contacts);
    contacts.meet(&fitting);
    losses.add(&act(placing, ground.look, contacts));
    losses
}

/// Makes the points of patches anew whose blocks have moved. Their springs follow to where the blocks
/// are first; what these and the bank keep then and the new ones do not is lost.
fn renew(fitting: &Fitting<'_>, ground: Ground<'_>, contacts: &mut Contacts) -> Losses {
    let each = |patch: &mut Patch| -> Option<(Losses, Option<Loosened>)> {
        if patch.bond.is_some() && ground.surfaces.search {
            return let_loose(fitting, patch).map(|(losses, loosened)| (losses, Some(loosened)));
        }
        if patch.bond.is_some() || !fitting.has_moved(patch) {
            return None;
        }
        let (old, mut losses) = Old::new(std::mem::take(patch), fitting);
        let blocks = old.patch.blocks;
        let gone = Patch { blocks, ..Patch::default() };
        *patch = fitting.patch(blocks, Some(&old)).unwrap_or(gone);
        losses.contact += old.kept() - patch.kept(&fitting.placing);
        Some((losses, None))
    };
    let patches = &mut contacts.patches;
    let lost: Vec<_> = patches.par_iter_mut().with_min_len(TOGETHER).filter_map(each).collect();
    let mut losses = Lost::default();
    for (lost, loosened) in lost {
        losses.add(&lost);
        if let Some(ended) = loosened {
            // Blocks of joints that have come further may meet others.
            contacts.known = false;
            contacts.end(ended);
        }
    }
    losses.total()
}

/// A joint that has come further: with what is left of it where it has ended.
type Loosened = Option<Ended>;

/// Makes a contact of a joint between faces that do not match, once it has failed and moved. Returns what
/// is lost on the way, and the joint; nothing where it has not come further.
fn let_loose(fitting: &Fitting<'_>, patch: &mut Patch) -> Option<(Losses, Loosened)> {
    let look = fitting.look;
    let found = patch.moved(&fitting.placing, look);
    let bond = patch.bond.as_mut().filter(|bond| found > Some(bond.release))?;
    if let Some(release) = found.filter(|&release| release < Release::Due) {
        bond.release = release;
        return Some((Losses::default(), None));
    }
    // Its axes are those of the last step, which a run that has just been resumed does not know.
    patch.turn(&fitting.placing);
    let load = patch.load(&fitting.placing);
    let before = patch.stored();
    let mut contact = fitting.patch(patch.blocks, None).unwrap_or_default();
    contact.blocks = patch.blocks;
    contact.bear(&fitting.placing, look, &load, 1.0);
    let ended = std::mem::replace(patch, contact).ended();
    Some((of_release(before - patch.stored(), look), ended))
}

impl Contacts {
    /// Whether two blocks are left to their joints: neighbours that are connected by joints which have
    /// not moved, or by their own.
    fn joined(&self, geometry: &Geometry, [a, b]: [u32; 2]) -> bool {
        let (a, b) = (a as usize, b as usize);
        if geometry.is_gone(a) || geometry.is_gone(b) {
            return true;
        }
        if let Some(step) = geometry.steps_between(a, b) {
            return in_lattice(geometry, &self.joints, [a, b], step);
        }
        // Across faces that do not match, by way of one block.
        self.held_by(geometry, a).any(|of_a| self.held_by(geometry, b).any(|of_b| of_a == of_b))
    }

    /// Blocks that a joint which has not moved holds at a block.
    fn held_by<'a>(
        &'a self,
        geometry: &'a Geometry,
        block: usize,
    ) -> impl Iterator<Item = usize> + 'a {
        let bonds = self.of(block).filter(|(patch, _)| {
            patch.bond.as_ref().is_some_and(|bond| bond.release == Release::Holds)
        });
        let others = bonds.map(|(patch, side)| patch.blocks[1 - side] as usize);
        let ways = FaceOf::all().filter_map(move |face| {
            let next = geometry.beyond(block, face)?;
            let owner = if face.upper { block } else { next };
            (self.joints[owner][face.direction] == Release::Holds).then_some(next)
        });
        others.chain(ways)
    }
}

/// The same of two blocks of one lattice.
fn in_lattice(
    geometry: &Geometry,
    joints: &[[Release; 3]],
    [a, b]: [usize; 2],
    step: [i64; 3],
) -> bool {
    if step.iter().any(|step| step.abs() > 1) {
        return false;
    }
    let mut ways = (0..3).filter(|&d| step[d] != 0);
    if let (Some(d), None) = (ways.next(), ways.next()) {
        let owner = if step[d] > 0 { a } else { b };
        return joints[owner][d] < Release::Done;
    }
    connected(geometry, joints, a, step)
}

/// Whether a block is connected with the one some steps away, one direction after the other, by joints
/// that hold.
fn connected(geometry: &Geometry, joints: &[[Release; 3]], from: usize, step: [i64; 3]) -> bool {
    if step == [0; 3] {
        return true;
    }
    (0..3).filter(|&d| step[d] != 0).any(|d| {
        let face = FaceOf { direction: d, upper: step[d] > 0 };
        let Some(next) = geometry.beyond(from, face) else { return false };
        let owner = if face.upper { from } else { next };
        let rest = [0, 1, 2].map(|e| if e == d { 0 } else { step[e] });
        joints[owner][d] == Release::Holds && connected(geometry, joints, next, rest)
    })
}
