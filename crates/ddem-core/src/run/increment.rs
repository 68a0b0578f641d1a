//! §7: increments of a relaxation: besides loads, assigned strengths and supports with a displacement go by parts.

use std::sync::Arc;

use super::Simulation;
use crate::model::Model;
use crate::state::Memory;
use crate::step::shift;
use ddem_joint::contact::Skins;
use ddem_mechanics::law::Reduced;
use ddem_mechanics::math::lanes::Lanes;

/// Increments of relaxations that drive supports.
const DRIVEN: u32 = 10;

impl Simulation {
    /// Begins an increment: strengths and supports go their part of the way.
    pub(super) fn begin_increment(&mut self, memory: &Memory) {
        if memory.increments > 1 {
            self.ramp_strengths(memory.left, memory.part(), true);
        }
        self.shift_supports(memory);
    }

    /// Strengths go by a part of the way from those of the stage that was left to those of the present one.
    /// Contacts are made `anew` where they have another friction now.
    pub(super) fn ramp_strengths(&mut self, left: usize, part: f64, anew: bool) {
        let Self { model, state, .. } = self;
        let before = model.back(left, state.stage);
        let differs = |block: u32| model.geometry.differs(&before, block as usize);
        if !(0..model.n_blocks()).any(|block| differs(block as u32)) {
            return;
        }
        let contacts = &mut state.contacts;
        contacts.make_anew(|patch| {
            anew && patch.bond.is_none() && patch.blocks.into_iter().any(differs)
        });
        let laws = model.ramp(&before, part);
        for patch in &mut contacts.patches {
            if let (Some(bond), Some(law)) = (&mut patch.bond, laws.get(&patch.blocks)) {
                bond.law = *law;
            }
        }
        state.breaks.look_again();
    }

    /// Divides the strengths of joints, by their numbers, by a factor, and with `contacts` the friction of faces
    /// that no joint gives.
    pub(super) fn reduce_strengths(&mut self, joints: &[usize], contacts: bool, factor: f64) {
        let Self { model, state, .. } = self;
        for &joint in joints {
            if let Some(law) = model.laws[joint].take() {
                model.laws[joint] = Some(Arc::new(Reduced { law, factor }));
            }
        }
        let Model { contact, properties, laws, geometry, .. } = &mut **model;
        if let Some(surfaces) = contact {
            surfaces.skins = Skins::new(properties, laws, geometry);
            if contacts {
                surfaces.skins.divide_friction(factor);
            }
        }
        state.contacts.make_anew(|patch| patch.bond.is_none());
        state.breaks.look_again();
    }

    /// Increments of the relaxation that comes, where nobody says how many: several where supports are driven, as
    /// joints that fail under all of a way at once have another history.
    #[must_use]
    pub fn default_increments(&self) -> u32 {
        let driven = self.state.fresh.map(|fresh| fresh.first..=self.state.stage);
        let ways = driven.map(|stages| self.model.conditions.ways(stages, 1.0)).unwrap_or_default();
        if ways.iter().flatten().any(|way| *way != 0.0) { DRIVEN } else { 1 }
    }

    /// Ways of the fixes in one increment `[m]`.
    pub(super) fn ways(&self, memory: &Memory) -> Vec<[f64; 3]> {
        let part = 1.0 / memory.increments as f64;
        let driven = memory.driven.map(|first| first..=self.state.stage);
        driven.map_or_else(Vec::new, |stages| self.model.conditions.ways(stages, part))
    }

    /// Supports go their part of the way to their displacement, at once; what they do is the mean of the
    /// reactions before and after.
    fn shift_supports(&mut self, memory: &Memory) {
        let ways = self.ways(memory);
        if ways.iter().flatten().all(|way| *way == 0.0) {
            return;
        }
        let before = self.work_along(&ways);
        let velocities = std::mem::replace(&mut self.view.velocities, ways);
        let (context, state, scratch) = self.parts();
        shift(context, state);
        scratch.fit(context.model, state);
        self.state.contacts.known = false;
        let ways = std::mem::replace(&mut self.view.velocities, velocities);
        // Velocities are the ways now: the power of loads is their work, but reactions would stop them.
        let loads = self.measure_once().sums.loads[0];
        self.state.v.fill(Lanes::ZERO);
        let after = self.work_along(&ways);
        let work = &mut self.state.work;
        work.supports += 0.5 * (before + after);
        work.loads += loads;
        work.most = work.most.max((work.loads + work.supports).abs());
    }

    /// Work of the present reactions along the ways of the supports `[J]`.
    fn work_along(&mut self, ways: &[[f64; 3]]) -> f64 {
        self.measure_once();
        let supports = self.view.active.supports.iter().zip(&self.scratch.reactions);
        let each = supports.map(|(support, reaction)| {
            ways[support.fix as usize][usize::from(support.axis)] * reaction
        });
        each.sum()
    }
}
