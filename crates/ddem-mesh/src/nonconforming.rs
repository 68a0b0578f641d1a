//! Nonconforming joints, by their faces and by their blocks.

use std::sync::Arc;

use super::lattice::NO_JOINT;
use super::{BlockFace, Geometry};
use ddem_mechanics::collide::FaceId;

/// Joint between two faces that lie on each other, or nearly so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonconformingJoint {
    /// Blocks a and b, the lower number first.
    pub blocks: [u32; 2],
    /// Face of each block.
    pub faces: [FaceId; 2],
    /// Number of the joint.
    pub joint: u16,
    /// Area in which the faces of their cells lie on each other, surrounding gaps included `[m²]`.
    pub area: f64,
    /// Distance of the two faces `[m]`.
    pub gap: f64,
    /// Normal stiffness of the joint `[Pa/m]`.
    pub stiffness: f64,
    /// Number of the cut that made its faces, if one did.
    pub cut: Option<u32>,
}

impl NonconformingJoint {
    /// Faces of the joint.
    #[must_use]
    pub fn sides(&self) -> [BlockFace; 2] {
        let side = |k: usize| BlockFace { block: self.blocks[k] as usize, face: self.faces[k] };
        [side(0), side(1)]
    }
}

/// Properties of a face's nonconforming joints.
#[derive(Clone, Copy, Debug)]
pub struct NonconformingFace {
    /// Number of the joint; of several joints the stiffest, whose stiffness bounds the others.
    pub joint: u16,
    stiffness: f64,
    /// Least distance to the other faces `[m]`.
    pub gap: f64,
}

impl Geometry {
    /// Sets the nonconforming joints, which must be sorted by their blocks.
    pub fn join(&mut self, nonconforming_joints: Vec<NonconformingJoint>) {
        let faces_of = |(at, joint_pair): (usize, &NonconformingJoint)| {
            [0, 1].map(|k| (joint_pair.blocks[k], joint_pair.faces[k].number(), at as u32))
        };
        let mut by_face: Vec<_> =
            nonconforming_joints.iter().enumerate().flat_map(faces_of).collect();
        by_face.sort_unstable();
        (self.nonconforming_joints, self.by_face) =
            (Arc::new(nonconforming_joints), Arc::new(by_face));
    }

    /// Drops the joints of removed blocks.
    pub fn clear_removed(&mut self) {
        let left = self.joined().copied().collect();
        self.join(left);
    }

    /// Nonconforming joints between blocks that have not been removed.
    pub fn joined(&self) -> impl Iterator<Item = &NonconformingJoint> {
        self.nonconforming_joints.iter().filter(|joint_pair| self.exists(joint_pair))
    }

    fn exists(&self, joint_pair: &NonconformingJoint) -> bool {
        !joint_pair.blocks.iter().any(|&block| self.is_removed(block as usize))
    }

    /// Nonconforming joints at a face of a block, but not those to removed blocks.
    pub(super) fn joined_at(
        &self,
        block: usize,
        face: u8,
    ) -> impl Iterator<Item = &NonconformingJoint> {
        let key = (block as u32, face);
        let from = self.by_face.partition_point(|&(block, face, _)| (block, face) < key);
        let here = self.by_face[from..].iter().take_while(move |(a, b, _)| (*a, *b) == key);
        let here = here.map(|(.., at)| &self.nonconforming_joints[*at as usize]);
        here.filter(|joint_pair| self.exists(joint_pair))
    }

    /// Properties of the nonconforming joints at a face of a block; `None` if it has none.
    #[must_use]
    pub fn nonconforming(&self, block: usize, face: u8) -> Option<NonconformingFace> {
        let each = self.joined_at(block, face).map(|joint_pair| {
            let &NonconformingJoint { joint, stiffness, gap, .. } = joint_pair;
            NonconformingFace { joint, stiffness, gap: gap.max(0.0) }
        });
        each.reduce(|known, new| {
            let gap = known.gap.min(new.gap);
            NonconformingFace { gap, ..if new.stiffness > known.stiffness { new } else { known } }
        })
    }

    /// Joint at a face of a block, even without a block on the other side.
    pub fn joint_at(&self, block: usize, face: FaceId) -> Option<u16> {
        let lattice = self.lattice(block);
        let (d, mut cell) = (face.direction, self.blocks[block].cell.map(|c| c as usize));
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

    /// True if the material or a joint of a block has changed.
    pub fn differs(&self, before: &Self, block: usize) -> bool {
        let joints = |geometry: &Self| {
            let number = |k: u8| {
                let nonconforming = geometry.nonconforming(block, k);
                nonconforming
                    .map(|nonconforming| nonconforming.joint)
                    .or_else(|| geometry.joint_at(block, FaceId::from_number(k)))
            };
            [0, 1, 2, 3, 4, 5].map(number)
        };
        self.blocks[block].material != before.blocks[block].material
            || joints(self) != joints(before)
    }

    /// Nonconforming joint of two blocks, if there is one.
    pub fn joint_of(&self, blocks: [u32; 2]) -> Option<u16> {
        let at =
            self.nonconforming_joints.binary_search_by_key(&blocks, |joint_pair| joint_pair.blocks);
        let joint_pair = &self.nonconforming_joints[at.ok()?];
        self.exists(joint_pair).then_some(joint_pair.joint)
    }

    /// Copies joints and materials from the same places in another stage.
    pub fn assign_as(&mut self, other: &Self) {
        for (own, other) in self.lattices.iter_mut().zip(&other.lattices) {
            let own = Arc::make_mut(own);
            (own.joint, own.material) = (other.joint.clone(), other.material.clone());
        }
        self.blocks = other.blocks.clone();
        let joint = |joint_pair: &NonconformingJoint| {
            other.joint_of(joint_pair.blocks).unwrap_or(joint_pair.joint)
        };
        let joined =
            self.joined().map(|own| NonconformingJoint { joint: joint(own), ..*own }).collect();
        self.join(joined);
    }
}
