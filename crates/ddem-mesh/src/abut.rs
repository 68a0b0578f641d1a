//! Joints between faces that do not match, by their faces and by their blocks.

use std::sync::Arc;

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

impl Geometry {
    /// Gives faces of different lattices joints, sorted by their blocks.
    pub fn join(&mut self, abutments: Vec<Abutment>) {
        let place = |(at, abutment): (usize, &Abutment)| {
            [0, 1].map(|k| (abutment.blocks[k], abutment.faces[k].number(), at as u32))
        };
        let mut places: Vec<_> = abutments.iter().enumerate().flat_map(place).collect();
        places.sort_unstable();
        (self.abutments, self.abutting) = (Arc::new(abutments), Arc::new(places));
    }

    /// Forgets the joints of blocks that have been taken out.
    pub fn forget_gone(&mut self) {
        let left = self.joined().copied().collect();
        self.join(left);
    }

    /// Faces of different lattices with a joint between them, of blocks that are there.
    pub fn joined(&self) -> impl Iterator<Item = &Abutment> {
        self.abutments.iter().filter(|abutment| self.is_there(abutment))
    }

    fn is_there(&self, abutment: &Abutment) -> bool {
        !abutment.blocks.iter().any(|&block| self.is_gone(block as usize))
    }

    /// The joints that a face of a block has to others that it does not match.
    #[must_use]
    pub fn abuts(&self, block: usize, face: u8) -> Option<Abuts> {
        let place = (block as u32, face);
        let from = self.abutting.partition_point(|&(block, face, _)| (block, face) < place);
        let here = self.abutting[from..].iter().take_while(|(a, b, _)| (*a, *b) == place);
        let here = here.map(|(.., at)| &self.abutments[*at as usize]);
        let each = here.filter(|abutment| self.is_there(abutment)).map(|abutment| {
            let &Abutment { joint, stiffness, gap, .. } = abutment;
            Abuts { joint, stiffness, gap: gap.max(0.0) }
        });
        each.reduce(|known, new| {
            let gap = known.gap.min(new.gap);
            Abuts { gap, ..if new.stiffness > known.stiffness { new } else { known } }
        })
    }

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
                let abuts = geometry.abuts(block, k);
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
        let abutment = &self.abutments[at.ok()?];
        self.is_there(abutment).then_some(abutment.joint)
    }

    /// Takes joints and materials from what is where in another stage.
    pub fn assign_as(&mut self, other: &Self) {
        for (own, other) in self.lattices.iter_mut().zip(&other.lattices) {
            let own = Arc::make_mut(own);
            (own.joint, own.material) = (other.joint.clone(), other.material.clone());
        }
        self.bodies = other.bodies.clone();
        let joint = |abutment: &Abutment| other.joint_of(abutment.blocks).unwrap_or(abutment.joint);
        let joined = self.joined().map(|own| Abutment { joint: joint(own), ..*own }).collect();
        self.join(joined);
    }
}
