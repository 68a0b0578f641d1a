//! §1: what is where.
//!
//! Each block set is a tensor-product [`Lattice`] cut by joint planes. A cell's body is moved
//! inward by half the thickness at every plane, never at the outer faces, so that bodies, face
//! joints, strips and corners tile the region exactly:
//!
//! ```text
//!   body 0          body 1          plan view; t = thickness
//!  +-------+ |t| +-------+ |t|
//!  |       | |f| |       | |f|     f  face joint, between two bodies
//!  +-------+ +-+ +-------+ +-+
//!  ---- f ---|s|---- f ----|s|     s  strip, where two planes cross
//!  +-------+ +-+ +-------+ +-+     c  corner, where three cross
//!  |       | | | |       | | |
//! ```

pub mod assembly;
mod block_face;
mod blocks;
mod cells;
mod conforming;
pub mod connected;
mod facing;
pub mod grid;
mod hexmesh;
pub mod in_situ;
pub mod inertia;
pub mod joint_sections;
mod lattice;
mod nonconforming;
pub mod pack;
mod pages;
pub mod parallel;
pub mod properties;
pub mod slot;
mod stages;
mod surface_point;
mod topology;

pub use block_face::{BlockFace, RestFace, Strip};
pub use cells::moved_to;
pub use conforming::ConformingJoint;
pub use conforming::faces;
pub use facing::{FaceOverlap, MISSES, SLIVER};
pub use hexmesh::{HexMesh, MeshBlock, MeshError, MeshFaces};
pub use lattice::{ELSEWHERE, Lattice, NO_JOINT, NONE, bounds, bounds_of};
pub use nonconforming::{NonconformingFace, NonconformingJoint};
pub use pages::Pages;
pub use stages::Stages;
pub use surface_point::SurfacePoint;
pub use topology::Topology;

use std::sync::Arc;

use nalgebra::Vector3;

/// Part of an edge within which a point lies on a face.
pub const ON_FACE: f64 = 1e-9;

/// A vector of three components.
pub type Vec3 = Vector3<f64>;

/// One block.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Its lattice.
    pub lattice: u32,
    /// Its cell there.
    pub cell: [u32; 3],
    /// Number of its first node; its nodes are contiguous, x fastest.
    pub first_node: u32,
    /// Number of its first element; its elements are contiguous, x fastest.
    pub first_element: u32,
    /// Its material.
    pub material: u16,
}

/// All blocks, in the order of the deck, and in a set with x fastest.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Lattices.
    pub lattices: Vec<Arc<Lattice>>,
    /// Blocks.
    pub blocks: Arc<Vec<Block>>,
    /// Number of nodes.
    pub n_nodes: usize,
    /// Number of elements.
    pub n_elements: usize,
    /// Faces of different lattices that lie on each other, with the joint between them, by their blocks: those
    /// of blocks that have been taken out since, too.
    pub nonconforming_joints: Arc<Vec<NonconformingJoint>>,
    /// Places there by block and number of the face, in order.
    by_face: Arc<Vec<(u32, u8, u32)>>,
    /// Faces of different sets that are nearer than their joint is thick, and not joined.
    pub apart: Arc<Vec<NonconformingJoint>>,
    /// Corners of the box around all sets of blocks `[m]`.
    pub bounds: [Vec3; 2],
    /// Lattices that have no gap between them.
    pub touching: Arc<Vec<(usize, usize)>>,
}

impl Geometry {
    /// Blocks in the cells of lattices, with numbers for them and their nodes, and no joints between lattices yet.
    #[must_use]
    pub fn new(lattices: Vec<Arc<Lattice>>, bounds: [Vec3; 2]) -> Self {
        let mut geometry = Self {
            lattices,
            blocks: Arc::default(),
            n_nodes: 0,
            n_elements: 0,
            nonconforming_joints: Arc::default(),
            by_face: Arc::default(),
            apart: Arc::default(),
            bounds,
            touching: Arc::default(),
        };
        geometry.number();
        geometry
    }

    fn number(&mut self) {
        let blocks = Arc::make_mut(&mut self.blocks);
        for (index, lattice) in self.lattices.iter_mut().map(Arc::make_mut).enumerate() {
            let nodes = lattice.nodes_per_block();
            let [nx, ny, nz] = lattice.count;
            for (z, y, x) in
                (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x))))
            {
                let cell = lattice.index([x, y, z]);
                if !lattice.has_block(cell) {
                    continue;
                }
                lattice.block[cell] = blocks.len() as u32;
                blocks.push(Block {
                    lattice: index as u32,
                    cell: [x as u32, y as u32, z as u32],
                    first_node: self.n_nodes as u32,
                    first_element: self.n_elements as u32,
                    material: lattice.material[cell],
                });
                self.n_nodes += nodes;
                self.n_elements += Topology::lattice(lattice.divisions).elements();
            }
        }
    }

    /// Takes blocks out: they keep their numbers, and are nobody's neighbours.
    pub fn remove(&mut self, blocks: &[usize]) {
        for &block in blocks {
            let Block { lattice, cell, .. } = self.blocks[block];
            let lattice = Arc::make_mut(&mut self.lattices[lattice as usize]);
            let index = lattice.index(cell.map(|c| c as usize));
            lattice.block[index] = NONE;
        }
    }

    /// True if a block has been removed.
    pub fn is_removed(&self, block: usize) -> bool {
        let cell = self.blocks[block].cell.map(|c| c as usize);
        let lattice = self.lattice(block);
        lattice.block[lattice.index(cell)] == NONE
    }

    /// Memory besides what another geometry has, too `[bytes]`.
    pub fn bytes(&self, other: Option<&Self>) -> usize {
        let known = |k: usize| other.map(|other| &other.lattices[k]);
        let own = self.lattices.iter().enumerate();
        let own = own.filter(|(k, own)| known(*k).is_none_or(|other| !Arc::ptr_eq(own, other)));
        let shared = |so: fn(&Self, &Self) -> bool| other.is_some_and(|other| so(self, other));
        let blocks = shared(|own, other| Arc::ptr_eq(&own.blocks, &other.blocks));
        let nonconforming_joints = shared(|own, other| {
            Arc::ptr_eq(&own.nonconforming_joints, &other.nonconforming_joints)
        });
        own.map(|(k, own)| size_of::<Lattice>() + own.bytes(known(k).map(|l| &**l))).sum::<usize>()
            + size_of_val(&self.lattices[..])
            + if blocks { 0 } else { size_of_val(&self.blocks[..]) }
            + if nonconforming_joints { 0 } else { size_of_val(&self.nonconforming_joints[..]) }
            + if nonconforming_joints { 0 } else { size_of_val(&self.by_face[..]) }
    }

    /// The block set of a body.
    pub fn set(&self, block: usize) -> usize {
        self.lattice(block).set
    }

    /// Lattice of a block.
    pub fn lattice(&self, block: usize) -> &Lattice {
        &self.lattices[self.blocks[block].lattice as usize]
    }

    /// The body at an offset of −1, 0 or 1 cells from a body.
    pub fn neighbour(&self, block: usize, offset: [i32; 3]) -> Option<usize> {
        if self.is_removed(block) {
            return None;
        }
        let lattice = self.lattice(block);
        let mut cell = [0; 3];
        for d in 0..3 {
            let at = i64::from(self.blocks[block].cell[d]) + i64::from(offset[d]);
            if at < 0 || at >= lattice.count[d] as i64 {
                return None;
            }
            cell[d] = at as usize;
        }
        match lattice.block[lattice.index(cell)] {
            NONE | ELSEWHERE => None,
            block => Some(block as usize),
        }
    }

    /// Panics where there is no such node: the answer to a wrong number would be a wrong place.
    #[track_caller]
    pub fn has_node(&self, node: usize) {
        let n = self.n_nodes;
        assert!(node < n, "there is no node {node}: the model has {n} nodes, from 0");
    }

    /// Panics where there is no such block.
    #[track_caller]
    pub fn has_block(&self, block: usize) {
        let n = self.blocks.len();
        assert!(block < n, "there is no block {block}: the model has {n} blocks, from 0");
    }

    /// Block of a node.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn block_of(&self, node: usize) -> usize {
        self.has_node(node);
        self.blocks.partition_point(|b| b.first_node as usize <= node) - 1
    }

    /// The body that has a node, and the node's lattice steps in it.
    #[track_caller]
    pub fn locate(&self, node: usize) -> (usize, [usize; 3]) {
        let block = self.block_of(node);
        let local = node - self.blocks[block].first_node as usize;
        (block, self.topology(block).steps(local))
    }

    /// Centre of a body's cell, the joints around it included `[m]`.
    pub fn centre(&self, block: usize) -> Vec3 {
        self.lattice(block).centre(self.blocks[block].cell.map(|c| c as usize))
    }

    /// Depth of a point inside a block, as a part of its edges (negative: outside), and the element nearest
    /// to it.
    pub fn inside(&self, block: usize, x: &Vec3) -> (f64, [usize; 3]) {
        let n = self.topology(block).divisions() as f64;
        let from = self.position(block, [0; 3]);
        let (mut inside, mut element) = (f64::INFINITY, [0; 3]);
        for (d, element) in element.iter_mut().enumerate() {
            let normal = self.normal(block, d);
            let along = (x - from).dot(&normal) / normal.dot(&self.axes(block)[d]);
            let part = along / (n * self.spacing(block, d));
            inside = inside.min(part.min(1.0 - part));
            // On a face between two elements the lower one.
            *element = ((part * n - ON_FACE).ceil() - 1.0).clamp(0.0, n - 1.0) as usize;
        }
        (inside, element)
    }

    /// Corners of a body, numbered by bits `[m]`.
    pub fn corners(&self, block: usize) -> [Vec3; 8] {
        self.topology(block).corners().map(|at| self.position(block, at))
    }

    /// Number of the node at lattice steps `at` of a body.
    pub fn node(&self, block: usize, at: [usize; 3]) -> usize {
        self.blocks[block].first_node as usize + self.topology(block).node(at)
    }

    /// Reference position of the node at lattice steps `at` of a body `[m]`.
    pub fn position(&self, block: usize, at: [usize; 3]) -> Vec3 {
        let lattice = self.lattice(block);
        let cell = self.blocks[block].cell;
        lattice.point([0, 1, 2].map(|d| lattice.line(d, cell[d] as usize, at[d])))
    }
}
