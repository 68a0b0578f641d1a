//! Where blocks and the points of their faces are.

use nalgebra::Matrix3;

use ddem_mechanics::collide::{Cell, FaceOf};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::grid::Bounds;
use ddem_mesh::pack::Packs;
use ddem_mesh::{Geometry, SurfacePoint, Topology, Vec3};

/// A block: its nodes at rest, and where these are in nodal fields.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The lowest node at rest `[m]`.
    corner: Vec3,
    /// The centre at rest `[m]`.
    middle: Vec3,
    /// Edges of one element `[m]`.
    steps: [Vec3; 3],
    /// Shortest edge of an element `[m]`.
    pub(super) spacing: f64,
    /// Half of the sum of the block's edges `[m]`.
    pub(super) size: f64,
    pub(super) topology: Topology,
    pub(super) rigid: bool,
    /// First number in a nodal field.
    first: usize,
    pub(super) pack: usize,
    pub(super) lane: usize,
}

/// Where everything is: nodal displacements and the frames of the packs.
#[derive(Clone, Copy)]
pub struct Placing<'a> {
    /// Blocks at rest.
    pub blocks: &'a [Placed],
    /// Displacements `[m]`.
    pub u: &'a [Lanes],
    /// Those of rigid bodies always, of others where they turn.
    pub frames: &'a [Frame],
    /// Small displacements: deformable bodies have no frames.
    pub small: bool,
    /// Velocities of the last half step and its time step `[m/s, s]`.
    pub last: (&'a [Lanes], f64),
    /// Nothing has moved since the last look: the first half step of a stage.
    pub start: bool,
}

pub(super) fn placed(geometry: &Geometry, packs: &Packs) -> Vec<Placed> {
    let place = |body: usize| {
        let topology = geometry.topology(body);
        let divisions = topology.divisions() as f64;
        let (pack, lane) = packs.slot(body);
        let steps = geometry.element_edges(body);
        let corner = geometry.position(body, [0; 3]);
        let edges = steps.map(|step| step.norm());
        Placed {
            corner,
            middle: corner + (steps[0] + steps[1] + steps[2]) * (0.5 * divisions),
            spacing: edges[0].min(edges[1]).min(edges[2]),
            size: 0.5 * divisions * (edges[0] + edges[1] + edges[2]),
            steps,
            topology,
            rigid: geometry.is_rigid(body),
            first: 3 * packs.packs[pack].start,
            pack,
            lane,
        }
    };
    (0..geometry.bodies.len()).map(place).collect()
}

impl Placed {
    /// Value of a nodal field at lattice steps `at`.
    #[inline(always)]
    pub(super) fn value(&self, field: &[Lanes], at: [usize; 3]) -> Vec3 {
        let place = self.first + 3 * self.topology.node(at);
        let node = &field[place..place + 3];
        Vec3::new(node[0].0[self.lane], node[1].0[self.lane], node[2].0[self.lane])
    }

    /// Position of the node at lattice steps `at` `[m]`.
    #[inline(always)]
    pub(super) fn node(&self, u: &[Lanes], at: [usize; 3]) -> Vec3 {
        let [x, y, z] = &self.steps;
        let along = x * at[0] as f64 + y * at[1] as f64 + z * at[2] as f64;
        self.corner + along + self.value(u, at)
    }

    #[inline]
    fn corners(&self, u: &[Lanes]) -> [Vec3; 8] {
        let corners = self.topology.corners();
        std::array::from_fn(|corner| self.node(u, corners[corner]))
    }

    /// The parallelepiped nearest to its corners.
    pub(super) fn cell(&self, u: &[Lanes]) -> Cell {
        let [a, b, c, d, e, f, g, h] = self.corners(u);
        let (low, high) = ((a + b) + (c + d), (e + f) + (g + h));
        Cell {
            centre: (low + high) / 8.0,
            half: [
                ((b - a) + (d - c) + (f - e) + (h - g)) / 8.0,
                ((c - a) + (d - b) + (g - e) + (h - f)) / 8.0,
                (high - low) / 8.0,
            ],
        }
    }

    /// The box around its corners, wider by a margin.
    pub(super) fn bounds(&self, u: &[Lanes], margin: f64) -> Bounds {
        let corners = self.corners(u);
        let first = [corners[0]; 2];
        let [low, high] =
            corners[1..].iter().fold(first, |[low, high], x| [low.inf(x), high.sup(x)]);
        [low.add_scalar(-margin), high.add_scalar(margin)]
    }

    /// Nodes that make a point of a face, numbered as in the block, and their weights.
    #[inline(always)]
    pub fn shares(&self, face: FaceOf, point: &SurfacePoint) -> [(usize, f64); 4] {
        point.shares(self.topology, face)
    }

    /// Value of a nodal field at a point.
    #[inline(always)]
    fn at(&self, field: &[Lanes], face: FaceOf, point: &SurfacePoint) -> Vec3 {
        let mut sum = Vec3::zeros();
        for (node, weight) in self.shares(face, point) {
            let node = &field[self.first + 3 * node..][..3];
            let value = Vec3::new(node[0].0[self.lane], node[1].0[self.lane], node[2].0[self.lane]);
            sum += value * weight;
        }
        sum
    }

    /// Position of a point at rest `[m]`, and the node that has most of it, numbered as in the block.
    pub fn seat(&self, face: FaceOf, point: &SurfacePoint) -> (Vec3, usize) {
        let shares = self.shares(face, point);
        let most = shares
            .iter()
            .fold(shares[0], |most, &share| if share.1 > most.1 { share } else { most });
        (self.rest(face, point), most.0)
    }

    /// Position of a point at rest `[m]`.
    #[inline(always)]
    fn rest(&self, face: FaceOf, point: &SurfacePoint) -> Vec3 {
        let d = face.direction;
        let along = |k: usize| f64::from(point.element[k]) + f64::from(point.on[k]);
        let up = if face.upper { self.topology.divisions() as f64 } else { 0.0 };
        let [x, y, z] = [0, 1, 2].map(|k| self.steps[(d + k) % 3]);
        self.corner + (x * up + y * along(0) + z * along(1))
    }

    /// Area of the face of one element at rest `[m²]`.
    pub fn element_area(&self, face: FaceOf) -> f64 {
        let d = face.direction;
        self.steps[(d + 1) % 3].cross(&self.steps[(d + 2) % 3]).norm()
    }
}

impl Placing<'_> {
    /// Rotation of a block from its reference position.
    pub(super) fn rotation(&self, block: usize) -> Matrix3<f64> {
        let Placed { pack, lane, .. } = self.blocks[block];
        Matrix3::from_fn(|i, k| self.frames[pack].rotation[i][k].0[lane])
    }

    /// How far a block turned in the last step, as a vector: the mean of its edges `[rad]`.
    pub(super) fn turned(&self, block: usize) -> Vec3 {
        let placed = &self.blocks[block];
        // Of a field of velocities, the half edges at rest and what they change by.
        let ways = placed.cell(self.last.0).half;
        let edges = placed.cell(self.u).half;
        let turn = |d: usize| {
            let way = ways[d] - placed.steps[d] * (0.5 * placed.topology.divisions() as f64);
            edges[d].cross(&way) / edges[d].norm_squared()
        };
        (turn(0) + turn(1) + turn(2)) * (0.5 * self.last.1)
    }

    /// Centre of a block `[m]`.
    pub(super) fn centre(&self, block: usize) -> Vec3 {
        let placed = &self.blocks[block];
        let Placed { pack, lane, .. } = *placed;
        if self.small {
            return placed.cell(self.u).centre;
        }
        placed.middle + Vec3::from(self.frames[pack].mean.map(|c| c.0[lane]))
    }

    /// Position of a point `[m]`.
    #[inline(always)]
    pub fn position(&self, block: usize, face: FaceOf, point: &SurfacePoint) -> Vec3 {
        let placed = &self.blocks[block];
        placed.rest(face, point) + placed.at(self.u, face, point)
    }

    /// From a point on one block to that on another `[m]`.
    #[inline(always)]
    pub(super) fn apart(
        &self,
        blocks: [u32; 2],
        faces: [FaceOf; 2],
        spots: &[SurfacePoint; 2],
    ) -> Vec3 {
        self.position(blocks[1] as usize, faces[1], &spots[1])
            - self.position(blocks[0] as usize, faces[0], &spots[0])
    }

    /// What that changed by in the last step `[m]`.
    pub(super) fn parted(
        &self,
        blocks: [u32; 2],
        faces: [FaceOf; 2],
        spots: &[SurfacePoint; 2],
    ) -> Vec3 {
        self.way(blocks[1] as usize, faces[1], &spots[1])
            - self.way(blocks[0] as usize, faces[0], &spots[0])
    }

    /// Way of a point in the last step `[m]`.
    pub(super) fn way(&self, block: usize, face: FaceOf, point: &SurfacePoint) -> Vec3 {
        self.blocks[block].at(self.last.0, face, point) * self.last.1
    }
}
