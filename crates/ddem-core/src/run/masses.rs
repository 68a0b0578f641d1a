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
        ContactMasses::new(&self.model, &self.state.contacts, progress, has_failed)
    }

    /// Masses with which Δt = 1 is stable, for the present contacts and for the gas of charges at
    /// the load factors at the end. Once pairs have failed, they cover every further failure.
    pub(super) fn masses(
        &mut self,
        progress: &RelaxationProgress,
        stop: &dyn Fn() -> bool,
    ) -> Result<Preconditioner, RunError> {
        self.masses_for(self.contact_masses(progress), progress, stop)
    }

    /// Adds contacts of more cells to the masses. The largest eigenvalue is that of before.
    pub(super) fn add_contact_masses(
        &mut self,
        masses: &mut Preconditioner,
        contact_masses: ContactMasses,
    ) -> Result<(), RunError> {
        let span = self.scratch.profiler.begin();
        let held = self.held();
        if masses.contact_masses.exist() {
            masses.add_contacts(&self.model, &held, contact_masses)?;
        } else {
            let largest = masses.largest;
            *masses = Preconditioner::new(&self.model, &held, contact_masses, &|| false)?;
            masses.scale_to(LARGEST, largest);
        }
        self.scratch.profiler.end(span, Phase::Relaxation);
        Ok(())
    }

    /// Masses for these contacts.
    pub(super) fn masses_for(
        &mut self,
        contact_masses: ContactMasses,
        progress: &RelaxationProgress,
        stop: &dyn Fn() -> bool,
    ) -> Result<Preconditioner, RunError> {
        let span = self.scratch.profiler.begin();
        let held = self.held();
        let without = contact_masses.without_cells();
        let mut masses = Preconditioner::new(&self.model, &held, without, stop)?;
        let has_failed = self.state.failed != [0; 2];
        let mut largest: f64 = 0.0;
        for broken in [false, true].into_iter().filter(|&broken| !broken || has_failed) {
            let mut broken_joints = self.model.tangent(broken);
            // Failed nonconforming joints are as stiff as before.
            if broken && broken_joints.packs.iter().all(Option::is_none) {
                continue;
            }
            let found = largest_clustered(
                &self.model,
                &mut masses,
                &mut broken_joints,
                &mut self.scratch,
                stop,
            )?;
            largest = largest.max(found);
        }
        largest += self.gas(&mut masses, &progress.to);
        if masses.contact_masses != contact_masses {
            masses = Preconditioner::new(&self.model, &held, contact_masses, stop)?;
        }
        masses.scale_to(LARGEST, largest);
        self.scratch.profiler.end(span, Phase::Relaxation);
        Ok(masses)
    }

    /// Held degrees of freedom, by node.
    fn held(&self) -> HashMap<u32, [bool; 3]> {
        let mut held: HashMap<u32, [bool; 3]> = HashMap::new();
        for (node, axis) in self.view.conditions.held() {
            held.entry(node).or_default()[axis] = true;
        }
        held
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
