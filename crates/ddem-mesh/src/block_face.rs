//! Faces of blocks.

use super::{Geometry, Vec3};
use ddem_mechanics::collide::{FaceId, weights};

/// Node of a face, sine of the angle between the edges of the face, and for each edge half the
/// distances to the next nodes, down and up `[m]`. Their products are the area of the node.
pub type TributaryLengths = (u32, f64, [[f64; 2]; 2]);

/// Face of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BlockFace {
    /// Number of the block.
    pub block: usize,
    /// Face of its cell.
    pub face: FaceId,
}

/// Position of a face at rest.
#[derive(Clone, Copy, Debug)]
pub struct RestFace {
    /// Outward unit normal.
    pub normal: Vec3,
    /// Corners, in order around the face `[m]`.
    pub corners: [Vec3; 4],
    /// Area `[m²]`.
    pub area: f64,
    /// Corners of the cell's face, extended to the middle of the surrounding gaps `[m]`.
    pub whole: [Vec3; 4],
}

impl RestFace {
    /// Centre of the corners `[m]`.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 4.0
    }
}

impl BlockFace {
    /// All pairs of a face of each of two blocks; of a part only faces of its cell.
    pub fn pairs(geometry: &Geometry, blocks: [usize; 2]) -> impl Iterator<Item = [Self; 2]> {
        let faces = |block| {
            let part = geometry.part(block);
            let of_cell = move |face: &FaceId| {
                part.is_none_or(|part| !face.upper && part.faces[face.direction].is_some())
            };
            FaceId::all().filter(of_cell).map(move |face| Self { block, face })
        };
        faces(blocks[0]).flat_map(move |first| faces(blocks[1]).map(move |second| [first, second]))
    }

    /// Direction of the block's lattice that the face lies across.
    #[must_use]
    pub fn direction(&self) -> usize {
        self.face.direction
    }

    /// Lattice steps of the face's corners, in order around it.
    #[must_use]
    pub fn steps(&self, geometry: &Geometry) -> [[usize; 3]; 4] {
        let topology = geometry.topology(self.block);
        let n = topology.divisions();
        [[0, 0], [n, 0], [n, n], [0, n]].map(|at| topology.on_face(self.face, at))
    }

    /// Corners, in order around the face `[m]`.
    #[must_use]
    pub fn corners(&self, geometry: &Geometry) -> [Vec3; 4] {
        self.steps(geometry).map(|at| geometry.position(self.block, at))
    }

    /// Position of the face at rest.
    #[must_use]
    pub fn at_rest(&self, geometry: &Geometry) -> RestFace {
        let lattice = geometry.lattice(self.block);
        if lattice.part.is_some() {
            let (normal, corners) = (self.outward(geometry), self.corners(geometry));
            return RestFace { normal, corners, area: self.area(geometry), whole: corners };
        }
        let cell = geometry.blocks[self.block].cell.map(|c| c as usize);
        let faces = lattice.faces(cell, self.face.direction);
        let [a, b, c, opposite] = faces[usize::from(self.face.upper)];
        RestFace {
            normal: self.outward(geometry),
            corners: self.corners(geometry),
            area: self.area(geometry),
            whole: [a, b, opposite, c],
        }
    }

    /// Centre of the face `[m]`.
    #[must_use]
    pub fn centre(&self, geometry: &Geometry) -> Vec3 {
        self.corners(geometry).iter().sum::<Vec3>() / 4.0
    }

    /// Area of the face `[m²]`.
    #[must_use]
    pub fn area(&self, geometry: &Geometry) -> f64 {
        let [a, b, c, d] = self.corners(geometry);
        if geometry.part(self.block).is_some() {
            return (c - a).cross(&(d - b)).norm() / 2.0;
        }
        (b - a).cross(&(d - a)).norm()
    }

    /// Outward unit normal.
    #[must_use]
    pub fn outward(&self, geometry: &Geometry) -> Vec3 {
        if geometry.part(self.block).is_some() {
            // Corners follow each other from the first edge after the direction to the second one.
            let [a, b, c, d] = self.corners(geometry);
            return (c - a).cross(&(d - b)).normalize() * f64::from(self.face.side());
        }
        let normal = geometry.lattice(self.block).normal(self.face.direction);
        normal * f64::from(self.face.side())
    }

    /// Corners, moved across the gaps beside the face `[m]`: the areas of its nodes extend that
    /// far.
    #[must_use]
    pub fn extended_corners(&self, geometry: &Geometry) -> [Vec3; 4] {
        self.steps(geometry).map(|at| {
            let x = geometry.position(self.block, at);
            let beside = (0..3).filter(|&d| d != self.face.direction).filter_map(|d| {
                let (other, step) = geometry.partner(self.block, at, d)?;
                Some(geometry.position(other, step) - x)
            });
            x + beside.sum::<Vec3>()
        })
    }

    /// True if another block has all corners of the face tied to its own.
    pub(super) fn is_tied(&self, geometry: &Geometry) -> bool {
        let others = |at: [usize; 3]| {
            let tied = geometry.ties.with(geometry.node(self.block, at) as u32).iter();
            let blocks = tied.map(|&node| geometry.block_of(node as usize));
            blocks.filter(|&block| block != self.block && !geometry.is_removed(block))
        };
        let [first, rest @ ..] = self.steps(geometry);
        others(first).any(|block| rest.iter().all(|&at| others(at).any(|other| other == block)))
    }

    /// True if no block and no joint is on the other side.
    #[must_use]
    pub fn is_outer(&self, geometry: &Geometry) -> bool {
        geometry.beyond(self.block, self.face).is_none()
            && geometry.nonconforming(self.block, self.face.number()).is_none()
            && !self.is_tied(geometry)
    }
}

/// Gauss points of an edge from 0 to 1.
const POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Shape functions of the corners of a quadrilateral at its four Gauss points, and their areas
/// `[m²]`. Sums over them are exact for products of a shape function and a linear one.
#[must_use]
pub fn quad_points(corners: &[Vec3; 4]) -> [([f64; 4], f64); 4] {
    std::array::from_fn(|at| {
        let [s, t] = [POINTS[at % 2], POINTS[at / 2]];
        let along = (corners[1] - corners[0]) * (1.0 - t) + (corners[2] - corners[3]) * t;
        let across = (corners[3] - corners[0]) * (1.0 - s) + (corners[2] - corners[1]) * s;
        (weights([s, t]), along.cross(&across).norm() / 4.0)
    })
}
