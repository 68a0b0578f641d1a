//! §9: contact between blocks that no joint holds together.
//!
//! Where two blocks come near each other they get a [`Patch`]: the faces that meet, as separating axes
//! say, and pairs of points that face each other, one for each node or vertex of the part where the
//! faces overlap, with the area that it stands for. Between the two points of a pair acts what acts in
//! a failed joint: springs with friction. Pairs are made anew when the blocks have moved against each
//! other by a small part of an element; then friction goes over to the nearest new pair. So a contact
//! is a joint that follows, and the areas of its points change with the overlap without a jump.
//!
//! | file | what |
//! |---|---|
//! | `patch_index` | where blocks are, points fixed to their faces |
//! | `surfaces` | stiffness and friction of two faces |
//! | `friction` | the strength that laws of joints leave to faces |
//! | `search` | which blocks are near each other, and which of these are left to their joints |
//! | `fit`, `side` | the pairs of points of a patch, on faces and edges |
//! | `history` | what old points hand on to new ones |
//! | `act` | what they exert |
//! | `bond` | the same of a joint between faces that do not match |
//! | `bound` | how stiff contacts can make a model |
//! | `doubts` | contacts that are perhaps not meant |
//! | `contact_model` | what is fixed about contacts |
//! | `release` | from a joint that has moved to a contact |

mod bond;
mod bound;
mod configuration;
mod contact_model;
mod forces;
mod friction;
mod history;
mod patch_builder;
mod release;
mod search;
mod side;
mod surfaces;
mod warnings;

use nalgebra::{Matrix3, Vector3};

use super::point::JointPoint;
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::law::Traction;
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::{SurfacePoint, Vec3};

pub use bound::{AddedStiffness, bound, outer};
pub use configuration::{Configuration, ContactBlock};
pub use release::{JointLookup, JointStatus};
pub use search::{NearPair, SearchContext, find, release_due_joints};
pub use warnings::ContactWarning;

pub use bond::{Bond, BondedPatch, ReleasedJoint, at_nodes, bonded_patches};
pub use contact_model::ContactModel;
use forces::update;
use release::release;
use serde::{Deserialize, Serialize};
pub use surfaces::{CombinedSurface, ContactSurfaces};

/// Part of an element by which two blocks move against each other before their patch is made anew,
/// and the distance at which they get one.
const REACH: f64 = 0.02;
/// Two points that face each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactPoint {
    /// On blocks a and b.
    pub spots: [SurfacePoint; 2],
    /// The springs between the two.
    pub pair: JointPoint,
    /// Way that it has slid since the blocks met, or it took the place of a joint `[m]`.
    pub slid: f64,
}

/// Two blocks that are near each other.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Patch {
    /// a and b, the lower number first.
    pub blocks: [u32; 2],
    /// Numbers of the faces of a and b that the points are on.
    pub faces: [u8; 2],
    /// Reference block, 0 or 1: the normal turns with it.
    pub reference: u8,
    /// Motion after which the points are made anew `[m]`.
    pub limit: f32,
    /// Unit normal from a to b, and a tangent, in the reference block's frame at rest.
    pub axes: [Vec3; 2],
    /// Axes in space.
    pub now: [Vec3; 2],
    /// Axes in the other block's frame, when the points were made.
    pub seen: [Vector3<f32>; 2],
    /// From the centre of a to that of b in the reference block's frame, then `[m]`.
    pub apart: Vec3,
    /// Stiffness and friction of the two faces.
    pub both: CombinedSurface,
    /// None: the patch is of no more use.
    pub points: Box<[ContactPoint]>,
    /// The joint that the points are of, if they are.
    pub bond: Option<Bond>,
    /// Couple on the reference block, with which the axes turn: it balances the forces of two points at
    /// a distance, and does the work of turning them `[N m]`.
    pub couple: Vec3,
    /// Energy that new points held less than those before, and may hold again `[J]`.
    pub energy_reserve: f64,
    /// The points have been made anew at the present positions: they have not moved since.
    pub(super) renewed: bool,
}

/// All patches, the blocks that may get one, and how far joints have moved.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Contacts {
    /// Patches, sorted by their blocks.
    pub patches: Vec<Patch>,
    /// Pairs of blocks without a patch that are not far from each other, sorted.
    pub near: Vec<NearPair>,
    /// True if the list of near pairs is complete.
    pub known: bool,
    /// Upper bound of the distance that the blocks of each pack have travelled since the boxes were sorted
    /// `[m]`.
    pub travel: Vec<Lanes>,
    /// Of the joint at the upper side of each block along each direction.
    pub joints: Vec<[JointStatus; 3]>,
    /// Joints between faces that do not match that have become contacts, sorted by their blocks.
    pub ended: Vec<ReleasedJoint>,
    /// Largest penetration `[m]`.
    pub deepest: f64,
    /// Patches of each block: places in `entries`, shape `(blocks + 1)`.
    #[serde(skip)]
    starts: Vec<u32>,
    /// Twice the patch, plus one for block b.
    #[serde(skip)]
    entries: Vec<u32>,
}

impl Contacts {
    /// None, for a number of blocks in packs.
    pub fn new(blocks: usize, packs: usize) -> Self {
        let joints = vec![[JointStatus::default(); 3]; blocks];
        let mut contacts = Self { joints, travel: vec![Lanes::ZERO; packs], ..Self::default() };
        contacts.index();
        contacts
    }

    /// Patches of a block, and which of its two blocks, 0 or 1, it is.
    #[inline]
    pub fn of(&self, block: usize) -> impl Iterator<Item = (&Patch, usize)> {
        let (from, to) = match self.starts.get(block..block + 2) {
            Some(&[from, to]) => (from as usize, to as usize),
            _ => (0, 0),
        };
        let entries = self.entries[from..to].iter();
        entries.map(|&entry| (&self.patches[entry as usize / 2], entry as usize % 2))
    }

    /// The patch of a joint of two blocks whose faces do not match, as long as it holds them.
    pub fn held(&self, blocks: [u32; 2]) -> Option<(&Patch, Bond)> {
        let patch = &self.patches[self.patch_index(blocks).ok()?];
        Some((patch, patch.bond?))
    }

    /// A joint of two blocks whose faces do not match, once a contact has taken its place.
    pub fn ended(&self, blocks: [u32; 2]) -> Option<&ReleasedJoint> {
        let at = self.ended.binary_search_by_key(&blocks, |ended| ended.blocks).ok()?;
        Some(&self.ended[at])
    }

    /// All joints between faces that do not match, with their blocks.
    pub fn bonds_mut(&mut self) -> impl Iterator<Item = ([u32; 2], &mut Bond)> {
        let Self { patches, ended, .. } = self;
        let held = patches.iter_mut().filter_map(|p| Some((p.blocks, p.bond.as_mut()?)));
        held.chain(ended.iter_mut().map(|ended| (ended.blocks, &mut ended.bond)))
    }

    /// Takes in joints that have ended.
    pub fn take_in_released(&mut self, ended: impl IntoIterator<Item = ReleasedJoint>) {
        self.ended.extend(ended);
        self.ended.sort_by_key(|ended| ended.blocks);
    }

    /// Place of the patch of two blocks, or where it would be.
    pub fn patch_index(&self, blocks: [u32; 2]) -> Result<usize, usize> {
        self.patches.binary_search_by_key(&blocks, |patch| patch.blocks)
    }

    /// Adds patches, and drops those without points.
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

    /// Takes the present state of all points for an equilibrium, or forgets the last one.
    pub fn set_equilibrium(&mut self, now: bool) {
        for patch in &mut self.patches {
            patch.points.iter_mut().for_each(|point| point.pair.state.equilibrium = None);
            if now {
                patch.set_equilibrium();
            }
        }
    }

    /// Forgets all patches but joints: blocks have been put elsewhere.
    pub fn clear_contacts(&mut self) {
        self.patches.retain(|patch| patch.bond.is_some());
        self.near.clear();
        self.known = false;
        self.index();
    }

    /// Finds the patches of each block.
    pub fn index(&mut self) {
        let blocks = self.joints.len();
        let mut counts = vec![0_u32; blocks + 1];
        let each = || {
            let patches = self.patches.iter().enumerate();
            patches.flat_map(|(i, patch)| [0, 1].map(|side| (i, side, patch.blocks[side] as usize)))
        };
        each().for_each(|(_, _, block)| counts[block + 1] += 1);
        for block in 0..blocks {
            counts[block + 1] += counts[block];
        }
        let mut next = counts.clone();
        let mut entries = vec![0; 2 * self.patches.len()];
        for (patch, side, block) in each() {
            entries[next[block] as usize] = (2 * patch + side) as u32;
            next[block] += 1;
        }
        (self.starts, self.entries) = (counts, entries);
    }

    /// Energy in all springs `[J]`.
    pub fn stored(&self) -> f64 {
        sum(self.patches.iter().map(Patch::stored))
    }

    /// Energy that points have given and not taken: the accounts below nothing `[J]`.
    pub fn debt(&self) -> f64 {
        sum(self.patches.iter().flat_map(Patch::pairs).map(JointPoint::debt))
    }

    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        let points: usize = self.patches.iter().map(|patch| patch.points.len()).sum();
        points * size_of::<ContactPoint>()
            + self.patches.len() * (size_of::<Patch>() + 8)
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

    /// Into the memory that is there.
    fn clone_from(&mut self, from: &Self) {
        self.patches.clone_from(&from.patches);
        self.near.clone_from(&from.near);
        self.travel.clone_from(&from.travel);
        self.joints.clone_from(&from.joints);
        self.starts.clone_from(&from.starts);
        self.entries.clone_from(&from.entries);
        self.ended.clone_from(&from.ended);
        (self.known, self.deepest) = (from.known, from.deepest);
    }
}

impl Clone for Patch {
    fn clone(&self) -> Self {
        Self { points: self.points.clone(), ..*self }
    }

    /// Into the memory that is there.
    fn clone_from(&mut self, from: &Self) {
        let mut points = std::mem::take(&mut self.points);
        points.clone_from(&from.points);
        *self = Self { points, ..*from };
    }
}

impl ContactPoint {
    /// Penetration, whether pressed or not `[m]`.
    fn depth(&self) -> f64 {
        -(self.pair.state.gap + self.pair.state.lifted)
    }
}

impl Patch {
    /// Energy in the springs, and what is in the bank `[J]`.
    fn stored(&self) -> f64 {
        let [normal, shear] = self.held(&[]);
        normal + shear + self.reserve()
    }

    /// Shortest edge of an element `[m]`.
    fn spacing(&self, configuration: &Configuration<'_>) -> f64 {
        let [a, b] = self.blocks.map(|block| configuration.blocks[block as usize].spacing);
        a.min(b)
    }

    /// Largest penetration of its points `[m]`.
    pub fn depth(&self) -> f64 {
        self.points.iter().map(ContactPoint::depth).fold(0.0, f64::max)
    }

    /// Pairs of points.
    pub(super) fn pairs(&self) -> impl Iterator<Item = &JointPoint> {
        self.points.iter().map(|point| &point.pair)
    }

    /// True where a point exerts anything.
    #[inline]
    pub fn acts(&self, point: &ContactPoint) -> bool {
        let state = &point.pair.state;
        state.gap <= 0.0 || state.drag != [0.0; 2] || self.bond.is_some()
    }

    /// Force of a point on block a `[N]`.
    #[inline(always)]
    pub fn force(&self, point: &ContactPoint) -> Vec3 {
        let [normal, along] = &self.now;
        let Traction { normal: press, shear } = point.pair.state.total_traction();
        let across = normal.cross(along);
        (normal * press + along * shear.x + across * shear.y) * point.pair.area
    }

    /// Area of all points `[m²]`.
    fn area(&self) -> f64 {
        self.pairs().map(|pair| pair.area).sum()
    }

    /// Faces of a and b that the points are on.
    #[inline(always)]
    pub fn faces(&self) -> [FaceId; 2] {
        self.faces.map(FaceId::from_number)
    }

    /// The block that the normal turns with, and the other.
    pub(super) fn order(&self) -> [usize; 2] {
        let [a, b] = self.blocks.map(|block| block as usize);
        if self.reference == 0 { [a, b] } else { [b, a] }
    }

    /// Turns the axes with the reference block.
    fn turn(&mut self, configuration: &Configuration<'_>) {
        self.now = self.present_axes(configuration);
    }

    fn present_axes(&self, configuration: &Configuration<'_>) -> [Vec3; 2] {
        let rotation = configuration.rotation(self.order()[0]);
        self.axes.map(|axis| rotation * axis)
    }

    /// Columns: the normal and two tangents, in space, where the axes were turned last.
    pub fn frame(&self) -> Matrix3<f64> {
        columns(self.now)
    }

    /// Columns of the axes in the present configuration.
    fn present_frame(&self, configuration: &Configuration<'_>) -> Matrix3<f64> {
        columns(self.present_axes(configuration))
    }
}

fn columns([normal, along]: [Vec3; 2]) -> Matrix3<f64> {
    Matrix3::from_columns(&[normal, along, normal.cross(&along)])
}
