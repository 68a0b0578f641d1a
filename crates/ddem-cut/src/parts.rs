//! Parts of cells: hexahedra at the vertices, or pyramids, with points that neighbours share.

use nalgebra::Vector3;

use crate::complex::CellComplex;
use crate::hexes::{CellNodes, cell_hexes};

/// Point of a part of a cell. Cells that share a vertex, an edge or a face have equal points there.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PartPoint {
    /// Vertex, by its number.
    Vertex(u32),
    /// Middle of an edge between two vertices, the lower number first.
    Edge(u32, u32),
    /// Mean of a face, by its corners in increasing order.
    Face(Vec<u32>),
    /// Mean of a cell, by its number.
    Cell(u32),
}

/// Part of a cell: the hexahedron at one of its vertices, or a pyramid below a part of a face.
#[derive(Clone, Debug, PartialEq)]
pub struct CellPart {
    /// Number of the vertex.
    pub vertex: u32,
    /// Vertices at the other ends of the edges that the first, second and third edge of the part
    /// lie on; a pyramid has two.
    pub ends: [Option<u32>; 3],
    /// Corners in VTK's order, of a pyramid four at its apex. The vertex is the first one.
    pub points: [PartPoint; 8],
    /// Positions of the corners `[m]`.
    pub corners: [Vector3<f64>; 8],
    /// Numbers of the faces of the cell that the faces across these edges, through the vertex, lie
    /// in; that of a pyramid is the last one.
    pub faces: [Option<u32>; 3],
}

impl CellComplex {
    /// Parts of a cell, in the order of its vertices. If more than three edges meet at one of them, or
    /// a hexahedron with `n` elements along its edges would be turned inside out, all parts are
    /// pyramids, whose apex is the mean of the cell.
    #[must_use]
    pub fn parts(&self, cell: usize, n: usize) -> Vec<CellPart> {
        let own = &self.cells()[cell];
        let nodes = CellNodes::new(own, 0);
        let mut positions = Vec::new();
        self.add_points(own, &nodes, &mut positions);
        let centre = positions.len() as u32 - 1;
        let mut points: Vec<PartPoint> =
            nodes.vertices.iter().map(|&vertex| PartPoint::Vertex(vertex)).collect();
        points.extend(nodes.edges.iter().map(|&(a, b)| PartPoint::Edge(a, b)));
        points.extend(own.faces.iter().map(|face| PartPoint::Face(face.sorted_corners())));
        points.push(PartPoint::Cell(cell as u32));
        let first_face = nodes.face(0);
        let part = |(vertex, hex): (u32, [u32; 8])| {
            let end = |at: usize| match points[hex[at] as usize] {
                PartPoint::Edge(a, b) => Some(if a == vertex { b } else { a }),
                _ => None,
            };
            let face = |at: usize| (hex[at] < centre).then(|| hex[at] - first_face);
            CellPart {
                vertex,
                ends: [1, 3, 4].map(end),
                points: hex.map(|point| points[point as usize].clone()),
                corners: hex.map(|point| positions[point as usize]),
                faces: [7, 5, 2].map(face),
            }
        };
        cell_hexes(own, &nodes, centre, &positions, n).into_iter().map(part).collect()
    }
}
