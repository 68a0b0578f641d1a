//! Faces that cells have in common, and blocks of joined cells.

use nalgebra::Vector3;

use crate::cell::CellFace;
use crate::complex::CellComplex;
use crate::fracture::{area_vector, clipped};
use crate::random::across;

/// Face, or part of a face, that two cells have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommonFace {
    /// Numbers of the cells, the lower one first.
    pub cells: [u32; 2],
    /// Number of the face in each of them.
    pub faces: [u32; 2],
    /// Number of the plane.
    pub plane: u32,
    /// True if both faces have the same corners. Otherwise a cut ended at this plane on one side, and
    /// the faces overlap in part.
    pub matches: bool,
}

/// Face of a cell by its plane and a number made of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct FaceKey {
    plane: u32,
    corners: u64,
    cell: u32,
    face: u32,
}

/// Face in the axes of its plane.
#[derive(Debug)]
struct FlatFace {
    key: FaceKey,
    /// True if the cell is below the plane.
    below: bool,
    /// Corners `[m]`, shape (n, 2).
    corners: Vec<[f64; 2]>,
    /// Least and largest first coordinate `[m]`.
    extent: [f64; 2],
}

/// Number made of corners, by the function FNV-1a.
fn digest(corners: &[u32]) -> u64 {
    corners
        .iter()
        .flat_map(|corner| corner.to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
        })
}

impl CellComplex {
    /// Faces that two cells have in common, in the order of their cells.
    #[must_use]
    pub fn common_faces(&self) -> Vec<CommonFace> {
        let mut keys = Vec::new();
        for (cell, of) in self.cells().iter().enumerate() {
            keys.extend(of.faces.iter().enumerate().map(|(face, of)| FaceKey {
                plane: of.plane,
                corners: digest(&of.sorted_corners()),
                cell: cell as u32,
                face: face as u32,
            }));
        }
        keys.sort_unstable();
        let mut common = Vec::new();
        for of_plane in keys.chunk_by(|a, b| a.plane == b.plane) {
            let left = self.matching(of_plane, &mut common);
            self.overlapping(&left, &mut common);
        }
        common.sort_unstable_by_key(|face| (face.cells, face.faces));
        common
    }

    /// Adds the pairs of faces in one plane that have the same corners. Returns the other faces.
    fn matching(&self, keys: &[FaceKey], common: &mut Vec<CommonFace>) -> Vec<FaceKey> {
        let corners = |key: &FaceKey| {
            self.cells()[key.cell as usize].faces[key.face as usize].sorted_corners()
        };
        let mut left = Vec::new();
        let mut at = 0;
        while let Some(key) = keys.get(at) {
            let next = keys.get(at + 1).filter(|next| {
                key.corners == next.corners
                    && self.is_below(key) != self.is_below(next)
                    && corners(key) == corners(next)
            });
            match next {
                Some(next) => common.push(CommonFace::new(key, next, true)),
                None => left.push(*key),
            }
            at += if next.is_some() { 2 } else { 1 };
        }
        left
    }

    /// Adds the pairs of faces in one plane that overlap.
    fn overlapping(&self, keys: &[FaceKey], common: &mut Vec<CommonFace>) {
        let below = keys.iter().filter(|key| self.is_below(key)).count();
        if below == 0 || below == keys.len() {
            return;
        }
        let axes = across(&self.planes()[keys[0].plane as usize].normal);
        let mut faces: Vec<FlatFace> = keys.iter().map(|key| self.flat(*key, &axes)).collect();
        faces.sort_by(|a, b| a.extent[0].total_cmp(&b.extent[0]).then(a.key.cmp(&b.key)));
        // Faces snap to the plane by the tolerance.
        let margin = 4.0 * self.tolerance();
        let mut reached: Vec<usize> = Vec::new();
        for (number, face) in faces.iter().enumerate() {
            reached.retain(|&other| faces[other].extent[1] > face.extent[0] + margin);
            let beside = reached.iter().map(|&other| &faces[other]);
            let overlap =
                beside.filter(|other| other.below != face.below && face.overlaps(other, margin));
            common.extend(overlap.map(|other| CommonFace::new(&face.key, &other.key, false)));
            reached.push(number);
        }
    }

    /// True if the cell of a face is below its plane.
    fn is_below(&self, key: &FaceKey) -> bool {
        let face = &self.cells()[key.cell as usize].faces[key.face as usize];
        face.area(self.points()).dot(&self.plane(face).normal) > 0.0
    }

    fn flat(&self, key: FaceKey, axes: &[Vector3<f64>; 2]) -> FlatFace {
        let face = &self.cells()[key.cell as usize].faces[key.face as usize];
        let corner = |&corner: &u32| axes.map(|axis| axis.dot(&self.points()[corner as usize]));
        let corners: Vec<[f64; 2]> = face.corners.iter().map(corner).collect();
        let extent = range(&corners, [1.0, 0.0]);
        FlatFace { key, below: self.is_below(&key), corners, extent }
    }

    /// Outward unit normal of a face: that of its plane, turned.
    #[must_use]
    pub fn outward(&self, face: &CellFace) -> Vector3<f64> {
        let normal = self.plane(face).normal;
        if face.area(self.points()).dot(&normal) < 0.0 { -normal } else { normal }
    }

    /// Mean of the corners of a face `[m]`.
    #[must_use]
    pub fn middle(&self, face: &CellFace) -> Vector3<f64> {
        let corners = face.corners.iter().map(|&corner| self.points()[corner as usize]);
        corners.sum::<Vector3<f64>>() / face.corners.len() as f64
    }

    /// Area that two cells have in common in a face `[m²]`.
    #[must_use]
    pub fn common_area(&self, common: &CommonFace) -> f64 {
        if common.matches {
            self.face_of(common, 0).area(self.points()).norm()
        } else {
            area_vector(&self.common_part(common)).norm()
        }
    }

    /// Mean of the corners of what two cells have in common in a face `[m]`.
    #[must_use]
    pub fn common_middle(&self, common: &CommonFace) -> Vector3<f64> {
        let part = if common.matches { Vec::new() } else { self.common_part(common) };
        if part.is_empty() {
            return self.middle(self.face_of(common, 0));
        }
        part.iter().sum::<Vector3<f64>>() / part.len() as f64
    }

    fn face_of(&self, common: &CommonFace, side: usize) -> &CellFace {
        &self.cells()[common.cells[side] as usize].faces[common.faces[side] as usize]
    }

    /// Corners of the part of a face that two cells have in common.
    fn common_part(&self, common: &CommonFace) -> Vec<Vector3<f64>> {
        let [one, other] = [0, 1].map(|side| self.face_of(common, side));
        let at = |corner: u32| self.points()[corner as usize];
        let normal = self.outward(other);
        // Beyond an edge is on its right, seen from outside.
        let beyond = other.edges().map(|(a, b)| {
            let right = (at(b) - at(a)).cross(&normal);
            (right, right.dot(&at(a)))
        });
        let corners = one.corners.iter().map(|&corner| at(corner)).collect();
        clipped(corners, &beyond.collect::<Vec<_>>())
    }

    /// Number of the block of each cell. Cells that are joined at common faces are one block;
    /// blocks are numbered in the order of their first cells.
    #[must_use]
    pub fn blocks(&self, common: &[CommonFace]) -> Vec<u32> {
        self.blocks_where(common, |face| self.planes()[face.plane as usize].joined)
    }

    /// Number of the block of each cell, if cells are joined at the common faces of a condition.
    #[must_use]
    pub fn blocks_where(
        &self,
        common: &[CommonFace],
        joined: impl Fn(&CommonFace) -> bool,
    ) -> Vec<u32> {
        let mut parents: Vec<u32> = (0..self.cells().len() as u32).collect();
        for face in common.iter().filter(|face| joined(face)) {
            let [a, b] = face.cells.map(|cell| root(&mut parents, cell));
            // The lowest cell is the root of its block.
            parents[a.max(b) as usize] = a.min(b);
        }
        let mut n = 0;
        let mut blocks = vec![0; parents.len()];
        for cell in 0..parents.len() {
            let root = root(&mut parents, cell as u32) as usize;
            if root == cell {
                blocks[cell] = n;
                n += 1;
            } else {
                blocks[cell] = blocks[root];
            }
        }
        blocks
    }
}

impl CommonFace {
    fn new(a: &FaceKey, b: &FaceKey, matches: bool) -> Self {
        let [low, high] = if a.cell < b.cell { [a, b] } else { [b, a] };
        Self { cells: [low.cell, high.cell], faces: [low.face, high.face], plane: a.plane, matches }
    }
}

impl FlatFace {
    /// True if two convex faces have more than a strip of width `margin` in common.
    fn overlaps(&self, other: &Self, margin: f64) -> bool {
        let separates = |normal: [f64; 2]| {
            let ([a, b], [c, d]) = (range(&self.corners, normal), range(&other.corners, normal));
            b.min(d) - a.max(c) <= margin
        };
        ![self, other].iter().any(|face| face.edge_normals().any(separates))
    }

    /// Unit normals of the edges; edges without length have none.
    fn edge_normals(&self) -> impl Iterator<Item = [f64; 2]> {
        let n = self.corners.len();
        (0..n).filter_map(move |i| {
            let ([a, b], [c, d]) = (self.corners[i], self.corners[(i + 1) % n]);
            let length = libm::hypot(c - a, d - b);
            (length > 0.0).then(|| [(d - b) / length, (a - c) / length])
        })
    }
}

/// Least and largest coordinate along a direction.
fn range(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> [f64; 2] {
    let along = corners.iter().map(|corner| corner[0] * x + corner[1] * y);
    along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
}

/// First cell of the block of a cell; shortens the path to it.
fn root(parents: &mut [u32], cell: u32) -> u32 {
    let mut at = cell;
    while parents[at as usize] != at {
        parents[at as usize] = parents[parents[at as usize] as usize];
        at = parents[at as usize];
    }
    at
}
