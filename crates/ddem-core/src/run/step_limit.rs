//! Block, joint or contact that limits the critical time step.
//!
//! The fastest mode of the model has its energy where the step is limited: in the elements of a
//! block, in a joint, or in the contacts of a block.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

use super::Simulation;
use super::critical::CriticalModel;
use crate::error::RunError;
use crate::model::Model;
use crate::state::profile::Phase;
use crate::step::timestep::{FastestMode, Spectrum};
use crate::step::{FirstPass, forces};
use ddem_joint::contact::BondedPatch;
use ddem_mechanics::law::SpringStiffness;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::NO_JOINT;

/// Part of a model that limits the critical time step. Blocks are those of the geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limiter {
    /// Elements of a block.
    Block(usize),
    /// Joint between two blocks, by its number.
    Joint {
        /// Number of its properties.
        joint: u16,
        /// Blocks on its sides.
        blocks: [usize; 2],
    },
    /// Contacts on the faces of a deformable block.
    Contacts(usize),
    /// Joints and contacts on the faces of a rigid block.
    RigidBlock(usize),
    /// Gas of a charge, by its number.
    Charge(usize),
}

/// Limit of the critical time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimit {
    /// The part of the model that limits the step.
    pub limiter: Limiter,
    /// Critical step `[s]`.
    pub step: f64,
}

impl Simulation {
    /// Limit of the critical step with which an automatic stage would begin now; `None` if no step is
    /// critical. The first call takes about as long as the critical step.
    ///
    /// # Errors
    ///
    /// [Stopped](Self::stop_when): a large model takes seconds.
    pub fn step_limit(&mut self) -> Result<Option<StepLimit>, RunError> {
        let broken = self.broken_limits()?;
        let step = self.critical(broken)?;
        if !(step.is_finite() && step > 0.0) {
            return Ok(None);
        }
        let known = self.limiters[usize::from(broken)];
        let limiter = known.map_or_else(|| self.find_limiter(broken, step), Ok)?;
        self.limiters[usize::from(broken)] = Some(limiter);
        Ok(Some(StepLimit { limiter, step }))
    }

    /// True if the step with springs in place of all joints that can fail is the shorter one, and holds.
    fn broken_limits(&mut self) -> Result<bool, RunError> {
        let intact = self.critical(false)?;
        let fails = self.state.failed != [0; 2] || (self.moves() && self.model.can_fail());
        Ok(fails && self.critical(true)? < intact)
    }

    /// Critical step that each whole block of cells alone allows, with its joints and contacts `[s]`, by the number of
    /// the block. The least is the critical step, unless a set of blocks or a charge limits it; that of a large model
    /// is up to 0.3 % shorter, by the margin of its iteration.
    ///
    /// # Errors
    ///
    /// [Stopped](Self::stop_when): a large model takes seconds.
    pub fn cell_steps(&mut self) -> Result<BTreeMap<usize, f64>, RunError> {
        if !self.model.has_cells() {
            return Ok(BTreeMap::new());
        }
        let broken = self.broken_limits()?;
        let mut parts = CriticalModel::new(&self.model, broken);
        let mut joints = std::mem::take(&mut parts.joints);
        let stop = || self.stop.load(Ordering::Relaxed);
        let spectrum = Spectrum { model: &self.model, added: parts.squares(), stop: &stop };
        let of = |block| self.model.whole_block(block);
        let squares = spectrum.of_groups(&of, &mut joints, &mut self.scratch)?;
        let largest = squares.iter().fold(0.0, |largest: f64, square| largest.max(*square));
        Ok(parts.block_steps(&squares, largest))
    }

    /// Part of the model with the most energy in its fastest mode.
    fn find_limiter(&mut self, broken: bool, step: f64) -> Result<Limiter, RunError> {
        let span = self.scratch.profiler.begin();
        let mut parts = CriticalModel::new(&self.model, broken);
        let mut joints = std::mem::take(&mut parts.joints);
        let stop = || self.stop.load(Ordering::Relaxed);
        let spectrum = Spectrum { model: &self.model, added: parts.squares(), stop: &stop };
        let iterated = match self.spectra[usize::from(broken)].take() {
            Some(iterated) => iterated,
            None => spectrum.iterate(&mut joints, &mut self.scratch)?,
        };
        let largest = iterated.largest();
        let [deformable, rigid] = parts.steps(largest);
        let stiffest = parts.stiffest_rigid(largest).filter(|_| rigid < deformable);
        let gas_limits = step * step < 0.5 * deformable.min(rigid).powi(2);
        let limiter = match stiffest {
            _ if gas_limits => Limiter::Charge(largest_at(self.gas_squares().into_iter())),
            Some(block) => Limiter::RigidBlock(block),
            None => {
                let mode = spectrum.fastest_mode(&iterated, &mut joints, &mut self.scratch)?;
                let pass = FirstPass { energies: true, ..FirstPass::linear(&self.model, &mode.u) };
                forces(pass, &mut joints, None, &mut self.scratch);
                let modal = ModalEnergy { model: &self.model, mode: &mode, added: parts.squares() };
                modal.largest(&self.scratch.energies)
            }
        };
        self.scratch.profiler.end(span, Phase::StartUp);
        Ok(limiter)
    }
}

/// Number of the largest value, the first of equal ones.
fn largest_at(values: impl Iterator<Item = f64>) -> usize {
    let most = values.enumerate().fold((0, f64::NEG_INFINITY), |most, (at, value)| {
        if value > most.1 { (at, value) } else { most }
    });
    most.0
}

/// Energy of the fastest mode in the parts of a model.
struct ModalEnergy<'a> {
    model: &'a Model,
    mode: &'a FastestMode,
    /// Stiffness over mass that contacts and nonconforming joints add to each node `[1/s²]`.
    added: &'a [Lanes],
}

impl ModalEnergy<'_> {
    /// Part with the most energy. `energies` are the strain energies of blocks and joints by pack.
    fn largest(&self, energies: &[[Lanes; 2]]) -> Limiter {
        let packs = &self.model.packs;
        let n = self.model.n_blocks();
        let of = |block: usize, part: usize| {
            let (pack, lane) = packs.slot(block);
            energies[pack][part].0[lane]
        };
        let joints: Vec<f64> = (0..n).map(|block| of(block, 1)).collect();
        // Parts of cells count together.
        let mut whole: BTreeMap<usize, (usize, [f64; 2])> = BTreeMap::new();
        for block in 0..n {
            let (_, sums) = whole.entry(self.model.whole_block(block)).or_insert((block, [0.0; 2]));
            sums[0] += of(block, 0);
            sums[1] += self.added(block);
        }
        let whole: Vec<(usize, [f64; 2])> = whole.into_values().collect();
        let [block, surface] =
            [0, 1].map(|part| whole[largest_at(whole.iter().map(|w| w.1[part]))]);
        let joint = largest_at(joints.iter().copied());
        if joints[joint] > block.1[0].max(surface.1[1]) {
            return self.joint_of(joint);
        }
        if surface.1[1] > block.1[0] {
            return self.on_surface(surface.0, surface.1[1]);
        }
        Limiter::Block(block.0)
    }

    /// Energy of the stiffness that is added to the nodes of a block.
    fn added(&self, block: usize) -> f64 {
        let model = self.model;
        let energy = |node: usize| {
            let slot = model.node_slot(node);
            let square = self.added.get(slot.at as usize / 3).map_or(0.0, |s| s.0[slot.lane()]);
            let scaled = model.get(&self.mode.scaled, node);
            0.5 * square * scaled.iter().map(|x| x * x).sum::<f64>()
        };
        if self.added.is_empty() { 0.0 } else { model.nodes_of(block).map(energy).sum() }
    }

    /// Joint at an upper side of a block with the most energy in springs as stiff as the joint.
    fn joint_of(&self, block: usize) -> Limiter {
        let Model { geometry, packs, sections, .. } = self.model;
        let (pack, lane) = packs.slot(block);
        let numbering = packs.numbering_of(&packs.packs[pack]);
        let energy = |d: usize| {
            let section = sections.get(pack, d).filter(|s| s.joints[lane] != NO_JOINT);
            let Some((section, other)) = section.zip(geometry.above(block, d)) else {
                return -1.0;
            };
            let stiffness = section.diagonal(lane);
            let first = [block, other].map(|of| geometry.blocks[of].first_node as usize);
            let pairs = numbering.pairs[d].iter().map(|pair| {
                let at = |side: usize| {
                    let local = numbering.joints[1 << d][pair.sides[side]].local;
                    self.model.get(&self.mode.u, first[side] + local)
                };
                let jump = [0, 1, 2].map(|c| at(1)[c] - at(0)[c]);
                let springs = (0..3).map(|c| stiffness[c] * jump[c] * jump[c]).sum::<f64>();
                springs * pair.elements().len() as f64
            });
            pairs.sum()
        };
        let d = largest_at((0..3).map(energy));
        match (sections.get(pack, d), geometry.above(block, d)) {
            (Some(section), Some(other)) => {
                Limiter::Joint { joint: section.joints[lane], blocks: [block, other] }
            }
            _ => Limiter::Block(block),
        }
    }

    /// Nonconforming joint of a block if such joints have half of the `energy` at its nodes, otherwise
    /// its contacts.
    fn on_surface(&self, block: usize, energy: f64) -> Limiter {
        let model = self.model;
        let own = model.whole_block(block);
        let touches = |joint: &&BondedPatch| {
            joint.patch.blocks.iter().any(|&other| model.whole_block(other as usize) == own)
        };
        let mut most: Option<(f64, &BondedPatch)> = None;
        let mut all = 0.0;
        let blocks = model.contact.as_ref().map_or(&[][..], |contact| &contact.blocks);
        for joint in model.bonded_patches.iter().filter(touches) {
            let SpringStiffness { normal, shear } = joint.patch.surface.stiffness;
            let nodes = joint.node_areas(blocks, &model.geometry);
            let nodes = nodes.filter(|(node, _)| model.whole_block(model.block_of(*node)) == own);
            let each = nodes.map(|(node, area)| {
                let u = model.get(&self.mode.u, node);
                normal.max(shear) * area * u.iter().map(|x| x * x).sum::<f64>()
            });
            let stored: f64 = each.sum();
            all += stored;
            if most.is_none_or(|(known, _)| stored > known) {
                most = Some((stored, joint));
            }
        }
        match most.and_then(|(_, joint)| joint.patch.bond.map(|bond| (bond, joint))) {
            Some((_, joint)) if joint.is_whole_rock && all > 0.5 * energy => Limiter::Block(block),
            Some((bond, joint)) if all > 0.5 * energy => {
                let blocks = joint.patch.blocks.map(|block| block as usize);
                Limiter::Joint { joint: bond.joint, blocks }
            }
            _ => Limiter::Contacts(block),
        }
    }
}
