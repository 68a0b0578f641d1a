//! Nonconforming joints in which all pairs hold: elastic springs without history.
//!
//! Their failure is checked for many pairs at once.

use rayon::prelude::*;

use super::fixed::PointForces;
use super::{BondedPatch, Configuration, ContactBlock, Contacts, Patch};
use crate::point::{JointCheck, PairContext, elastic};
use ddem_mesh::Vec3;

/// Patches per parallel task.
const TOGETHER: usize = 64;
/// Pairs that are checked for failure at once.
const AT_ONCE: usize = 16;

impl Contacts {
    /// Fixes the points of a restored state, those of joints as in the model.
    pub fn fix(&mut self, bonded_patches: &[BondedPatch], blocks: &[ContactBlock]) {
        let of =
            |blocks: [u32; 2]| bonded_patches.binary_search_by_key(&blocks, |b| b.patch.blocks);
        for patch in &mut self.patches {
            match of(patch.blocks).ok().filter(|_| patch.bond.is_some()) {
                Some(at) => patch.fixed.clone_from(&bonded_patches[at].patch.fixed),
                None => patch.fix(blocks),
            }
        }
    }

    /// Updates the joints in which all pairs hold, and marks those that still do.
    pub fn update_holding(&mut self, configuration: &Configuration<'_>, context: PairContext<'_>) {
        let runs = self.joint_forces.runs(&mut self.patches, TOGETHER);
        runs.into_par_iter().for_each(|mut run| {
            run.each(|patch, forces| {
                patch.holds = patch.update_holding(configuration, context, forces);
            });
        });
    }
}

impl Patch {
    /// Updates the tractions of a joint if all its pairs hold. Returns true if they still do.
    fn update_holding(
        &mut self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
        forces: &mut [Vec3],
    ) -> bool {
        let Some(bond) = self.bond else { return false };
        if self.pairs().any(|pair| pair.failure.is_some()) {
            return false;
        }
        let check = context.law(bond.law).and_then(|law| {
            let JointCheck { divisor, .. } = self.check(configuration, context);
            Some((law, divisor?))
        });
        self.update_axes(configuration);
        let axes = self.frame();
        let stiffness = self.surface.stiffness;
        let motions = self.rigid_motions(configuration);
        let Self { fixed, points, .. } = self;
        let (mut forces, mut failed) = (PointForces::new(forces), false);
        let chunks = points.chunks_mut(AT_ONCE).zip(fixed.chunks(AT_ONCE));
        for (first, (points, fixed)) in (0..).step_by(AT_ONCE).zip(chunks) {
            let (mut normal, mut shear_squared) = ([0.0; AT_ONCE], [0.0; AT_ONCE]);
            for (i, (point, fixed)) in points.iter_mut().zip(fixed).enumerate() {
                let relative_position = fixed.relative_position(configuration.u, &motions);
                let own = axes.tr_mul(&relative_position) - point.pair.origin;
                let traction = elastic(stiffness, own);
                (point.pair.state.traction, point.pair.state.gap) = (traction, own.x);
                let force = Self::force_along(&axes, point);
                forces.add(first + i, fixed, &motions, &relative_position, force);
                if let Some((_, divisor)) = check {
                    normal[i] = traction.normal / divisor;
                    shear_squared[i] = (traction.shear / divisor).norm_squared();
                }
            }
            if let Some((law, _)) = check {
                failed |= law.any_failure(&normal[..points.len()], &shear_squared[..points.len()]);
            }
        }
        self.set_forces(forces);
        !failed
    }
}
