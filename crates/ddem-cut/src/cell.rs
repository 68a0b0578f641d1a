//! Convex cells: faces of shared points.

use nalgebra::Vector3;

/// Face of a cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellFace {
    /// Number of its plane.
    pub plane: u32,
    /// Numbers of its points, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
}

impl CellFace {
    /// Directed edges, around the face.
    pub fn edges(&self) -> impl Iterator<Item = (u32, u32)> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(&a, &b)| (a, b))
    }

    /// Numbers of its points in increasing order: equal for the two sides of a face.
    #[must_use]
    pub fn sorted_corners(&self) -> Vec<u32> {
        let mut corners = self.corners.clone();
        corners.sort_unstable();
        corners
    }

    /// Area vector `[m²]`, outward: half the sum of the cross products of its corners.
    #[must_use]
    pub fn area(&self, points: &[Vector3<f64>]) -> Vector3<f64> {
        let at = |corner: u32| points[corner as usize];
        let Some(&first) = self.corners.first() else { return Vector3::zeros() };
        let origin = at(first);
        self.edges()
            .map(|(a, b)| (at(a) - origin).cross(&(at(b) - origin)) / 2.0)
            .fold(Vector3::zeros(), |sum, part| sum + part)
    }
}

/// Convex cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConvexCell {
    /// Faces.
    pub faces: Vec<CellFace>,
    /// Number of its region.
    pub region: u32,
}

/// Flaw in the topology of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellDefect {
    /// Face with fewer than three corners, or with one of them twice.
    Face,
    /// Edge that is not once in each direction.
    Edge,
    /// Numbers of vertices, edges and faces that no polyhedron has.
    Euler,
}

impl ConvexCell {
    /// Numbers of its points, in increasing order.
    #[must_use]
    pub fn vertices(&self) -> Vec<u32> {
        vertices(&self.faces)
    }

    /// Number of edges.
    #[must_use]
    pub fn n_edges(&self) -> usize {
        self.faces.iter().map(|face| face.corners.len()).sum::<usize>() / 2
    }

    /// Checks that the faces close to a polyhedron without holes.
    ///
    /// # Errors
    ///
    /// The first flaw.
    pub fn check(&self) -> Result<(), CellDefect> {
        check(&self.faces)
    }
}

pub(crate) fn vertices(faces: &[CellFace]) -> Vec<u32> {
    let mut all: Vec<u32> = faces.iter().flat_map(|face| face.corners.iter().copied()).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Checks that faces close to a polyhedron without holes.
pub(crate) fn check(faces: &[CellFace]) -> Result<(), CellDefect> {
    for face in faces {
        let once = |i: usize| !face.corners[..i].contains(&face.corners[i]);
        if face.corners.len() < 3 || !(1..face.corners.len()).all(once) {
            return Err(CellDefect::Face);
        }
    }
    let mut edges: Vec<(u32, u32)> = faces.iter().flat_map(CellFace::edges).collect();
    edges.sort_unstable();
    let paired = edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok());
    if !paired || edges.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(CellDefect::Edge);
    }
    if vertices(faces).len() + faces.len() != edges.len() / 2 + 2 {
        return Err(CellDefect::Euler);
    }
    Ok(())
}
