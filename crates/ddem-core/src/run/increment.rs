//! Increments of a relaxation (§7): loads, assigned strengths and supports with a displacement
//! change in parts.

use std::sync::Arc;

use super::Simulation;
use crate::model::Model;
use crate::state::RelaxationProgress;
use crate::step::apply_support_displacements;
use ddem_joint::contact::ContactSurfaces;
use ddem_mechanics::law::ReducedLaw;
use ddem_mechanics::math::lanes::Lanes;

impl Simulation {
    /// Begins an increment: changes strengths and moves supports by their fraction.
    pub(super) fn begin_increment(&mut self, progress: &RelaxationProgress) {
        if progress.increments > 1 {
            self.ramp_strengths(progress.from_stage, progress.fraction(), true);
        }
        self.shift_supports(progress);
    }

    /// Sets the strengths to a fraction of the way from those of the stage `from_stage` to those of
    /// the present stage. With `remake`, contacts whose friction has changed are remade.
    pub(super) fn ramp_strengths(&mut self, from_stage: usize, fraction: f64, remake: bool) {
        let Self { model, state, .. } = self;
        let before = model.back(from_stage, state.stage);
        let differs = |block: u32| model.geometry.differs(&before, block as usize);
        if !(0..model.n_blocks()).any(|block| differs(block as u32)) {
            return;
        }
        let contacts = &mut state.contacts;
        contacts.remake(|patch| {
            remake && patch.bond.is_none() && patch.blocks.into_iter().any(differs)
        });
        let laws = model.ramp(&before, fraction);
        for patch in &mut contacts.patches {
            if let (Some(bond), Some(law)) = (&mut patch.bond, laws.get(&patch.blocks)) {
                bond.law = *law;
            }
        }
        state.broken_joints.recheck();
    }

    /// Divides the strengths of joints, given by their numbers, by a factor. With `contacts` it
    /// also divides the friction of faces that does not come from a joint.
    pub(super) fn reduce_strengths(&mut self, joints: &[usize], contacts: bool, factor: f64) {
        let Self { model, state, .. } = self;
        for &joint in joints {
            if let Some(law) = model.laws[joint].take() {
                model.laws[joint] = Some(Arc::new(ReducedLaw { law, factor }));
            }
        }
        let Model { contact, properties, laws, geometry, .. } = &mut **model;
        if let Some(contact_model) = contact {
            contact_model.surfaces = ContactSurfaces::new(properties, laws, geometry);
            if contacts {
                contact_model.surfaces.divide_friction(factor);
            }
        }
        state.contacts.remake(|patch| patch.bond.is_none());
        state.broken_joints.recheck();
    }

    /// Default number of increments of a relaxation.
    pub const INCREMENTS: u32 = 1;
    /// Default number of increments of a relaxation that drives supports.
    pub const DRIVEN_INCREMENTS: u32 = 10;

    /// Default number of increments of the next relaxation: several if it drives supports, because
    /// joints that fail under the whole displacement at once have another history.
    #[must_use]
    pub fn default_increments(&self) -> u32 {
        let driven = self.state.stage_entry.map(|entry| entry.first..=self.state.stage);
        let support_increments = driven
            .map(|stages| self.model.conditions.support_increments(stages, 1.0))
            .unwrap_or_default();
        if support_increments.iter().flatten().any(|increment| *increment != 0.0) {
            Self::DRIVEN_INCREMENTS
        } else {
            Self::INCREMENTS
        }
    }

    /// Displacements of the supports in one increment `[m]`.
    pub(super) fn support_increments(&self, progress: &RelaxationProgress) -> Vec<[f64; 3]> {
        let fraction = 1.0 / progress.increments as f64;
        let driven = progress.driven.map(|first| first..=self.state.stage);
        driven.map_or_else(Vec::new, |stages| {
            self.model.conditions.support_increments(stages, fraction)
        })
    }

    /// Moves supports by their displacement in one increment, at once. Their work uses the mean of
    /// the reactions before and after.
    fn shift_supports(&mut self, progress: &RelaxationProgress) {
        let support_increments = self.support_increments(progress);
        if support_increments.iter().flatten().all(|increment| *increment == 0.0) {
            return;
        }
        let before = self.work_along(&support_increments);
        let velocities = std::mem::replace(&mut self.view.velocities, support_increments);
        let (context, state, scratch) = self.parts();
        apply_support_displacements(context, state, scratch);
        scratch.fit(context.model, state);
        self.state.contacts.near_is_complete = false;
        let support_increments = std::mem::replace(&mut self.view.velocities, velocities);
        // The velocities are the displacement increments here, so that the power of the loads is
        // their work. The reactions would stop these velocities and are measured afterwards, at
        // rest.
        let loads = self.measure_once().sums.loads[0];
        self.state.v.fill(Lanes::ZERO);
        let after = self.work_along(&support_increments);
        let work = &mut self.state.work;
        work.supports += 0.5 * (before + after);
        work.loads += loads;
        work.most = work.most.max((work.loads + work.supports).abs());
    }

    /// Work of the present reactions over the displacements of the supports `[J]`.
    fn work_along(&mut self, support_increments: &[[f64; 3]]) -> f64 {
        self.measure_once();
        let supports = self.view.conditions.supports.iter().zip(&self.scratch.reactions);
        let each = supports.map(|(support, reaction)| {
            support_increments[support.fix as usize][usize::from(support.axis)] * reaction
        });
        each.sum()
    }
}
