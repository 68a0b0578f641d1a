//! Critical time step of a model (§6).

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

use super::Simulation;
use crate::error::RunError;
use crate::model::Model;
use crate::state::profile::Phase;
use crate::step::timestep::Spectrum;
use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::{AddedStiffness, ContactSurfaces, bounds_at_nodes, rigid_bounds};
use ddem_mechanics::math::lanes::Lanes;

/// Stiffnesses from which the critical step follows.
pub(super) struct CriticalModel<'a> {
    model: &'a Model,
    surfaces: Cow<'a, ContactSurfaces>,
    /// True if blocks may meet.
    meets: bool,
    /// Damping ratio of contacts and failed pairs.
    ratio: f64,
    /// Stiffness that contacts and nonconforming joints add to nodes.
    added: Option<AddedStiffness>,
    /// Joint lattices.
    pub(super) joints: BrokenJoints,
}

impl<'a> CriticalModel<'a> {
    /// Stiffnesses of a model with its joints as they are, or with springs in place of all joints
    /// that can fail (`broken`).
    pub(super) fn new(model: &'a Model, broken: bool) -> Self {
        let contact_model = if broken { model.contact.as_ref() } else { model.open_surfaces() };
        let meets = contact_model.is_some();
        // One set of blocks whose joints all hold has neither contacts nor dashpots.
        let ratio = if broken || meets { model.sliding.ratio } else { 0.0 };
        let Model { geometry, packs, assembly, .. } = model;
        let own = || ContactSurfaces::new(&model.properties, &model.laws, geometry);
        let surfaces =
            contact_model.map_or_else(|| Cow::Owned(own()), |s| Cow::Borrowed(&s.surfaces));
        let bonds = match contact_model {
            Some(contact) if model.has_cells() => {
                let met = contact.search.then_some(&contact.surfaces);
                let (joints, all) = (&model.bonded_patches, |_| true);
                bounds_at_nodes(joints, met, &contact.blocks, geometry, &all, &all)
            }
            _ => Vec::new(),
        };
        let added = (meets || ratio > 0.0).then(|| {
            AddedStiffness::new(&surfaces, geometry, packs, assembly, meets, ratio, &bonds)
        });
        Self { model, surfaces, meets, ratio, added, joints: model.tangent(broken) }
    }

    /// Additional stiffness over mass of each node of deformable blocks `[1/s²]`; empty if there is
    /// none.
    pub(super) fn squares(&self) -> &[Lanes] {
        self.added.as_ref().map_or(&[], |added| &added.squares)
    }

    /// Upper bounds of the squared angular frequency of each rigid block or body, with its first block
    /// `[1/s²]`; none if such blocks do not meet others.
    fn rigid(&self, largest: f64) -> impl Iterator<Item = (usize, f64)> {
        let Model { geometry, packs, assembly, .. } = self.model;
        // Rigid blocks without joints have no stiffness. Their step assumes that they meet others.
        let met = self.meets || largest == 0.0;
        let bounds = met.then(|| rigid_bounds(&self.surfaces, geometry, packs, assembly));
        bounds.into_iter().flatten()
    }

    /// Rigid block with the largest bound, if that exceeds the largest eigenvalue.
    pub(super) fn stiffest_rigid(&self, largest: f64) -> Option<usize> {
        let stiffest = self.rigid(largest).max_by(|a, b| a.1.total_cmp(&b.1))?;
        (stiffest.1 > largest).then_some(stiffest.0)
    }

    /// Critical step of a group of deformable blocks, from its largest eigenvalue `[s]`.
    fn deformable_step(&self, largest: f64) -> f64 {
        self.added.as_ref().map_or(2.0 / largest.sqrt(), |added| added.critical_step(largest))
    }

    /// Critical step of rigid blocks, from their largest square `[s]`.
    fn rigid_step(&self, largest: f64) -> f64 {
        let damped = if self.model.packs.rigid > 0 { self.ratio } else { 0.0 };
        2.0 / largest.sqrt() * ((1.0 + damped * damped).sqrt() - damped)
    }

    /// Critical steps of deformable blocks with all joints, and of rigid blocks `[s]`, from the largest
    /// eigenvalue.
    pub(super) fn steps(&self, largest: f64) -> [f64; 2] {
        let bounds = self.rigid(largest).map(|(_, square)| square);
        [self.deformable_step(largest), self.rigid_step(bounds.fold(largest, f64::max))]
    }

    /// Critical step of each whole block of cells `[s]`, by its number, from the largest eigenvalue of each one and of
    /// the model.
    pub(super) fn block_steps(&self, squares: &[f64], largest: f64) -> BTreeMap<usize, f64> {
        let model = self.model;
        let cells = (0..model.n_blocks()).filter(|&block| model.geometry.part(block).is_some());
        let whole = cells.map(|block| model.whole_block(block));
        let mut steps: BTreeMap<usize, f64> =
            whole.map(|whole| (whole, self.deformable_step(squares[whole]))).collect();
        for (block, square) in self.rigid(largest) {
            if let Some(step) = steps.get_mut(&model.whole_block(block)) {
                *step = self.rigid_step(square);
            }
        }
        steps
    }
}

impl Simulation {
    pub(super) fn critical(&mut self, broken: bool) -> Result<f64, RunError> {
        if let Some(step) = self.critical_steps[usize::from(broken)] {
            return Ok(step);
        }
        let span = self.scratch.profiler.begin();
        let mut parts = CriticalModel::new(&self.model, broken);
        let mut joints = std::mem::take(&mut parts.joints);
        let stop = || self.stop.load(Ordering::Relaxed);
        let spectrum = Spectrum { model: &self.model, added: parts.squares(), stop: &stop };
        let iterated = spectrum.iterate(&mut joints, &mut self.scratch)?;
        let [deformable, rigid] = parts.steps(iterated.largest());
        let step = self.critical_step_with_gas(deformable.min(rigid));
        self.critical_steps[usize::from(broken)] = Some(step);
        self.spectra[usize::from(broken)] = Some(iterated);
        self.scratch.profiler.end(span, Phase::StartUp);
        Ok(step)
    }

    /// Resets all critical steps and what limits them.
    pub(super) fn forget_critical_steps(&mut self) {
        self.critical_steps = [None; 2];
        self.spectra = [None, None];
        self.limiters = [None; 2];
    }
}
