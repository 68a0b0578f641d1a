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
//! | `place` | where blocks are, points fixed to their faces |
//! | `skins` | stiffness and friction of two faces |
//! | `search` | which blocks are near each other, and which of these are left to their joints |
//! | `fit`, `side` | the pairs of points of a patch, on faces and edges |
//! | `heirs` | what old points hand on to new ones |
//! | `act` | what they exert |
//! | `bound` | how stiff contacts can make a model |
//! | `doubts` | contacts that are perhaps not meant |
//! | `release` | from a joint that has moved to a contact |

mod act;
mod bound;
mod doubts;
mod fit;
mod heirs;
mod place;
mod release;
mod search;
mod side;
mod skins;

use nalgebra::Matrix3;

use crate::deck::{Deck, Joint};
use crate::geometry::{Geometry, Vec3};
use crate::law::response::stored;
use crate::law::{Memory, Stiffness};
use crate::mechanism::is_connected;
use crate::pack::Packs;

pub(crate) use bound::{bound, faces, outer};
pub(crate) use place::{Placed, Placing, Spot};
pub(crate) use release::{Places, Release};
pub(crate) use search::{Ground, Search, find, let_go};

use act::act;
use place::placed;
use release::release;
pub(crate) use skins::{Both, Skins};

/// Part of an element by which two blocks move against each other before their patch is made anew,
/// and the distance at which they get one.
const REACH: f64 = 0.02;

/// The faces of all blocks: what is fixed about contacts.
#[derive(Debug)]
pub(crate) struct Surfaces {
    pub(crate) skins: Skins,
    pub(crate) blocks: Vec<Placed>,
    /// Shortest edge of a block `[m]`.
    pub(crate) shortest: f64,
    /// Blocks may meet before any joint has failed.
    pub(crate) open: bool,
}

impl Surfaces {
    pub(crate) fn new(deck: &Deck, geometry: &Geometry, packs: &Packs) -> Self {
        let edges = (0..geometry.bodies.len()).map(|body| geometry.shortest_edge(body));
        let shortest = edges.fold(f64::INFINITY, f64::min);
        // Blocks that joints connect do not meet before some of these have failed.
        let can_fail = deck.joints.values().any(Joint::breaks);
        let open = !(can_fail && is_connected(geometry));
        Self { skins: Skins::new(deck, geometry), blocks: placed(geometry, packs), shortest, open }
    }
}

/// Two points that face each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Point {
    /// On blocks a and b.
    pub(crate) spots: [Spot; 2],
    /// Area that they stand for `[m²]`.
    pub(crate) area: f64,
    /// Of the springs; the dilation is the distance at which they bear nothing.
    pub(crate) memory: Memory,
    /// Normal traction of the dashpot at the last step `[Pa]`.
    pub(crate) drag: f64,
    /// Force on block a `[N]`, as it was last computed.
    pub(crate) force: Vec3,
}

/// Two blocks that are near each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Patch {
    /// a and b, the lower number first.
    pub(crate) blocks: [u32; 2],
    /// Which of them, 0 or 1, the normal turns with.
    pub(crate) reference: u8,
    /// Unit normal from a to b, and a tangent, in the reference block's frame at rest.
    pub(crate) axes: [Vec3; 2],
    /// The same in the other's frame, when the points were made.
    pub(crate) seen: [Vec3; 2],
    /// From the centre of a to that of b in the reference block's frame, then `[m]`.
    pub(crate) apart: Vec3,
    /// Motion after which the points are made anew `[m]`; 0: the patch is of no more use.
    pub(crate) limit: f64,
    /// Lever of turns `[m]`.
    pub(crate) lever: f64,
    /// Edge of an element `[m]`.
    pub(crate) spacing: f64,
    pub(crate) both: Both,
    pub(crate) points: Vec<Point>,
    /// Couple on the reference block, with which the axes turn: it balances the forces of two points at
    /// a distance, and does the work of turning them `[N m]`.
    pub(crate) couple: Vec3,
    /// What new points held less than those before, and may hold again `[J]`.
    pub(crate) bank: f64,
    /// Energy in the springs, and what is in the bank `[J]`.
    pub(crate) stored: f64,
    /// How far pressed points are in each other `[m]`.
    pub(crate) depth: f64,
}

/// All patches, by their blocks, and how far joints have moved.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Contacts {
    pub(crate) patches: Vec<Patch>,
    /// Of the joint at the upper side of each block along each direction.
    pub(crate) joints: Vec<[Release; 3]>,
    /// Patches of each block: places in `entries`, shape `(blocks + 1)`.
    starts: Vec<u32>,
    /// Twice the patch, plus one for block b.
    entries: Vec<u32>,
}

impl Contacts {
    /// None, for a number of blocks.
    pub(crate) fn new(blocks: usize) -> Self {
        let mut contacts =
            Self { joints: vec![[Release::default(); 3]; blocks], ..Self::default() };
        contacts.index();
        contacts
    }

    /// Patches of a block, and which of its two blocks, 0 or 1, it is.
    pub(crate) fn of(&self, block: usize) -> impl Iterator<Item = (&Patch, usize)> {
        let (from, to) = match self.starts.get(block..block + 2) {
            Some(&[from, to]) => (from as usize, to as usize),
            _ => (0, 0),
        };
        let entries = self.entries[from..to].iter();
        entries.map(|&entry| (&self.patches[entry as usize / 2], entry as usize % 2))
    }

    /// Place of the patch of two blocks, or where it would be.
    pub(crate) fn place(&self, blocks: [u32; 2]) -> Result<usize, usize> {
        self.patches.binary_search_by_key(&blocks, |patch| patch.blocks)
    }

    /// Adds patches, sorts them and drops those without any use.
    pub(crate) fn renew(&mut self, more: Vec<Patch>) {
        let before = self.patches.len();
        self.patches.retain(|patch| patch.limit > 0.0);
        if self.patches.len() == before && more.is_empty() {
            return;
        }
        self.patches.extend(more);
        self.patches.sort_by_key(|patch| patch.blocks);
        self.index();
    }

    /// Forgets all patches: blocks have been put elsewhere.
    pub(crate) fn part(&mut self) {
        self.patches.clear();
        self.index();
    }

    /// Finds the patches of each block.
    pub(crate) fn index(&mut self) {
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
    pub(crate) fn stored(&self) -> f64 {
        self.patches.iter().map(|patch| patch.stored).sum()
    }

    /// Memory in use `[bytes]`.
    pub(crate) fn bytes(&self) -> usize {
        let points: usize = self.patches.iter().map(|patch| patch.points.capacity()).sum();
        points * size_of::<Point>()
            + self.patches.len() * (size_of::<Patch>() + 8)
            + self.joints.len() * (size_of::<[Release; 3]>() + 4)
    }
}

impl Patch {
    /// Energy in the springs by what they remember, and in the bank `[J]`.
    fn energy(&self) -> f64 {
        let [normal, shear] = self.both.stiffness;
        let of = |point: &Point| point.area * stored(Stiffness { normal, shear }, &point.memory);
        self.bank + self.points.iter().map(of).sum::<f64>()
    }

    /// The block that the normal turns with, and the other.
    pub(crate) fn order(&self) -> [usize; 2] {
        let [a, b] = self.blocks.map(|block| block as usize);
        if self.reference == 0 { [a, b] } else { [b, a] }
    }

    /// Columns: the normal and two tangents, in space.
    pub(crate) fn frame(&self, placing: &Placing<'_>) -> Matrix3<f64> {
        let rotation = placing.rotation(self.order()[0]);
        let [normal, along] = self.axes.map(|axis| rotation * axis);
        Matrix3::from_columns(&[normal, along, normal.cross(&along)])
    }
}
