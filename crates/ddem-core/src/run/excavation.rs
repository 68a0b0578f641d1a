//! Removal of blocks at the start of a stage (§13).

use std::sync::Arc;

use super::{Simulation, peaks};
use crate::model::conditions::{AppliedForces, FadingForces};
use crate::state::motion::Motion;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{MassProperties, Pose};
use ddem_mesh::Geometry;

impl Simulation {
    /// Removes blocks on the way from one stage to another, one excavation after the other, so that
    /// each releases its own forces. Joints and materials become those of the stage.
    pub(super) fn excavate(&mut self, from: usize, stage: usize) {
        let mut last = from;
        let mut steps = Vec::new();
        for (first, geometry) in self.model.steps(from, stage) {
            // If joints change in the same stage, that step follows the removal and releases no
            // forces.
            let fading = if first > last { self.model.fading(last, first) } else { Vec::new() };
            steps.push((geometry, fading));
            last = first;
        }
        if !steps.is_empty() {
            self.finish_relaxation();
            steps.into_iter().for_each(|(geometry, fading)| self.remove_blocks(geometry, &fading));
            let Self { model, state, .. } = self;
            state
                .locked_reactions
                .retain(|&node, _| !model.is_removed(model.block_of(node as usize)));
            self.view.renew(&self.model, &self.state);
        }
    }

    /// Removes the blocks that `now` no longer has, and gives the others its joints and materials.
    /// The forces that the removed blocks exerted on the rest continue where they are to fade,
    /// unless the stage supports them. The energy that is added or removed is booked as work.
    fn remove_blocks(&mut self, now: Arc<Geometry>, fading: &[usize]) {
        // No pair fails between the two measurements; the next step checks the new state.
        let held = std::mem::replace(&mut self.failure_suspended, true);
        let forces = if fading.is_empty() { Vec::new() } else { self.forces() };
        let before = self.energy().balance;
        let mass_properties = self.model.assembly.rigid.clone();
        let geometry = self.model.excavate(now);
        self.keep_rigid_motion(&mass_properties);
        self.clear_removed();
        self.update_joints(&geometry);
        self.scratch.fit(&self.model, &self.state);
        // The next step checks its length again.
        self.forget_critical_steps();
        let assembly = &self.model.assembly;
        *self.motion = if self.motion.fictitious {
            Motion::relaxing(assembly)
        } else {
            let (before, step) = (self.state.before, self.motion.time_step);
            Motion::dynamic(assembly, self.damping, before, step)
        };
        self.view.renew(&self.model, &self.state);
        let lost = self.energy().balance - before;
        self.state.work.loads += lost;
        if !fading.is_empty() {
            let after = self.forces();
            self.release(fading, &forces, &after);
        }
        self.failure_suspended = held;
    }

    /// Keeps the motion of the corners of rigid blocks whose mass properties have changed; `before` are
    /// the former ones.
    fn keep_rigid_motion(&mut self, before: &[[MassProperties; LANES]]) {
        let mass_properties =
            before.iter().zip(&self.model.assembly.rigid).flat_map(|(a, b)| a.iter().zip(b));
        for (pose, (old, new)) in self.state.poses.iter_mut().flatten().zip(mass_properties) {
            if old.inertia != new.inertia {
                // The centre of mass moves if a body loses a part.
                let away = old.arm(0) - new.arm(0);
                let spin = old.angular_velocity(&pose.turn, pose.momentum);
                pose.shift = pose.displacement(&away);
                pose.velocity += spin.cross(&(pose.turn * away));
                pose.momentum = new.momentum(&pose.turn, spin);
            }
        }
    }

    /// Updates joints and contacts after a change of joints or materials. Bonded pairs are checked
    /// for failure again, and contacts get their new friction. `before` is the former geometry.
    fn update_joints(&mut self, before: &Geometry) {
        let Self { model, state, .. } = self;
        state.broken_joints.recheck();
        let contacts = &mut state.contacts;
        for (blocks, bond) in contacts.bonds_mut() {
            bond.joint = model.geometry.joint_of(blocks).unwrap_or(bond.joint);
            bond.law = bond.joint;
        }
        let differs = |&block: &u32| model.geometry.differs(before, block as usize);
        contacts.remake(|patch| patch.bond.is_none() && patch.blocks.iter().any(differs));
        self.sampling_period = peaks::sampling_period(model);
    }

    /// Applies the forces that are missing `after` the removal as loads that fade.
    fn release(&mut self, fading: &[usize], before: &[[f64; 3]], after: &[[f64; 3]]) {
        let mut missing = AppliedForces::new();
        for (node, (before, after)) in before.iter().zip(after).enumerate() {
            let force = [0, 1, 2].map(|c| before[c] - after[c]);
            if force != [0.0; 3] && !self.model.is_removed(self.model.block_of(node)) {
                missing.insert(node as u32, force);
            }
        }
        // The removals of one stage take equal parts of the forces, and each part fades by itself.
        let part = 1.0 / fading.len() as f64;
        missing.values_mut().flatten().for_each(|x| *x *= part);
        let released = FadingForces { start_time: self.state.time, forces: missing };
        for &load in fading {
            self.model.set_released(load, &released);
            self.state.load_factors[load] = 1.0;
            if let Some(factor) = self.view.factors.get_mut(load) {
                *factor = 1.0;
            }
            self.state.released.insert(load, released.clone());
        }
    }

    /// Clears all data of removed blocks in the state.
    fn clear_removed(&mut self) {
        let model = &self.model;
        let packs = &model.packs;
        for (index, pack) in packs.packs.iter().enumerate() {
            for lane in 0..pack.filled {
                let block = pack.blocks[lane] as usize;
                if !model.is_removed(block) {
                    continue;
                }
                let nodes = 3 * pack.start..3 * (pack.start + packs.numbering_of(pack).nodes);
                let clear = |field: &mut [Lanes]| {
                    field[nodes.clone()].iter_mut().for_each(|lanes| lanes.0[lane] = 0.0);
                };
                clear(&mut self.state.u);
                clear(&mut self.state.v);
                if pack.rigid {
                    self.state.poses[pack.rigid_start][lane] = Pose::default();
                }
            }
            for offset in 1..8_usize {
                let direction = offset.is_power_of_two().then(|| offset.trailing_zeros() as usize);
                let section = direction.and_then(|d| model.sections.get(index, d));
                let table = model.assembly.pack_tables[index][offset] as usize;
                let table = model.assembly.tables.get(table);
                self.state.broken_joints.clear_absent(index, offset, section, table);
            }
        }
        let (contacts, mut ended) = (&mut self.state.contacts, Vec::new());
        for patch in &mut contacts.patches {
            if patch.blocks.iter().any(|&block| model.is_removed(block as usize)) {
                ended.extend(patch.ended());
                patch.clear();
            }
        }
        contacts.add_released(ended);
        contacts.near.clear();
        contacts.near_is_complete = false;
        contacts.renew(Vec::new());
    }
}
