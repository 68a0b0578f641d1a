//! Contact between blocks that no joint holds together (§9).
//!
//! Two blocks that come near each other get a [`Patch`]. It consists of the two faces that meet,
//! found by separating axes, and of pairs of facing points. Each node or vertex of the overlap of
//! the faces is a pair with its share of the area. Springs with friction act between the points of
//! a pair, as in a failed joint.
//!
//! Pairs are remade when the blocks have moved against each other by a small part of an element.
//! Each new pair inherits the friction of the nearest old one. So the areas of the points change
//! with the overlap without a jump.
//!
//! | file | content |
//! |---|---|
//! | `configuration` | positions of blocks and of points fixed to their faces |
//! | `surfaces` | stiffness and friction of two faces |
//! | `friction` | strength that the laws of joints leave to faces |
//! | `search`, `joined_cells` | search for near blocks, without those that their joints keep apart |
//! | `patch_builder`, `clipped`, `side` | pairs of points of a patch, on faces and edges |
//! | `meeting` | separation of two bodies and the features in contact |
//! | `cells` | cells of several blocks as bodies |
//! | `patch` | points, axes and forces of a patch |
//! | `fixed` | points fixed to nodes or rigid bodies, to which their forces go |
//! | `matched` | pairs of two faces with equal corners |
//! | `history_transfer` | transfer of history from old points to new ones |
//! | `forces`, `four_pairs` | forces of the points, of four at a time |
//! | `bond`, `bond_groups` | nonconforming joints, and those of two cells as one |
//! | `holding` | nonconforming joints in which all pairs hold |
//! | `by_block` | patches of each block, and their forces on it |
//! | `joint_forces` | forces of nonconforming joints, side by side, and the nodes to which they go |
//! | `bound`, `bounds_at_nodes` | upper bounds of the stiffness of contacts |
//! | `warnings` | warnings about contacts that may be unintended |
//! | `contact_model` | constant data of contacts |
//! | `release` | replacement of displaced joints by contacts |

mod bond;
mod bond_groups;
mod bound;
mod bounds_at_nodes;
mod by_block;
mod cells;
mod clipped;
mod configuration;
mod contact_model;
mod fixed;
mod forces;
mod four_pairs;
mod friction;
mod history_transfer;
mod holding;
mod joined_cells;
mod joint_forces;
mod matched;
mod meeting;
mod patch;
mod patch_builder;
mod release;
mod search;
mod side;
mod surfaces;
mod warnings;

use std::sync::Arc;

use nalgebra::Vector3;

use super::point::JointPoint;
use ddem_mechanics::law::damage_at_equilibrium;
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::SpatialVector;
use ddem_mesh::{SurfacePoint, Vec3};

pub use bound::{AddedStiffness, bound, outer, rigid_bounds};
pub use configuration::{Configuration, ContactBlock};
pub use release::{JointLookup, JointStatus};
pub use search::{NearPair, SearchContext, find, release_due_joints};
pub use warnings::ContactWarning;

pub use bond::{Bond, BondedPatch, ReleasedJoint, at_nodes, bonded_patches};
use bond_groups::BondGroups;
pub use bounds_at_nodes::bounds_at_nodes;
pub use contact_model::ContactModel;
use fixed::FixedPair;
use forces::update;
use joint_forces::JointForces;
use release::release;
use serde::{Deserialize, Serialize};
pub use surfaces::{CombinedSurface, ContactSurfaces};

/// Motion of two blocks against each other at which their patch is remade, and distance at which
/// they get one, as a fraction of an element edge.
const CONTACT_DISTANCE: f64 = 0.02;
/// Distance of the centres of two neighbours at rest, over the sum of their sizes. They may have been
/// apart a little.
const NEIGHBOURS: f64 = 1.5;

/// Two points that face each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactPoint {
    /// Points on blocks a and b.
    pub points: [SurfacePoint; 2],
    /// The springs between the two.
    pub pair: JointPoint,
    /// Accumulated slip since the blocks met or the joint was released `[m]`.
    pub slip_path: f64,
}

impl ContactPoint {
    /// Pair of two points for an area `[m²]`, without history.
    pub(super) fn new(points: [SurfacePoint; 2], area: f64) -> Self {
        Self { points, pair: JointPoint { area, ..JointPoint::default() }, slip_path: 0.0 }
    }
}

/// Two blocks that are near each other.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Patch {
    /// Bodies a and b, the lower number first: blocks, or the first blocks of cells.
    pub blocks: [u32; 2],
    /// Reference block, 0 or 1: the normal rotates with it.
    pub reference: u8,
    /// Motion after which the points are remade `[m]`.
    pub limit: f32,
    /// Unit normal from a to b, and a tangent, in the reference block's frame at rest.
    pub axes: [Vec3; 2],
    /// Axes in space.
    pub axes_now: [Vec3; 2],
    /// Axes in the other block's frame when the points were made.
    pub axes_in_other: [Vector3<f32>; 2],
    /// Vector from the centre of a to that of b in the reference block's frame, when the points
    /// were made `[m]`.
    pub relative_position: Vec3,
    /// Stiffness and friction of the two faces.
    pub surface: CombinedSurface,
    /// Pairs of points; a patch without points is dropped.
    pub points: Box<[ContactPoint]>,
    /// Joint that the points belong to, if any.
    pub bond: Option<Bond>,
    /// Couple on the reference block, with which the axes rotate `[N m]`. It balances the forces of
    /// two points at a distance and does the work of rotating them.
    pub couple: Vec3,
    /// Energy that new points held less than the old ones, and may hold again `[J]`.
    pub energy_reserve: f64,
    /// True if the points have been remade at the present positions and have not moved since.
    pub(super) renewed: bool,
    /// True for a joint whose pairs all hold at the present positions, its tractions being updated.
    #[serde(skip)]
    pub(super) holds: bool,
    /// Blocks of the two bodies on which a contact has points, as bits.
    #[serde(skip)]
    parts: [u64; 2],
    /// Side of a joint with the larger face, on which the other slides once all pairs have failed; `None`
    /// if none is larger.
    #[serde(skip)]
    ground: Option<u8>,
    /// Nodes or arms of its points.
    #[serde(skip)]
    fixed: Arc<[FixedPair]>,
    /// Forces of all points on rigid bodies a and b, and their torques about the first nodes of `blocks`;
    /// zero for deformable bodies.
    #[serde(skip)]
    wrenches: [SpatialVector; 2],
}

/// Patches, near pairs of blocks, and statuses of the joints.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Contacts {
    /// Patches, sorted by their blocks.
    pub patches: Vec<Patch>,
    /// Pairs of blocks without a patch that may soon come within contact distance, sorted.
    pub near: Vec<NearPair>,
    /// True if the list of near pairs is complete.
    pub near_is_complete: bool,
    /// Upper bound of the travel of the blocks of each pack since the boxes were sorted `[m]`.
    pub travel: Vec<Lanes>,
    /// Status of the joint at the upper side of each block along each direction.
    pub joints: Vec<[JointStatus; 3]>,
    /// First block of the cell of each block; empty without cells.
    pub bodies: Vec<u32>,
    /// Nonconforming joints that contacts have replaced, sorted by their blocks.
    pub ended: Vec<ReleasedJoint>,
    /// Largest penetration `[m]`.
    pub deepest: f64,
    /// Start of each block's patches in `entries`, shape `(blocks + 1)`.
    #[serde(skip)]
    starts: Vec<u32>,
    /// Twice the number of the patch, plus one if the block is of body b.
    #[serde(skip)]
    entries: Vec<u32>,
    /// True for blocks with contacts.
    #[serde(skip)]
    has_contacts: Vec<bool>,
    /// Joints that a contact replaces as one: the patches of two blocks or of two cells.
    #[serde(skip)]
    bond_groups: BondGroups,
    /// Forces of nonconforming joints with deformable blocks.
    #[serde(skip)]
    joint_forces: JointForces,
}

impl Contacts {
    /// Empty contacts of a number of blocks in packs. `bodies` are the first blocks of their cells;
    /// empty without cells.
    pub fn new(blocks: usize, packs: usize, bodies: Vec<u32>) -> Self {
        let joints = vec![[JointStatus::default(); 3]; blocks];
        let travel = vec![Lanes::ZERO; packs];
        let mut contacts = Self { joints, travel, bodies, ..Self::default() };
        contacts.index();
        contacts
    }

    /// Body of a block: the first block of its cell, or the block itself.
    #[inline]
    pub(super) fn body(&self, block: u32) -> u32 {
        self.bodies.get(block as usize).copied().unwrap_or(block)
    }

    /// Patch of the nonconforming joint of two blocks, unless a contact has replaced it.
    pub fn bonded_patch(&self, blocks: [u32; 2]) -> Option<(&Patch, Bond)> {
        let patch = &self.patches[self.patch_index(blocks).ok()?];
        Some((patch, patch.bond?))
    }

    /// Nonconforming joint of two blocks after a contact has replaced it.
    pub fn ended(&self, blocks: [u32; 2]) -> Option<&ReleasedJoint> {
        let at = self.ended.binary_search_by_key(&blocks, |ended| ended.blocks).ok()?;
        Some(&self.ended[at])
    }

    /// All nonconforming joints with their blocks.
    pub fn bonds_mut(&mut self) -> impl Iterator<Item = ([u32; 2], &mut Bond)> {
        let Self { patches, ended, .. } = self;
        let held = patches.iter_mut().filter_map(|p| Some((p.blocks, p.bond.as_mut()?)));
        held.chain(ended.iter_mut().map(|ended| (ended.blocks, &mut ended.bond)))
    }

    /// Adds nonconforming joints that contacts have replaced.
    pub fn add_released(&mut self, ended: impl IntoIterator<Item = ReleasedJoint>) {
        self.ended.extend(ended);
        self.ended.sort_by_key(|ended| ended.blocks);
    }

    /// Bodies in contact, or whose joint a contact has replaced.
    pub fn touching(&self) -> impl Iterator<Item = [u32; 2]> {
        let loose = self.patches.iter().filter(|patch| patch.bond.is_none());
        let loose = loose.map(|patch| patch.blocks);
        loose.chain(self.ended.iter().map(|ended| ended.blocks))
    }

    /// True if all contacts are between bodies that were beside each other at rest.
    pub fn are_of_neighbours(&self, blocks: &[ContactBlock]) -> bool {
        let loose = self.patches.iter().filter(|patch| patch.bond.is_none());
        loose.map(|patch| patch.blocks.map(|block| block as usize)).all(|[a, b]| {
            blocks[a].distance(&blocks[b]) <= NEIGHBOURS * (blocks[a].size + blocks[b].size)
        })
    }

    /// Index of the patch of two blocks, or its insertion point.
    pub fn patch_index(&self, blocks: [u32; 2]) -> Result<usize, usize> {
        self.patches.binary_search_by_key(&blocks, |patch| patch.blocks)
    }

    /// Adds patches and drops those without points.
    pub fn renew(&mut self, more: Vec<Patch>) {
        let before = self.patches.len();
        self.patches.retain(|patch| !patch.points.is_empty());
        if self.patches.len() == before && more.is_empty() {
            return;
        }
        self.patches.extend(more);
        self.patches.sort_by_key(|patch| patch.blocks);
        self.index();
    }

    /// Gives closed faces of joints that have parted their residual cohesion again, in an equilibrium.
    pub fn regain_cohesion(&mut self) {
        for patch in self.patches.iter_mut().filter(|patch| patch.bond.is_some()) {
            for point in &mut patch.points {
                let state = &mut point.pair.state;
                state.damage = damage_at_equilibrium(state.damage, state.gap);
            }
        }
    }

    /// Stores the present state of all points as equilibrium if `now`; otherwise clears it.
    pub fn set_equilibrium(&mut self, now: bool) {
        for patch in &mut self.patches {
            patch.points.iter_mut().for_each(|point| point.pair.state.equilibrium = None);
            if now {
                patch.set_equilibrium();
            }
        }
    }

    /// Removes all patches except joints, because blocks have been repositioned.
    pub fn clear_contacts(&mut self) {
        self.patches.retain(|patch| patch.bond.is_some());
        self.near.clear();
        self.near_is_complete = false;
        self.index();
    }

    /// Energy in the springs of the wanted patches `[J]`.
    pub fn stored(&self, wanted: impl Fn(&Patch) -> bool) -> f64 {
        sum(self.patches.iter().filter(|patch| wanted(patch)).map(Patch::stored))
    }

    /// Energy that points have given in excess of what they took `[J]`: sum of the
    /// energy deficits, at most 0.
    pub fn energy_deficit(&self) -> f64 {
        sum(self.patches.iter().flat_map(Patch::pairs).map(JointPoint::energy_deficit))
    }

    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        let points: usize = self.patches.iter().map(|patch| patch.points.len()).sum();
        // Joints share their fixed pairs with the model.
        let loose = self.patches.iter().filter(|patch| patch.bond.is_none());
        let fixed: usize = loose.map(|patch| patch.fixed.len()).sum();
        points * size_of::<ContactPoint>()
            + fixed * size_of::<FixedPair>()
            + self.patches.len() * size_of::<Patch>()
            + 4 * (self.entries.len() + self.bodies.len())
            + self.has_contacts.len()
            + self.joint_forces.bytes()
            + size_of_val(&self.near[..])
            + size_of_val(&self.travel[..])
            + self.joints.len() * (size_of::<[JointStatus; 3]>() + 4)
    }
}

impl Clone for Contacts {
    fn clone(&self) -> Self {
        let mut contacts = Self::default();
        contacts.clone_from(self);
        contacts
    }

    /// Reuses the memory of the target.
    fn clone_from(&mut self, from: &Self) {
        self.patches.clone_from(&from.patches);
        self.near.clone_from(&from.near);
        self.travel.clone_from(&from.travel);
        self.joints.clone_from(&from.joints);
        self.starts.clone_from(&from.starts);
        self.entries.clone_from(&from.entries);
        self.has_contacts.clone_from(&from.has_contacts);
        self.ended.clone_from(&from.ended);
        self.bodies.clone_from(&from.bodies);
        self.bond_groups.clone_from(&from.bond_groups);
        self.joint_forces.clone_from(&from.joint_forces);
        (self.near_is_complete, self.deepest) = (from.near_is_complete, from.deepest);
    }
}

impl Clone for Patch {
    fn clone(&self) -> Self {
        Self { points: self.points.clone(), fixed: self.fixed.clone(), ..*self }
    }

    /// Reuses the memory of the target.
    fn clone_from(&mut self, from: &Self) {
        let mut points = std::mem::take(&mut self.points);
        points.clone_from(&from.points);
        *self = Self { points, fixed: from.fixed.clone(), ..*from };
    }
}

impl ContactPoint {
    /// Geometric penetration `[m]`, with or without pressure.
    fn depth(&self) -> f64 {
        -(self.pair.state.gap + self.pair.state.applied_dilation)
    }
}
