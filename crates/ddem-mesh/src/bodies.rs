//! Cells as bodies of several blocks. The parts of a rigid cell move as one (§8).

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector3};

use crate::assembly::Assembly;
use crate::pack::Packs;
use crate::properties::Properties;
use crate::topology::Topology;
use crate::{Geometry, Vec3};
use ddem_mechanics::element::hex8::mass_moments;
use ddem_mechanics::math::disjoint_sets::DisjointSets;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{CornerArms, CornerMoments, MassProperties};

/// Marker for a lane without a part of a body.
const NO_BODY: u32 = u32::MAX;

/// Part of a body: a block of a pack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodyPart {
    /// Number of its block.
    pub block: usize,
    /// Pack of its block.
    pub pack: usize,
    /// Lane of its block.
    pub lane: usize,
}

/// Cells that have not been removed, as bodies of several blocks. Cells that are joined are one body.
/// Blocks of lattices are bodies of their own and are not among them.
#[derive(Clone, Debug, Default)]
pub struct CellBodies {
    /// Parts, body after body.
    parts: Vec<BodyPart>,
    /// First part of each body, shape `(bodies + 1)`.
    starts: Vec<u32>,
    /// Body of each lane of all packs; empty without bodies.
    of_lane: Vec<[u32; LANES]>,
}

impl CellBodies {
    /// Bodies of the rigid cells of a geometry.
    #[must_use]
    pub fn rigid(geometry: &Geometry, packs: &Packs) -> Self {
        Self::new(geometry, packs, true, |_| 0)
    }

    /// Bodies of the deformable cells of a geometry. Parts of a block that an excavation has separated
    /// are several bodies.
    #[must_use]
    pub fn deformable(geometry: &Geometry, packs: &Packs, properties: &Properties) -> Self {
        let mut groups = DisjointSets::new(geometry.blocks.len());
        for nodes in geometry.tied_deformable() {
            let first = geometry.block_of(nodes[0] as usize);
            nodes.iter().for_each(|&node| groups.join([first, geometry.block_of(node as usize)]));
        }
        let is_whole_rock = |joint: u16| properties.joints[usize::from(joint)].is_whole_rock();
        for joined in geometry.joined().filter(|joined| is_whole_rock(joined.joint)) {
            groups.join(joined.blocks.map(|block| block as usize));
        }
        Self::new(geometry, packs, false, |block| groups.lowest(block))
    }

    /// Bodies of the rigid or deformable cells. Blocks of one whole block and one `group` are one body.
    fn new(
        geometry: &Geometry,
        packs: &Packs,
        rigid: bool,
        mut group: impl FnMut(usize) -> usize,
    ) -> Self {
        let mut of_whole: BTreeMap<(u32, usize), Vec<usize>> = BTreeMap::new();
        let exists =
            |&block: &usize| geometry.is_rigid(block) == rigid && !geometry.is_removed(block);
        for block in (0..geometry.blocks.len()).filter(exists) {
            if let Some(part) = geometry.part(block) {
                of_whole.entry((part.block, group(block))).or_default().push(block);
            }
        }
        if of_whole.is_empty() {
            return Self::default();
        }
        let mut bodies = Self {
            starts: vec![0],
            of_lane: vec![[NO_BODY; LANES]; packs.packs.len()],
            ..Self::default()
        };
        for (body, blocks) in of_whole.into_values().enumerate() {
            for block in blocks {
                let (pack, lane) = packs.slot(block);
                bodies.of_lane[pack][lane] = body as u32;
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

    /// Body of a lane of a pack; `None` for a block of its own.
    #[inline]
    #[must_use]
    pub fn body(&self, pack: usize, lane: usize) -> Option<usize> {
        let body = self.of_lane.get(pack)?[lane];
        (body != NO_BODY).then_some(body as usize)
    }

    /// True if a pack has parts of bodies.
    #[inline]
    #[must_use]
    pub fn has(&self, pack: usize) -> bool {
        self.of_lane.get(pack).is_some_and(|bodies| *bodies != [NO_BODY; LANES])
    }

    /// True for the first part of a body, which counts in sums over bodies, and for a block of its own.
    #[inline]
    #[must_use]
    pub fn counts(&self, pack: usize, lane: usize) -> bool {
        self.body(pack, lane).is_none_or(|body| {
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

/// Moments of a mass about a point.
#[derive(Default)]
struct MassMoments {
    /// Mass `[kg]`.
    mass: f64,
    /// First moments `[kg m]`.
    first: Vec3,
    /// Second moments `Σ m x xᵀ` `[kg m²]`.
    second: Matrix3<f64>,
}

impl MassMoments {
    fn add(&mut self, mass: f64, first: Vec3, second: Matrix3<f64>) {
        self.mass += mass;
        self.first += first;
        self.second += second;
    }

    /// Adds a hexahedron, whose corners are numbered by bits.
    fn add_hexahedron(&mut self, corners: &[Vec3; 8], density: f64) {
        let vtk = Topology::lattice(1).hex(0).map(|corner| Point3::from(corners[corner]));
        let (mass, first, second) = mass_moments(&vtk, density);
        self.add(mass, first, second);
    }

    /// Mass `[kg]`, centre of mass `[m]` and second moments about it `[kg m²]`.
    fn about_centre(&self) -> (f64, Vec3, Matrix3<f64>) {
        let centre = self.first / self.mass;
        (self.mass, centre, self.second - centre * centre.transpose() * self.mass)
    }
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
        let mut sums = MassMoments::default();
        for part in parts {
            let block = &self.blocks[part.block];
            let inertia = self.part(part.block).map_or(1.0, |part| part.inertia);
            let density = inertia * properties.materials[usize::from(block.material)].density;
            let corners = self.corners_of_part(part.block).map(|x| x - origin);
            sums.add_hexahedron(&corners, density);
            for (x, [layer, ..]) in corners.iter().zip(&joints[block.first_node as usize..]) {
                sums.add(*layer, x * *layer, x * x.transpose() * *layer);
            }
        }
        let (mass, centre, second) = sums.about_centre();
        (mass, origin + centre, Matrix3::identity() * second.trace() - second)
    }

    /// Length of a cell: the longest edge of the box that has the same moments of volume `[m]`.
    #[must_use]
    pub fn length_of_cell(&self, parts: &[BodyPart]) -> f64 {
        let origin = self.position(parts[0].block, [0; 3]);
        let mut sums = MassMoments::default();
        for part in parts {
            sums.add_hexahedron(&self.corners_of_part(part.block).map(|x| x - origin), 1.0);
        }
        let (volume, _, second) = sums.about_centre();
        (12.0 * second.symmetric_eigenvalues().max() / volume).sqrt()
    }

    /// Corners of a part at rest `[m]`.
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
        self.bodies = CellBodies::rigid(geometry, packs);
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
