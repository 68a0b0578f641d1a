//! Present states of the joints: one view of conforming and nonconforming joints.

use super::Model;
use super::pairs::BlockJoint;
use ddem_joint::broken::{BrokenJoints, BrokenLattice};
use ddem_joint::contact::{ContactPoint, Contacts, JointStatus};
use ddem_joint::point::{JointPoint, has_rotated};
use ddem_mechanics::law::JointLaw;

/// State of a joint at one time.
pub(crate) struct JointState<'a> {
    /// Numbers of its two blocks.
    pub(crate) blocks: [usize; 2],
    /// Law of the joint; `None` if it never fails.
    law: Option<&'a dyn JointLaw>,
    pairs: usize,
    points: JointPairs<'a>,
    /// Shortest distance between its pairs `[m]`.
    spacing: f64,
    /// True if a contact has replaced the joint.
    released: bool,
}

/// Storage of a joint's pairs.
enum JointPairs<'a> {
    /// The joint is absent.
    Absent,
    /// The joint consists of elements only.
    Elements,
    /// A lane of a lattice with springs.
    Lane(&'a BrokenLattice, usize),
    /// Points of a nonconforming joint.
    Patch(&'a [ContactPoint]),
    /// Last state of the pairs of a joint that a contact has replaced.
    Released(&'a [JointPoint]),
}

impl Model {
    /// State of a joint, by its number.
    pub(crate) fn joint_state<'a>(
        &'a self,
        joint: usize,
        broken_joints: &'a BrokenJoints,
        contacts: &'a Contacts,
    ) -> JointState<'a> {
        let (points, law, spacing, released) = match self.joint(joint) {
            BlockJoint::Matching(face) => {
                let d = usize::from(face.direction);
                let (pack, lane) = self.packs.slot(face.a as usize);
                let section = self.sections.get(pack, d);
                let points = match (section, broken_joints.get(pack, 1 << d)) {
                    (Some(_), Some(broken)) => JointPairs::Lane(broken, lane),
                    (Some(_), None) => JointPairs::Elements,
                    (None, _) => JointPairs::Absent,
                };
                let stages = contacts.joints.get(face.a as usize);
                let released = stages.is_some_and(|stages| stages[d] == JointStatus::Released);
                let spacing = section.map_or(0.0, |section| section.spacing(lane));
                (points, section.map(|section| section.laws[lane]), spacing, released)
            }
            BlockJoint::Nonconforming(joint) => {
                let blocks = joint.patch.blocks;
                let contact_model = self.contact.as_ref();
                let spacing =
                    contact_model.map_or(0.0, |contact_model| contact_model.spacing(blocks));
                match (contacts.bonded_patch(blocks), contacts.ended(blocks)) {
                    (Some((patch, bond)), _) => {
                        (JointPairs::Patch(&patch.points), Some(bond.law), spacing, false)
                    }
                    (None, Some(ended)) => {
                        (JointPairs::Released(&ended.pairs), Some(ended.bond.law), spacing, true)
                    }
                    (None, None) => (JointPairs::Absent, None, spacing, false),
                }
            }
        };
        let law = law.and_then(|law| self.laws.get(usize::from(law))?.as_deref());
        let pairs = match points {
            // Springs within whole rock have no numbered pairs.
            JointPairs::Patch(points) => points.len(),
            _ => self.pairs_of(joint).len(),
        };
        let blocks = self.joint(joint).blocks();
        JointState { blocks, law, pairs, points, spacing, released }
    }

    /// States of all joints between blocks that have not been removed.
    pub(crate) fn joint_states<'a>(
        &'a self,
        broken_joints: &'a BrokenJoints,
        contacts: &'a Contacts,
    ) -> impl Iterator<Item = JointState<'a>> {
        let all = self.joints().map(move |joint| self.joint_state(joint, broken_joints, contacts));
        all.filter(|joint| !joint.blocks.iter().any(|&block| self.is_removed(block)))
    }
}

impl<'a> JointState<'a> {
    /// A pair; `None` if the joint has no springs.
    pub(crate) fn point(&self, pair: usize) -> Option<JointPoint> {
        match self.points {
            JointPairs::Absent | JointPairs::Elements => None,
            JointPairs::Lane(broken, lane) => Some(broken.points.get(pair, lane)),
            JointPairs::Patch(points) => Some(points[pair].pair),
            JointPairs::Released(pairs) => Some(pairs[pair]),
        }
    }

    /// Pairs of the joint; none if it has no springs.
    pub(crate) fn points(&self) -> impl Iterator<Item = JointPoint> {
        (0..self.pairs).filter_map(|pair| self.point(pair))
    }

    /// True if a pair has failed.
    pub(crate) fn has_failed(&self) -> bool {
        self.points().any(|point| point.failure.is_some())
    }

    /// True if a pair is bonded and the joint has bond strength.
    pub(crate) fn holds(&self) -> bool {
        self.law.is_none_or(JointLaw::is_cohesive)
            && match self.points {
                JointPairs::Absent => false,
                JointPairs::Elements => true,
                _ => self.points().any(|point| point.failure.is_none()),
            }
    }

    /// True if a contact has replaced the joint.
    pub(crate) fn is_released(&self) -> bool {
        self.released
    }

    /// True if the joint has rotated so far about its bonded pairs that they must fail.
    pub(crate) fn has_rotated(&self) -> bool {
        let can = self.law.is_some_and(JointLaw::is_cohesive) && !self.released;
        can && self.holds() && has_rotated(self.points(), self.spacing)
    }
}
