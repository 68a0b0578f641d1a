//! Present configuration of the blocks and of the points on their faces.

use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion};

use super::cells::{ContactCell, cells};
use ddem_mechanics::collide::{FaceId, Parallelepiped};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::Pose;
use ddem_mesh::grid::Bounds;
use ddem_mesh::pack::Packs;
use ddem_mesh::{Geometry, SurfacePoint, Topology, Vec3};

/// Geometry of a block at rest, and the location of its nodes in nodal fields.
#[derive(Clone, Debug)]
pub struct ContactBlock {
    /// Position of the lowest node at rest `[m]`.
    corner: Vec3,
    /// Position of the centre at rest `[m]`.
    middle: Vec3,
    /// Edge vectors of one element `[m]`.
    steps: [Vec3; 3],
    /// Shortest edge of an element, or that of its cell `[m]`.
    pub(super) spacing: f64,
    /// Half of the sum of the block's edges, or the size of its cell `[m]`.
    pub(super) size: f64,
    pub(super) topology: Topology,
    pub(super) rigid: bool,
    /// Index of its first component in a nodal field.
    first: usize,
    pub(super) pack: usize,
    pub(super) lane: usize,
    /// Number of its pack among the rigid ones.
    rigid_pack: usize,
    /// Positions of its nodes at rest, if it is a part of a cell `[m]`; else empty.
    nodes: Box<[Vec3]>,
    /// Cell that it is a part of.
    pub(super) polyhedron: Option<Arc<ContactCell>>,
}

/// Present configuration: nodal displacements and the frames of the packs.
#[derive(Clone, Copy)]
pub struct Configuration<'a> {
    /// Blocks at rest.
    pub blocks: &'a [ContactBlock],
    /// Displacements `[m]`.
    pub u: &'a [Lanes],
    /// Frames of rigid blocks, and of deformable blocks that rotate.
    pub frames: &'a [Frame],
    /// True for small displacements: deformable blocks have no frames.
    pub small: bool,
    /// Nodal velocities of the last half step `[m/s]` and the time step `[s]`.
    pub last: (&'a [Lanes], f64),
    /// True in the first half step of a stage: nothing has moved since the last evaluation.
    pub start: bool,
    /// Poses of rigid blocks, by rigid pack; empty at rest.
    pub poses: &'a [[Pose; LANES]],
}

pub(super) fn contact_block(geometry: &Geometry, packs: &Packs) -> Vec<ContactBlock> {
    let cells = cells(geometry);
    let current = |block: usize| {
        let cell = cells[block].clone();
        let topology = geometry.topology(block);
        let divisions = topology.divisions() as f64;
        let (pack, lane) = packs.slot(block);
        let steps = geometry.element_edges(block);
        let corner = geometry.position(block, [0; 3]);
        let edges = steps.map(|step| step.norm());
        let shortest = edges[0].min(edges[1]).min(edges[2]);
        let size = 0.5 * divisions * (edges[0] + edges[1] + edges[2]);
        ContactBlock {
            corner,
            middle: corner + (steps[0] + steps[1] + steps[2]) * (0.5 * divisions),
            spacing: cell.as_ref().map_or(shortest, |cell| cell.spacing),
            size: cell.as_ref().map_or(size, |cell| cell.size),
            steps,
            topology,
            rigid: geometry.is_rigid(block),
            first: 3 * packs.packs[pack].start,
            pack,
            lane,
            rigid_pack: packs.packs[pack].rigid_start,
            nodes: nodes_of_part(geometry, block),
            polyhedron: cell,
        }
    };
    (0..geometry.blocks.len()).map(current).collect()
}

/// Positions of the nodes of a part of a cell at rest `[m]`; none for other blocks.
fn nodes_of_part(geometry: &Geometry, block: usize) -> Box<[Vec3]> {
    if geometry.part(block).is_none() {
        return Box::default();
    }
    let topology = geometry.topology(block);
    (0..topology.nodes()).map(|node| geometry.position(block, topology.steps(node))).collect()
}

impl ContactBlock {
    /// Index of the first component of its pack in a nodal field.
    pub(super) fn pack_start(&self) -> usize {
        self.first
    }

    /// Index of the first component of a node, numbered as in the block, in a nodal field.
    pub(super) fn index(&self, node: usize) -> usize {
        self.first + 3 * node
    }

    /// Nodes of the element face that holds a point, numbered as in the block.
    pub(super) fn nodes_around(&self, point: &SurfacePoint) -> [usize; 4] {
        self.topology.quad(point.face(), point.element.map(usize::from))
    }

    /// Position of a node at rest `[m]`.
    pub(super) fn rest_node(&self, node: usize) -> Vec3 {
        self.nodes.get(node).copied().unwrap_or_else(|| self.corner + self.rest_arm(node))
    }

    /// Vector from the first node to a node at rest `[m]`.
    pub(super) fn rest_arm(&self, node: usize) -> Vec3 {
        if let Some(at) = self.nodes.get(node) {
            return at - self.nodes[0];
        }
        let [i, j, k] = self.topology.steps(node).map(|at| at as f64);
        let [x, y, z] = &self.steps;
        x * i + y * j + z * k
    }

    /// Value of a nodal field at lattice steps `at`.
    #[inline(always)]
    pub(super) fn value(&self, field: &[Lanes], at: [usize; 3]) -> Vec3 {
        let slot = self.first + 3 * self.topology.node(at);
        let node = &field[slot..slot + 3];
        Vec3::new(node[0].0[self.lane], node[1].0[self.lane], node[2].0[self.lane])
    }

    /// Position of the node at lattice steps `at` `[m]`.
    #[inline(always)]
    pub(super) fn node(&self, u: &[Lanes], at: [usize; 3]) -> Vec3 {
        if let Some(node) = self.nodes.get(self.topology.node(at)) {
            return node + self.value(u, at);
        }
        let [x, y, z] = &self.steps;
        let along = x * at[0] as f64 + y * at[1] as f64 + z * at[2] as f64;
        self.corner + along + self.value(u, at)
    }

    #[inline]
    pub(super) fn corners(&self, u: &[Lanes]) -> [Vec3; 8] {
        let corners = self.topology.corners();
        std::array::from_fn(|corner| self.node(u, corners[corner]))
    }

    /// Best-fit parallelepiped of its corners.
    pub(super) fn cell(&self, u: &[Lanes]) -> Parallelepiped {
        let [a, b, c, d, e, f, g, h] = self.corners(u);
        let (low, high) = ((a + b) + (c + d), (e + f) + (g + h));
        Parallelepiped {
            centre: (low + high) / 8.0,
            half: [
                ((b - a) + (d - c) + (f - e) + (h - g)) / 8.0,
                ((c - a) + (d - b) + (g - e) + (h - f)) / 8.0,
                (high - low) / 8.0,
            ],
        }
    }

    /// Bounding box of its corners, enlarged by a margin `[m]`.
    pub(super) fn bounds(&self, u: &[Lanes], margin: f64) -> Bounds {
        let corners = self.corners(u);
        let first = [corners[0]; 2];
        let [low, high] =
            corners[1..].iter().fold(first, |[low, high], x| [low.inf(x), high.sup(x)]);
        [low.add_scalar(-margin), high.add_scalar(margin)]
    }

    /// Nodes of the element face that holds a point, numbered as in the block, and their weights.
    #[inline(always)]
    pub fn weights(&self, point: &SurfacePoint) -> [(usize, f64); 4] {
        point.weights(self.topology)
    }

    /// Value of a nodal field at a point.
    #[inline(always)]
    fn at(&self, field: &[Lanes], point: &SurfacePoint) -> Vec3 {
        let mut sum = Vec3::zeros();
        for (node, weight) in self.weights(point) {
            let node = &field[self.first + 3 * node..][..3];
            let value = Vec3::new(node[0].0[self.lane], node[1].0[self.lane], node[2].0[self.lane]);
            sum += value * weight;
        }
        sum
    }

    /// Position of a point at rest `[m]`, and the node with the largest weight, numbered as in the
    /// block.
    pub fn rest_point(&self, point: &SurfacePoint) -> (Vec3, usize) {
        let weights = self.weights(point);
        let most = weights
            .iter()
            .fold(weights[0], |most, &share| if share.1 > most.1 { share } else { most });
        (self.rest(point), most.0)
    }

    /// Distance of its centre from that of another block at rest `[m]`.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        (other.middle - self.middle).norm()
    }

    /// Position of a point at rest `[m]`.
    #[inline(always)]
    fn rest(&self, point: &SurfacePoint) -> Vec3 {
        if !self.nodes.is_empty() {
            let weights = self.weights(point);
            return weights
                .iter()
                .fold(Vec3::zeros(), |sum, (node, w)| sum + self.nodes[*node] * *w);
        }
        let face = point.face();
        let d = face.direction;
        let along = |k: usize| f64::from(point.element[k]) + f64::from(point.on[k]);
        let up = if face.upper { self.topology.divisions() as f64 } else { 0.0 };
        let [x, y, z] = [0, 1, 2].map(|k| self.steps[(d + k) % 3]);
        self.corner + (x * up + y * along(0) + z * along(1))
    }

    /// Area of the face of one element at rest `[m²]`.
    pub fn element_area(&self, face: FaceId) -> f64 {
        if !self.nodes.is_empty() {
            let elements = self.topology.divisions().pow(2) as f64;
            return self.diagonals(face).norm() / (2.0 * elements);
        }
        let d = face.direction;
        self.steps[(d + 1) % 3].cross(&self.steps[(d + 2) % 3]).norm()
    }

    /// Cross product of the diagonals of a face at rest `[m²]`, towards the upper side.
    fn diagonals(&self, face: FaceId) -> Vec3 {
        let n = self.topology.divisions();
        let corner =
            |at: [usize; 2]| self.nodes[self.topology.node(self.topology.on_face(face, at))];
        (corner([n, n]) - corner([0, 0])).cross(&(corner([0, n]) - corner([n, 0])))
    }

    /// True if the block is a part of a cell.
    pub(super) fn is_part(&self) -> bool {
        !self.nodes.is_empty()
    }

    /// Outward unit normal of a face of a part at rest; `None` for other blocks.
    pub(super) fn part_normal(&self, face: FaceId) -> Option<Vec3> {
        let side = if face.upper { 1.0 } else { -1.0 };
        let is_part = !self.nodes.is_empty();
        is_part
            .then(|| self.diagonals(face))
            .and_then(|area| area.try_normalize(0.0))
            .map(|n| n * side)
    }

    /// Corners of an element of a face of a part at rest, around it `[m]`, and the numbers of their
    /// nodes on the face.
    pub(super) fn part_quad(&self, face: FaceId, element: [usize; 2]) -> [(usize, Vec3); 4] {
        let [i, k] = element;
        let side = self.topology.divisions() + 1;
        [[i, k], [i + 1, k], [i + 1, k + 1], [i, k + 1]].map(|at| {
            let node = self.topology.node(self.topology.on_face(face, at));
            (at[0] + side * at[1], self.nodes[node])
        })
    }
}

impl Configuration<'_> {
    /// Rotation of a rigid block from rest; `None` for a deformable one, and at rest.
    pub(super) fn turn(&self, contact_block: &ContactBlock) -> Option<UnitQuaternion<f64>> {
        let poses = self.poses.get(contact_block.rigid_pack).filter(|_| contact_block.rigid)?;
        Some(poses[contact_block.lane].turn)
    }

    /// Rotation of a block from its reference position.
    pub(super) fn rotation(&self, block: usize) -> Matrix3<f64> {
        let ContactBlock { pack, lane, .. } = self.blocks[block];
        Matrix3::from_fn(|i, k| self.frames[pack].rotation[i][k].0[lane])
    }

    /// Rotation vector of a block in the last step `[rad]`, averaged over its edges.
    pub(super) fn rotation_increment(&self, block: usize) -> Vec3 {
        let contact_block = &self.blocks[block];
        // `cell` of a velocity field gives the half edges at rest plus their rates.
        let half_edges = contact_block.cell(self.last.0).half;
        let edges = contact_block.cell(self.u).half;
        let turn = |d: usize| {
            let du = half_edges[d]
                - contact_block.steps[d] * (0.5 * contact_block.topology.divisions() as f64);
            edges[d].cross(&du) / edges[d].norm_squared()
        };
        (turn(0) + turn(1) + turn(2)) * (0.5 * self.last.1)
    }

    /// Centre of a block `[m]`.
    pub(super) fn centre(&self, block: usize) -> Vec3 {
        let contact_block = &self.blocks[block];
        let ContactBlock { pack, lane, .. } = *contact_block;
        if self.small {
            return contact_block.cell(self.u).centre;
        }
        contact_block.middle + Vec3::from(self.frames[pack].mean.map(|c| c.0[lane]))
    }

    /// Position of a point of a body `[m]`.
    #[inline(always)]
    pub fn position(&self, body: u32, point: &SurfacePoint) -> Vec3 {
        let contact_block = &self.blocks[point.block(body)];
        contact_block.rest(point) + contact_block.at(self.u, point)
    }

    /// Change of the vector between two points in the last step `[m]`.
    pub(super) fn relative_displacement_increment(
        &self,
        bodies: [u32; 2],
        points: &[SurfacePoint; 2],
    ) -> Vec3 {
        self.du(bodies[1], &points[1]) - self.du(bodies[0], &points[0])
    }

    /// Displacement increment of a point in the last step `[m]`.
    pub(super) fn du(&self, body: u32, point: &SurfacePoint) -> Vec3 {
        self.blocks[point.block(body)].at(self.last.0, point) * self.last.1
    }
}
