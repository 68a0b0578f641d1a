//! Strengths that change by parts, as loads do, when a relax stage is entered.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Model;
use ddem_joint::contact::ContactSurfaces;
use ddem_mechanics::law::BlendedLaw;
use ddem_mesh::Geometry;
use ddem_mesh::NO_JOINT;
use ddem_mesh::joint_sections::JointSections;

impl Model {
    /// Gives joints that are others than `before` strengths that are a part of the way from those to their
    /// own: laws beyond those of the deck. One that could not fail before has its own at once. All of the way
    /// is what the deck says. Returns the laws of joints between faces that do not match, by their blocks.
    pub(crate) fn ramp(&mut self, before: &Geometry, part: f64) -> BTreeMap<[u32; 2], u16> {
        let own = self.properties.joints.len();
        self.laws.truncate(own);
        let Self { laws, properties, geometry, packs, contact, .. } = self;
        let mut changes: Vec<[u16; 2]> = Vec::new();
        let mut law = |old: u16, new: u16| {
            let of = |joint: u16| laws.get(usize::from(joint)).cloned().flatten();
            let (Some(from), Some(to)) = (of(old), of(new)) else { return new };
            if old == new || part >= 1.0 {
                return new;
            }
            let known = changes.iter().position(|change| *change == [old, new]);
            let at = known.unwrap_or_else(|| {
                changes.push([old, new]);
                laws.push(Some(Arc::new(BlendedLaw { laws: [from, to], part })));
                changes.len() - 1
            });
            debug_assert!(own + at < usize::from(NO_JOINT), "numbers have 16 bits");
            u16::try_from(own + at).unwrap_or(new)
        };
        let mut within =
            |block: usize, d: usize, joint: u16| law(before.joint_above(block, d), joint);
        let sections = JointSections::new(properties, geometry, packs, &mut within);
        let between = geometry.joined().map(|joint_pair| {
            let old = before.joint_of(joint_pair.blocks).unwrap_or(NO_JOINT);
            (joint_pair.blocks, law(old, joint_pair.joint))
        });
        let between = between.collect();
        if let Some(contact_model) = contact {
            contact_model.surfaces =
                ContactSurfaces::between(properties, laws, geometry, before, part);
        }
        self.sections = sections;
        between
    }
}
