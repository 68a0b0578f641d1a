//! Fictitious masses of a relaxation, scaled to stability (§7).

use std::collections::HashMap;

use super::Simulation;
use crate::error::RunError;
use crate::state::RelaxationProgress;
use crate::state::profile::Phase;
use crate::step::clustered::{largest_clustered, largest_of_gases};
use crate::step::preconditioner::{ContactMasses, Preconditioner};

/// Largest eigenvalue of `M⁻¹K` after scaling; 4 is the limit of stability.
const LARGEST: f64 = 3.6;

impl Simulation {
    /// Contacts that the masses account for at the present state.
    pub(super) fn contact_masses(&self, progress: &RelaxationProgress) -> ContactMasses {
        let has_failed = self.state.failed != [0; 2];
        ContactMasses::new(&self.model, &self.state.contacts, !progress.has_met, has_failed)
    }

    /// Masses with which Δt = 1 is stable, for the present contacts and for the gas of charges at
    /// the load factors at the end. Once pairs have failed, they cover every further failure.
    pub(super) fn masses(
        &mut self,
        progress: &RelaxationProgress,
        stop: &dyn Fn() -> bool,
    ) -> Result<Preconditioner, RunError> {
        let span = self.scratch.profiler.begin();
        let mut held: HashMap<u32, [bool; 3]> = HashMap::new();
        for (node, axis) in self.view.conditions.held() {
            held.entry(node).or_default()[axis] = true;
        }
        let has_failed = self.state.failed != [0; 2];
        let contact_masses = self.contact_masses(progress);
        let mut preconditioner = Preconditioner::new(&self.model, &held, contact_masses, stop)?;
        let mut largest: f64 = 0.0;
        for broken in [false, true].into_iter().filter(|&broken| !broken || has_failed) {
            let mut broken_joints = self.model.tangent(broken);
            let found = largest_clustered(
                &self.model,
                &mut preconditioner,
                &mut broken_joints,
                &mut self.scratch,
                stop,
            )?;
            largest = largest.max(found);
        }
        largest += self.gas(&mut preconditioner, &progress.to);
        // Contacts are at most as stiff as their part of the masses, and add to the other
        // stiffness.
        preconditioner.scale(LARGEST / (largest + if contact_masses.any { 1.0 } else { 0.0 }));
        self.scratch.profiler.end(span, Phase::Relaxation);
        Ok(preconditioner)
    }

    /// Largest eigenvalue added by the gas of the charges in force.
    fn gas(&mut self, preconditioner: &mut Preconditioner, factors: &[f64]) -> f64 {
        let factors = factors.iter().skip(self.model.conditions.loaded.len());
        let charges = self.charged().zip(factors).filter(|(_, factor)| **factor > 0.0);
        let gases = charges.filter_map(|((charge, gas), factor)| {
            let (stiffness, areas) = charge.stiffness(&self.wall_displacements(charge), gas)?;
            Some((charge.nodes.clone(), factor * stiffness, areas))
        });
        let gases: Vec<_> = gases.collect();
        largest_of_gases(&self.model, preconditioner, &gases, &mut self.scratch)
    }
}
