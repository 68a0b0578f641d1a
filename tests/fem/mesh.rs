//! Nodes and elements.

use nalgebra::{Vector3, Vector6};

use super::{OracleMaterial, element};

/// Kind of region that an element fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LatticePart {
    /// Part of a deformable block.
    Body,
    /// Part of the joint between two facing blocks.
    Joint,
    /// Crossing of two joint planes.
    Strip,
    /// Crossing of three joint planes.
    Corner,
}

/// One hexahedron.
#[derive(Clone, Debug)]
pub struct Hexahedron {
    /// Kind of the region that it fills.
    pub kind: LatticePart,
    /// Its nodes, in VTK order.
    pub nodes: [usize; 8],
    /// Its material.
    pub material: OracleMaterial,
    /// The block of a block element.
    pub block: Option<usize>,
}

/// A mesh of a jointed lattice.
///
/// Existing blocks are numbered x fastest, then y, then z, and so are the nodes within a block. The
/// node number is `block · (n+1)³ + local`. Elements of blocks come first (block by block, x
/// fastest), then joints, strips and corners.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Reference positions.
    pub nodes: Vec<Vector3<f64>>,
    /// The elements.
    pub elements: Vec<Hexahedron>,
    /// The node at each point of the lattice of nodes, x fastest; none in removed blocks. Empty for a
    /// mesh that is no lattice.
    pub(super) grid: Vec<Option<usize>>,
    /// Lattice coordinates of the nodes along each axis.
    pub(super) stations: [Vec<f64>; 3],
    /// Elements of a block along each edge.
    pub(super) divisions: usize,
}

impl Mesh {
    /// A mesh of block elements that is no lattice.
    pub fn of_hexahedra(
        nodes: Vec<Vector3<f64>>,
        hexahedra: impl IntoIterator<Item = [usize; 8]>,
        material: OracleMaterial,
    ) -> Self {
        let element = |nodes| Hexahedron { kind: LatticePart::Body, nodes, material, block: None };
        let elements = hexahedra.into_iter().map(element).collect();
        Self { nodes, elements, grid: Vec::new(), stations: Default::default(), divisions: 1 }
    }

    /// Number of degrees of freedom.
    pub fn dofs(&self) -> usize {
        3 * self.nodes.len()
    }

    /// The positions of an element's nodes.
    pub fn corners(&self, element: &Hexahedron) -> [Vector3<f64>; 8] {
        element.nodes.map(|node| self.nodes[node])
    }

    /// The nodes whose reference position satisfies the condition, ascending.
    pub fn select(&self, condition: impl Fn(&Vector3<f64>) -> bool) -> Vec<usize> {
        (0..self.nodes.len()).filter(|&node| condition(&self.nodes[node])).collect()
    }

    /// The node nearest to a position, the lower number on a tie (to 1e-9 m).
    pub fn nearest(&self, position: Vector3<f64>) -> usize {
        let mut best = (f64::INFINITY, 0);
        for (node, at) in self.nodes.iter().enumerate() {
            let distance = (at - position).norm();
            if distance < best.0 - 1e-9 {
                best = (distance, node);
            }
        }
        best.1
    }

    /// Number of lattice nodes along each axis.
    pub fn grid_size(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.stations[axis].len())
    }

    /// The node at a point of the lattice of nodes.
    pub fn grid_node(&self, at: [usize; 3]) -> Option<usize> {
        let size = self.grid_size();
        self.grid[at[0] + size[0] * (at[1] + size[1] * at[2])]
    }

    /// The length along `axis` that belongs to each lattice station: half of each neighbouring
    /// interval, joint gaps included.
    pub fn tributary_lengths(&self, axis: usize) -> Vec<f64> {
        let stations = &self.stations[axis];
        let mut lengths = vec![0.0; stations.len()];
        for (index, pair) in stations.windows(2).enumerate() {
            lengths[index] += (pair[1] - pair[0]) / 2.0;
            lengths[index + 1] += (pair[1] - pair[0]) / 2.0;
        }
        lengths
    }

    /// The nodes of the outer face of the region across `axis`, each with its tributary area as a
    /// fraction of the face. No block of the face may be missing.
    pub fn outer_face(&self, axis: usize, high: bool) -> Vec<(usize, f64)> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (along_u, along_v) = (self.tributary_lengths(u), self.tributary_lengths(v));
        let whole = along_u.iter().sum::<f64>() * along_v.iter().sum::<f64>();
        let mut face = Vec::with_capacity(along_u.len() * along_v.len());
        for (q, length_v) in along_v.iter().enumerate() {
            for (p, length_u) in along_u.iter().enumerate() {
                let mut at = [0; 3];
                at[axis] = if high { self.grid_size()[axis] - 1 } else { 0 };
                (at[u], at[v]) = (p, q);
                let node = self.grid_node(at).expect("a block of the outer face is missing");
                face.push((node, length_u * length_v / whole));
            }
        }
        face
    }

    /// The stress at the centroid of an element, for displacements by degree of freedom.
    pub fn stress(&self, element: &Hexahedron, displacements: &[f64]) -> Vector6<f64> {
        let moved = element
            .nodes
            .map(|node| Vector3::from_column_slice(&displacements[3 * node..3 * node + 3]));
        element::stress_at_centroid(&self.corners(element), &element.material, &moved)
    }

    /// The row-sum lumped mass of every node.
    pub fn masses(&self) -> Vec<f64> {
        let mut masses = vec![0.0; self.nodes.len()];
        for element in &self.elements {
            let shares = element::lumped_masses(&self.corners(element), &element.material);
            for (&node, share) in element.nodes.iter().zip(shares) {
                masses[node] += share;
            }
        }
        masses
    }

    /// Nodes connected by joints, strips or corners: sets of 1, 2, 4 or 8, ascending.
    pub fn clusters(&self) -> Vec<Vec<usize>> {
        if self.grid.is_empty() {
            return (0..self.nodes.len()).map(|node| vec![node]).collect();
        }
        let mut gathered = vec![Vec::new(); self.grid.len()];
        let per_block: [Vec<usize>; 3] = [0, 1, 2].map(|axis| self.vertex_of_station(axis));
        let size = self.grid_size();
        for (index, node) in self.grid.iter().enumerate() {
            let at = [index % size[0], index / size[0] % size[1], index / (size[0] * size[1])];
            let vertex = [0, 1, 2].map(|axis| per_block[axis][at[axis]]);
            let home = vertex[0] + size[0] * (vertex[1] + size[1] * vertex[2]);
            gathered[home].extend(node);
        }
        gathered.retain(|cluster| !cluster.is_empty());
        gathered.iter_mut().for_each(|cluster| cluster.sort_unstable());
        gathered
    }

    /// Numbers the stations along `axis`; the two sides of a joint gap have the same number.
    fn vertex_of_station(&self, axis: usize) -> Vec<usize> {
        let mut vertex = 0;
        (0..self.stations[axis].len())
            .map(|station| {
                if station > 0 && !self.is_gap(station - 1) {
                    vertex += 1;
                }
                vertex
            })
            .collect()
    }

    /// True if the interval after a station lies between two blocks.
    pub(super) fn is_gap(&self, interval: usize) -> bool {
        (interval + 1).is_multiple_of(self.divisions + 1)
    }
}
