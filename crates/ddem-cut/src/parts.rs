//! Parts of cells: a hexahedron at each vertex of three edges, with points that neighbours share.

use nalgebra::Vector3;

use crate::complex::CellComplex;
use crate::hexes::{CellNodes, corner_hex, corners};

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

/// Part of a cell: the hexahedron at one of its vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct CellPart {
    /// Number of the vertex.
    pub vertex: u32,
    /// Corners in VTK's order. The vertex is the first one; the faces across the first, second
    /// and third edge through it are parts of faces of the cell.
    pub points: [PartPoint; 8],
    /// Positions of the corners `[m]`.
    pub corners: [Vector3<f64>; 8],
    /// Numbers of these faces of the cell.
    pub faces: [u32; 3],
}

impl CellComplex {
    /// Parts of a cell, in the order of its vertices.
    ///
    /// # Errors
    ///
    /// The number of a vertex at which more than three edges meet.
    pub fn parts(&self, cell: usize) -> Result<Vec<CellPart>, u32> {
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
        let part = |&vertex: &u32| {
            let at_vertex = corners(own, vertex);
            if at_vertex.len() != 3 {
                return Err(vertex);
            }
            let hex = corner_hex(&at_vertex, &nodes, vertex, centre).ok_or(vertex)?;
            // Means of faces are opposite to the vertex in the faces across the three edges.
            let faces = [hex[7], hex[5], hex[2]].map(|point| point - first_face);
            let points = hex.map(|point| points[point as usize].clone());
            let corners = hex.map(|point| positions[point as usize]);
            Ok(CellPart { vertex, points, corners, faces })
        };
        nodes.vertices.iter().map(part).collect()
    }
}
