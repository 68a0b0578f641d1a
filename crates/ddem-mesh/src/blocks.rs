//! Numbering, edges, faces and neighbours of blocks, as all higher modules use them.

use super::topology::Topology;
use super::{Geometry, PartShape, Vec3};
use ddem_mechanics::collide::FaceId;

impl Geometry {
    /// Numbering of the nodes, elements and faces of a block.
    #[must_use]
    pub fn topology(&self, block: usize) -> Topology {
        Topology::lattice(self.lattice(block).divisions)
    }

    /// True if a block does not deform (§8).
    #[must_use]
    pub fn is_rigid(&self, block: usize) -> bool {
        self.lattice(block).rigid
    }

    /// Shape of a block that is a part of a cell.
    #[must_use]
    pub fn part(&self, block: usize) -> Option<&PartShape> {
        self.lattice(block).part.as_deref()
    }

    /// True if the elements of a block are boxes.
    #[must_use]
    pub fn is_box(&self, block: usize) -> bool {
        let lattice = self.lattice(block);
        lattice.part.is_none() && lattice.is_box()
    }

    fn cell(&self, block: usize) -> [usize; 3] {
        self.blocks[block].cell.map(|c| c as usize)
    }

    /// Unit vectors along the edges of a block.
    #[must_use]
    pub fn axes(&self, block: usize) -> &[Vec3; 3] {
        &self.lattice(block).axes
    }

    /// Unit normal of the faces of a block across a direction, towards the upper one.
    #[must_use]
    pub fn normal(&self, block: usize, d: usize) -> Vec3 {
        self.lattice(block).normal(d)
    }

    /// Edges of one element of a block `[m]`.
    #[must_use]
    pub fn element_edges(&self, block: usize) -> [Vec3; 3] {
        [0, 1, 2].map(|d| self.axes(block)[d] * self.spacing(block, d))
    }

    /// Element size of a block along an edge `[m]`.
    #[must_use]
    pub fn spacing(&self, block: usize, d: usize) -> f64 {
        self.lattice(block).spacing(d, self.blocks[block].cell[d] as usize)
    }

    /// Length of an edge of a block `[m]`.
    #[must_use]
    pub fn edge(&self, block: usize, d: usize) -> f64 {
        self.spacing(block, d) * self.topology(block).divisions() as f64
    }

    /// Shortest edge of a block `[m]`.
    #[must_use]
    pub fn shortest_edge(&self, block: usize) -> f64 {
        let edge = |d: usize| self.edge(block, d);
        edge(0).min(edge(1)).min(edge(2))
    }

    /// Longest edge of a block `[m]`.
    #[must_use]
    pub fn longest_edge(&self, block: usize) -> f64 {
        let edge = |d: usize| self.edge(block, d);
        edge(0).max(edge(1)).max(edge(2))
    }

    /// Height of one element of a block above the faces across a direction `[m]`.
    #[must_use]
    pub fn height(&self, block: usize, d: usize) -> f64 {
        self.spacing(block, d) * self.normal(block, d).dot(&self.axes(block)[d])
    }

    /// Height of one element under a face across a direction `[m]`. In cells it is the width of the
    /// cell over the elements across it.
    #[must_use]
    pub fn surface_height(&self, block: usize, d: usize) -> f64 {
        match self.part(block) {
            Some(part) => part.width / (2 * self.topology(block).divisions()) as f64,
            None => self.height(block, d),
        }
    }

    /// Block beyond a face, with a joint of their lattice between them.
    #[must_use]
    pub fn beyond(&self, block: usize, face: FaceId) -> Option<usize> {
        let mut offset = [0; 3];
        offset[face.direction] = face.side();
        self.neighbour(block, offset)
    }

    /// Block beyond the upper face across a direction; the given block owns the joint between them.
    #[must_use]
    pub fn above(&self, block: usize, d: usize) -> Option<usize> {
        self.beyond(block, FaceId { direction: d, upper: true })
    }

    /// Cells from one block to another along each edge; `None` if they are in different lattices.
    #[must_use]
    pub fn steps_between(&self, from: usize, to: usize) -> Option<[i64; 3]> {
        let [a, b] = [from, to].map(|block| &self.blocks[block]);
        let step = |d: usize| i64::from(b.cell[d]) - i64::from(a.cell[d]);
        (a.lattice == b.lattice).then(|| [0, 1, 2].map(step))
    }

    /// Number of the joint at the upper side of a block across a direction.
    #[must_use]
    pub fn joint_above(&self, block: usize, d: usize) -> u16 {
        self.lattice(block).joint_above(self.cell(block), d)
    }

    /// Width of the gap at the upper side of a block across a direction `[m]`.
    #[must_use]
    pub fn gap_above(&self, block: usize, d: usize) -> f64 {
        self.lattice(block).gaps[d][self.cell(block)[d] + 1]
    }

    /// Area of a quarter of an element of the joint at the upper side of a block `[m²]`.
    #[must_use]
    pub fn joint_quarter(&self, block: usize, d: usize) -> f64 {
        self.lattice(block).joint_area(self.cell(block), d) / 4.0
    }
}
