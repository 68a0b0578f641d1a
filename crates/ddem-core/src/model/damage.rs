//! Joints as they are now: one view of those whose faces match and of those whose faces do not.

use super::Model;
use super::pairs::Joint;
use crate::joint::breaks::{Breaks, Broken, Point};
use crate::joint::contact::{Bond, Contacts, Patch, Release};
use crate::law::JointLaw;
use crate::mesh::seams::Seam;

/// Damage of a joint at one time.
pub(crate) struct Damage<'a> {
    /// Its two blocks.
    pub(crate) blocks: [usize; 2],
    /// Its law; `None`: it never fails.
    pub(super) law: Option<&'a dyn JointLaw>,
    of: Of<'a>,
}

enum Of<'a> {
    /// Springs of the lane of one whose faces match, none while it is elements alone.
    Matching { broken: Option<&'a Broken>, seam: Option<&'a Seam>, lane: usize, released: bool },
    /// Springs of one whose faces do not; once a contact has taken its place there is no patch.
    Seated(Option<(&'a Bond, Option<&'a Patch>)>),
}

impl Model {
    /// Damage of a joint, by its number.
    pub(crate) fn damage<'a>(
        &'a self,
        joint: usize,
        breaks: &'a Breaks,
        contacts: &'a Contacts,
    ) -> Damage<'a> {
        let (of, law) = match self.joint(joint) {
            Joint::Matching(face) => {
                let d = usize::from(face.direction);
                let (pack, lane) = self.packs.slot(face.a as usize);
                let (broken, seam) = (breaks.get(pack, 1 << d), self.seams.get(pack, d));
                let stages = contacts.joints.get(face.a as usize);
                let released = stages.is_some_and(|stages| stages[d] == Release::Done);
                (Of::Matching { broken, seam, lane, released }, seam.map(|seam| seam.laws[lane]))
            }
            Joint::Seated(joint) => {
                let bond = contacts.bond(joint.patch.blocks);
                (Of::Seated(bond), bond.map(|(bond, _)| bond.law))
            }
        };
        let law = law.and_then(|law| self.laws.get(usize::from(law))?.as_deref());
        Damage { blocks: self.joint(joint).blocks(), law, of }
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

impl Damage<'_> {
    /// History of a pair and the time at which it failed `[s]`; `None` where there are elements alone.
    pub(crate) fn point(&self, pair: usize) -> Option<(Point, f64)> {
        match self.of {
            Of::Matching { broken, lane, .. } => {
                broken.map(|broken| (broken.points[pair][lane], broken.times[pair][lane]))
            }
            Of::Seated(bond) => {
                let (bond, patch) = bond?;
                let point = bond.point(pair, patch.map(|patch| &patch.points[pair]));
                Some((point, bond.pairs[pair].time))
            }
        }
    }

    /// True where a pair has failed.
    pub(crate) fn has_failed(&self) -> bool {
        match self.of {
            Of::Matching { broken, lane, .. } => broken.is_some_and(|b| b.has_failed(lane)),
            Of::Seated(bond) => {
                bond.is_some_and(|(bond, _)| bond.pairs.iter().any(|pair| pair.mode.is_some()))
            }
        }
    }

    /// True where a pair is bonded, and has a strength to hold with.
    pub(crate) fn holds(&self) -> bool {
        self.law.is_none_or(JointLaw::bonds)
            && match self.of {
                Of::Matching { broken, seam, lane, .. } => {
                    seam.is_some() && broken.is_none_or(|broken| broken.holds(lane))
                }
                Of::Seated(bond) => bond.is_some_and(|(bond, _)| !bond.failed()),
            }
    }

    /// True where a contact has taken the place of the joint.
    pub(crate) fn is_released(&self) -> bool {
        match self.of {
            Of::Matching { released, .. } => released,
            Of::Seated(bond) => matches!(bond, Some((_, None))),
        }
    }

    /// True where the joint has turned about pairs that still hold, so far that it is to let go of them.
    pub(crate) fn hinges(&self, model: &Model) -> bool {
        self.law.is_some_and(JointLaw::bonds)
            && match self.of {
                Of::Matching { broken: Some(broken), seam: Some(seam), lane, .. } => {
                    broken.holds(lane) && broken.turned(seam, lane)
                }
                Of::Seated(Some((_, Some(patch)))) => {
                    model.contact.as_ref().is_some_and(|surfaces| patch.hinges(&surfaces.blocks))
                }
                _ => false,
            }
    }
}
