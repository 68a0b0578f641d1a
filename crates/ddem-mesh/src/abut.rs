//! Joints between faces that do not match, by their faces and by their blocks.

use std::collections::HashMap;

use super::lattice::NO_JOINT;
use super::{BlockFace, Geometry};
use ddem_mechanics::collide::FaceOf;

/// Two faces that lie on each other, or nearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Abutment {
    /// a and b, the lower number first.
    pub blocks: [u32; 2],
    /// A face of each.
    pub faces: [FaceOf; 2],
    /// Number of the joint.
    pub joint: u16,
    /// Of the parts of their cells' faces that lie on each other, gaps around included `[m²]`.
    pub area: f64,
    /// Distance of the two faces `[m]`.
    pub gap: f64,
    /// Normal stiffness of the joint `[Pa/m]`.
    pub stiffness: f64,
}

impl Abutment {
    /// Its two faces.
    #[must_use]
    pub fn sides(&self) -> [BlockFace; 2] {
        let side = |k: usize| BlockFace { block: self.blocks[k] as usize, face: self.faces[k] };
        [side(0), side(1)]
    }
}

/// What a face has of the joints to others that it does not match.
#[derive(Clone, Copy, Debug)]
pub struct Abuts {
    /// Of several the stiffest, which bounds what the others do.
    pub joint: u16,
    stiffness: f64,
    /// Least distance to the other faces `[m]`.
    pub gap: f64,
}

/// The joint at each face, by block and number.
pub fn abutting(abutments: &[Abutment]) -> HashMap<(u32, u8), Abuts> {
    let mut faces: HashMap<(u32, u8), Abuts> = HashMap::new();
    for abutment in abutments {
        let &Abutment { joint, stiffness, gap, .. } = abutment;
        let new = Abuts { joint, stiffness, gap: gap.max(0.0) };
        for side in 0..2 {
            let face = (abutment.blocks[side], abutment.faces[side].number());
            let known = faces.entry(face).or_insert(new);
            let gap = known.gap.min(new.gap);
            *known = Abuts { gap, ..if new.stiffness > known.stiffness { new } else { *known } };
        }
    }
    faces
}

impl Geometry {
    /// Joint at a face of a block, whether another block is there or not.
    pub fn joint_at(&self, body: usize, face: FaceOf) -> Option<u16> {
        let lattice = self.lattice(body);
        let (d, mut cell) = (face.direction, self.bodies[body].cell.map(|c| c as usize));
        let joint = match (face.upper, cell[d]) {
            (true, _) => lattice.joint_above(cell, d),
            (false, 0) => lattice.own_joint[d],
            (false, at) => {
                cell[d] = at - 1;
                lattice.joint_above(cell, d)
            }
        };
        Some(joint).filter(|&joint| joint != NO_JOINT)
    }

    /// Whether a block has another material or other joints than before.
    pub fn differs(&self, before: &Self, block: usize) -> bool {
        let joints = |geometry: &Self| {
            let number = |k: u8| {
                let abuts = geometry.abutting.get(&(block as u32, k));
                abuts
                    .map(|abuts| abuts.joint)
                    .or_else(|| geometry.joint_at(block, FaceOf::of_number(k)))
            };
            [0, 1, 2, 3, 4, 5].map(number)
        };
        self.bodies[block].material != before.bodies[block].material
            || joints(self) != joints(before)
    }

    /// The joint of two blocks whose faces do not match, if there is one.
    pub fn joint_of(&self, blocks: [u32; 2]) -> Option<u16> {
        let at = self.abutments.binary_search_by_key(&blocks, |abutment| abutment.blocks);
        at.ok().map(|at| self.abutments[at].joint)
    }

    /// Takes joints and materials from what is where in another stage.
    pub fn assign_as(&mut self, other: &Self) {
        for (own, other) in self.lattices.iter_mut().zip(&other.lattices) {
            (own.joint, own.material) = (other.joint.clone(), other.material.clone());
        }
        self.bodies = other.bodies.clone();
        for abutment in &mut self.abutments {
            abutment.joint = other.joint_of(abutment.blocks).unwrap_or(abutment.joint);
        }
        self.abutting = abutting(&self.abutments);
    }
}
