//! Neighbours through matched faces, and blocks of joined cells.

use crate::complex::CellComplex;

/// Face that two cells share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MatchedFace {
    /// Numbers of the cells, the lower one first.
    pub cells: [u32; 2],
    /// Number of the face in each of them.
    pub faces: [u32; 2],
    /// Number of the plane.
    pub plane: u32,
}

/// Face of a cell by its plane and a number made of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct FaceKey {
    plane: u32,
    corners: u64,
    cell: u32,
    face: u32,
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
    /// Faces with the same corners on both sides, in the order of their cells.
    #[must_use]
    pub fn matched_faces(&self) -> Vec<MatchedFace> {
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
        let corners = |key: &FaceKey| {
            self.cells()[key.cell as usize].faces[key.face as usize].sorted_corners()
        };
        let mut matched: Vec<MatchedFace> = keys
            .windows(2)
            .filter(|pair| (pair[0].plane, pair[0].corners) == (pair[1].plane, pair[1].corners))
            .filter(|pair| corners(&pair[0]) == corners(&pair[1]))
            .map(|pair| MatchedFace {
                cells: [pair[0].cell, pair[1].cell],
                faces: [pair[0].face, pair[1].face],
                plane: pair[0].plane,
            })
            .collect();
        matched.sort_unstable_by_key(|face| (face.cells, face.faces));
        matched
    }

    /// Number of the block of each cell. Cells that are joined at matched faces are one block;
    /// blocks are numbered in the order of their first cells.
    #[must_use]
    pub fn blocks(&self, matched: &[MatchedFace]) -> Vec<u32> {
        let mut parents: Vec<u32> = (0..self.cells().len() as u32).collect();
        for face in matched.iter().filter(|face| self.planes()[face.plane as usize].joined) {
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

/// First cell of the block of a cell; shortens the path to it.
fn root(parents: &mut [u32], cell: u32) -> u32 {
    let mut at = cell;
    while parents[at as usize] != at {
        parents[at as usize] = parents[parents[at as usize] as usize];
        at = parents[at as usize];
    }
    at
}
