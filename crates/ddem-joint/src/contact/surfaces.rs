//! Contact properties of block faces: each face carries half of its joint, and two faces in contact act in series.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::friction::{FaceFriction, Friction};
use super::{Contacts, Patch};
use ddem_mechanics::collide::{EdgeId, FaceId};
use ddem_mechanics::law::{Laws, SpringStiffness};
use ddem_mesh::joint_sections::VibratingMass;
use ddem_mesh::properties::{JointProperties, Properties};
use ddem_mesh::{Geometry, NonconformingFace};

/// Friction angle where neither the deck nor a joint says one `[degrees]`.
const FRICTION: f64 = 30.0;

/// One face of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContactSurface {
    /// Half of the joint's thickness `[m]`.
    pub(super) thickness: f64,
    /// Stiffness of this half `[Pa/m]`.
    pub(super) stiffness: SpringStiffness,
    /// Friction that failure leaves, if the joint has a law.
    friction: Option<FaceFriction>,
    /// Mass that a contact moves, for each unit of area.
    moved: VibratingMass,
    /// Of the block `[kg/m³]`.
    density: f64,
    /// Stiffness of the joint, if there is one `[Pa/m]`.
    joint: Option<SpringStiffness>,
    /// The joint is one between faces that do not match: no lattice has it.
    nonconforming: bool,
}

/// Combined properties of two faces in contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CombinedSurface {
    /// Distance of the bodies at which they touch `[m]`.
    pub surface: f64,
    /// Stiffness of both in series `[Pa/m]`.
    pub stiffness: SpringStiffness,
    /// Friction of the weaker one.
    pub friction: Friction,
    /// Of the dashpot along the normal `[Pa s/m]`.
    pub dashpot: f64,
}

/// The skins of all blocks.
#[derive(Clone, Debug)]
pub struct ContactSurfaces {
    kinds: Vec<ContactSurface>,
    /// By block and face, twice the direction plus one at the upper side.
    of_block: Vec<[u32; 6]>,
    /// Given for all contacts.
    normal: Option<f64>,
    shear: Option<f64>,
    tan_friction: Option<f64>,
    /// Of faces to which neither the deck nor a joint gives any.
    tan_default: f64,
    /// Part of the way of strengths from others before.
    part: f64,
    damping: f64,
    /// Largest thickness `[m]`.
    pub(super) thickest: f64,
    /// Largest stiffnesses of a face `[Pa/m]`.
    hardest: SpringStiffness,
}

impl ContactSurfaces {
    /// Of all faces, from their joints and materials.
    pub fn new(properties: &Properties, laws: &Laws, geometry: &Geometry) -> Self {
        let contact = &properties.contact;
        let mut surfaces = Self {
            kinds: Vec::new(),
            of_block: Vec::with_capacity(geometry.blocks.len()),
            normal: contact.normal_stiffness,
            shear: contact.shear_stiffness,
            tan_friction: contact.tan_friction,
            tan_default: libm::tan(FRICTION.to_radians()),
            part: 1.0,
            damping: contact.damping_ratio(),
            thickest: 0.0,
            hardest: SpringStiffness { normal: 0.0, shear: 0.0 },
        };
        let mut known: HashMap<[u64; 10], u32> = HashMap::new();
        for block in 0..geometry.blocks.len() {
            let faces = std::array::from_fn(|face| {
                let nonconforming = geometry.nonconforming(block, face as u8);
                let surface =
                    ContactSurface::new(properties, laws, geometry, block, face, nonconforming);
                surfaces.thickest = surfaces.thickest.max(surface.thickness);
                let SpringStiffness { normal, shear } = surface.stiffness;
                surfaces.hardest.normal = surfaces.hardest.normal.max(normal);
                surfaces.hardest.shear = surfaces.hardest.shear.max(shear);
                *known.entry(surface.key()).or_insert_with(|| {
                    surfaces.kinds.push(surface);
                    surfaces.kinds.len() as u32 - 1
                })
            });
            surfaces.of_block.push(faces);
        }
        surfaces
    }

    /// Divides the friction that no joint gives.
    pub fn divide_friction(&mut self, factor: f64) {
        self.tan_friction = self.tan_friction.map(|tan| tan / factor);
        self.tan_default /= factor;
    }

    /// Of faces whose friction is a part of the way from that of `before`.
    pub fn between(
        properties: &Properties,
        laws: &Laws,
        now: &Geometry,
        before: &Geometry,
        part: f64,
    ) -> Self {
        let [mut surfaces, old] =
            [now, before].map(|geometry| Self::new(properties, laws, geometry));
        if part >= 1.0 {
            return surfaces;
        }
        let mut kinds = Vec::new();
        for (of_block, old_block) in surfaces.of_block.iter_mut().zip(&old.of_block) {
            for (kind, old_kind) in of_block.iter_mut().zip(old_block) {
                let (mut surface, old) =
                    (surfaces.kinds[*kind as usize], old.kinds[*old_kind as usize]);
                if let Some((new, old)) = surface.friction.as_mut().zip(old.friction) {
                    *new = new.after(old, part);
                }
                let known = kinds.iter().position(|known| *known == surface);
                *kind = known.unwrap_or(kinds.len()) as u32;
                if known.is_none() {
                    kinds.push(surface);
                }
            }
        }
        (surfaces.kinds, surfaces.part) = (kinds, part);
        surfaces
    }

    pub(super) fn of(&self, block: u32, face: FaceId) -> &ContactSurface {
        &self.kinds[self.of_block[block as usize][usize::from(face.number())] as usize]
    }

    /// Of an edge: the mean of the two faces beside it.
    pub(super) fn of_edge(&self, block: u32, edge: EdgeId) -> ContactSurface {
        let [a, b] = sides_of(edge).map(|face| *self.of(block, face));
        let mean = |of: fn(&ContactSurface) -> f64| 0.5 * (of(&a) + of(&b));
        ContactSurface {
            thickness: mean(|surface| surface.thickness),
            stiffness: SpringStiffness {
                normal: mean(|surface| surface.stiffness.normal),
                shear: mean(|surface| surface.stiffness.shear),
            },
            friction: match (a.friction, b.friction) {
                (Some(a), Some(b)) => Some(a.mean(b)),
                (a, b) => a.or(b),
            },
            moved: VibratingMass::mean(a.moved, b.moved),
            density: mean(|surface| surface.density),
            joint: None,
            nonconforming: false,
        }
    }

    /// The surfaces without the given contact stiffness along the normal (0) or across (1).
    pub(super) fn without(&self, direction: usize) -> Self {
        let mut without = self.clone();
        *[&mut without.normal, &mut without.shear][direction] = None;
        without
    }

    /// Least and largest stiffness of contacts of two equal faces, along the normal (0) or across (1).
    pub(super) fn range(&self, direction: usize) -> [f64; 2] {
        let each = self.kinds.iter().map(|kind| {
            let SpringStiffness { normal, shear } = self.combined([kind; 2], [false; 2]).stiffness;
            [normal, shear][direction]
        });
        each.fold([f64::INFINITY, 0.0], |[least, most], k| [k.min(least), k.max(most)])
    }

    /// The part of its edge by which a block sinks in under its own weight, where that is much, with its
    /// density and the stiffness: `ρ g h / k` of its height h.
    pub(super) fn settlement(&self, gravity: f64, much: f64) -> Option<[f64; 3]> {
        let each = self.kinds.iter().map(|kind| {
            let stiffness = self.combined([kind; 2], [false; 2]).stiffness.normal;
            [kind.density * gravity / stiffness, kind.density, stiffness]
        });
        each.max_by(|a, b| a[0].total_cmp(&b[0])).filter(|worst| worst[0] > much)
    }

    /// Stiffness of a contact of a face with the stiffest that there is `[Pa/m]`.
    fn largest_stiffness(&self, surface: &ContactSurface) -> SpringStiffness {
        let series = |a: f64, b: f64| a * b / (a + b);
        let SpringStiffness { normal, shear } = surface.stiffness;
        SpringStiffness {
            normal: self.normal.unwrap_or_else(|| series(normal, self.hardest.normal)),
            shear: self.shear.unwrap_or_else(|| series(shear, self.hardest.shear)),
        }
    }

    /// Stiffness of a contact or of the joint of a face, whichever is larger `[Pa/m]`.
    pub fn largest_with_joint(&self, block: u32, face: FaceId) -> SpringStiffness {
        let surface = self.of(block, face);
        let SpringStiffness { normal, shear } = self.largest_stiffness(surface);
        let joint = surface.joint.unwrap_or(SpringStiffness { normal: 0.0, shear: 0.0 });
        SpringStiffness { normal: normal.max(joint.normal), shear: shear.max(joint.shear) }
    }

    /// Excess of a face's contact stiffness over its joint's `[Pa/m]`, as the contact takes the joint's
    /// place.
    pub(super) fn excess_over_joint(&self, block: u32, face: FaceId) -> SpringStiffness {
        let surface = self.of(block, face);
        let SpringStiffness { normal, shear } = self.largest_stiffness(surface);
        if surface.nonconforming {
            return self.largest_with_joint(block, face);
        }
        let joint = surface.joint.unwrap_or(SpringStiffness { normal: 0.0, shear: 0.0 });
        SpringStiffness {
            normal: (normal - joint.normal).max(0.0),
            shear: (shear - joint.shear).max(0.0),
        }
    }

    /// Mass on a contact or joint of a stiffness at a face, in parts of that of the layer of nodes there.
    pub(super) fn moved(&self, block: u32, face: FaceId, stiffness: f64) -> f64 {
        let moved = &self.of(block, face).moved;
        moved.mass(stiffness) / moved.layer()
    }

    /// Largest thickness of the skins of a block `[m]`.
    pub(super) fn thickness(&self, block: u32) -> f64 {
        let kinds = self.of_block[block as usize].iter();
        kinds.map(|&kind| self.kinds[kind as usize].thickness).fold(0.0, f64::max)
    }

    pub(super) fn density(&self, block: u32, face: FaceId) -> f64 {
        self.of(block, face).density
    }

    /// Of two faces in contact; a body that is held does not move however heavy the other is.
    pub(super) fn combined(
        &self,
        [a, b]: [&ContactSurface; 2],
        held: [bool; 2],
    ) -> CombinedSurface {
        let series = |a: f64, b: f64| a * b / (a + b);
        let normal = series(a.stiffness.normal, b.stiffness.normal);
        let shear = series(a.stiffness.shear, b.stiffness.shear);
        let normal = self.normal.unwrap_or(normal);
        let given = self.tan_friction.map(Friction::Angle);
        let friction = given.or_else(|| Friction::of([a.friction, b.friction], self.part));
        let [of_a, of_b] = [a, b].map(|surface| surface.moved.mass(normal));
        let mass = match held {
            [true, false] => of_b,
            [false, true] => of_a,
            _ => series(of_a, of_b),
        };
        CombinedSurface {
            surface: a.thickness + b.thickness,
            stiffness: SpringStiffness { normal, shear: self.shear.unwrap_or(shear) },
            friction: friction.unwrap_or(Friction::Angle(self.tan_default)),
            dashpot: self.dashpot(normal, mass),
        }
    }
}

impl ContactSurfaces {
    /// Dashpot of a normal stiffness `[Pa/m]` and a mass for each unit of area `[Pa s/m]`.
    fn dashpot(&self, normal: f64, mass: f64) -> f64 {
        2.0 * self.damping * (normal * mass).sqrt()
    }

    /// Dashpot of a joint of two faces with a normal stiffness of its own `[Pa s/m]`.
    pub(super) fn dashpot_of_joint(&self, [a, b]: [&ContactSurface; 2], normal: f64) -> f64 {
        let [a, b] = [a, b].map(|surface| surface.moved.mass(normal));
        self.dashpot(normal, a * b / (a + b))
    }
}

impl Contacts {
    /// Supports have come or gone on some blocks: their contacts are made anew, as dashpots have another
    /// mass now.
    pub fn remake_where_supports_changed(&mut self, changed: impl Fn(usize) -> bool) {
        let damped = |patch: &Patch| patch.both.dashpot > 0.0;
        self.remake(|patch| damped(patch) && patch.blocks.iter().any(|&b| changed(b as usize)));
    }

    /// Contacts are made anew: as if the blocks had moved by more than they are valid for.
    pub fn remake(&mut self, chosen: impl Fn(&Patch) -> bool) {
        for patch in self.patches.iter_mut().filter(|patch| chosen(patch)) {
            patch.apart.x += 3.0 * f64::from(patch.limit);
        }
    }
}

/// The two faces beside an edge.
pub(super) fn sides_of(edge: EdgeId) -> [FaceId; 2] {
    [0, 1]
        .map(|next| FaceId { direction: (edge.direction + 1 + next) % 3, upper: edge.upper[next] })
}

impl ContactSurface {
    fn new(
        properties: &Properties,
        laws: &Laws,
        geometry: &Geometry,
        block: usize,
        face: usize,
        nonconforming: Option<NonconformingFace>,
    ) -> Self {
        let (d, upper) = (face / 2, face % 2 == 1);
        let elastic = &properties.materials[usize::from(geometry.blocks[block].material)];
        let height = geometry.height(block, d);
        let moved = VibratingMass::new(geometry, block, d, elastic);
        let number = geometry
            .beyond(block, FaceId { direction: d, upper })
            .map(|other| geometry.joint_above(if upper { block } else { other }, d));
        let number =
            nonconforming.map(|nonconforming| nonconforming.joint).or(number).map(usize::from);
        let joint = number.map(|number| &properties.joints[number]);
        let own =
            SpringStiffness { normal: elastic.p_modulus() / height, shear: elastic.shear / height };
        let stiffness = joint.map(JointProperties::stiffness);
        let SpringStiffness { normal, shear } = stiffness.unwrap_or(own);
        // Faces that are nearer than their joint is thick do not overlap.
        let room = nonconforming.map_or(f64::INFINITY, |nonconforming| nonconforming.gap);
        Self {
            thickness: joint.map_or(0.0, |joint| joint.thickness.min(room) / 2.0),
            stiffness: SpringStiffness { normal: 2.0 * normal, shear: 2.0 * shear },
            friction: number.and_then(|number| FaceFriction::new(laws, number)),
            moved,
            density: elastic.density,
            joint: stiffness,
            nonconforming: nonconforming.is_some(),
        }
    }

    fn key(&self) -> [u64; 10] {
        let SpringStiffness { normal, shear } = self.stiffness;
        let [tan, law] = FaceFriction::key(self.friction);
        let nonconforming = if self.nonconforming { 1.0 } else { 0.0 };
        let [layer, whole, impedance] = self.moved.numbers();
        [
            self.thickness,
            normal,
            shear,
            tan,
            law,
            layer,
            whole,
            impedance,
            self.density,
            nonconforming,
        ]
        .map(f64::to_bits)
    }
}
