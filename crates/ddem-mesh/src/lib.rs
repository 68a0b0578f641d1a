//! Geometry of blocks and joints (§1).
//!
//! Each block set is a tensor-product [`Lattice`] cut by joint planes. A block is its cell moved
//! inward by half the joint thickness at every plane, but not at the outer faces. Blocks, face
//! joints, strips and corners therefore tile the region exactly:
//!
//! ```text
//!  block 0         block 1          plan view; t = thickness
//!  +-------+ |t| +-------+ |t|
//!  |       | |f| |       | |f|     f  face joint, between two blocks
//!  +-------+ +-+ +-------+ +-+
//!  ---- f ---|s|---- f ----|s|     s  strip, where two planes cross
//!  +-------+ +-+ +-------+ +-+     c  corner, where three planes cross
//!  |       | | | |       | | |
//! ```

pub mod assembly;
mod block_face;
mod blocks;
mod bodies;
mod cells;
mod conforming;
pub mod connected;
mod facing;
mod free_face;
pub mod grid;
mod hexahedra;
mod hexmesh;
pub mod in_situ;
pub mod inertia;
pub mod joint_sections;
mod lattice;
mod nonconforming;
pub mod numbering;
pub mod pack;
mod pages;
pub mod parallel;
mod part;
pub mod properties;
pub mod slot;
mod stages;
mod surface_point;
mod ties;
mod topology;
mod whole;

pub use block_face::{BlockFace, RestFace, TributaryLengths, quad_points};
pub use bodies::{BodyPart, CellBodies};
pub use cells::moved_to;
pub use conforming::ConformingJoint;
pub use conforming::faces;
pub use facing::{FaceOverlap, MISSES, SLIVER};
pub use free_face::FreeElement;
pub use hexmesh::{HexMesh, MeshBlock, MeshError, MeshFaces};
pub use lattice::{ELSEWHERE, Lattice, NO_JOINT, NONE, bounds, bounds_of};
pub use nonconforming::{NonconformingFace, NonconformingJoint};
pub use pages::Pages;
pub use part::{PartShape, distorted, stiffest_nodes};
pub use stages::Stages;
pub use surface_point::SurfacePoint;
pub use ties::{TiedSlots, Ties};
pub use topology::Topology;
pub use whole::CellCount;

use std::sync::Arc;

use nalgebra::Vector3;

/// Distance within which a point lies on a face, as a fraction of an edge.
pub const ON_FACE: f64 = 1e-9;

/// A vector of three components.
pub type Vec3 = Vector3<f64>;

/// Block of a model.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Number of its lattice.
    pub lattice: u32,
    /// Cell in that lattice.
    pub cell: [u32; 3],
    /// Number of its first node; its nodes are contiguous, x fastest.
    pub first_node: u32,
    /// Number of its first element; its elements are contiguous, x fastest.
    pub first_element: u32,
    /// Number of its material.
    pub material: u16,
}

/// All blocks, in the order of the deck; within a set x runs fastest.
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
    /// Nonconforming joints between lattices, sorted by their blocks. Joints of removed blocks are
    /// included.
    pub nonconforming_joints: Arc<Vec<NonconformingJoint>>,
    /// Indices of these joints by block and number of the face, sorted.
    by_face: Arc<Vec<(u32, u8, u32)>>,
    /// Faces of different sets that are nearer than the thickness of their joint, but not joined.
    pub unjoined_faces: Arc<Vec<NonconformingJoint>>,
    /// Low and high corner of the box around all block sets `[m]`.
    pub bounds: [Vec3; 2],
    /// Pairs of lattices without a gap between them.
    pub touching: Arc<Vec<(usize, usize)>>,
    /// Nodes that move as one. Those of removed blocks are included.
    pub ties: Arc<Ties>,
}

impl Geometry {
    /// Geometry of the blocks in the cells of lattices, with numbered blocks and nodes. It has no
    /// joints between lattices yet.
    #[must_use]
    pub fn new(lattices: Vec<Arc<Lattice>>, bounds: [Vec3; 2]) -> Self {
        let mut geometry = Self {
            lattices,
            blocks: Arc::default(),
            n_nodes: 0,
            n_elements: 0,
            nonconforming_joints: Arc::default(),
            by_face: Arc::default(),
            unjoined_faces: Arc::default(),
            bounds,
            touching: Arc::default(),
            ties: Arc::default(),
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

    /// Removes blocks. They keep their numbers, but are no longer neighbours of others.
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

    /// Memory that is not shared with another geometry `[bytes]`.
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
            + if shared(|own, other| Arc::ptr_eq(&own.ties, &other.ties)) {
                0
            } else {
                self.ties.bytes()
            }
    }

    /// Number of a block's set.
    pub fn set(&self, block: usize) -> usize {
        self.lattice(block).set
    }

    /// Lattice of a block.
    pub fn lattice(&self, block: usize) -> &Lattice {
        &self.lattices[self.blocks[block].lattice as usize]
    }

    /// Block at an offset of −1, 0 or 1 cells from a block.
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

    /// Panics if there is no such node, because a wrong number would give a wrong position.
    #[track_caller]
    pub fn has_node(&self, node: usize) {
        let n = self.n_nodes;
        assert!(node < n, "there is no node {node}: the model has {n} nodes, from 0");
    }

    /// Panics if there is no such block.
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

    /// Block of a node, and the lattice steps of the node in it.
    #[track_caller]
    pub fn locate(&self, node: usize) -> (usize, [usize; 3]) {
        let block = self.block_of(node);
        let local = node - self.blocks[block].first_node as usize;
        (block, self.topology(block).steps(local))
    }

    /// Centre of a block's cell, which includes the surrounding joints `[m]`.
    pub fn centre(&self, block: usize) -> Vec3 {
        self.lattice(block).centre(self.blocks[block].cell.map(|c| c as usize))
    }

    /// Centroid of a block, or of the cell that it is a part of `[m]`.
    pub fn centroid(&self, block: usize) -> Vec3 {
        self.part(block).map_or_else(|| self.centre(block), |part| part.centroid)
    }

    /// Depth of a point inside a block as a fraction of its edges (negative outside), and the
    /// element nearest to the point.
    pub fn inside(&self, block: usize, x: &Vec3) -> (f64, [usize; 3]) {
        let n = self.topology(block).divisions() as f64;
        if let Some(part) = self.part(block) {
            let at = part.coordinates(x);
            let inside = at.iter().map(|at| at.min(1.0 - at)).fold(f64::INFINITY, f64::min);
            return (
                inside,
                at.map(|at| ((at * n - ON_FACE).ceil() - 1.0).clamp(0.0, n - 1.0) as usize),
            );
        }
        let from = self.position(block, [0; 3]);
        let (mut inside, mut element) = (f64::INFINITY, [0; 3]);
        for (d, element) in element.iter_mut().enumerate() {
            let normal = self.normal(block, d);
            let along = (x - from).dot(&normal) / normal.dot(&self.axes(block)[d]);
            let part = along / (n * self.spacing(block, d));
            inside = inside.min(part.min(1.0 - part));
            // A point on a face between two elements belongs to the lower one.
            *element = ((part * n - ON_FACE).ceil() - 1.0).clamp(0.0, n - 1.0) as usize;
        }
        (inside, element)
    }

    /// Corners of a block, numbered by bits `[m]`.
    pub fn corners(&self, block: usize) -> [Vec3; 8] {
        self.topology(block).corners().map(|at| self.position(block, at))
    }

    /// Number of the node at lattice steps `at` of a block.
    pub fn node(&self, block: usize, at: [usize; 3]) -> usize {
        self.blocks[block].first_node as usize + self.topology(block).node(at)
    }

    /// Reference position of the node at lattice steps `at` of a block `[m]`.
    pub fn position(&self, block: usize, at: [usize; 3]) -> Vec3 {
        let lattice = self.lattice(block);
        if let Some(part) = &lattice.part {
            return part.point(at.map(|at| at as f64 / lattice.divisions as f64));
        }
        let cell = self.blocks[block].cell;
        lattice.point([0, 1, 2].map(|d| lattice.line(d, cell[d] as usize, at[d])))
    }
}
