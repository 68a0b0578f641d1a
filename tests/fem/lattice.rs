//! Blocks cut by joint planes, as a description and as a mesh.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use super::{Hexahedron, LatticePart, Mesh, OracleMaterial};

/// The node offsets of an element, in VTK order.
const VTK_OFFSETS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// A joint face: the one between `cell` and its next neighbour along `axis`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// The direction across the face.
    pub axis: usize,
    /// The cell on its low side.
    pub cell: [usize; 3],
}

/// A region cut into blocks by joint planes of a given thickness.
///
/// A cell is a place for a block, removed or not. It is named by its three indices or by its
/// number, x fastest, then y, then z.
pub struct OracleLattice<'a> {
    /// Start of the three edges of the region.
    pub origin: Vector3<f64>,
    /// Unit vectors along the edges, right-handed.
    pub axes: [Vector3<f64>; 3],
    /// Cuts between the cells along each edge: one more than there are blocks.
    pub cuts: [Vec<f64>; 3],
    /// Thickness of each inner joint plane, measured along its normal.
    pub thickness: [Vec<f64>; 3],
    /// Elements of a block along each edge.
    pub divisions: usize,
    /// Numbers of the cells without a block.
    pub removed: BTreeSet<usize>,
    /// The material of the block in a cell.
    pub body: Box<dyn Fn([usize; 3]) -> OracleMaterial + 'a>,
    /// The material of a joint; `None` if it is not a continuum.
    pub joint: Box<dyn Fn(Face) -> Option<OracleMaterial> + 'a>,
}

impl OracleLattice<'_> {
    /// A box of equal blocks along the coordinate axes, with joints of the rock itself.
    pub fn boxed(
        size: [f64; 3],
        count: [usize; 3],
        divisions: usize,
        thickness: f64,
        rock: OracleMaterial,
    ) -> Self {
        let cut = |axis: usize| {
            let step = size[axis] / count[axis] as f64;
            (0..=count[axis]).map(|index| index as f64 * step).collect()
        };
        Self {
            origin: Vector3::zeros(),
            axes: [Vector3::x(), Vector3::y(), Vector3::z()],
            cuts: [0, 1, 2].map(cut),
            thickness: count.map(|blocks| vec![thickness; blocks - 1]),
            divisions,
            removed: BTreeSet::new(),
            body: Box::new(move |_| rock),
            joint: Box::new(move |_| Some(rock)),
        }
    }

    /// Builds the mesh.
    pub fn mesh(&self) -> Mesh {
        let mut mesh = Mesh {
            nodes: Vec::new(),
            elements: Vec::new(),
            grid: Vec::new(),
            stations: [0, 1, 2].map(|axis| self.stations(axis)),
            divisions: self.divisions,
        };
        self.place_nodes(&mut mesh);
        self.place_bodies(&mut mesh);
        self.place_joints(&mut mesh);
        mesh
    }

    /// Number of cells along each axis.
    fn count(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.cuts[axis].len() - 1)
    }

    /// All cells, x fastest.
    fn cells(&self) -> Vec<[usize; 3]> {
        boxed_indices(self.count())
    }

    /// True if a cell holds a block.
    fn exists(&self, cell: [usize; 3]) -> bool {
        let count = self.count();
        !self.removed.contains(&(cell[0] + count[0] * (cell[1] + count[1] * cell[2])))
    }

    /// The width of each gap across `axis`, along the edge of that axis.
    fn gaps(&self, axis: usize) -> Vec<f64> {
        let normal = self.axes[(axis + 1) % 3].cross(&self.axes[(axis + 2) % 3]).normalize();
        let slant = normal.dot(&self.axes[axis]).abs();
        self.thickness[axis].iter().map(|thickness| thickness / slant).collect()
    }

    /// The lattice coordinates of all nodes along an axis, block after block.
    fn stations(&self, axis: usize) -> Vec<f64> {
        let (cuts, gaps) = (&self.cuts[axis], self.gaps(axis));
        let mut stations = Vec::new();
        for block in 0..cuts.len() - 1 {
            let before = if block > 0 { gaps[block - 1] / 2.0 } else { 0.0 };
            let after = gaps.get(block).map_or(0.0, |gap| gap / 2.0);
            let (low, high) = (cuts[block] + before, cuts[block + 1] - after);
            stations.extend(
                (0..=self.divisions)
                    .map(|index| low + (high - low) * index as f64 / self.divisions as f64),
            );
        }
        stations
    }

    /// Numbers and places the nodes of the blocks that exist.
    fn place_nodes(&self, mesh: &mut Mesh) {
        let size = mesh.grid_size();
        mesh.grid = vec![None; size.iter().product()];
        let edge = self.divisions + 1;
        for cell in self.cells().into_iter().filter(|&cell| self.exists(cell)) {
            for local in boxed_indices([edge; 3]) {
                let at = [0, 1, 2].map(|axis| cell[axis] * edge + local[axis]);
                mesh.grid[at[0] + size[0] * (at[1] + size[1] * at[2])] = Some(mesh.nodes.len());
                let along = |axis: usize| self.axes[axis] * mesh.stations[axis][at[axis]];
                mesh.nodes.push(self.origin + along(0) + along(1) + along(2));
            }
        }
    }

    /// Adds the elements of the blocks, block by block.
    fn place_bodies(&self, mesh: &mut Mesh) {
        let present = self.cells().into_iter().filter(|&cell| self.exists(cell));
        for (block, cell) in present.enumerate() {
            for local in boxed_indices([self.divisions; 3]) {
                let at = [0, 1, 2].map(|axis| cell[axis] * (self.divisions + 1) + local[axis]);
                mesh.elements.push(Hexahedron {
                    kind: LatticePart::Body,
                    nodes: nodes_at(mesh, at).expect("a block has all its nodes"),
                    material: (self.body)(cell),
                    block: Some(block),
                });
            }
        }
    }

    /// Adds the elements between the blocks: joints, then strips, then corners.
    fn place_joints(&self, mesh: &mut Mesh) {
        let intervals = mesh.grid_size().map(|stations| stations - 1);
        let mut found = Vec::new();
        for at in boxed_indices(intervals) {
            let across = at.map(|interval| mesh.is_gap(interval));
            let kind = match across.iter().filter(|&&gap| gap).count() {
                0 => continue,
                1 => LatticePart::Joint,
                2 => LatticePart::Strip,
                _ => LatticePart::Corner,
            };
            let cell = at.map(|interval| interval / (self.divisions + 1));
            if let (Some(nodes), Some(material)) =
                (nodes_at(mesh, at), self.meeting_material(cell, across))
            {
                found.push(Hexahedron { kind, nodes, material, block: None });
            }
        }
        found.sort_by_key(|element| element.kind);
        mesh.elements.append(&mut found);
    }

    /// The material where the joints across the given axes meet beyond `cell`: the most compliant
    /// one, the first on a tie. None unless all of them are continua with a thickness.
    fn meeting_material(&self, cell: [usize; 3], across: [bool; 3]) -> Option<OracleMaterial> {
        let mut softest: Option<OracleMaterial> = None;
        for axis in (0..3).filter(|&axis| across[axis]) {
            if self.thickness[axis][cell[axis]] <= 0.0 {
                return None;
            }
            let others = [0, 1, 2].map(|other| across[other] && other != axis);
            for step in boxed_indices(others.map(|wide| if wide { 2 } else { 1 })) {
                let low = [0, 1, 2].map(|other| cell[other] + step[other]);
                let joint = (self.joint)(Face { axis, cell: low })?;
                if softest.is_none_or(|so_far| joint.confined() < so_far.confined()) {
                    softest = Some(joint);
                }
            }
        }
        softest
    }
}

/// All index triples below `count`, the first index fastest.
fn boxed_indices(count: [usize; 3]) -> Vec<[usize; 3]> {
    let mut indices = Vec::with_capacity(count.iter().product());
    for k in 0..count[2] {
        for j in 0..count[1] {
            indices.extend((0..count[0]).map(|i| [i, j, k]));
        }
    }
    indices
}

/// The nodes of the element after a lattice point, if all of them exist.
fn nodes_at(mesh: &Mesh, at: [usize; 3]) -> Option<[usize; 8]> {
    let mut nodes = [0; 8];
    for (node, offset) in nodes.iter_mut().zip(VTK_OFFSETS) {
        *node = mesh.grid_node([0, 1, 2].map(|axis| at[axis] + offset[axis]))?;
    }
    Some(nodes)
}
