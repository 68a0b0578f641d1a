//! Joints and their pairs of points, one on each side of the joint (§1).

use std::ops::Range;

use crate::model::Model;
use ddem_joint::contact::{BondedPatch, Patch};
use ddem_mesh::ConformingJoint;
use ddem_mesh::properties::JointProperties;

impl Model {
    /// All conforming joints. In [`pairs`](Self::pairs) the pairs of nonconforming joints follow
    /// theirs.
    #[must_use]
    pub fn faces(&self) -> &[ConformingJoint] {
        &self.faces
    }

    /// Number of the properties of each joint between two blocks. Springs within whole rock are no joints.
    pub fn joint_numbers(&self) -> impl Iterator<Item = u16> + '_ {
        let is_joint = |joint: &u16| !self.properties.joints[usize::from(*joint)].is_whole_rock();
        let by_face = self.geometry.joined().map(|joint_pair| joint_pair.joint);
        self.faces.iter().map(|face| face.joint).chain(by_face.filter(is_joint))
    }

    /// Numbers of joints and of pairs that can fail in at least one stage.
    #[must_use]
    pub fn n_breakable(&self) -> [usize; 2] {
        let broken_joints =
            |joint: Option<u16>| joint.is_some_and(|at| self.laws[at as usize].is_some());
        let matching = self.faces.iter().map(|face| {
            (
                self.stages.any(|at| broken_joints(Some(face.at(at)))),
                (face.divisions as usize + 1).pow(2),
            )
        });
        let fails = |joint: &BondedPatch| {
            self.stages.any(|at| broken_joints(at.joint_of(joint.patch.blocks)))
        };
        let others = self.nonconforming_joints().filter(|joint| fails(joint));
        let others = [self.whole_joints(fails), others.map(|joint| joint.patch.points.len()).sum()];
        let breakable = matching.filter(|(broken_joints, _)| *broken_joints);
        breakable.fold(others, |[joints, pairs], (_, more)| [joints + 1, pairs + more])
    }

    /// Number of joints between two blocks.
    #[must_use]
    pub fn n_joints(&self) -> usize {
        self.faces.len() + self.nonconforming_joints().count()
    }

    /// Numbers of all joints; springs within whole rock have numbers among them.
    pub(crate) fn joints(&self) -> Range<usize> {
        0..self.faces.len() + self.bonded_patches.len()
    }

    /// Nonconforming joints, without springs within whole rock.
    pub(super) fn nonconforming_joints(&self) -> impl Iterator<Item = &BondedPatch> {
        self.bonded_patches.iter().filter(|joint| !joint.is_whole_rock)
    }

    /// True if a patch is springs within whole rock.
    pub(crate) fn is_whole_rock(&self, patch: &Patch) -> bool {
        let joint = patch.bond.map(|bond| &self.properties.joints[usize::from(bond.joint)]);
        joint.is_some_and(JointProperties::is_whole_rock)
    }

    /// Number of pairs of all conforming and nonconforming joints.
    #[must_use]
    pub fn n_pairs(&self) -> usize {
        let conforming = || self.faces.last().map_or(0, ConformingJoint::end);
        self.bonded_patches.last().map_or_else(conforming, |joint| joint.pairs().end)
    }

    /// Number of pairs of points of nonconforming joints, and of springs within whole rock.
    #[must_use]
    pub fn n_nonconforming_pairs(&self) -> usize {
        self.bonded_patches.iter().map(|joint| joint.patch.points.len()).sum()
    }

    /// Numbers of the pairs of a joint; those of nonconforming joints come last.
    pub(crate) fn pairs_of(&self, joint: usize) -> Range<usize> {
        match self.joint(joint) {
            BlockJoint::Matching(face) => face.first_pair as usize..face.end(),
            BlockJoint::Nonconforming(joint) => joint.pairs(),
        }
    }

    /// Number of the joint that has a pair; the end of [`joints`](Self::joints) if there is no such pair.
    pub(crate) fn joint_of(&self, pair: usize) -> usize {
        let matching = self.faces.partition_point(|face| face.end() <= pair);
        matching + self.bonded_patches.partition_point(|joint| joint.pairs().end <= pair)
    }

    /// A joint by its number.
    pub(crate) fn joint(&self, joint: usize) -> BlockJoint<'_> {
        let matching = self.faces.get(joint).map(BlockJoint::Matching);
        matching.unwrap_or_else(|| {
            BlockJoint::Nonconforming(&self.bonded_patches[joint - self.faces.len()])
        })
    }

    /// All pairs, in order.
    pub fn pairs(&self) -> impl Iterator<Item = PairAtRest> + '_ {
        let matching = self.faces.iter().flat_map(move |face| {
            let (normal, joint) = (face.normal(&self.geometry), face.joint);
            face.pairs(&self.geometry).map(move |nodes| {
                let [a, b] = nodes.map(|node| self.point(node as usize));
                let point = [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
                PairAtRest { nodes, point, normal, joint, cut: None }
            })
        });
        matching.chain(self.nonconforming_joints().flat_map(|joint| self.bonded_patch(joint)))
    }

    /// Pairs of a nonconforming joint.
    pub(super) fn bonded_patch<'a>(
        &'a self,
        joint: &'a BondedPatch,
    ) -> impl Iterator<Item = PairAtRest> + 'a {
        let (patch, number) = (&joint.patch, BlockJoint::Nonconforming(joint).number());
        let [a, b] = patch.blocks.map(|block| block as usize);
        let placed = self
            .contact
            .as_ref()
            .map(|contact_model| &contact_model.blocks[..])
            .unwrap_or_default();
        patch.points.iter().map(move |point| {
            let side = |block: usize, side: usize| placed[block].rest_point(&point.points[side]);
            let [(x, on_a), (y, on_b)] = [side(a, 0), side(b, 1)];
            let first = [a, b].map(|block| self.geometry.blocks[block].first_node);
            PairAtRest {
                nodes: [first[0] + on_a as u32, first[1] + on_b as u32],
                point: ((x + y) / 2.0).into(),
                normal: patch.axes_now[0].into(),
                joint: number,
                cut: joint.cut,
            }
        })
    }

    /// Pairs at the corners of each part of all joints, in order around it. A triangle repeats its
    /// last pair.
    pub fn quads(&self) -> impl Iterator<Item = [u32; 4]> + '_ {
        let bonded_patch = self.nonconforming_joints().flat_map(|joint| {
            joint.quads.iter().map(|quad| quad.map(|at| at + joint.first_pair as u32))
        });
        self.faces.iter().flat_map(ConformingJoint::quads).chain(bonded_patch)
    }
}

/// A joint between two blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) enum BlockJoint<'a> {
    /// Conforming joint of one lattice.
    Matching(&'a ConformingJoint),
    /// Nonconforming joint.
    Nonconforming(&'a BondedPatch),
}

impl BlockJoint<'_> {
    /// The two blocks.
    pub(crate) fn blocks(&self) -> [usize; 2] {
        match self {
            Self::Matching(face) => [face.a, face.b],
            Self::Nonconforming(joint) => joint.patch.blocks,
        }
        .map(|block| block as usize)
    }

    /// Number of its properties.
    pub(crate) fn number(&self) -> u16 {
        match self {
            Self::Matching(face) => face.joint,
            Self::Nonconforming(joint) => joint.patch.bond.as_ref().map_or(0, |bond| bond.joint),
        }
    }

    /// Nodes on both sides of its pairs.
    pub(crate) fn nodes(&self, model: &Model) -> Vec<[u32; 2]> {
        match self {
            Self::Matching(face) => face.pairs(&model.geometry).collect(),
            Self::Nonconforming(joint) => {
                model.bonded_patch(joint).map(|pair| pair.nodes).collect()
            }
        }
    }
}

/// A pair of a joint at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairAtRest {
    /// Nodes on sides a and b. In a nonconforming joint each is the node with the largest shape
    /// function at its point.
    pub nodes: [u32; 2],
    /// Midpoint between the two sides `[m]`.
    pub point: [f64; 3],
    /// Unit normal, from a to b.
    pub normal: [f64; 3],
    /// Number of the joint's properties, in sorted order of the names.
    pub joint: u16,
    /// Number of the cut that made the joint, if one did.
    pub cut: Option<u32>,
}
