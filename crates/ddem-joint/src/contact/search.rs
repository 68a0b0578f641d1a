//! Search for blocks that are near each other.
//!
//! The boxes of the blocks are sorted into a grid only if a block may have left its margin. Pairs
//! of near blocks are checked only if they may have come within contact distance.

use fearless_simd::Level;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::bond_groups::{advanced, load};
use super::history_transfer::OldPatch;
use super::joined_cells::JoinedCells;
use super::patch_builder::PatchBuilder;
use super::release::{JointLookup, JointStatus};
use super::{Configuration, ContactBlock, ContactModel, Contacts, Patch, release, update};
use crate::broken::BrokenJoints;
use crate::losses::{LossSums, Losses};
use crate::point::PairContext;
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::grid;
use ddem_mesh::{Geometry, Vec3};

/// Travel, as a fraction of the contact distance, after which two blocks just beyond it are checked
/// again.
const SOON: f64 = 0.01;
/// Blocks of a patch that a contact has replaced.
const REPLACED: [u32; 2] = [u32::MAX; 2];
/// Least number of pairs per parallel task.
const TOGETHER: usize = 256;

/// Two near blocks without a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NearPair {
    /// The two blocks, the lower number first.
    pub blocks: [u32; 2],
    /// Combined travel at which they are checked next `[m]`.
    pub next_check: f64,
}

/// Constant data of a search.
#[derive(Clone, Copy)]
pub struct SearchContext<'a> {
    /// Blocks and their joints.
    pub joints: JointLookup<'a>,
    /// Faces of all blocks.
    pub contact_model: &'a ContactModel,
    /// Blocks with supports, by pack and lane.
    pub held: &'a [[bool; LANES]],
    /// Context of the pairs.
    pub context: PairContext<'a>,
    /// Instruction set.
    pub level: Level,
}

impl<'a> SearchContext<'a> {
    fn builder(&self, configuration: Configuration<'a>) -> PatchBuilder<'a> {
        PatchBuilder {
            configuration,
            surfaces: &self.contact_model.surfaces,
            context: self.context,
            level: self.level,
            held: self.held,
        }
    }
}

impl Contacts {
    /// Numbers of pairs that would fail now, in shear and in tension, in the nonconforming joints that do
    /// not hold.
    pub fn failing(&self, configuration: &Configuration<'_>, context: PairContext<'_>) -> [u64; 2] {
        let patches = self.patches.par_iter().with_min_len(TOGETHER);
        let patches = patches.filter(|patch| !patch.holds);
        let failing: Vec<[u64; 2]> =
            patches.map(|patch| patch.failing(configuration, context)).collect();
        failing.iter().fold([0; 2], |sum, more| [sum[0] + more[0], sum[1] + more[1]])
    }

    /// Adds the displacement increments of a pack's blocks to their travel `[m]`.
    pub fn add_travel(&mut self, pack: usize, du: [f64; LANES]) {
        if let Some(travel) = self.travel.get_mut(pack) {
            (0..LANES).for_each(|lane| travel.0[lane] += du[lane]);
        }
    }

    /// Combined travel of two bodies since the boxes were sorted `[m]`.
    fn travel_of(&self, configuration: &Configuration<'_>, bodies: [u32; 2]) -> f64 {
        let [a, b] = bodies.map(|body| {
            let travel = configuration.blocks_of(body).map(|block| {
                let ContactBlock { pack, lane, .. } = configuration.blocks[block];
                self.travel[pack].0[lane]
            });
            travel.fold(0.0, f64::max)
        });
        a + b
    }

    /// Sorts the boxes of all blocks if a block may have left its margin.
    fn sort_boxes(&mut self, search: &SearchContext<'_>, configuration: &Configuration<'_>) {
        let SearchContext { joints, contact_model, .. } = *search;
        let travelled = self.travel.iter().flat_map(|lanes| lanes.0).fold(0.0, f64::max);
        if !contact_model.search || (self.near_is_complete && travelled <= contact_model.margin) {
            return;
        }
        let margin = contact_model.margin + contact_model.surfaces.thickest;
        let bounds = |block: usize| {
            if self.body(block as u32) as usize != block {
                // A cell has one box, and a box of NaN overlaps none.
                return [Vec3::repeat(f64::NAN); 2];
            }
            let spacing = configuration.blocks[block].spacing;
            configuration.bounds(block as u32, margin + 0.5 * super::CONTACT_DISTANCE * spacing)
        };
        let boxes: Vec<_> = (0..configuration.blocks.len()).into_par_iter().map(bounds).collect();
        let joined = JoinedCells::new(self, configuration);
        let near = grid::overlapping_pairs(&boxes).into_par_iter().with_min_len(TOGETHER).filter(
            |&blocks| {
                self.patch_index(blocks).is_err()
                    && !self.is_left_to_joints(joints.geometry, blocks)
                    && !joined.are_left_to_joints(blocks)
            },
        );
        let left = |blocks: [u32; 2]| {
            let known = self.near.binary_search_by_key(&blocks, |near| near.blocks);
            let next_check = known.map_or(0.0, |at| self.near[at].next_check);
            NearPair { blocks, next_check: next_check - self.travel_of(configuration, blocks) }
        };
        self.near = near.map(left).collect();
        self.travel.fill(Lanes::ZERO);
        self.near_is_complete = true;
    }

    /// Makes patches of blocks that have come within contact distance, and drops patches without
    /// points.
    fn make_patches(&mut self, builder: &PatchBuilder<'_>) {
        let configuration = &builder.configuration;
        let context = |near: &NearPair| -> Option<Result<Patch, f64>> {
            let travelled = self.travel_of(configuration, near.blocks);
            if travelled < near.next_check {
                return None;
            }
            let free = builder.separation_budget(near.blocks);
            if free > 0.0 {
                return Some(Err(travelled + free));
            }
            Some(match builder.patch(near.blocks, None) {
                Some(patch) if patch.points.is_empty() => Err(travelled + f64::from(patch.limit)),
                Some(patch) => Ok(patch),
                // The nearest faces may have thinner skins than other faces of the two blocks.
                None => Err(travelled + SOON * builder.contact_distance(near.blocks)),
            })
        };
        let found: Vec<(usize, Result<Patch, f64>)> = if self.near.len() < TOGETHER {
            let each = self.near.iter().enumerate();
            each.filter_map(|(at, near)| Some((at, context(near)?))).collect()
        } else {
            let each = self.near.par_iter().with_min_len(TOGETHER).enumerate();
            each.filter_map(|(at, near)| Some((at, context(near)?))).collect()
        };
        let mut more = Vec::new();
        for (at, found) in found {
            match found {
                Ok(patch) => more.push(patch),
                Err(next_check) => self.near[at].next_check = next_check,
            }
        }
        self.replace_patches(configuration, more);
    }

    /// Adds patches, and moves the blocks of patches without points back to the near pairs.
    fn replace_patches(&mut self, configuration: &Configuration<'_>, more: Vec<Patch>) {
        let without_points = self.patches.iter().filter(|patch| patch.points.is_empty());
        let without_points: Vec<NearPair> = without_points
            .map(|&Patch { blocks, limit, .. }| NearPair {
                blocks,
                next_check: self.travel_of(configuration, blocks) + f64::from(limit),
            })
            .collect();
        if !more.is_empty() {
            let has_patch =
                |near: &NearPair| more.binary_search_by_key(&near.blocks, |p| p.blocks).is_ok();
            self.near.retain(|near| !has_patch(near));
        }
        if !without_points.is_empty() {
            self.near.extend(without_points);
            self.near.sort_unstable_by_key(|near| near.blocks);
        }
        self.renew(more);
    }
}

/// Releases the pending joints before joints act. Returns the losses.
pub fn release_due_joints(
    search: SearchContext<'_>,
    configuration: Configuration<'_>,
    broken_joints: &mut BrokenJoints,
    contacts: &mut Contacts,
) -> Losses {
    // Without an early end the loop compares many statuses at once.
    let statuses = contacts.joints.as_flattened().iter();
    if !statuses.fold(false, |any, &status| any | (status == JointStatus::Pending)) {
        return Losses::default();
    }
    let builder = search.builder(configuration);
    let make = |blocks: [u32; 2]| builder.patch(blocks, None);
    contacts.near_is_complete = false;
    let (lost, failed) =
        release(search.joints, &configuration, search.context, broken_joints, contacts, &make);
    Losses { failed: [failed, 0], ..of_release(lost, search.context) }
}

/// Loss from the energy that the springs of a joint held in excess of its contact. In relaxation it
/// counts as damping, as all energy of an unbalanced state does.
fn of_release(lost: f64, context: PairContext<'_>) -> Losses {
    if context.relaxing && lost > 0.0 {
        Losses { damping: lost, ..Losses::default() }
    } else {
        Losses { contact: lost, ..Losses::default() }
    }
}

/// Updates the contacts at the present positions: makes, renews and drops patches, then updates
/// their forces. Returns the losses.
pub fn find(
    search: SearchContext<'_>,
    configuration: Configuration<'_>,
    contacts: &mut Contacts,
) -> Losses {
    let builder = search.builder(configuration);
    contacts.sort_boxes(&search, &configuration);
    let mut losses = renew(&builder, search, contacts);
    contacts.make_patches(&builder);
    losses.add(&update(search, configuration, contacts));
    losses
}

/// Remakes the points of patches whose blocks have moved. The old springs are updated at the
/// present positions first. The energy that they hold in excess of the new ones is lost.
fn renew(builder: &PatchBuilder<'_>, search: SearchContext<'_>, contacts: &mut Contacts) -> Losses {
    let mut losses = LossSums::default();
    if search.contact_model.search {
        release_bonds(builder, contacts, &mut losses);
    }
    let each = |patch: &mut Patch| -> Option<Losses> {
        if patch.bond.is_some() || !builder.has_moved(patch) {
            return None;
        }
        let (old, mut losses) = OldPatch::new(std::mem::take(patch), builder);
        let blocks = old.patch.blocks;
        let travelled = Patch { blocks, ..Patch::default() };
        *patch = builder.patch(blocks, Some(&old)).unwrap_or(travelled);
        losses.contact += old.conserved_energy() - patch.conserved_energy(&builder.configuration);
        patch.note_parts();
        Some(losses)
    };
    let patches = &mut contacts.patches;
    let lost: Vec<_> = patches.par_iter_mut().with_min_len(TOGETHER).filter_map(each).collect();
    lost.iter().for_each(|lost| losses.add(lost));
    losses.total()
}

/// Advances the statuses of nonconforming joints, and turns them into contacts once they have failed
/// and moved.
fn release_bonds(builder: &PatchBuilder<'_>, contacts: &mut Contacts, losses: &mut LossSums) {
    let (groups, patches) = (&contacts.bond_groups, &contacts.patches);
    let of = |group: usize| groups.of(group).iter().map(|&patch| &patches[patch as usize]);
    let each = |group: usize| {
        let found = advanced(of(group), &builder.configuration, builder.context)?;
        Some((group, found))
    };
    let all = (0..groups.len()).into_par_iter().with_min_len(TOGETHER);
    let found: Vec<(usize, JointStatus)> = all.filter_map(each).collect();
    if found.is_empty() {
        return;
    }
    // Blocks of joints whose status has advanced may meet others.
    contacts.near_is_complete = false;
    let groups = std::mem::take(&mut contacts.bond_groups);
    for (group, status) in found {
        let own = groups.of(group);
        if status < JointStatus::Pending {
            for &patch in own {
                let bond = &mut contacts.patches[patch as usize].bond;
                bond.iter_mut().for_each(|bond| bond.status = status);
            }
        } else {
            losses.add(&release_group(builder, contacts, own));
        }
    }
    contacts.patches.retain(|patch| patch.blocks != REPLACED);
    contacts.patches.sort_by_key(|patch| patch.blocks);
    contacts.index();
}

/// Turns joints of two bodies into a contact, which begins with their load. Returns the losses.
fn release_group(builder: &PatchBuilder<'_>, contacts: &mut Contacts, own: &[u32]) -> Losses {
    // The axes are those of the last step, which a resumed run does not have.
    for &patch in own {
        contacts.patches[patch as usize].update_axes(&builder.configuration);
    }
    let patches = || own.iter().map(|&patch| &contacts.patches[patch as usize]);
    let bodies = contacts.patches[own[0] as usize].blocks.map(|block| contacts.body(block));
    let before: f64 = patches().map(Patch::stored).sum();
    let mut contact = builder.patch(bodies, None).unwrap_or_default();
    contact.blocks = bodies;
    if let Some(load) = load(patches(), &builder.configuration) {
        contact.preload(&builder.configuration, builder.context, &load, 1.0);
    }
    let lost = before - contact.stored();
    let mut ended = Vec::with_capacity(own.len());
    for &patch in own {
        let replaced = Patch { blocks: REPLACED, ..Patch::default() };
        ended.extend(std::mem::replace(&mut contacts.patches[patch as usize], replaced).ended());
    }
    contacts.patches[own[0] as usize] = contact;
    contacts.add_released(ended);
    of_release(lost, builder.context)
}

impl Contacts {
    /// True if contact between two blocks is left to joints: neighbours connected by joints that
    /// have not moved, or by their own joint.
    fn is_left_to_joints(&self, geometry: &Geometry, [a, b]: [u32; 2]) -> bool {
        let (a, b) = (a as usize, b as usize);
        if geometry.is_removed(a) || geometry.is_removed(b) {
            return true;
        }
        if let Some(step) = geometry.steps_between(a, b) {
            return in_lattice(geometry, &self.joints, [a, b], step);
        }
        // Blocks that both have a joint in place with the same third block, across nonconforming
        // faces.
        self.held_by(geometry, a).any(|of_a| self.held_by(geometry, b).any(|of_b| of_a == of_b))
    }

    /// Blocks that a joint in place connects to a block.
    fn held_by<'a>(
        &'a self,
        geometry: &'a Geometry,
        block: usize,
    ) -> impl Iterator<Item = usize> + 'a {
        let bonds = self.of(block).filter(|(patch, _)| {
            patch.bond.as_ref().is_some_and(|bond| bond.status == JointStatus::InPlace)
        });
        let others = bonds.map(|(patch, side)| patch.blocks[1 - side] as usize);
        let neighbours = FaceId::all().filter_map(move |face| {
            let next = geometry.beyond(block, face)?;
            let owner = if face.upper { block } else { next };
            (self.joints[owner][face.direction] == JointStatus::InPlace).then_some(next)
        });
        others.chain(neighbours)
    }
}

/// True if contact between two blocks of one lattice is left to joints.
fn in_lattice(
    geometry: &Geometry,
    joints: &[[JointStatus; 3]],
    [a, b]: [usize; 2],
    step: [i64; 3],
) -> bool {
    if step.iter().any(|step| step.abs() > 1) {
        return false;
    }
    let mut directions = (0..3).filter(|&d| step[d] != 0);
    if let (Some(d), None) = (directions.next(), directions.next()) {
        let owner = if step[d] > 0 { a } else { b };
        return joints[owner][d] < JointStatus::Released;
    }
    connected(geometry, joints, a, step)
}

/// True if joints in place connect a block with the one some steps away, one direction after the
/// other.
fn connected(
    geometry: &Geometry,
    joints: &[[JointStatus; 3]],
    from: usize,
    step: [i64; 3],
) -> bool {
    if step == [0; 3] {
        return true;
    }
    (0..3).filter(|&d| step[d] != 0).any(|d| {
        let face = FaceId { direction: d, upper: step[d] > 0 };
        let Some(next) = geometry.beyond(from, face) else { return false };
        let owner = if face.upper { from } else { next };
        let rest = [0, 1, 2].map(|e| if e == d { 0 } else { step[e] });
        joints[owner][d] == JointStatus::InPlace && connected(geometry, joints, next, rest)
    })
}
