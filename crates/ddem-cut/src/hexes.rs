//! Hexahedra of cells, by midpoint subdivision.

use nalgebra::Vector3;

use crate::cell::{CellFace, ConvexCell};
use crate::complex::CellComplex;

/// Hexahedra that fill cells. Points of different cells are separate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellHexes {
    /// Corners, midpoints of edges, means of faces, and means of cells `[m]`.
    pub points: Vec<Vector3<f64>>,
    /// Eight points of each hexahedron in VTK's order.
    pub hexes: Vec<[u32; 8]>,
    /// Number of the cell of each hexahedron.
    pub cells: Vec<u32>,
}

/// Numbers of the points of one cell.
#[derive(Debug)]
pub(crate) struct CellNodes {
    pub(crate) vertices: Vec<u32>,
    /// Edges with the lower vertex first, in increasing order.
    pub(crate) edges: Vec<(u32, u32)>,
    /// Number of the first point; vertices, edges, faces and the cell follow.
    first: u32,
}

impl CellNodes {
    pub(crate) fn new(cell: &ConvexCell, first: u32) -> Self {
        let edges = cell.faces.iter().flat_map(CellFace::edges);
        let mut edges: Vec<(u32, u32)> = edges.filter(|(a, b)| a < b).collect();
        edges.sort_unstable();
        Self { vertices: cell.vertices(), edges, first }
    }

    fn vertex(&self, vertex: u32) -> u32 {
        self.first + self.vertices.partition_point(|&other| other < vertex) as u32
    }

    fn edge(&self, a: u32, b: u32) -> u32 {
        let edge = (a.min(b), a.max(b));
        let position = self.edges.partition_point(|&other| other < edge);
        self.first + (self.vertices.len() + position) as u32
    }

    pub(crate) fn face(&self, face: usize) -> u32 {
        self.first + (self.vertices.len() + self.edges.len() + face) as u32
    }
}

/// Part of a face at one of its corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceCorner {
    face: usize,
    before: u32,
    after: u32,
}

impl CellComplex {
    /// Hexahedra between each vertex of a cell, the midpoints of its edges, the means of its faces
    /// and the mean of the cell. If a vertex has more than three edges, or a hexahedron would be turned
    /// inside out, the cell is filled by pyramids below the parts of its faces instead, as hexahedra
    /// with four equal points.
    #[must_use]
    pub fn hexes(&self) -> CellHexes {
        let mut all = CellHexes::default();
        for (number, cell) in self.cells().iter().enumerate() {
            let nodes = CellNodes::new(cell, all.points.len() as u32);
            self.add_points(cell, &nodes, &mut all.points);
            let centre = all.points.len() as u32 - 1;
            let hexes = cell_hexes(cell, &nodes, centre, &all.points, 1);
            all.hexes.extend(hexes.into_iter().map(|(_, hex)| hex));
            all.cells.resize(all.hexes.len(), number as u32);
        }
        all
    }

    pub(crate) fn add_points(
        &self,
        cell: &ConvexCell,
        nodes: &CellNodes,
        points: &mut Vec<Vector3<f64>>,
    ) {
        let at = |vertex: u32| self.points()[vertex as usize];
        let mean = |vertices: &[u32]| {
            vertices.iter().fold(Vector3::zeros(), |sum, &vertex| sum + at(vertex))
                / vertices.len() as f64
        };
        points.extend(nodes.vertices.iter().map(|&vertex| at(vertex)));
        points.extend(nodes.edges.iter().map(|&(a, b)| (at(a) + at(b)) / 2.0));
        points.extend(cell.faces.iter().map(|face| mean(&face.corners)));
        points.push(mean(&nodes.vertices));
    }
}

/// Hexahedra of a cell with their vertices; pyramids if a vertex has more than three edges, or if a
/// hexahedron with `n` elements along its edges is turned inside out. `points` are the positions of all
/// points `[m]`.
pub(crate) fn cell_hexes(
    cell: &ConvexCell,
    nodes: &CellNodes,
    centre: u32,
    points: &[Vector3<f64>],
    n: usize,
) -> Vec<(u32, [u32; 8])> {
    let at_vertices: Vec<_> =
        nodes.vertices.iter().map(|&vertex| (vertex, corners(cell, vertex))).collect();
    let hex = |(vertex, corners): &(u32, Vec<FaceCorner>)| {
        let hex = corner_hex(corners, nodes, *vertex, centre).filter(|_| corners.len() == 3)?;
        is_sound(&hex.map(|point| points[point as usize]), n).then_some((*vertex, hex))
    };
    let hexes: Option<Vec<_>> = at_vertices.iter().map(hex).collect();
    hexes.unwrap_or_else(|| {
        let of = |(vertex, corners): &(u32, Vec<FaceCorner>)| {
            let vertex = *vertex;
            pyramids(corners, nodes, vertex, centre).into_iter().map(move |hex| (vertex, hex))
        };
        at_vertices.iter().flat_map(of).collect::<Vec<_>>()
    })
}

/// Coordinates of the corners of a hexahedron in VTK's order.
const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// True if a hexahedron has a positive volume, and a positive Jacobian in the middle; with more
/// elements the Jacobian must be positive at all corners.
fn is_sound(corners: &[Vector3<f64>; 8], n: usize) -> bool {
    if n > 1 {
        return CORNERS.into_iter().all(|at| jacobian(corners, at) > 0.0);
    }
    // The Jacobian is a polynomial of second degree in each coordinate: two points are exact.
    let gauss = CORNERS.map(|at| at.map(|x| x / 3.0_f64.sqrt()));
    let volume: f64 = gauss.into_iter().map(|at| jacobian(corners, at)).sum();
    volume > 0.0 && jacobian(corners, [0.0; 3]) > 0.0
}

/// Determinant of the Jacobian of a hexahedron at a point with coordinates from −1 to 1.
fn jacobian(corners: &[Vector3<f64>; 8], at: [f64; 3]) -> f64 {
    let along = |axis: usize| -> Vector3<f64> {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        let weight = |sign: &[f64; 3]| {
            sign[axis] * (1.0 + sign[next] * at[next]) * (1.0 + sign[last] * at[last]) / 8.0
        };
        CORNERS.iter().zip(corners).map(|(sign, corner)| corner * weight(sign)).sum()
    };
    along(0).cross(&along(1)).dot(&along(2))
}

/// Parts of the faces at a vertex.
fn corners(cell: &ConvexCell, vertex: u32) -> Vec<FaceCorner> {
    let of_face = |(face, of): (usize, &CellFace)| {
        let n = of.corners.len();
        let i = of.corners.iter().position(|&corner| corner == vertex)?;
        let (before, after) = (of.corners[(i + n - 1) % n], of.corners[(i + 1) % n]);
        Some(FaceCorner { face, before, after })
    };
    cell.faces.iter().enumerate().filter_map(of_face).collect()
}

impl CellNodes {
    /// Part of a face at a vertex, seen from inside: vertex, edge before, face, edge after.
    fn quad(&self, vertex: u32, corner: &FaceCorner) -> [u32; 4] {
        let [before, after] = [corner.before, corner.after].map(|end| self.edge(vertex, end));
        [self.vertex(vertex), before, self.face(corner.face), after]
    }
}

/// Hexahedron at a vertex of three edges.
fn corner_hex(
    corners: &[FaceCorner],
    nodes: &CellNodes,
    vertex: u32,
    centre: u32,
) -> Option<[u32; 8]> {
    let (base, others) = corners.split_first()?;
    let beside =
        |end: u32| others.iter().find(|corner| corner.before == end || corner.after == end);
    let (left, right) = (beside(base.before)?, beside(base.after)?);
    let third = if left.before == base.before { left.after } else { left.before };
    let [a, b, c, d] = nodes.quad(vertex, base);
    let top = nodes.edge(vertex, third);
    Some([a, b, c, d, top, nodes.face(left.face), centre, nodes.face(right.face)])
}

fn pyramids(corners: &[FaceCorner], nodes: &CellNodes, vertex: u32, centre: u32) -> Vec<[u32; 8]> {
    let pyramid = |corner: &FaceCorner| {
        let [a, b, c, d] = nodes.quad(vertex, corner);
        [a, b, c, d, centre, centre, centre, centre]
    };
    corners.iter().map(pyramid).collect()
}
