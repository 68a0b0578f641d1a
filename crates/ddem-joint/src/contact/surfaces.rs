//! Contact properties of block faces. Each face has half of its joint; two faces in contact act in
//! series.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::friction::{FaceFriction, Friction};
use super::{Contacts, Patch};
use ddem_mechanics::collide::{EdgeId, FaceId};
use ddem_mechanics::law::{Laws, SpringStiffness};
use ddem_mesh::joint_sections::VibratingMass;
use ddem_mesh::properties::{FRICTION, JointProperties, Properties};
use ddem_mesh::{Geometry, NonconformingFace};

/// Contact properties of one face of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContactSurface {
    /// Half of the joint's thickness `[m]`.
    pub(super) thickness: f64,
    /// Stiffness of this half `[Pa/m]`.
    pub(super) stiffness: SpringStiffness,
    /// Friction after failure, if the joint has a law.
    friction: Option<FaceFriction>,
    /// Mass per unit area that vibrates on a contact.
    vibrating_mass: VibratingMass,
    /// Density of the block `[kg/m³]`.
    density: f64,
    /// Stiffness of the joint, if there is one `[Pa/m]`.
    joint: Option<SpringStiffness>,
    /// True if the joint is nonconforming, so that it belongs to no lattice.
    nonconforming: bool,
}

/// Combined properties of two faces in contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CombinedSurface {
    /// Distance of the faces at which contact begins `[m]`.
    pub thickness: f64,
    /// Stiffness of both in series `[Pa/m]`.
    pub stiffness: SpringStiffness,
    /// Friction of the weaker face.
    pub friction: Friction,
    /// Coefficient of the dashpot along the normal `[Pa s/m]`.
    pub dashpot: f64,
}

/// Contact surfaces of all blocks.
#[derive(Clone, Debug)]
pub struct ContactSurfaces {
    kinds: Vec<ContactSurface>,
    /// Index in `kinds`, by block and face. The face is twice the direction, plus one at the upper
    /// side.
    of_block: Vec<[u32; 6]>,
    /// Normal stiffness given for all contacts `[Pa/m]`.
    normal: Option<f64>,
    shear: Option<f64>,
    tan_friction: Option<f64>,
    /// Tangent of the friction angle if neither the deck nor a joint gives one.
    tan_default: f64,
    /// Fraction of the way from the previous strengths to the present ones.
    fraction: f64,
    damping: f64,
    /// Largest thickness `[m]`.
    pub(super) thickest: f64,
    /// Largest stiffnesses of a face `[Pa/m]`.
    stiffest: SpringStiffness,
}

impl ContactSurfaces {
    /// Surfaces of all faces, from their joints and materials.
    pub fn new(properties: &Properties, laws: &Laws, geometry: &Geometry) -> Self {
        let contact = &properties.contact;
        let mut surfaces = Self {
            kinds: Vec::new(),
            of_block: Vec::with_capacity(geometry.blocks.len()),
            normal: contact.normal_stiffness,
            shear: contact.shear_stiffness,
            tan_friction: contact.tan_friction,
            tan_default: libm::tan(FRICTION.to_radians()),
            fraction: 1.0,
            damping: contact.damping_ratio(),
            thickest: 0.0,
            stiffest: SpringStiffness { normal: 0.0, shear: 0.0 },
        };
        let mut known: HashMap<[u64; 10], u32> = HashMap::new();
        for block in 0..geometry.blocks.len() {
            let faces = std::array::from_fn(|face| {
                let nonconforming = geometry.nonconforming(block, face as u8);
                let surface =
                    ContactSurface::new(properties, laws, geometry, block, face, nonconforming);
                surfaces.thickest = surfaces.thickest.max(surface.thickness);
                let SpringStiffness { normal, shear } = surface.stiffness;
                surfaces.stiffest.normal = surfaces.stiffest.normal.max(normal);
                surfaces.stiffest.shear = surfaces.stiffest.shear.max(shear);
                *known.entry(surface.key()).or_insert_with(|| {
                    surfaces.kinds.push(surface);
                    surfaces.kinds.len() as u32 - 1
                })
            });
            surfaces.of_block.push(faces);
        }
        surfaces
    }

    /// Divides the friction that does not come from joints by a factor.
    pub fn divide_friction(&mut self, factor: f64) {
        self.tan_friction = self.tan_friction.map(|tan| tan / factor);
        self.tan_default /= factor;
    }

    /// Surfaces whose friction is a fraction `fraction` of the way from that of `before` to that of
    /// `now`.
    pub fn between(
        properties: &Properties,
        laws: &Laws,
        now: &Geometry,
        before: &Geometry,
        fraction: f64,
    ) -> Self {
        let [mut surfaces, old] =
            [now, before].map(|geometry| Self::new(properties, laws, geometry));
        if fraction >= 1.0 {
            return surfaces;
        }
        let mut kinds = Vec::new();
        for (of_block, old_block) in surfaces.of_block.iter_mut().zip(&old.of_block) {
            for (kind, old_kind) in of_block.iter_mut().zip(old_block) {
                let (mut surface, old) =
                    (surfaces.kinds[*kind as usize], old.kinds[*old_kind as usize]);
                if let Some((new, old)) = surface.friction.as_mut().zip(old.friction) {
                    *new = new.after(old, fraction);
                }
                let known = kinds.iter().position(|known| *known == surface);
                *kind = known.unwrap_or(kinds.len()) as u32;
                if known.is_none() {
                    kinds.push(surface);
                }
            }
        }
        (surfaces.kinds, surfaces.fraction) = (kinds, fraction);
        surfaces
    }

    pub(super) fn of(&self, block: u32, face: FaceId) -> &ContactSurface {
        &self.kinds[self.of_block[block as usize][usize::from(face.number())] as usize]
    }

    /// Surface of an edge: the mean of the two adjacent faces.
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
            vibrating_mass: VibratingMass::mean(a.vibrating_mass, b.vibrating_mass),
            density: mean(|surface| surface.density),
            joint: None,
            nonconforming: false,
        }
    }

    /// Surfaces without the given contact stiffness, normal (0) or shear (1).
    pub(super) fn without(&self, direction: usize) -> Self {
        let mut without = self.clone();
        *[&mut without.normal, &mut without.shear][direction] = None;
        without
    }

    /// Smallest and largest stiffness of contacts of two equal faces, normal (0) or shear (1)
    /// `[Pa/m]`.
    pub(super) fn range(&self, direction: usize) -> [f64; 2] {
        let each = self.kinds.iter().map(|kind| {
            let SpringStiffness { normal, shear } = self.combined([kind; 2], [false; 2]).stiffness;
            [normal, shear][direction]
        });
        each.fold([f64::INFINITY, 0.0], |[least, most], k| [k.min(least), k.max(most)])
    }

    /// Largest penetration of a block under its own weight, as a fraction of its height, with the
    /// block's density and the normal stiffness. `None` if the fraction is at most `much`. A block
    /// of height h penetrates by `ρ g h / k`.
    pub(super) fn settlement(&self, gravity: f64, much: f64) -> Option<[f64; 3]> {
        let each = self.kinds.iter().map(|kind| {
            let stiffness = self.combined([kind; 2], [false; 2]).stiffness.normal;
            [kind.density * gravity / stiffness, kind.density, stiffness]
        });
        each.max_by(|a, b| a[0].total_cmp(&b[0])).filter(|worst| worst[0] > much)
    }

    /// Stiffness of a contact between a face and the stiffest face of all `[Pa/m]`.
    fn largest_stiffness(&self, surface: &ContactSurface) -> SpringStiffness {
        let series = |a: f64, b: f64| a * b / (a + b);
        let SpringStiffness { normal, shear } = surface.stiffness;
        SpringStiffness {
            normal: self.normal.unwrap_or_else(|| series(normal, self.stiffest.normal)),
            shear: self.shear.unwrap_or_else(|| series(shear, self.stiffest.shear)),
        }
    }

    /// Stiffness of a contact or of the joint of a face, the larger one `[Pa/m]`.
    pub fn largest_with_joint(&self, block: u32, face: FaceId) -> SpringStiffness {
        let surface = self.of(block, face);
        let SpringStiffness { normal, shear } = self.largest_stiffness(surface);
        let joint = surface.joint.unwrap_or(SpringStiffness { normal: 0.0, shear: 0.0 });
        SpringStiffness { normal: normal.max(joint.normal), shear: shear.max(joint.shear) }
    }

    /// Largest stiffness of a contact or joint of a face in any direction `[Pa/m]`, and coefficient of
    /// its dashpot `[Pa s/m]`.
    pub(super) fn largest_at(&self, block: u32, face: FaceId) -> [f64; 2] {
        let SpringStiffness { normal, shear } = self.largest_with_joint(block, face);
        [normal.max(shear), self.dashpot_of_joint([self.of(block, face); 2], normal)]
    }

    /// Excess of a face's contact stiffness over that of its joint, which the contact replaces
    /// `[Pa/m]`. For nonconforming joints it is the larger of the two stiffnesses.
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

    /// Mass that vibrates on a contact or joint of a given stiffness at a face, relative to the
    /// mass of the layer of nodes there.
    pub(super) fn mass_ratio(&self, block: u32, face: FaceId, stiffness: f64) -> f64 {
        let mass = &self.of(block, face).vibrating_mass;
        mass.mass(stiffness) / mass.layer()
    }

    /// Largest thickness of the surfaces of a block `[m]`.
    pub(super) fn thickness(&self, block: u32) -> f64 {
        let kinds = self.of_block[block as usize].iter();
        kinds.map(|&kind| self.kinds[kind as usize].thickness).fold(0.0, f64::max)
    }

    pub(super) fn density(&self, block: u32, face: FaceId) -> f64 {
        self.of(block, face).density
    }

    /// Combined surface of two faces. If only one block is fixed, it counts as infinitely heavy.
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
        let friction = given.or_else(|| Friction::of([a.friction, b.friction], self.fraction));
        let [of_a, of_b] = [a, b].map(|surface| surface.vibrating_mass.mass(normal));
        let mass = match held {
            [true, false] => of_b,
            [false, true] => of_a,
            _ => series(of_a, of_b),
        };
        CombinedSurface {
            thickness: a.thickness + b.thickness,
            stiffness: SpringStiffness { normal, shear: self.shear.unwrap_or(shear) },
            friction: friction.unwrap_or(Friction::Angle(self.tan_default)),
            dashpot: self.dashpot(normal, mass),
        }
    }
}

impl ContactSurfaces {
    /// Dashpot coefficient for a normal stiffness `[Pa/m]` and a mass per unit area `[Pa s/m]`.
    fn dashpot(&self, normal: f64, mass: f64) -> f64 {
        2.0 * self.damping * (normal * mass).sqrt()
    }

    /// Dashpot coefficient of a joint of two faces that has its own normal stiffness `[Pa s/m]`.
    pub(super) fn dashpot_of_joint(&self, [a, b]: [&ContactSurface; 2], normal: f64) -> f64 {
        let [a, b] = [a, b].map(|surface| surface.vibrating_mass.mass(normal));
        self.dashpot(normal, a * b / (a + b))
    }
}

impl Contacts {
    /// Remakes damped contacts of blocks whose supports changed, because their dashpots have
    /// another mass.
    pub fn remake_where_supports_changed(&mut self, changed: impl Fn(usize) -> bool) {
        let damped = |patch: &Patch| patch.surface.dashpot > 0.0;
        self.remake(|patch| damped(patch) && patch.blocks.iter().any(|&b| changed(b as usize)));
    }

    /// Marks the chosen contacts for remaking, as if their blocks had moved beyond the limit of the
    /// patch.
    pub fn remake(&mut self, chosen: impl Fn(&Patch) -> bool) {
        for patch in self.patches.iter_mut().filter(|patch| chosen(patch)) {
            patch.relative_position.x += 3.0 * f64::from(patch.limit);
        }
    }
}

/// The two faces adjacent to an edge.
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
        let height = geometry.surface_height(block, d);
        let vibrating_mass = VibratingMass::new(geometry, block, d, elastic);
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
        // The thickness is at most the gap, so that faces nearer than their joint is thick do not
        // overlap.
        let room = nonconforming.map_or(f64::INFINITY, |nonconforming| nonconforming.gap);
        Self {
            thickness: joint.map_or(0.0, |joint| joint.thickness.min(room) / 2.0),
            stiffness: SpringStiffness { normal: 2.0 * normal, shear: 2.0 * shear },
            friction: number.and_then(|number| FaceFriction::new(laws, number)),
            vibrating_mass,
            density: elastic.density,
            joint: stiffness,
            nonconforming: nonconforming.is_some(),
        }
    }

    fn key(&self) -> [u64; 10] {
        let SpringStiffness { normal, shear } = self.stiffness;
        let [tan, law] = FaceFriction::key(self.friction);
        let nonconforming = if self.nonconforming { 1.0 } else { 0.0 };
        let [layer, whole, impedance] = self.vibrating_mass.numbers();
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
