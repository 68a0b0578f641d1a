//! Blocks given as hexahedra between nodes, the form that other programs write.

use std::collections::BTreeMap;

use super::{Lattice, Vec3};
use ddem_mechanics::collide::FaceId;

/// Tolerance of a node's position as a fraction of an element edge.
const MISSES: f64 = 1e-6;

/// Blocks as hexahedra: nodes, and the nodes and block of each hexahedron.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HexMesh {
    /// Positions of the nodes, shape `(n_nodes, 3)` `[m]`.
    pub nodes: Vec<[f64; 3]>,
    /// Nodes of the hexahedra in VTK's order, shape `(n_hexes, 8)`.
    pub hexes: Vec<[u32; 8]>,
    /// Block of each hexahedron, numbered from 0 without gaps, shape `(n_hexes)`.
    pub blocks: Vec<u32>,
}

/// Error in a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The mesh has no hexahedron.
    #[error("the mesh has no hexahedron: give one or more")]
    Empty,
    /// The number of block numbers differs from the number of hexahedra.
    #[error(
        "the numbers of blocks ({blocks}) and of hexahedra ({hexes}) differ: each hexahedron has the number of its block"
    )]
    Blocks {
        /// Number of block numbers.
        blocks: usize,
        /// Number of hexahedra.
        hexes: usize,
    },
    /// A hexahedron has a node that does not exist.
    #[error("hexahedron {hex} has node {node}: the mesh has {nodes} nodes, from 0")]
    NoNode {
        /// Number of the hexahedron.
        hex: usize,
        /// Number of the node.
        node: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// A block number below the largest one has no hexahedron.
    #[error("block {block} has no hexahedron: blocks are numbered from 0 without gaps")]
    NoBlock {
        /// Number of the block.
        block: usize,
    },
    /// The position of a node is not finite.
    #[error("node {node} is at {at:?}, which is not finite: correct its coordinates")]
    NotFinite {
        /// Number of the node.
        node: u32,
        /// Position of the node `[m]`.
        at: [f64; 3],
    },
    /// Two blocks share a node, so that they can never separate.
    #[error("blocks {first} and {second} share node {node}: each block needs nodes of its own")]
    Shared {
        /// Number of the node.
        node: u32,
        /// Number of one block.
        first: u32,
        /// Number of the other block.
        second: u32,
    },
    /// The hexahedra of a block are not a grid of n × n × n equal parallelepipeds.
    #[error(
        "block {block} (number of hexahedra: {hexes}) is not a parallelepiped divided evenly into n × n × n: {why}; \
         other hexahedra are not supported"
    )]
    Shape {
        /// Number of the block.
        block: usize,
        /// Number of its hexahedra.
        hexes: usize,
        /// First deviation.
        why: String,
    },
}

/// Block of a mesh: an evenly divided parallelepiped.
#[derive(Clone, Debug)]
pub struct MeshBlock {
    /// Lower corner `[m]`.
    pub origin: Vec3,
    /// Edges of the whole block, right-handed, each nearest to the axis with its number `[m]`.
    pub edges: [Vec3; 3],
    /// Elements along each edge.
    pub divisions: usize,
    /// Nodes of the mesh in the order of the grid, the first edge fastest.
    pub nodes: Vec<u32>,
}

impl HexMesh {
    /// Blocks of the mesh.
    ///
    /// # Errors
    ///
    /// Wrong numbers, nodes that two blocks share, and blocks of other shapes.
    pub fn parallelepipeds(&self) -> Result<Vec<MeshBlock>, MeshError> {
        self.check()?;
        let count = self.blocks.iter().max().map_or(0, |last| *last as usize + 1);
        // With more blocks than hexahedra nothing is allocated for them.
        let count = count.min(self.hexes.len() + 1);
        let mut hexes = vec![Vec::new(); count];
        self.blocks.iter().zip(&self.hexes).for_each(|(&block, hex)| {
            if let Some(hexes) = hexes.get_mut(block as usize) {
                hexes.push(*hex);
            }
        });
        if let Some(block) = hexes.iter().position(Vec::is_empty) {
            return Err(MeshError::NoBlock { block });
        }
        let fitted = |(block, hexes): (usize, &Vec<[u32; 8]>)| {
            let count = hexes.len();
            self.fit(hexes).map_err(|why| MeshError::Shape { block, hexes: count, why })
        };
        hexes.iter().enumerate().map(fitted).collect()
    }

    fn check(&self) -> Result<(), MeshError> {
        let Self { nodes, hexes, blocks } = self;
        if hexes.is_empty() {
            return Err(MeshError::Empty);
        }
        if hexes.len() != blocks.len() {
            return Err(MeshError::Blocks { blocks: blocks.len(), hexes: hexes.len() });
        }
        let mut of_node: BTreeMap<u32, u32> = BTreeMap::new();
        for (hex, (corners, &block)) in hexes.iter().zip(blocks).enumerate() {
            for &node in corners {
                let Some(at) = nodes.get(node as usize) else {
                    return Err(MeshError::NoNode { hex, node, nodes: nodes.len() });
                };
                if !at.iter().all(|x| x.is_finite()) {
                    return Err(MeshError::NotFinite { node, at: *at });
                }
                let first = *of_node.entry(node).or_insert(block);
                if first != block {
                    return Err(MeshError::Shared { node, first, second: block });
                }
            }
        }
        Ok(())
    }

    fn at(&self, node: u32) -> Vec3 {
        Vec3::from(self.nodes[node as usize])
    }

    /// Grid of the hexahedra of a block, or the first deviation from one.
    fn fit(&self, hexes: &[[u32; 8]]) -> Result<MeshBlock, String> {
        let divisions = (1..).find(|n: &usize| n.pow(3) >= hexes.len()).unwrap_or(1);
        if divisions.pow(3) != hexes.len() {
            return Err("the number of hexahedra is no cube".into());
        }
        let steps = self.steps(hexes);
        let edges = steps.map(|step| step * divisions as f64);
        let volume = edges[0].cross(&edges[1]).dot(&edges[2]);
        let longest = edges.iter().map(Vec3::norm).fold(0.0, f64::max);
        if volume.is_nan() || volume <= 1e-12 * longest.powi(3) {
            return Err("it has no volume".into());
        }
        let mut nodes: Vec<u32> = hexes.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let n = divisions + 1;
        if nodes.len() != n.pow(3) {
            return Err(format!("it has {} nodes instead of {}", nodes.len(), n.pow(3)));
        }
        // The lower corner has the least coordinates along the edges.
        let matrix = nalgebra::Matrix3::from_columns(&steps);
        let Some(inverse) = matrix.try_inverse() else { return Err("it has no volume".into()) };
        let along = |node: &u32| inverse * self.at(*node);
        let least = nodes.iter().map(along).reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let mut grid = vec![u32::MAX; n.pow(3)];
        for node in nodes {
            let exact = along(&node) - least;
            let step = exact.map(f64::round);
            if (exact - step).amax() > MISSES || step.iter().any(|&i| i < 0.0 || i as usize >= n) {
                let at = self.nodes[node as usize];
                return Err(format!("node {node} at {at:?} is not on its grid"));
            }
            let [i, j, k] = [0, 1, 2].map(|d| step[d] as usize);
            let slot = &mut grid[i + n * (j + n * k)];
            if *slot != u32::MAX {
                return Err(format!("nodes {} and {node} are at one place", *slot));
            }
            *slot = node;
        }
        cells(hexes, &grid, n)?;
        Ok(MeshBlock { origin: matrix * least, edges, divisions, nodes: grid })
    }

    /// Edge vectors of an element, right-handed, each nearest to the axis with its number and along
    /// it.
    fn steps(&self, hexes: &[[u32; 8]]) -> [Vec3; 3] {
        let corner = |k: usize| self.at(hexes[0][k]);
        let mut steps = [1, 3, 4].map(|k| corner(k) - corner(0));
        let best =
            |order: &[usize; 3]| (0..3).map(|d| steps[order[d]].normalize()[d].abs()).sum::<f64>();
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
        let order = orders.into_iter().reduce(|a, b| if best(&b) > best(&a) { b } else { a });
        steps = order.unwrap_or([0, 1, 2]).map(|d| steps[d]);
        for (d, step) in steps.iter_mut().enumerate() {
            if step[d] < 0.0 {
                *step = -*step;
            }
        }
        if steps[0].cross(&steps[1]).dot(&steps[2]) < 0.0 {
            steps[2] = -steps[2];
        }
        steps
    }
}

/// Returns an error if the hexahedra are not the cells of a grid of nodes, each once.
fn cells(hexes: &[[u32; 8]], grid: &[u32], n: usize) -> Result<(), String> {
    let local: BTreeMap<u32, usize> =
        grid.iter().enumerate().map(|(at, &node)| (node, at)).collect();
    let mut seen = vec![false; grid.len()];
    for hex in hexes {
        let mut locals = hex.map(|node| local[&node]);
        locals.sort_unstable();
        let low = locals[0];
        let cell = [0, 1, n, n + 1].map(|at| low + at);
        let cell: Vec<usize> = cell.into_iter().chain(cell.map(|at| at + n * n)).collect();
        if locals[..] != cell[..] || seen[low] {
            return Err(format!("the hexahedron of nodes {hex:?} is no cell of its grid"));
        }
        seen[low] = true;
    }
    Ok(())
}

impl MeshBlock {
    /// Lattice of one cell with the block.
    #[must_use]
    pub fn lattice(&self, set: usize, material: u16, rigid: bool) -> Lattice {
        let divisions = if rigid { 1 } else { self.divisions };
        let lattice = Lattice::of_one_block(set, material, divisions, self.origin, self.edges);
        Lattice { rigid, ..lattice }
    }
}

/// Faces of the blocks of a mesh, by their nodes.
#[derive(Debug)]
pub struct MeshFaces<'a> {
    blocks: &'a [MeshBlock],
    /// Block of a node and the node's number in it.
    of_node: BTreeMap<u32, (usize, usize)>,
}

impl<'a> MeshFaces<'a> {
    /// Faces of the given blocks.
    #[must_use]
    pub fn new(blocks: &'a [MeshBlock]) -> Self {
        let nodes = blocks.iter().enumerate().flat_map(|(block, found)| {
            let nodes = found.nodes.iter().enumerate();
            nodes.map(move |(local, &node)| (node, (block, local)))
        });
        Self { blocks, of_node: nodes.collect() }
    }

    /// Block and face that contain four nodes.
    #[must_use]
    pub fn of(&self, quad: [u32; 4]) -> Option<(usize, FaceId)> {
        let (block, _) = *self.of_node.get(&quad[0])?;
        let n = self.blocks[block].divisions + 1;
        let mut steps = [[0; 3]; 4];
        for (step, node) in steps.iter_mut().zip(quad) {
            let &(own, local) = self.of_node.get(&node)?;
            if own != block {
                return None;
            }
            *step = [local % n, local / n % n, local / (n * n)];
        }
        let on = |face: &FaceId| {
            let level = if face.upper { n - 1 } else { 0 };
            steps.iter().all(|step| step[face.direction] == level)
        };
        FaceId::all().find(on).map(|face| (block, face))
    }
}
