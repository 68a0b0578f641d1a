//! Parts of a model that other crates read.

use std::sync::Arc;

use super::Model;
use crate::charge::ChargeSize;
use crate::conditions::Conditions;
use crate::contact::ContactDoubt;
use crate::geometry::Geometry;
use crate::problem::Problem;

impl Model {
    /// The problem that it was made from.
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

    /// Size of each charge before it goes off, in their order.
    #[must_use]
    pub fn charges(&self) -> Vec<ChargeSize> {
        self.conditions.charged.iter().map(|charged| charged.charge.size).collect()
    }

    /// True for a joint, given by its number, that can fail.
    #[must_use]
    pub fn joint_can_fail(&self, joint: u16) -> bool {
        self.laws.get(usize::from(joint)).is_some_and(Option::is_some)
    }

    /// Stiffnesses of contacts far from those of the blocks.
    #[must_use]
    pub fn contact_doubts(&self) -> Vec<ContactDoubt> {
        let of = (&*self.geometry, &self.packs, &self.assembly);
        let contact = self.contact.iter().filter(|contact| contact.search);
        contact.flat_map(|contact| contact.doubts(&self.properties, of)).collect()
    }
}
