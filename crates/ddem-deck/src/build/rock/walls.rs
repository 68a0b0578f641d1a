//! Faces of cells that look into holes.

use ddem_core::problem::{BlockFace, Geometry, NONE, Stages};

use super::blocks::RockBlocks;
use crate::schema::SmallKind;

/// Faces of cells beside cells that are removed at the start or in a stage.
#[derive(Clone, Debug, Default)]
pub(in crate::build) struct CellWalls {
    /// Cell and number of each face, with the first block of the cell beyond it, which is [`NONE`] if that is
    /// removed at the start; sorted.
    beyond: Vec<([u32; 2], u32)>,
}

impl RockBlocks<'_> {
    /// Faces beside cells that are removed.
    pub(in crate::build) fn walls(&self, stages: &Stages) -> CellWalls {
        let mut beyond = Vec::new();
        // Removed cells never come back.
        let last = stages.geometries.last().map(|(_, geometry)| geometry);
        for (side, face) in self.rock.common.iter().flat_map(|face| [(0, face), (1, face)]) {
            let [own, other] = [side, 1 - side].map(|side| face.cells[side] as usize);
            let block = match self.parts[other].is_empty() {
                true => NONE,
                false => self.first[other] as u32,
            };
            let is_removed = |geometry: &Geometry| geometry.is_removed(block as usize);
            // Cells that are too thin leave no hole.
            if self.rock.treatment(other) == Some(SmallKind::Removed) {
                continue;
            }
            let goes = block == NONE || last.is_some_and(|last| is_removed(last));
            if goes && !self.parts[own].is_empty() {
                beyond.push(([own as u32, face.faces[side]], block));
            }
        }
        beyond.sort_unstable();
        CellWalls { beyond }
    }
}

impl CellWalls {
    /// True if a cell beyond a face of a part has been removed.
    pub(in crate::build) fn has(&self, geometry: &Geometry, face: &BlockFace) -> bool {
        let Some(own) = cell_face(geometry, face) else { return false };
        let from = self.beyond.partition_point(|(face, _)| *face < own);
        let here = self.beyond[from..].iter().take_while(|(face, _)| *face == own);
        let mut blocks = here.map(|(_, block)| *block);
        blocks.any(|block| block == NONE || geometry.is_removed(block as usize))
    }
}

/// Cell of a part, and the number of its face in which a face of the part lies; `None` for blocks of sets.
pub(in crate::build) fn cell_face(geometry: &Geometry, face: &BlockFace) -> Option<[u32; 2]> {
    let part = geometry.part(face.block)?;
    Some([part.cell, part.faces[face.direction()].filter(|_| !face.face.upper)?])
}
