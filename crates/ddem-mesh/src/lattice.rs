//! Lattice of one block set.

use std::sync::Arc;

use super::{Pages, PartShape, Vec3};

/// Marker for a cell without a block.
pub const NONE: u32 = u32::MAX;
/// Marker for a cell without a block, whose space a coarser or finer lattice fills.
pub const ELSEWHERE: u32 = u32::MAX - 1;
/// Marker for no joint.
pub const NO_JOINT: u16 = u16::MAX;

/// Lattice of cells between joint planes, with nodes on lines along three edges.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Number of the block set.
    pub set: usize,
    /// Entry of `refine` that made the lattice from coarser blocks.
    pub refined: Option<usize>,
    /// Position of the lower corner `[m]`.
    pub origin: Vec3,
    /// Unit vectors along the three edges.
    pub axes: [Vec3; 3],
    /// Elements along each edge of a block; 1 for rigid blocks.
    pub divisions: usize,
    /// True if the blocks do not deform (§8).
    pub rigid: bool,
    /// Cells along each edge.
    pub count: [usize; 3],
    /// Positions of the cuts along each edge, shape `(count + 1)` `[m]`.
    pub cuts: [Vec<f64>; 3],
    /// Lengths of the cells along each edge `[m]`; they are equal if the cuts are evenly spaced.
    pub lengths: [Vec<f64>; 3],
    /// Width of the gap at each cut along the edge, shape `(count + 1)` `[m]`.
    pub gaps: [Vec<f64>; 3],
    /// Block in each cell, or [`NONE`] or [`ELSEWHERE`]; x fastest.
    pub block: Pages,
    /// Material of each cell.
    pub material: Arc<Vec<u16>>,
    /// Joint at the upper side of each cell, for each direction of the normal.
    pub joint: [Arc<Vec<u16>>; 3],
    /// Joint of the set for each direction of the normal, also at its outer faces.
    pub own_joint: [u16; 3],
    /// True shape of the block, if the lattice is a part of a cell.
    pub part: Option<Arc<PartShape>>,
}

impl Lattice {
    /// Lattice of one deformable block without joints.
    pub(super) fn of_one_block(
        set: usize,
        material: u16,
        divisions: usize,
        origin: Vec3,
        edges: [Vec3; 3],
    ) -> Self {
        let lengths = edges.map(|edge| edge.norm());
        let no_joint: Arc<Vec<u16>> = vec![NO_JOINT].into();
        Self {
            set,
            refined: None,
            origin,
            axes: edges.map(|edge| edge.normalize()),
            divisions,
            rigid: false,
            count: [1; 3],
            cuts: lengths.map(|length| vec![0.0, length]),
            lengths: lengths.map(|length| vec![length]),
            gaps: [0; 3].map(|_| vec![0.0; 2]),
            block: vec![0].into(),
            material: vec![material].into(),
            joint: [no_joint.clone(), no_joint.clone(), no_joint],
            own_joint: [NO_JOINT; 3],
            part: None,
        }
    }

    /// Number of a cell; x fastest.
    pub fn index(&self, cell: [usize; 3]) -> usize {
        cell[0] + self.count[0] * (cell[1] + self.count[1] * cell[2])
    }

    /// Cell with a number.
    pub fn cell(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.count;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// True if a cell has a block.
    pub fn has_block(&self, index: usize) -> bool {
        self.block[index] < ELSEWHERE
    }

    /// Number of nodes of one block.
    pub fn nodes_per_block(&self) -> usize {
        (self.divisions + 1).pow(3)
    }

    /// Element size along an edge in a cell `[m]`.
    pub fn spacing(&self, d: usize, cell: usize) -> f64 {
        let gaps = self.gaps[d][cell] / 2.0 + self.gaps[d][cell + 1] / 2.0;
        (self.lengths[d][cell] - gaps) / self.divisions as f64
    }

    /// Area of one element of the joint at the upper side of a cell along d `[m²]`. Between rigid
    /// blocks it extends to the middle of the surrounding gaps, because they have no strips.
    pub fn joint_area(&self, cell: [usize; 3], d: usize) -> f64 {
        let edge = |e: usize| {
            let whole =
                if self.rigid { self.lengths[e][cell[e]] } else { self.spacing(e, cell[e]) };
            self.axes[e] * whole
        };
        edge((d + 1) % 3).cross(&edge((d + 2) % 3)).norm()
    }

    /// Position along an edge of the i-th line of nodes in a cell `[m]`.
    pub fn line(&self, d: usize, cell: usize, i: usize) -> f64 {
        if i == self.divisions {
            self.cuts[d][cell + 1] - self.gaps[d][cell + 1] / 2.0
        } else {
            self.cuts[d][cell] + self.gaps[d][cell] / 2.0 + i as f64 * self.spacing(d, cell)
        }
    }

    /// Point at the given positions along the three edges `[m]`.
    pub fn point(&self, along: [f64; 3]) -> Vec3 {
        self.origin + self.axes[0] * along[0] + self.axes[1] * along[1] + self.axes[2] * along[2]
    }

    /// Unit normal of the planes that cut edge d, pointing to its upper end.
    pub fn normal(&self, d: usize) -> Vec3 {
        let n = self.axes[(d + 1) % 3].cross(&self.axes[(d + 2) % 3]).normalize();
        if n.dot(&self.axes[d]) < 0.0 { -n } else { n }
    }

    /// True if elements are boxes along the coordinate axes.
    pub fn is_box(&self) -> bool {
        (0..3).all(|d| (0..3).all(|k| d == k || self.axes[d][k] == 0.0))
    }

    /// Joint at the upper side of a cell along d.
    pub fn joint_above(&self, cell: [usize; 3], d: usize) -> u16 {
        self.joint[d][self.index(cell)]
    }

    /// Centre of a cell `[m]`.
    pub fn centre(&self, cell: [usize; 3]) -> Vec3 {
        self.point([0, 1, 2].map(|d| (self.cuts[d][cell[d]] + self.cuts[d][cell[d] + 1]) / 2.0))
    }

    /// Corners of the lower (0) and upper (1) faces of a cell along d, gaps included.
    pub fn faces(&self, cell: [usize; 3], d: usize) -> [[Vec3; 4]; 2] {
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        [0, 1].map(|side| {
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, k)| {
                let mut along = [0.0; 3];
                along[d] = self.cuts[d][cell[d] + side];
                along[e] = self.cuts[e][cell[e] + i];
                along[f] = self.cuts[f][cell[f] + k];
                self.point(along)
            })
        })
    }

    /// Memory that is not shared with another lattice `[bytes]`.
    pub fn bytes(&self, other: Option<&Self>) -> usize {
        let numbers = [&self.cuts, &self.lengths, &self.gaps].into_iter().flatten();
        let cells = |lattice: &Self| {
            let [x, y, z] = lattice.joint.clone();
            [lattice.material.clone(), x, y, z]
        };
        let known: Vec<Arc<Vec<u16>>> = other.into_iter().flat_map(cells).collect();
        let own = cells(self).into_iter();
        let own = own.filter(|cells| !known.iter().any(|other| Arc::ptr_eq(cells, other)));
        numbers.map(|numbers| size_of_val(&numbers[..])).sum::<usize>()
            + own.map(|cells| size_of_val(&cells[..])).sum::<usize>()
            + self.block.bytes(other.map(|other| &other.block))
    }

    /// Shortest edge of a cell `[m]`.
    pub fn shortest(&self) -> f64 {
        self.lengths.iter().flatten().copied().fold(f64::INFINITY, f64::min)
    }

    /// Corners of a range of cells, numbered by bits `[m]`.
    pub fn corners_of(&self, from: [usize; 3], to: [usize; 3]) -> [Vec3; 8] {
        std::array::from_fn(|k| {
            let end = |d: usize| if k & (1 << d) == 0 { from[d] } else { to[d] };
            self.point([0, 1, 2].map(|d| self.cuts[d][end(d)]))
        })
    }

    /// Corners of the whole lattice, numbered by bits `[m]`.
    pub fn corners(&self) -> [Vec3; 8] {
        self.corners_of([0; 3], self.count)
    }
}

/// Low and high corner of the box around points `[m]`.
pub fn bounds_of(points: &[Vec3]) -> [Vec3; 2] {
    let start = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
    points.iter().fold(start, |[low, high], x| [low.inf(x), high.sup(x)])
}

/// Low and high corner of the box around all lattices `[m]`.
pub fn bounds(lattices: &[Arc<Lattice>]) -> [Vec3; 2] {
    bounds_of(&lattices.iter().flat_map(|lattice| lattice.corners()).collect::<Vec<_>>())
}
