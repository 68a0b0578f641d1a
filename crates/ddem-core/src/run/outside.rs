//! Stages come into force; and what boundaries and charges do from outside.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::Simulation;
use crate::error::RunError;
use crate::model::Model;
use crate::model::boundary::{Column, Moving, Pace};
use crate::model::charge::{Charge, ChargeState, Fill, Push};
use crate::state::view::StageView;
use crate::state::{Fresh, State};
use ddem_mesh::Vec3;
use ddem_mesh::slot::NodeSlot;

/// Part of its volume at the start with which a cavity is narrower than it was.
const NARROW: f64 = 0.999;

impl Simulation {
    /// Begins stage `stage` of the deck, the present one or a later one: its supports and loads come into
    /// force, and what is taken out by then is. Joints and materials become those of the stage, and a release
    /// that has begun goes on until a relax stage. What supports bore that end where a boundary is goes on as
    /// constant forces.
    ///
    /// # Errors
    ///
    /// [`RunError::EarlierStage`]: [`save`](Self::save) and [`restore`](Self::restore) go back.
    ///
    /// # Panics
    ///
    /// If the model has no such stage; one without stages has stage 0.
    pub fn enter(&mut self, stage: usize) -> Result<(), RunError> {
        let n = self.model.n_stages();
        assert!(stage < n, "there is no stage {stage}: the model has {n}, from 0");
        let left = self.state.stage;
        if stage < left {
            return Err(RunError::EarlierStage { stage, present: left });
        }
        self.settle();
        let active = self.model.active(stage, &self.state.applied);
        // What they bore, they bore with the blocks that are taken out now.
        if !self.model.borders.list.is_empty() {
            self.measure_once();
            let borne = (&self.view.active, &self.scratch.reactions[..], &self.state.kept);
            self.state.kept = self.model.borders.kept(stage, borne, &active);
            self.begin_columns(stage);
        }
        let state = &mut *self.state;
        state.fresh.get_or_insert(Fresh { left, first: left + 1 });
        state.stage = stage;
        // Stages that were skipped begin together with this one.
        state.stage_starts.resize(stage, state.time);
        state.stage_starts.push(state.time);
        let held = std::mem::take(&mut self.view.active.held_bodies);
        self.view.renew(&self.model, &self.state);
        self.excavate(left, stage);
        let (packs, now) = (&self.model.packs, &self.view.active.held_bodies);
        self.state.contacts.hold_anew(|block| {
            let (pack, lane) = packs.slot(block);
            held[pack][lane] != now[pack][lane]
        });
        Ok(())
    }

    /// The critical step with the gas of charges, as stiff as it is at the start or more, beside the springs that
    /// a critical step is given for `[s]`.
    pub(super) fn with_gas(&self, step: f64) -> f64 {
        let gases = self.charged().filter_map(|(charge, fills)| {
            Some((&charge.nodes, charge.stiffness(&self.moved(charge), fills)?))
        });
        let gases: Vec<_> = gases.collect();
        let own = |(nodes, (stiffness, areas)): &(&Vec<u32>, (f64, Vec<Vec3>))| {
            let mass = |node: &u32| self.model.mass(*node as usize);
            // Walls that have been taken out have none; the charge is over then.
            let each = nodes.iter().zip(areas).filter(|(node, _)| mass(node) > 0.0);
            let each = each.map(|(node, a)| a.norm_squared() / mass(node));
            stiffness * each.sum::<f64>()
        };
        let alone: Vec<f64> = gases.iter().map(own).collect();
        let meet = meeting(gases.iter().map(|(nodes, _)| &nodes[..]));
        // Gershgorin: what each has in common with the others is at most the mean of both.
        let row = |i: usize| meet[i].iter().map(|&j| (alone[i] * alone[j]).sqrt()).sum::<f64>();
        match (0..gases.len()).map(row).fold(0.0, f64::max) {
            0.0 => step,
            more => 2.0 / (4.0 / (step * step) + more).sqrt(),
        }
    }

    /// A charge at the present time, by its number; `None` where there is none.
    #[must_use]
    pub fn charge(&self, index: usize) -> Option<ChargeState> {
        let conditions = &self.model.conditions;
        let State { stage, time, stage_starts, .. } = &*self.state;
        let (charge, fills) = self.charged().nth(index)?;
        let push = charge.push(&self.moved(charge), fills);
        let factors = conditions.factors(*stage, *time, stage_starts).unwrap_or_default();
        let factor = factors.get(conditions.loaded.len() + index).copied().unwrap_or(0.0);
        Some(ChargeState {
            pressure: push.pressure * factor,
            volume: push.volume,
            vented: push.fills.iter().all(|fill| fill.left.is_some()),
            began: fills.iter().map(|fill| fill.began).sum(),
        })
    }

    /// Gas that goes off now where there is less room than at the start is stiffer, and its step shorter.
    pub(super) fn look_at_new_gas(&mut self) -> Result<(), RunError> {
        if self.state.fills.iter().all(|fill| fill.began.is_some()) {
            return Ok(());
        }
        self.take_factors()?;
        let factors = self.view.factors.iter().skip(self.model.conditions.loaded.len());
        let acts = self.charged().zip(factors).filter(|(_, factor)| **factor != 0.0);
        let mut fills = acts.flat_map(|((_, fills), _)| fills);
        let begins = fills.any(|fill| fill.began.is_none());
        drop(fills);
        if !begins {
            return Ok(());
        }
        let fills = self.press();
        let before = std::mem::replace(&mut self.state.fills, fills);
        let shells = self.charged().flat_map(|(charge, fills)| charge.shells.iter().zip(fills));
        let narrow = shells.zip(&before).any(|((shell, now), before)| {
            before.began.is_none() && now.began.is_some_and(|began| began < NARROW * shell.volume)
        });
        if narrow {
            self.critical_steps = [None; 2];
        } else {
            self.state.fills = before;
        }
        Ok(())
    }

    /// Charges with what is in their shells.
    pub(super) fn charged(&self) -> impl Iterator<Item = (&Charge, &[Fill])> {
        let mut fills = self.state.fills.as_slice();
        self.model.conditions.charged.iter().map(move |charged| {
            let (own, others) = fills.split_at(charged.charge.shells.len());
            fills = others;
            (&charged.charge, own)
        })
    }

    /// Displacements of the nodes that a charge pushes.
    pub(super) fn moved(&self, charge: &Charge) -> Vec<Vec3> {
        let u = |node: &u32| Vec3::from(self.model.get(&self.state.u, *node as usize));
        charge.nodes.iter().map(u).collect()
    }

    /// Gas of the charges in force pushes its walls where they are now. Returns what is in the shells by
    /// now.
    pub(super) fn press(&mut self) -> Vec<Fill> {
        let loads = self.model.conditions.loaded.len();
        let acts = |load: usize| self.view.factors.get(load).is_some_and(|factor| *factor != 0.0);
        let charged: Vec<_> = self.charged().collect();
        let each = charged.par_iter().enumerate().map(|(index, (charge, before))| {
            acts(loads + index).then(|| charge.push(&self.moved(charge), before))
        });
        let each: Vec<Option<Push>> = each.collect();
        let mut fills = Vec::with_capacity(self.state.fills.len());
        for (push, (_, before)) in each.iter().zip(charged) {
            fills.extend(push.as_ref().map_or(before, |push| &push.fills));
        }
        let Self { model, view: StageView { active, .. }, .. } = self;
        let pushes = model.conditions.charged.iter().zip(each).enumerate();
        for (index, (charged, push)) in pushes {
            let Some(push) = push else { continue };
            for (node, force) in charged.charge.nodes.iter().zip(push.forces) {
                let slot = model.node_slot(*node as usize);
                if let Some(present) = active.force_mut(slot, (loads + index) as u32) {
                    *present = force.into();
                }
            }
        }
        fills
    }

    /// Columns that come into force are at rest.
    fn begin_columns(&mut self, stage: usize) {
        let borders = &self.model.borders;
        for (index, border) in borders.list.iter().enumerate() {
            let goes_on = borders.has(index, self.state.stage);
            if borders.has(index, stage) && !goes_on {
                for column in &border.columns {
                    let levels = column.first..column.first + column.nodes.len();
                    self.state.columns[levels].fill([Vec3::zeros(); 2]);
                }
            }
        }
    }

    /// What boundaries will do in the next step, and where that takes the columns.
    pub(super) fn take_pushes(&mut self) -> Result<(), RunError> {
        if self.view.outside.dashpots.is_empty() {
            self.view.columns = Moving::default();
            return Ok(());
        }
        let State { stage, time, stage_starts, columns, .. } = &*self.state;
        let Model { borders, assembly, .. } = &*self.model;
        let factors = borders.factors(*stage, *time, stage_starts)?;
        let motion = &self.motion;
        let rates = |column: &Column, level: usize, dug: bool| {
            // Beside what has been taken out the ground has the damping that it had.
            if dug {
                return column.squares[level].map(|square| motion.rate(square));
            }
            let NodeSlot { pack, at, lane } = column.slots[level];
            let inertia = assembly.pack_inertia[pack] as usize;
            let at = at as usize - 3 * self.model.packs.packs[pack].start;
            let mass = assembly.inertia[inertia].mass[at / 3].0[usize::from(lane)];
            [0, 1, 2].map(|c| motion.classes[inertia].at(at + c, usize::from(lane))[2] / mass)
        };
        let pace = Pace {
            interval: motion.interval,
            part: 0.5 * motion.behind(),
            local: motion.local,
            stiffness: motion.stiffness,
            factors: &factors,
            velocities: &self.view.velocities,
            rates: &rates,
        };
        let mut moving = std::mem::take(&mut self.view.columns);
        moving.clear(columns.len());
        for standing in &self.view.outside.standing {
            let column = &borders.list[standing.border].columns[standing.column];
            column.step(standing, &pace, columns, &mut moving);
        }
        let StageView { outside, pushes, .. } = &mut self.view;
        outside.push(borders, &factors, &moving, pushes);
        self.view.columns = moving;
        Ok(())
    }

    /// Columns go the step that was looked at.
    pub(super) fn move_columns(&mut self) {
        for ([u, v], ahead) in self.state.columns.iter_mut().zip(&self.view.columns.ahead) {
            *u += ahead * self.motion.time_step;
            *v = *ahead;
        }
    }

    /// Velocities of the columns come to the present time.
    pub(super) fn settle_columns(&mut self) {
        for ([_, v], mean) in self.state.columns.iter_mut().zip(&self.view.columns.mean) {
            *v = *mean;
        }
    }
}

/// For each of some lists of nodes those that have a node in common with it, itself included, in order.
fn meeting<'a>(lists: impl Iterator<Item = &'a [u32]>) -> Vec<BTreeSet<usize>> {
    let (mut places, mut meet) = (Vec::new(), Vec::new());
    for (list, nodes) in lists.enumerate() {
        places.extend(nodes.iter().map(|&node| (node, list)));
        meet.push(BTreeSet::new());
    }
    places.sort_unstable();
    for at_node in places.chunk_by(|a, b| a.0 == b.0) {
        for &(_, list) in at_node {
            meet[list].extend(at_node.iter().map(|&(_, other)| other));
        }
    }
    meet
}

#[cfg(test)]
mod tests {
    use super::meeting;

    #[test]
    fn lists_meet_at_the_nodes_that_they_share() {
        let lists: [&[u32]; 5] = [&[1, 2, 3], &[7, 9], &[3, 4], &[], &[4, 9]];
        let met: Vec<Vec<usize>> =
            meeting(lists.into_iter()).into_iter().map(|met| met.into_iter().collect()).collect();
        assert_eq!(met, [vec![0, 2], vec![1, 4], vec![0, 2, 4], vec![], vec![1, 2, 4]]);
    }
}
