//! Conditions that stop a run.

use std::collections::BTreeSet;

use super::Simulation;
use crate::error::{FastestBlock, MovingBlock, RunError};
use crate::model::Model;
use crate::state::State;
use crate::state::watch::Verdict;
use ddem_joint::contact::Contacts;
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::math::sums::StepSums;
use ddem_mesh::Vec3;

impl Simulation {
    /// Verdict on the present dynamic stage if it ended now. It is at rest if forces are balanced,
    /// no blocks continue to move against each other, and all loads, supports and waves with a
    /// history in the deck have reached their last value.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let verdict = self.state.watch.verdict(self.last.ratio());
        let open = verdict == Verdict::AtRest && !self.stays();
        if open { Verdict::Undecided } else { verdict }
    }

    /// Verdict that is certain enough to end the stage, after 2000 steps. It is `fails` only if
    /// blocks in contact have moved against each other by half an edge without slowing down.
    /// Falling blocks may still come to rest.
    #[must_use]
    pub fn decided(&self) -> Option<Verdict> {
        let verdict = self.state.watch.decided(self.last.ratio())?;
        (verdict != Verdict::AtRest || self.stays()).then_some(verdict)
    }

    /// True if blocks at rest will stay at rest: no load changes, and they were watched for long
    /// enough.
    fn stays(&self) -> bool {
        !self.loads_change() && self.state.is_known(&self.model, &self.motion)
    }

    /// True if loads, supports or waves change after the present time.
    fn loads_change(&self) -> bool {
        let State { stage, time, stage_starts, .. } = &*self.state;
        let Model { conditions, boundaries, .. } = &*self.model;
        conditions.change_after(*stage, *time, stage_starts)
            || boundaries.change_after(*stage, *time, stage_starts)
    }

    /// Error of a stage in which blocks continue to move against each other, with the blocks that
    /// have moved so far.
    #[must_use]
    pub fn no_equilibrium(&self) -> RunError {
        let (blocks, distance) = self.state.farthest(&self.model);
        let blocks = blocks.map(|block| self.model.whole_block(block));
        let (ratio, failed) = (self.last.ratio(), self.state.failed.iter().sum());
        RunError::NoEquilibrium { blocks, distance, moving: self.moving_blocks(), ratio, failed }
    }

    /// Blocks that have moved since pairs last failed, or since the stage or increment began, by
    /// decreasing displacement in the stage.
    #[must_use]
    pub fn moving_blocks(&self) -> Vec<MovingBlock> {
        let mut seen = BTreeSet::new();
        let whole = |moving: MovingBlock| {
            let block = self.model.whole_block(moving.block);
            seen.insert(block).then_some(MovingBlock { block, ..moving })
        };
        self.state.moving(&self.model).into_iter().filter_map(whole).collect()
    }

    /// Checks the sums and contacts of a step or a measurement.
    pub(super) fn check(&self, sums: StepSums, contacts: &Contacts) -> Result<(), RunError> {
        if sums.free.is_finite() {
            self.check_speed(sums)?;
            return self.check_depth(contacts);
        }
        Err(self.diverged())
    }

    /// Error of forces that are not finite.
    pub(super) fn diverged(&self) -> RunError {
        let (block, node) = self.worst_node();
        let block = self.model.whole_block(block);
        RunError::Diverged { step: self.state.steps, time: self.state.time, block, node }
    }

    /// Checks the penetration of blocks, which could pass through each other.
    fn check_depth(&self, contacts: &Contacts) -> Result<(), RunError> {
        let Some(contact_model) = self.model.searched() else { return Ok(()) };
        let Contacts { patches, deepest, .. } = contacts;
        let deep = *deepest > 0.25 * contact_model.shortest;
        for (patch, depth) in patches.iter().filter(|_| deep).map(|patch| (patch, patch.depth())) {
            let blocks = patch.blocks.map(|block| block as usize);
            let edges = blocks.map(|block| contact_model.depth(&self.model.geometry, block));
            let edge = edges[0].min(edges[1]);
            if depth > 0.25 * edge {
                let sets = Box::new(blocks.map(|block| self.model.set_name(block)));
                let (step, time) = (self.state.steps, self.state.time);
                let driven = blocks.iter().find_map(|&block| Some((self.driver(block)?, block)));
                let relaxes = self.motion.fictitious;
                let blocks = blocks.map(|block| self.model.whole_block(block));
                return Err(RunError::DeepPenetration {
                    blocks,
                    sets,
                    step,
                    time,
                    depth,
                    edge,
                    driven,
                    relaxes,
                });
            }
        }
        Ok(())
    }

    /// Support that moves a block in this step, by its number in the deck.
    fn driver(&self, block: usize) -> Option<usize> {
        let (pack, lane) = self.model.packs.slot(block);
        let supports = &self.view.conditions.supports[self.view.conditions.supports_of(pack)];
        let mut own = supports.iter().filter(|support| usize::from(support.lane) == lane);
        let moves = own.find(|s| self.view.velocities[s.fix as usize][usize::from(s.axis)] != 0.0);
        moves.map(|support| support.fix as usize)
    }

    /// Checks how far blocks move in a step, because contacts are found from step to step.
    fn check_speed(&self, sums: StepSums) -> Result<(), RunError> {
        let Some(contact_model) = self.model.searched() else { return Ok(()) };
        let (edge, dt) = (contact_model.shortest, self.motion.time_step);
        let far = 0.25 * edge;
        // No node is faster than √3 times the largest component. Exact speeds are computed only if
        // that is too fast.
        let may = |component: f64| 3.0_f64.sqrt() * dt * component > far;
        if self.motion.fictitious || !may(sums.fastest.0[0]) {
            return Ok(());
        }
        let (speed, block) =
            self.fastest_node(|pack, lane| may(self.scratch.sums[pack].fastest.0[lane]));
        let distance = dt * speed;
        if distance <= far {
            return Ok(());
        }
        let (step, time) = (self.state.steps, self.state.time);
        let (set, driven) = (self.model.set_name(block), self.driver(block));
        let block = self.model.whole_block(block);
        Err(RunError::BlockTooFast { block, set, step, time, distance, edge, driven })
    }

    /// Speed of the fastest node `[m/s]` and its block, among the blocks that `wanted` selects by
    /// pack and lane.
    fn fastest_node(&self, wanted: impl Fn(usize, usize) -> bool) -> (f64, usize) {
        let packs = &self.model.packs;
        let mut most = (0.0, 0);
        for (index, pack) in packs.packs.iter().enumerate() {
            let nodes = 3 * pack.start..3 * (pack.start + packs.numbering_of(pack).nodes);
            for lane in (0..pack.filled).filter(|&lane| wanted(index, lane)) {
                for v in self.state.v[nodes.clone()].chunks_exact(3) {
                    let speed = Vec3::from([0, 1, 2].map(|c| v[c].0[lane])).norm();
                    if speed > most.0 {
                        most = (speed, pack.blocks[lane] as usize);
                    }
                }
            }
        }
        most
    }

    /// The fastest block; `None` if nothing moves.
    #[must_use]
    pub fn fastest_block(&self) -> Option<FastestBlock> {
        let (speed, block) = self.fastest_node(|_, _| true);
        let set = self.model.set_name(block);
        let block = self.model.whole_block(block);
        (speed > 0.0).then_some(FastestBlock { block, set, speed })
    }

    /// Error of a relaxation that reached its last step without equilibrium.
    #[must_use]
    pub fn not_converged(&self, tolerance: f64, max_steps: u64) -> RunError {
        RunError::NotConverged {
            ratio: self.unbalanced(),
            tolerance,
            max_steps,
            failed: self.state.failed.iter().sum(),
            fastest: self.fastest_block(),
        }
    }

    /// Name of the stiffest joint beside a block and its thickness `[m]`, 0 if it consists of
    /// springs.
    pub(super) fn stiffest_joint(&self, block: usize) -> Option<(String, f64)> {
        let Model { geometry, packs, sections, properties, .. } = &*self.model;
        let below = |direction| geometry.beyond(block, FaceId { direction, upper: false });
        let owners = (0..3).flat_map(|d| [(Some(block), d), (below(d), d)]);
        let stiffest = owners.filter_map(|(owner, d)| {
            let (pack, lane) = packs.slot(owner?);
            let section = sections.get(pack, d)?;
            Some((section.stiffness(lane).normal, section.joints[lane], section.springs[lane]))
        });
        let (_, joint, springs) = stiffest.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let joint = properties.joints.get(usize::from(joint))?;
        Some((joint.name.clone(), if springs { 0.0 } else { joint.thickness }))
    }

    /// Block and node with the largest force; NaN counts as larger than any number.
    fn worst_node(&self) -> (usize, usize) {
        let size = |x: f64| if x.is_nan() { f64::INFINITY } else { x.abs() };
        let mut worst = (f64::NEG_INFINITY, 0, 0);
        for (index, pack) in self.model.packs.packs.iter().enumerate() {
            let nodes = self.model.packs.numbering_of(pack).nodes;
            let forces = &self.scratch.f[3 * pack.start..3 * (pack.start + nodes)];
            for (at, f) in forces.iter().enumerate() {
                for lane in 0..pack.filled {
                    if size(f.0[lane]) <= worst.0 {
                        continue;
                    }
                    let block = self.model.packs.packs[index].blocks[lane] as usize;
                    worst = (size(f.0[lane]), block, at / 3);
                }
            }
        }
        let (_, block, local) = worst;
        (block, self.model.geometry.blocks[block].first_node as usize + local)
    }
}
