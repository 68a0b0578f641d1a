//! §7: what goes by the increments of a relaxation besides loads: strengths that are assigned anew, and
//! supports that are driven to a displacement.

use super::Simulation;
use crate::state::Memory;
use crate::step::shift;

impl Simulation {
    /// What is another one in the increment that begins: strengths, and where supports are.
    pub(crate) fn begin_increment(&mut self, memory: &Memory) {
        if memory.increments > 1 {
            self.ramp_strengths(memory.left, memory.part(), true);
        }
        self.shift_supports(memory);
    }

    /// Strengths go by a part of the way from those of the stage that was left to those of the present one.
    /// Contacts are made `anew` where they have another friction now.
    pub(crate) fn ramp_strengths(&mut self, left: usize, part: f64, anew: bool) {
        let Self { model, state, .. } = self;
        let before = model.back(left, state.dug);
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
        self.measured = None;
    }

    /// Supports go their part of the way to their displacement, at once; what they do is the mean of the
    /// reactions before and after.
    fn shift_supports(&mut self, memory: &Memory) {
        let Some(first) = memory.driven else { return };
        let part = 1.0 / memory.increments as f64;
        let ways = self.model.conditions.ways((first, self.state.stage), part);
        if ways.iter().flatten().all(|way| *way == 0.0) {
            return;
        }
        let before = self.work_along(&ways);
        let velocities = std::mem::replace(&mut self.velocities, ways);
        let (context, state, scratch) = self.parts();
        shift(context, state);
        scratch.fit(context.model, state);
        self.state.contacts.known = false;
        self.measured = None;
        let ways = std::mem::replace(&mut self.velocities, velocities);
        let after = self.work_along(&ways);
        self.state.work.supports += 0.5 * (before + after);
        self.measured = None;
    }

    /// Work of the present reactions along the ways of the supports `[J]`.
    fn work_along(&mut self, ways: &[[f64; 3]]) -> f64 {
        self.measure_once();
        let supports = self.active.supports.iter().zip(&self.scratch.reactions);
        let each = supports.map(|(support, reaction)| {
            ways[support.fix as usize][usize::from(support.axis)] * reaction
        });
        each.sum()
    }
}
