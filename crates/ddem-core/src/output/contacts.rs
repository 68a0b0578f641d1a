//! Public view of contacts: [`Contact`], and the table [`CONTACT_FIELDS`] for writers and bindings.

use rayon::prelude::*;

use super::{FieldKind, Snapshot};
use crate::model::Model;
use ddem_joint::contact::{Configuration, ContactPoint, Patch};

/// Fraction of the friction limit from which a contact counts as sliding; it allows for rounding.
const SLIDING: f64 = 1.0 - 1e-9;

/// Pair of points of two blocks that press on each other (§9). The force acts on block a at
/// `position`, and its opposite on block b at the same point. Forces and moments balance to
/// rounding. (In small kinematics the moments of deformable blocks are only as exact as
/// displacements are small.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Blocks a and b, the lower number first.
    pub blocks: [usize; 2],
    /// Present point of action `[m]`.
    pub position: [f64; 3],
    /// Unit normal, from a to b.
    pub normal: [f64; 3],
    /// Force on block a `[N]`: `F = A T` of springs, friction and dashpot. Its component along the
    /// normal is negative: pressure.
    pub force: [f64; 3],
    /// Area of the pair of points `[m²]`.
    pub area: f64,
    /// Distance between the two faces along the normal, less half the joint thickness of each face
    /// `[m]`. It is negative where they overlap.
    pub gap: f64,
    /// Length of the slip path since the blocks met, or since the contact replaced their joint,
    /// without the elastic part `[m]`. Earlier slip was the field `slip` of the joint's pairs,
    /// which is 0 from then on (`released`).
    pub slip: f64,
    /// True if friction is fully mobilised; never true without friction.
    pub sliding: bool,
}

impl Contact {
    /// Traction on block a `[Pa]`, tension along the normal positive: `T = F/A`.
    #[must_use]
    pub fn traction(&self) -> [f64; 3] {
        self.force.map(|f| f / self.area)
    }
}

/// One output field of contacts.
#[derive(Clone, Copy, Debug)]
pub struct ContactField {
    /// Name in files and bindings.
    pub name: &'static str,
    /// Unit, "1" for a plain number.
    pub unit: &'static str,
    /// Numbers per contact.
    pub components: usize,
    /// Kind of the numbers.
    pub kind: FieldKind,
    /// Numbers of one contact; those beyond its components are 0.
    of: fn(&Contact) -> [f64; 3],
}

/// All output fields of contacts except their positions.
pub const CONTACT_FIELDS: [ContactField; 8] = [
    ContactField::new("force", "N", 3, |c| c.force),
    ContactField::new("traction", "Pa", 3, Contact::traction),
    ContactField::new("normal", "1", 3, |c| c.normal),
    ContactField::new("area", "m2", 1, |c| [c.area, 0.0, 0.0]),
    ContactField::new("gap", "m", 1, |c| [c.gap, 0.0, 0.0]),
    ContactField::new("slip", "m", 1, |c| [c.slip, 0.0, 0.0]),
    ContactField::new("sliding", "1", 1, sliding).kind(FieldKind::Flag),
    ContactField::new("blocks", "1", 2, blocks).kind(FieldKind::Integer),
];

fn sliding(contact: &Contact) -> [f64; 3] {
    [f64::from(u8::from(contact.sliding)), 0.0, 0.0]
}

fn blocks(contact: &Contact) -> [f64; 3] {
    [contact.blocks[0] as f64, contact.blocks[1] as f64, 0.0]
}

impl ContactField {
    const fn new(
        name: &'static str,
        unit: &'static str,
        components: usize,
        of: fn(&Contact) -> [f64; 3],
    ) -> Self {
        Self { name, unit, components, kind: FieldKind::Real, of }
    }

    const fn kind(self, kind: FieldKind) -> Self {
        Self { kind, ..self }
    }

    /// Writes the numbers of contacts, one contact after another.
    pub fn fill(&self, contacts: &[Contact], out: &mut [f64]) {
        for (contact, out) in contacts.iter().zip(out.chunks_exact_mut(self.components)) {
            out.copy_from_slice(&(self.of)(contact)[..self.components]);
        }
    }
}

/// Numbers of contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactCounts {
    /// Pairs of blocks whose faces or edges are near enough to have contact points (§9).
    pub near: usize,
    /// Pairs of blocks that press on each other.
    pub block_pairs: usize,
    /// Pairs of contact points that press on each other.
    pub points: usize,
    /// Largest penetration `[m]`.
    pub deepest: f64,
}

/// True if a patch is a contact. Patches of nonconforming joints belong to the pairs.
fn is_contact(patch: &Patch) -> bool {
    patch.bond.is_none()
}

/// True if a point carries force. Points whose faces have just parted may carry the traction of the
/// energy correction.
fn carries_force(point: &ContactPoint) -> bool {
    point.pair.state.gap < 0.0 || point.pair.state.added_tractions != [0.0; 2]
}

impl Snapshot<'_> {
    /// Implements [`Simulation::contacts`](crate::Simulation::contacts).
    pub(crate) fn contacts(&self) -> Vec<Contact> {
        let Some(surfaces) = &self.model.contact else { return Vec::new() };
        let configuration = Configuration {
            blocks: &surfaces.blocks,
            u: &self.state.u,
            frames: &self.scratch.frames,
            small: !self.model.corotational(),
            last: (&self.state.v, 0.0),
            start: true,
            poses: &self.state.poses,
        };
        let patches =
            self.scratch.measured_contacts.patches.par_iter().filter(|patch| is_contact(patch));
        patches.flat_map_iter(|patch| patch_contacts(patch, &configuration, self.model)).collect()
    }

    /// Implements [`Simulation::contact_counts`](crate::Simulation::contact_counts).
    pub(crate) fn contact_counts(&self) -> ContactCounts {
        let patches = &self.scratch.measured_contacts.patches;
        let mut counts = ContactCounts::default();
        for patch in patches.iter().filter(|patch| is_contact(patch)) {
            counts.near += usize::from(!patch.points.is_empty());
            let points = patch.points.iter().filter(|point| carries_force(point)).count();
            counts.block_pairs += usize::from(points > 0);
            counts.points += points;
            counts.deepest = counts.deepest.max(patch.depth());
        }
        counts
    }

    /// Implements [`Simulation::touching_blocks`](crate::Simulation::touching_blocks).
    pub(crate) fn touching_blocks(&self) -> usize {
        let presses = |patch: &&Patch| is_contact(patch) && patch.points.iter().any(carries_force);
        self.state.contacts.patches.iter().filter(presses).count()
    }

    /// Implements [`Simulation::contact_points`](crate::Simulation::contact_points).
    pub(crate) fn contact_points(&self) -> [usize; 2] {
        let patches = &self.state.contacts.patches;
        let points = || patches.iter().filter(|p| is_contact(p)).flat_map(|patch| &patch.points);
        [points().count(), points().filter(|point| carries_force(point)).count()]
    }
}

/// Contacts at the points of a patch that carry force.
fn patch_contacts(
    patch: &Patch,
    configuration: &Configuration<'_>,
    model: &Model,
) -> impl Iterator<Item = Contact> {
    let normal = patch.axes_now[0];
    let blocks = patch.blocks.map(|block| model.whole_block(block as usize));
    patch.points.iter().filter(|point| carries_force(point)).map(move |point| {
        let at = [0, 1].map(|side| configuration.position(patch.blocks[side], &point.points[side]));
        let springs = point.pair.state.traction;
        let limit = patch.surface.friction.strength(&model.laws, springs.normal);
        Contact {
            blocks,
            // The couple of the two points acts on the reference block. At the point of the other
            // block the force alone has the same moment.
            position: at[1 - usize::from(patch.reference)].into(),
            normal: normal.into(),
            force: patch.force(point).into(),
            area: point.pair.area,
            gap: normal.dot(&(at[1] - at[0])) - patch.surface.thickness,
            slip: point.slip_path,
            sliding: limit > 0.0 && springs.shear.norm() >= SLIDING * limit,
        }
    })
}
