//! Joints as they are now: one view of those whose faces match and of those whose faces do not.

use super::Model;
use super::pairs::Joint;
use ddem_joint::breaks::{Breaks, Broken};
use ddem_joint::contact::{ContactPoint, Contacts, Release};
use ddem_joint::point::{JointPoint, turned};
use ddem_mechanics::law::JointLaw;

/// Damage of a joint at one time.
pub(crate) struct Damage<'a> {
    /// Its two blocks.
    pub(crate) blocks: [usize; 2],
    /// Its law; `None`: it never fails.
    law: Option<&'a dyn JointLaw>,
    pairs: usize,
    points: Points<'a>,
    /// Shortest distance of its pairs `[m]`.
    spacing: f64,
    /// A contact has taken its place.
    released: bool,
}

/// Where the pairs of a joint are.
enum Points<'a> {
    /// It is not there.
    Nowhere,
    /// Elements alone.
    Elements,
    /// A lane of a lattice with springs.
    Lane(&'a Broken, usize),
    /// Faces that do not match.
    Patch(&'a [ContactPoint]),
    /// The same, once a contact has taken their place.
    Ended(&'a [JointPoint]),
}

impl Model {
    /// Damage of a joint, by its number.
    pub(crate) fn damage<'a>(
        &'a self,
        joint: usize,
        breaks: &'a Breaks,
        contacts: &'a Contacts,
    ) -> Damage<'a> {
        let (points, law, spacing, released) = match self.joint(joint) {
            Joint::Matching(face) => {
                let d = usize::from(face.direction);
                let (pack, lane) = self.packs.slot(face.a as usize);
                let seam = self.seams.get(pack, d);
                let points = match (seam, breaks.get(pack, 1 << d)) {
                    (Some(_), Some(broken)) => Points::Lane(broken, lane),
                    (Some(_), None) => Points::Elements,
                    (None, _) => Points::Nowhere,
                };
                let stages = contacts.joints.get(face.a as usize);
                let released = stages.is_some_and(|stages| stages[d] == Release::Done);
                let spacing = seam.map_or(0.0, |seam| seam.spacing(lane));
                (points, seam.map(|seam| seam.laws[lane]), spacing, released)
            }
            Joint::Seated(joint) => {
                let blocks = joint.patch.blocks;
                let surfaces = self.contact.as_ref();
                let spacing = surfaces.map_or(0.0, |surfaces| surfaces.spacing(blocks));
                match (contacts.held(blocks), contacts.ended(blocks)) {
                    (Some((patch, bond)), _) => {
                        (Points::Patch(&patch.points), Some(bond.law), spacing, false)
                    }
                    (None, Some(ended)) => {
                        (Points::Ended(&ended.pairs), Some(ended.bond.law), spacing, true)
                    }
                    (None, None) => (Points::Nowhere, None, spacing, false),
                }
            }
        };
        let law = law.and_then(|law| self.laws.get(usize::from(law))?.as_deref());
        let (blocks, pairs) = (self.joint(joint).blocks(), self.pairs_of(joint).len());
        Damage { blocks, law, pairs, points, spacing, released }
    }

    /// Damage of all joints whose two blocks are there.
    pub(crate) fn damages<'a>(
        &'a self,
        breaks: &'a Breaks,
        contacts: &'a Contacts,
    ) -> impl Iterator<Item = Damage<'a>> {
        let all = (0..self.n_joints()).map(move |joint| self.damage(joint, breaks, contacts));
        all.filter(|damage| !damage.blocks.iter().any(|&block| self.is_removed(block)))
    }
}

impl<'a> Damage<'a> {
    /// A pair; `None` where there are elements alone.
    pub(crate) fn point(&self, pair: usize) -> Option<&'a JointPoint> {
        match self.points {
            Points::Nowhere | Points::Elements => None,
            Points::Lane(broken, lane) => Some(&broken.points[pair][lane]),
            Points::Patch(points) => Some(&points[pair].pair),
            Points::Ended(pairs) => Some(&pairs[pair]),
        }
    }

    /// Its pairs; none where there are elements alone.
    pub(crate) fn points(&self) -> impl Iterator<Item = &'a JointPoint> {
        (0..self.pairs).filter_map(|pair| self.point(pair))
    }

    /// True where a pair has failed.
    pub(crate) fn has_failed(&self) -> bool {
        self.points().any(|point| point.failure.is_some())
    }

    /// True where a pair is bonded, and has a strength to hold with.
    pub(crate) fn holds(&self) -> bool {
        self.law.is_none_or(JointLaw::bonds)
            && match self.points {
                Points::Nowhere => false,
                Points::Elements => true,
                _ => self.points().any(|point| point.failure.is_none()),
            }
    }

    /// True where a contact has taken the place of the joint.
    pub(crate) fn is_released(&self) -> bool {
        self.released
    }

    /// True where the joint has turned about pairs that still hold, so far that it is to let go of them.
    pub(crate) fn hinges(&self) -> bool {
        let can = self.law.is_some_and(JointLaw::bonds) && !self.released;
        can && self.holds() && turned(self.points(), self.spacing)
    }
}
