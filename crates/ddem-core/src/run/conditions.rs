//! Start of a stage, and the actions of boundaries and charges.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::Simulation;
use crate::error::RunError;
use crate::model::Model;
use crate::model::boundary::{Column, ColumnMotion, ColumnStep};
use crate::model::charge::{ChargeForces, ChargeState, GasCharge, GasSurfaceState};
use crate::state::view::StageView;
use crate::state::{StageEntry, State};
use ddem_mesh::Vec3;
use ddem_mesh::slot::NodeSlot;

/// Fraction of its initial volume below which a cavity counts as narrowed.
const NARROW: f64 = 0.999;

impl Simulation {
    /// Enters stage `stage` of the deck, the present one or a later one. Its supports and loads
    /// come into force, and blocks that it or a skipped stage removes are removed. Joints and
    /// materials become those of the stage. A release that has begun continues until a relax stage.
    /// If a support ends at a boundary, its reaction continues as a constant force.
    ///
    /// # Errors
    ///
    /// [`RunError::EarlierStage`]; use [`save`](Self::save) and [`restore`](Self::restore) to go
    /// back.
    ///
    /// # Panics
    ///
    /// If the model has no such stage; a model without stages has stage 0.
    pub fn enter(&mut self, stage: usize) -> Result<(), RunError> {
        let n = self.model.n_stages();
        assert!(stage < n, "there is no stage {stage}: the model has {n}, from 0");
        let from_stage = self.state.stage;
        if stage < from_stage {
            return Err(RunError::EarlierStage { stage, present: from_stage });
        }
        self.synchronise();
        let active = self.model.active(stage, &self.state.applied);
        // The reactions are those with the blocks that are removed now.
        if !self.model.boundaries.list.is_empty() {
            self.measure_once();
            let carried =
                (&self.view.conditions, &self.scratch.reactions[..], &self.state.locked_reactions);
            self.state.locked_reactions =
                self.model.boundaries.locked_reactions(stage, carried, &active);
            self.begin_columns(stage);
        }
        let state = &mut *self.state;
        state.stage_entry.get_or_insert(StageEntry { from_stage, first: from_stage + 1 });
        state.stage = stage;
        // Skipped stages begin together with this one.
        state.stage_starts.resize(stage, state.time);
        state.stage_starts.push(state.time);
        let held = std::mem::take(&mut self.view.conditions.held_blocks);
        self.view.renew(&self.model, &self.state);
        self.excavate(from_stage, stage);
        let (packs, now) = (&self.model.packs, &self.view.conditions.held_blocks);
        self.state.contacts.remake_where_supports_changed(|block| {
            let (pack, lane) = packs.slot(block);
            held[pack][lane] != now[pack][lane]
        });
        Ok(())
    }

    /// Critical step with the gas of the charges `[s]`. `step` is the critical step without gas.
    /// The gas counts as stiff as at the start, or stiffer.
    pub(super) fn critical_step_with_gas(&self, step: f64) -> f64 {
        match self.gas_squares().into_iter().fold(0.0, f64::max) {
            0.0 => step,
            more => 2.0 / (4.0 / (step * step) + more).sqrt(),
        }
    }

    /// Upper bounds of the squared angular frequency that each charge with gas adds `[1/s²]`.
    pub(super) fn gas_squares(&self) -> Vec<f64> {
        let gases = self.charged().map(|(charge, surfaces)| {
            (&charge.nodes[..], charge.stiffness(&self.wall_displacements(charge), surfaces))
        });
        let gases: Vec<_> = gases.collect();
        let own = |(nodes, gas): &(&[u32], Option<(f64, Vec<Vec3>)>)| {
            let Some((stiffness, areas)) = gas else { return 0.0 };
            let mass = |node: &u32| self.model.mass(*node as usize);
            // Removed walls have no mass, and their charge has ended.
            let each = nodes.iter().zip(areas).filter(|(node, _)| mass(node) > 0.0);
            let each = each.map(|(node, a)| a.norm_squared() / mass(node));
            stiffness * each.sum::<f64>()
        };
        let alone: Vec<f64> = gases.iter().map(own).collect();
        let coupled = lists_that_share_nodes(gases.iter().map(|(nodes, _)| *nodes));
        // Gershgorin's bound: the coupling of two gases is at most the geometric mean of both.
        let row = |i: usize| coupled[i].iter().map(|&j| (alone[i] * alone[j]).sqrt()).sum::<f64>();
        (0..gases.len()).map(row).collect()
    }

    /// State of a charge at the present time, by its number; `None` if there is none.
    #[must_use]
    pub fn charge(&self, index: usize) -> Option<ChargeState> {
        let conditions = &self.model.conditions;
        let State { stage, time, stage_starts, .. } = &*self.state;
        let (charge, surfaces) = self.charged().nth(index)?;
        let gas = charge.gas_forces(&self.wall_displacements(charge), surfaces);
        let factors = conditions.factors(*stage, *time, stage_starts).unwrap_or_default();
        let factor = factors.get(conditions.loaded.len() + index).copied().unwrap_or(0.0);
        Some(ChargeState {
            pressure: gas.pressure * factor,
            volume: gas.volume,
            vented: gas.surfaces.iter().all(|surface| surface.venting_volume.is_some()),
            detonation_volume: surfaces.iter().map(|surface| surface.detonation_volume).sum(),
        })
    }

    /// Resets the critical steps if a charge detonates now in a volume smaller than at the start.
    /// Its gas is then stiffer and needs a shorter step.
    pub(super) fn check_new_gas(&mut self) -> Result<(), RunError> {
        if self.state.gas_surfaces.iter().all(|surface| surface.detonation_volume.is_some()) {
            return Ok(());
        }
        self.update_factors()?;
        let factors = self.view.factors.iter().skip(self.model.conditions.loaded.len());
        let acts = self.charged().zip(factors).filter(|(_, factor)| **factor != 0.0);
        let mut surfaces = acts.flat_map(|((_, surfaces), _)| surfaces);
        let begins = surfaces.any(|surface| surface.detonation_volume.is_none());
        drop(surfaces);
        if !begins {
            return Ok(());
        }
        let surfaces = self.update_gas();
        let before = std::mem::replace(&mut self.state.gas_surfaces, surfaces);
        let surfaces =
            self.charged().flat_map(|(charge, surfaces)| charge.surfaces.iter().zip(surfaces));
        let narrow = surfaces.zip(&before).any(|((surface, now), before)| {
            before.detonation_volume.is_none()
                && now
                    .detonation_volume
                    .is_some_and(|detonation_volume| detonation_volume < NARROW * surface.volume)
        });
        if narrow {
            self.forget_critical_steps();
        } else {
            self.state.gas_surfaces = before;
        }
        Ok(())
    }

    /// Charges with the gas states of their surfaces.
    pub(super) fn charged(&self) -> impl Iterator<Item = (&GasCharge, &[GasSurfaceState])> {
        let mut surfaces = self.state.gas_surfaces.as_slice();
        self.model.conditions.charged.iter().map(move |charged| {
            let (own, others) = surfaces.split_at(charged.charge.surfaces.len());
            surfaces = others;
            (&charged.charge, own)
        })
    }

    /// Displacements of the nodes of a charge `[m]`.
    pub(super) fn wall_displacements(&self, charge: &GasCharge) -> Vec<Vec3> {
        let u = |node: &u32| Vec3::from(self.model.get(&self.state.u, *node as usize));
        charge.nodes.iter().map(u).collect()
    }

    /// Updates the forces of the charges in force to the present positions of their walls. Returns
    /// the present gas states of all surfaces.
    pub(super) fn update_gas(&mut self) -> Vec<GasSurfaceState> {
        let loads = self.model.conditions.loaded.len();
        let acts = |load: usize| self.view.factors.get(load).is_some_and(|factor| *factor != 0.0);
        let charged: Vec<_> = self.charged().collect();
        let each = charged.par_iter().enumerate().map(|(index, (charge, before))| {
            acts(loads + index).then(|| charge.gas_forces(&self.wall_displacements(charge), before))
        });
        let each: Vec<Option<ChargeForces>> = each.collect();
        let mut surfaces = Vec::with_capacity(self.state.gas_surfaces.len());
        for (gas, (_, before)) in each.iter().zip(charged) {
            surfaces.extend(gas.as_ref().map_or(before, |gas| &gas.surfaces));
        }
        let Self { model, view: StageView { conditions, .. }, .. } = self;
        let boundary_forces = model.conditions.charged.iter().zip(each).enumerate();
        for (index, (charged, gas)) in boundary_forces {
            let Some(gas) = gas else { continue };
            for (node, force) in charged.charge.nodes.iter().zip(gas.forces) {
                let slot = model.node_slot(*node as usize);
                if let Some(present) = conditions.force_mut(slot, (loads + index) as u32) {
                    *present = force.into();
                }
            }
        }
        surfaces
    }

    /// Sets the free-field columns that come into force to rest.
    fn begin_columns(&mut self, stage: usize) {
        let boundaries = &self.model.boundaries;
        for (index, boundary) in boundaries.list.iter().enumerate() {
            let continues = boundaries.has(index, self.state.stage);
            if boundaries.has(index, stage) && !continues {
                for column in &boundary.columns {
                    let levels = column.first..column.first + column.nodes.len();
                    self.state.columns[levels].fill([Vec3::zeros(); 2]);
                }
            }
        }
    }

    /// Updates the boundary forces of the next step and the motion of the columns.
    pub(super) fn update_boundary_forces(&mut self) -> Result<(), RunError> {
        if self.view.boundaries.dashpots.is_empty() {
            self.view.columns = ColumnMotion::default();
            return Ok(());
        }
        let State { stage, time, stage_starts, columns, .. } = &*self.state;
        let Model { boundaries, assembly, .. } = &*self.model;
        let factors = boundaries.factors(*stage, *time, stage_starts)?;
        let motion = &self.motion;
        let rates = |column: &Column, level: usize, excavated: bool| {
            // Beside removed blocks the ground keeps its former damping.
            if excavated {
                return column.squares[level].map(|square| motion.rate(square));
            }
            let NodeSlot { pack, at, lane } = column.slots[level];
            let inertia = assembly.pack_inertia[pack] as usize;
            let at = at as usize - 3 * self.model.packs.packs[pack].start;
            let mass = assembly.inertia[inertia].mass[at / 3].0[usize::from(lane)];
            [0, 1, 2].map(|c| motion.classes[inertia].at(at + c, usize::from(lane))[2] / mass)
        };
        let step = ColumnStep {
            interval: motion.interval,
            fraction: 0.5 * motion.previous_step_ratio(),
            local: motion.local,
            stiffness: motion.stiffness,
            factors: &factors,
            velocities: &self.view.velocities,
            rates: &rates,
        };
        let mut column_motion = std::mem::take(&mut self.view.columns);
        column_motion.clear(columns.len());
        for active in &self.view.boundaries.columns {
            let column = &boundaries.list[active.boundary].columns[active.column];
            column.step(active, &step, columns, &mut column_motion);
        }
        let StageView { boundaries: in_force, boundary_forces, .. } = &mut self.view;
        in_force.forces(boundaries, &factors, &column_motion, boundary_forces);
        self.view.columns = column_motion;
        Ok(())
    }

    /// Moves the columns by the step that was computed last.
    pub(super) fn move_columns(&mut self) {
        for ([u, v], ahead) in self.state.columns.iter_mut().zip(&self.view.columns.ahead) {
            *u += ahead * self.motion.time_step;
            *v = *ahead;
        }
    }

    /// Brings the velocities of the columns to the present time.
    pub(super) fn synchronise_columns(&mut self) {
        for ([_, v], mean) in self.state.columns.iter_mut().zip(&self.view.columns.mean) {
            *v = *mean;
        }
    }
}

/// Indices of the lists that share a node with each list of nodes, itself included, in order.
fn lists_that_share_nodes<'a>(lists: impl Iterator<Item = &'a [u32]>) -> Vec<BTreeSet<usize>> {
    let (mut entries, mut coupled) = (Vec::new(), Vec::new());
    for (list, nodes) in lists.enumerate() {
        entries.extend(nodes.iter().map(|&node| (node, list)));
        coupled.push(BTreeSet::new());
    }
    entries.sort_unstable();
    for at_node in entries.chunk_by(|a, b| a.0 == b.0) {
        for &(_, list) in at_node {
            coupled[list].extend(at_node.iter().map(|&(_, other)| other));
        }
    }
    coupled
}

#[cfg(test)]
mod tests {
    use super::lists_that_share_nodes;

    #[test]
    fn lists_with_common_nodes_are_found() {
        let lists: [&[u32]; 5] = [&[1, 2, 3], &[7, 9], &[3, 4], &[], &[4, 9]];
        let found: Vec<Vec<usize>> = lists_that_share_nodes(lists.into_iter())
            .into_iter()
            .map(|found| found.into_iter().collect())
            .collect();
        assert_eq!(found, [vec![0, 2], vec![1, 4], vec![0, 2, 4], vec![], vec![1, 2, 4]]);
    }
}
