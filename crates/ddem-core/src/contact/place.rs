//! Where blocks and the points of their faces are.

use nalgebra::Matrix3;

use crate::element::corotation::Frame;
use crate::geometry::{Geometry, Vec3};
use crate::grid::Bounds;
use crate::lanes::Lanes;
use crate::pack::Packs;
use crate::touch::{Cell, FaceOf};

/// A block: its nodes at rest, and where these are in nodal fields.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    /// The lowest node at rest `[m]`.
    corner: Vec3,
    /// The centre at rest `[m]`.
    middle: Vec3,
    /// Edges of one element `[m]`.
    steps: [Vec3; 3],
    /// Elements along each edge.
    pub(crate) divisions: usize,
    /// First number in a nodal field.
    first: usize,
    pub(crate) pack: usize,
    pub(crate) lane: usize,
}

/// A point of a face, fixed to the block: an element's face and bilinear coordinates there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spot {
    /// Twice the direction of the face's normal, plus one at the upper side.
    pub(crate) face: u8,
    /// Element along the next two directions, cyclically.
    pub(crate) element: [u16; 2],
    /// Where in the element's face, each from 0 to 1.
    pub(crate) on: [f32; 2],
}

/// Where everything is: nodal displacements and the frames of the packs.
#[derive(Clone, Copy)]
pub(crate) struct Placing<'a> {
    pub(crate) blocks: &'a [Placed],
    /// Displacements `[m]`.
    pub(crate) u: &'a [Lanes],
    /// Those of rigid bodies always, of others where they turn.
    pub(crate) frames: &'a [Frame],
    /// Small displacements: deformable bodies have no frames.
    pub(crate) small: bool,
    /// Velocities of the last half step and its time step `[m/s, s]`.
    pub(crate) last: (&'a [Lanes], f64),
    /// Nothing has moved since the last look: the first half step of a stage.
    pub(crate) start: bool,
}

pub(crate) fn placed(geometry: &Geometry, packs: &Packs) -> Vec<Placed> {
    let place = |body: usize| {
        let lattice = geometry.lattice(body);
        let cell = geometry.bodies[body].cell;
        let (pack, lane) = packs.slot(body);
        let steps = [0, 1, 2].map(|d| lattice.axes[d] * lattice.spacing(d, cell[d] as usize));
        let corner = geometry.position(body, [0; 3]);
        Placed {
            corner,
            middle: corner + (steps[0] + steps[1] + steps[2]) * (0.5 * lattice.divisions as f64),
            steps,
            divisions: lattice.divisions,
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
    pub(crate) fn value(&self, field: &[Lanes], at: [usize; 3]) -> Vec3 {
        let n = self.divisions + 1;
        let place = self.first + 3 * (at[0] + n * (at[1] + n * at[2]));
        let node = &field[place..place + 3];
        Vec3::new(node[0].0[self.lane], node[1].0[self.lane], node[2].0[self.lane])
    }

    /// Position of the node at lattice steps `at` `[m]`.
    #[inline(always)]
    pub(crate) fn node(&self, u: &[Lanes], at: [usize; 3]) -> Vec3 {
        let [x, y, z] = &self.steps;
        let along = x * at[0] as f64 + y * at[1] as f64 + z * at[2] as f64;
        self.corner + along + self.value(u, at)
    }

    fn corners(&self, u: &[Lanes]) -> [Vec3; 8] {
        let end = |corner: usize, d: usize| if corner >> d & 1 == 1 { self.divisions } else { 0 };
        std::array::from_fn(|corner| self.node(u, [0, 1, 2].map(|d| end(corner, d))))
    }

    /// The parallelepiped nearest to its corners.
    pub(crate) fn cell(&self, u: &[Lanes]) -> Cell {
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
    pub(crate) fn bounds(&self, u: &[Lanes], margin: f64) -> Bounds {
        let corners = self.corners(u);
        let first = [corners[0]; 2];
        let [low, high] =
            corners[1..].iter().fold(first, |[low, high], x| [low.inf(x), high.sup(x)]);
        [low.add_scalar(-margin), high.add_scalar(margin)]
    }

    /// Lattice steps of the corners of an element's face: (0,0), (1,0), (1,1), (0,1) along the
    /// next two directions.
    pub(crate) fn quad(&self, face: FaceOf, [i, k]: [usize; 2]) -> [[usize; 3]; 4] {
        let d = face.direction;
        [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| {
            let mut at = [0; 3];
            at[d] = if face.upper { self.divisions } else { 0 };
            at[(d + 1) % 3] = i + a;
            at[(d + 2) % 3] = k + b;
            at
        })
    }

    /// The four nodes and weights that make a spot.
    #[inline(always)]
    pub(crate) fn shares(&self, spot: &Spot) -> [([usize; 3], f64); 4] {
        let nodes = self.quad(spot.face_of(), spot.element.map(usize::from));
        let weights = crate::touch::weights(spot.on.map(f64::from));
        std::array::from_fn(|k| (nodes[k], weights[k]))
    }

    /// Area of the face of one element at rest `[m²]`.
    pub(crate) fn element_area(&self, face: FaceOf) -> f64 {
        let d = face.direction;
        self.steps[(d + 1) % 3].cross(&self.steps[(d + 2) % 3]).norm()
    }

    /// Shortest edge of an element `[m]`.
    pub(crate) fn spacing(&self) -> f64 {
        self.steps.iter().map(Vec3::norm).fold(f64::INFINITY, f64::min)
    }

    /// Number of its first node in nodal fields, and of a node at lattice steps.
    #[inline(always)]
    pub(crate) fn local(&self, at: [usize; 3]) -> usize {
        let n = self.divisions + 1;
        at[0] + n * (at[1] + n * at[2])
    }
}

impl Spot {
    pub(crate) fn new(face: FaceOf, element: [usize; 2], on: [f64; 2]) -> Self {
        let face = 2 * face.direction as u8 + u8::from(face.upper);
        Self { face, element: element.map(|i| i as u16), on: on.map(|x| x as f32) }
    }

    pub(crate) fn face_of(&self) -> FaceOf {
        FaceOf { direction: usize::from(self.face / 2), upper: self.face % 2 == 1 }
    }
}

impl Placing<'_> {
    /// Rotation of a block from its reference position.
    pub(crate) fn rotation(&self, block: usize) -> Matrix3<f64> {
        let Placed { pack, lane, .. } = self.blocks[block];
        Matrix3::from_fn(|i, k| self.frames[pack].rotation[i][k].0[lane])
    }

    /// How far a block turned in the last step, as a vector: the mean of its edges `[rad]`.
    pub(crate) fn turned(&self, block: usize) -> Vec3 {
        let placed = &self.blocks[block];
        // Of a field of velocities, the half edges at rest and what they change by.
        let ways = placed.cell(self.last.0).half;
        let edges = placed.cell(self.u).half;
        let turn = |d: usize| {
            let way = ways[d] - placed.steps[d] * (0.5 * placed.divisions as f64);
            edges[d].cross(&way) / edges[d].norm_squared()
        };
        (turn(0) + turn(1) + turn(2)) * (0.5 * self.last.1)
    }

    /// Centre of a block `[m]`.
    pub(crate) fn centre(&self, block: usize) -> Vec3 {
        let placed = &self.blocks[block];
        let Placed { pack, lane, .. } = *placed;
        if self.small {
            return placed.cell(self.u).centre;
        }
        placed.middle + Vec3::from(self.frames[pack].mean.map(|c| c.0[lane]))
    }

    /// Position of a spot `[m]`, and its way in the last step `[m]`.
    #[inline(always)]
    pub(crate) fn spot(&self, block: usize, spot: &Spot) -> [Vec3; 2] {
        let placed = &self.blocks[block];
        let (mut x, mut way) = (Vec3::zeros(), Vec3::zeros());
        for (at, weight) in placed.shares(spot) {
            x += placed.node(self.u, at) * weight;
            way += placed.value(self.last.0, at) * weight;
        }
        [x, way * self.last.1]
    }

    /// Position of a spot `[m]`.
    #[inline(always)]
    pub(crate) fn position(&self, block: usize, spot: &Spot) -> Vec3 {
        let placed = &self.blocks[block];
        let shares = placed.shares(spot).into_iter();
        shares.map(|(at, weight)| placed.node(self.u, at) * weight).sum()
    }
}
