//! Strengths that change in increments of a relax stage, as loads do.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::Model;
use crate::error::RunError;
use ddem_joint::contact::ContactSurfaces;
use ddem_mechanics::law::BlendedLaw;
use ddem_mesh::Geometry;
use ddem_mesh::NO_JOINT;
use ddem_mesh::joint_sections::JointSections;

impl Model {
    /// Numbers of joint properties, before and now, between which strengths change gradually. Both
    /// can fail.
    fn gradual_changes(&self, before: &Geometry) -> Vec<[u16; 2]> {
        let now = &self.geometry;
        let number =
            |geometry: &Geometry, (block, d): (usize, usize)| geometry.joint_above(block, d);
        let faces = (0..now.blocks.len()).flat_map(|block| (0..3).map(move |d| (block, d)));
        let within = faces.map(|face| [number(before, face), number(now, face)]);
        let between = now
            .joined()
            .map(|joint| [before.joint_of(joint.blocks).unwrap_or(NO_JOINT), joint.joint]);
        let can_fail = |joint: u16| matches!(self.laws.get(usize::from(joint)), Some(Some(_)));
        let changes: BTreeSet<[u16; 2]> = within.chain(between).collect();
        changes.into_iter().filter(|&[a, b]| a != b && can_fail(a) && can_fail(b)).collect()
    }

    /// Checks that the laws between those of `before` and the present ones can be numbered.
    ///
    /// # Errors
    ///
    /// There are more than 65 534 laws.
    pub(crate) fn check_ramp(&self, before: &Geometry) -> Result<(), RunError> {
        let laws = self.properties.joints.len() + self.gradual_changes(before).len();
        if laws < usize::from(NO_JOINT) { Ok(()) } else { Err(RunError::TooManyLaws { laws }) }
    }

    /// Gives joints that differ from `before` intermediate strengths, at a `fraction` of the way to
    /// their own. The intermediate laws follow those of the deck. A joint that could not fail
    /// before has its own law at once. At fraction 1 all laws are those of the deck. Returns the
    /// laws of nonconforming joints, by their blocks.
    pub(crate) fn ramp(&mut self, before: &Geometry, fraction: f64) -> BTreeMap<[u32; 2], u16> {
        let own = self.properties.joints.len();
        self.laws.truncate(own);
        let changes = if fraction < 1.0 { self.gradual_changes(before) } else { Vec::new() };
        let Self { laws, properties, geometry, packs, contact, .. } = self;
        for change in &changes {
            let [Some(from), Some(to)] = change.map(|joint| laws[usize::from(joint)].clone())
            else {
                continue;
            };
            laws.push(Some(Arc::new(BlendedLaw { laws: [from, to], fraction })));
        }
        let law = |old: u16, new: u16| {
            changes.binary_search(&[old, new]).map_or(new, |at| (own + at) as u16)
        };
        let mut within =
            |block: usize, d: usize, joint: u16| law(before.joint_above(block, d), joint);
        let sections = JointSections::new(properties, geometry, packs, &mut within);
        let between = geometry.joined().map(|joint| {
            let old = before.joint_of(joint.blocks).unwrap_or(NO_JOINT);
            (joint.blocks, law(old, joint.joint))
        });
        let between = between.collect();
        if let Some(contact_model) = contact {
            contact_model.surfaces =
                ContactSurfaces::between(properties, laws, geometry, before, fraction);
        }
        self.sections = sections;
        between
    }
}
