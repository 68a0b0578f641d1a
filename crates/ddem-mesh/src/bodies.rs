//! Rigid bodies of several blocks: cells, whose parts move as one (§8).

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector3};

use crate::assembly::Assembly;
use crate::pack::Packs;
use crate::properties::Properties;
use crate::{Geometry, Vec3};
use ddem_mechanics::element::hex8::mass_moments;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{CornerArms, CornerMoments, MassProperties};

/// Marker for a lane without a part of a body.
const NO_BODY: u32 = u32::MAX;

/// Part of a rigid body: a block of a rigid pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodyPart {
    /// Number of its block.
    pub block: usize,
    /// Pack of its block.
    pub pack: usize,
    /// Lane of its block.
    pub lane: usize,
}

/// Rigid bodies of several blocks that have not been removed. Other rigid blocks are bodies of their
/// own and are not among them.
#[derive(Clone, Debug, Default)]
pub struct RigidBodies {
    /// Parts, body after body.
    parts: Vec<BodyPart>,
    /// First part of each body, shape `(bodies + 1)`.
    starts: Vec<u32>,
    /// Body of each lane of the rigid packs; empty without bodies.
    of_lane: Vec<[u32; LANES]>,
}

impl RigidBodies {
    /// Bodies of the rigid cells of a geometry.
    #[must_use]
    pub fn new(geometry: &Geometry, packs: &Packs) -> Self {
        let mut of_whole: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let exists = |block: &usize| geometry.is_rigid(*block) && !geometry.is_removed(*block);
        for block in (0..geometry.blocks.len()).filter(exists) {
            if let Some(part) = geometry.part(block) {
                of_whole.entry(part.block).or_default().push(block);
            }
        }
        if of_whole.is_empty() {
            return Self::default();
        }
        let mut bodies = Self {
            starts: vec![0],
            of_lane: vec![[NO_BODY; LANES]; packs.rigid],
            ..Self::default()
        };
        for (body, blocks) in of_whole.into_values().enumerate() {
            for block in blocks {
                let (pack, lane) = packs.slot(block);
                bodies.of_lane[packs.packs[pack].rigid_start][lane] = body as u32;
                bodies.parts.push(BodyPart { block, pack, lane });
            }
            bodies.starts.push(bodies.parts.len() as u32);
        }
        bodies
    }

    /// True without bodies.
    #[inline]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Number of bodies.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Parts of a body.
    #[inline]
    #[must_use]
    pub fn parts(&self, body: usize) -> &[BodyPart] {
        &self.parts[self.starts[body] as usize..self.starts[body + 1] as usize]
    }

    /// Body of a lane of a rigid pack, the number of which counts rigid packs; `None` for a block of
    /// its own.
    #[inline]
    #[must_use]
    pub fn body(&self, rigid_pack: usize, lane: usize) -> Option<usize> {
        let body = self.of_lane.get(rigid_pack)?[lane];
        (body != NO_BODY).then_some(body as usize)
    }

    /// True for the first part of a body, which counts in sums over bodies, and for a block of its own.
    #[inline]
    #[must_use]
    pub fn counts(&self, packs: &Packs, pack: usize, lane: usize) -> bool {
        self.body(packs.packs[pack].rigid_start, lane).is_none_or(|body| {
            let first = self.parts(body)[0];
            (first.pack, first.lane) == (pack, lane)
        })
    }

    /// Memory in use `[bytes]`.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.parts[..]) + 4 * self.starts.len() + size_of_val(&self.of_lane[..])
    }
}

/// Arms of the corners of rigid blocks, from the mass properties of their packs.
pub(crate) fn corner_arms(rigid: &[[MassProperties; LANES]]) -> Vec<CornerArms> {
    let at = |pack: &[MassProperties; LANES], corner: usize| {
        [0, 1, 2].map(|c| Lanes(pack.each_ref().map(|block| block.arm(corner)[c])))
    };
    let of_pack = |pack| std::array::from_fn(|corner| at(pack, corner));
    rigid.iter().map(of_pack).collect()
}

impl Geometry {
    /// Mass `[kg]`, centre of mass `[m]` and inertia about it `[kg m²]` of blocks that are parts of
    /// cells, with the masses of joints at their nodes.
    fn inertia_of(
        &self,
        properties: &Properties,
        parts: &[BodyPart],
        joints: &[[f64; 4]],
    ) -> (f64, Vec3, Matrix3<f64>) {
        // Relative to a corner, so that a body far from the origin loses no digits.
        let origin = self.position(parts[0].block, [0; 3]);
        let (mut mass, mut first, mut second) = (0.0, Vec3::zeros(), Matrix3::zeros());
        let mut add = |own: (f64, Vec3, Matrix3<f64>)| {
            mass += own.0;
            first += own.1;
            second += own.2;
        };
        for part in parts {
            let block = &self.blocks[part.block];
            let inertia = self.part(part.block).map_or(1.0, |part| part.inertia);
            let density = inertia * properties.materials[usize::from(block.material)].density;
            let corners = self.corners_of_part(part.block).map(|x| x - origin);
            let vtk = self.topology(part.block).hex(0).map(|node| Point3::from(corners[node]));
            add(mass_moments(&vtk, density));
            for (x, [layer, ..]) in corners.iter().zip(&joints[block.first_node as usize..]) {
                add((*layer, x * *layer, x * x.transpose() * *layer));
            }
        }
        let centre = first / mass;
        second -= centre * centre.transpose() * mass;
        (mass, origin + centre, Matrix3::identity() * second.trace() - second)
    }

    /// Positions of the corners of a rigid part, which are its nodes `[m]`.
    fn corners_of_part(&self, block: usize) -> [Vec3; 8] {
        self.topology(block).corners().map(|at| self.position(block, at))
    }
}

impl Assembly {
    /// Finds the rigid bodies of several blocks, and gives the parts of each the mass and the inertia of
    /// the whole body. `bonds` are mass and stiffness of nonconforming joints by node, or empty.
    pub(crate) fn unite_bodies(
        &mut self,
        geometry: &Geometry,
        packs: &Packs,
        properties: &Properties,
        bonds: &[[f64; 4]],
    ) {
        self.bodies = RigidBodies::new(geometry, packs);
        if self.bodies.is_empty() {
            return;
        }
        let mut joints = bonds.to_vec();
        joints.resize(geometry.n_nodes, [0.0; 4]);
        for body in 0..self.bodies.len() {
            let parts = self.bodies.parts(body);
            let (mass, centre, inertia) = geometry.inertia_of(properties, parts, &joints);
            let arms = |part: &BodyPart| geometry.corners_of_part(part.block).map(|x| x - centre);
            let all: Vec<Vec3> = parts.iter().flat_map(arms).collect();
            let stiffness = parts.iter().fold(Vector3::zeros(), |sum, part| {
                let first = geometry.blocks[part.block].first_node as usize;
                let nodes = joints[first..first + 8].iter();
                nodes.fold(sum, |sum, [_, x, y, z]| sum + Vector3::new(*x, *y, *z))
            });
            let (whole, moments) =
                (MassProperties::with_inertia(mass, &inertia, stiffness), CornerMoments::new(&all));
            for part in parts {
                let rigid = packs.packs[part.pack].rigid_start;
                self.rigid[rigid][part.lane] = whole.clone().with_corners(arms(part), moments);
            }
        }
    }
}
