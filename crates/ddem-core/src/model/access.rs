//! Parts of a model that other crates read.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::Model;
use crate::error::{ErrorCode, Fault};
use crate::model::charge::ChargeSize;
use crate::model::conditions::Conditions;
use crate::model::problem::Problem;
use ddem_joint::contact::{ContactModel, ContactWarning};
use ddem_mesh::Geometry;

impl Model {
    /// The problem from which the model was made.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// Blocks, their nodes and joints in the present stage.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Supports, loads and charges, with the histories that programs compute.
    #[must_use]
    pub fn conditions(&self) -> &Conditions {
        &self.conditions
    }

    /// Size of each charge before detonation, in the order of the charges.
    #[must_use]
    pub fn charges(&self) -> Vec<ChargeSize> {
        self.conditions.charged.iter().map(|charged| charged.charge.size).collect()
    }

    /// True if the joint with this number can fail.
    #[must_use]
    pub fn joint_can_fail(&self, joint: u16) -> bool {
        self.laws.get(usize::from(joint)).is_some_and(Option::is_some)
    }

    /// Warnings about contact stiffnesses far from those of the blocks.
    #[must_use]
    pub fn contact_warnings(&self) -> Vec<ContactWarning> {
        let Self { geometry, packs, assembly, properties, .. } = self;
        let contact = self.contact.iter().filter(|contact| contact.search);
        let warnings =
            |contact: &ContactModel| contact.warnings(properties, geometry, packs, assembly);
        contact.flat_map(warnings).collect()
    }

    /// Fault of a search for a factor of safety in a model in which nothing can fail, at the place
    /// of the stage.
    #[must_use]
    pub fn without_strength(&self, place: &str) -> Option<Fault> {
        let nothing = "there is no strength to divide: no joint can fail, and blocks do not meet";
        let help = "give joints `friction`, `cohesion` or `tension`, or let blocks meet";
        let weak = self.laws.iter().all(Option::is_none) && !self.can_meet();
        weak.then(|| Fault::new(ErrorCode::NotSupported, place, nothing).help(help))
    }

    /// Names of the joints between blocks that never fail.
    pub fn joints_without_strength(&self) -> impl Iterator<Item = &str> {
        let used: BTreeSet<u16> = self.joint_numbers().collect();
        let weak = move |number: usize| {
            u16::try_from(number).is_ok_and(|joint| used.contains(&joint))
                && self.laws[number].is_none()
        };
        let joints = self.properties.joints.iter().enumerate();
        joints.filter(move |(number, _)| weak(*number)).map(|(_, joint)| joint.name.as_str())
    }
}
