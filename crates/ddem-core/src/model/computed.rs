//! Laws and histories that programs compute.

use std::sync::Arc;

use super::Model;
use crate::error::{ErrorCode, Fault};
use crate::model::history::{Function, no_velocity};
use crate::model::sliding::SlidingDamping;
use ddem_joint::contact::{ContactModel, ContactSurfaces};
use ddem_mechanics::law::{self, JointLaw};
use ddem_mesh::properties::JointProperties;

impl Model {
    /// New model of the same problem before its first stage, with the laws and histories that a
    /// program has set in this one.
    ///
    /// # Errors
    ///
    /// Those of [`set_law`](Self::set_law).
    pub(crate) fn rebuilt(&self) -> Result<Self, Fault> {
        let mut model = Self::new(self.problem.clone());
        for (JointProperties { name, .. }, law) in self.properties.joints.iter().zip(&self.laws) {
            let own = self.computed.contains(&format!("joints.{name}"));
            if let Some(law) = law.as_ref().filter(|_| own) {
                model.set_law(name, law.clone())?;
            }
        }
        model.conditions.take_histories(&self.conditions);
        model.boundaries.take_histories(&self.boundaries);
        model.computed.clone_from(&self.computed);
        Ok(model)
    }

    /// Gives all joints of a name a custom law instead of the deck's strengths.
    ///
    /// The law is not part of the deck. A simulation that is restored needs a model with the same
    /// laws, and warnings and reports refer to the deck's strengths. Contacts are searched for from
    /// now on, unless the deck has `contact = false`. Their strength is
    /// [`JointLaw::contact_strength`], unless `[contact]` of the deck has a friction.
    ///
    /// # Errors
    ///
    /// No joint has that name. A strength of the law is negative or not a number, its dilation
    /// takes more energy than its friction dissipates, or its methods for contacts or failure
    /// contradict its strengths.
    pub fn set_law(&mut self, joint: &str, law: Arc<dyn JointLaw>) -> Result<(), Fault> {
        let joints = &self.properties.joints;
        let is_joint = |known: &&JointProperties| !known.is_whole_rock();
        let Some(index) = joints.iter().position(|known| known.name == joint && is_joint(&known))
        else {
            let names = joints.iter().filter(is_joint).map(|known| format!("`{}`", known.name));
            let place = format!("joints.{joint}");
            let fault = Fault::new(ErrorCode::UnknownName, place, "no joint has this name");
            return Err(fault.help(match names.collect::<Vec<_>>().join(", ").as_str() {
                "" => "the model has no joints".to_owned(),
                names => format!("joints of the model: {names}"),
            }));
        };
        law::check(&*law)
            .map_err(|why| Fault::new(ErrorCode::InvalidLaw, format!("joints.{joint}"), why))?;
        self.properties.joints[index].law = Some(law.clone());
        self.laws[index] = Some(law);
        self.computed.push(format!("joints.{joint}"));
        let Self { laws, contact, geometry, packs, properties, .. } = &*self;
        self.sliding = SlidingDamping::new(laws, contact.as_ref(), properties, geometry, packs);
        // Blocks whose joints can fail now may meet, unless the deck excludes contacts.
        if !self.properties.contact.given && self.can_fail() {
            let new =
                || ContactModel::new(&self.properties, &self.laws, &self.geometry, &self.packs);
            let mut contact_model = self.contact.take().unwrap_or_else(new);
            contact_model.from_start &= !ddem_mesh::connected::is_connected(&self.geometry);
            contact_model.search = true;
            self.properties.contact.search = true;
            self.contact = Some(contact_model);
        }
        if let Some(contact_model) = &mut self.contact {
            contact_model.surfaces =
                ContactSurfaces::new(&self.properties, &self.laws, &self.geometry);
        }
        Ok(())
    }

    /// Gives a load, by its number in the deck, a factor in time that a program computes. It
    /// replaces the deck's history and is not part of the deck, as with [`set_law`](Self::set_law).
    ///
    /// # Errors
    ///
    /// There is no such load.
    pub fn set_load_history(&mut self, load: usize, function: Arc<Function>) -> Result<(), Fault> {
        self.conditions.set_history("load", load, function)?;
        self.computed.push(format!("load[{load}].history"));
        Ok(())
    }

    /// Gives a charge, by its number in the deck, a factor in time on its pressure that a program
    /// computes. Its time counts from the detonation. It replaces the deck's history.
    ///
    /// # Errors
    ///
    /// There is no such charge.
    pub fn set_charge_history(
        &mut self,
        charge: usize,
        function: Arc<Function>,
    ) -> Result<(), Fault> {
        self.conditions.set_history("charge", charge, function)?;
        self.computed.push(format!("charge[{charge}].history"));
        Ok(())
    }

    /// Gives a driven support, by its number in the deck, a factor in time on its velocity that a
    /// program computes. It replaces the deck's history.
    ///
    /// # Errors
    ///
    /// There is no such support, or it has no `velocity`.
    pub fn set_fix_history(&mut self, fix: usize, function: Arc<Function>) -> Result<(), Fault> {
        if self.conditions.fixed.get(fix).is_some_and(|fix| fix.velocity.is_none()) {
            return Err(no_velocity(&format!("fix[{fix}]")));
        }
        self.conditions.set_history("fix", fix, function)?;
        self.computed.push(format!("fix[{fix}].history"));
        Ok(())
    }

    /// Gives the wave of a boundary, by its number in the deck, a factor in time that a program
    /// computes. It replaces the deck's history.
    ///
    /// # Errors
    ///
    /// There is no such boundary, or it has no `velocity`.
    pub fn set_boundary_history(
        &mut self,
        boundary: usize,
        function: Arc<Function>,
    ) -> Result<(), Fault> {
        self.boundaries.set_history(boundary, function)?;
        self.computed.push(format!("boundary[{boundary}].history"));
        Ok(())
    }
}
