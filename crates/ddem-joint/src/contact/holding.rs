//! Nonconforming joints in which all pairs hold: elastic springs without history.
//!
//! Their failure is checked for four pairs at once.

use fearless_simd::{Simd, dispatch};
use fearless_simd_macros::simd;
use rayon::prelude::*;

use super::fixed::PointForces;
use super::four_pairs::{
    ElasticLanes, PairAxes, areas, first_four, first_four_mut, from_origins, relative_positions,
};
use super::joint_forces::PatchRun;
use super::{BondedPatch, Configuration, ContactBlock, Contacts, Patch, SearchContext};
use crate::point::{PairContext, elastic_traction};
use ddem_mechanics::math::lanes::{LANES, Lanes, splat};
use ddem_mesh::Vec3;

/// Patches per parallel task.
const TOGETHER: usize = 64;

impl Contacts {
    /// Fixes the points of a restored state, those of joints as in the model.
    pub fn fix(&mut self, bonded_patches: &[BondedPatch], blocks: &[ContactBlock]) {
        let of =
            |blocks: [u32; 2]| bonded_patches.binary_search_by_key(&blocks, |b| b.patch.blocks);
        for patch in &mut self.patches {
            match of(patch.blocks).ok().filter(|_| patch.bond.is_some()) {
                Some(at) => {
                    let model = &bonded_patches[at].patch;
                    patch.fixed.clone_from(&model.fixed);
                    patch.ground = model.ground;
                }
                None => patch.fix(blocks),
            }
        }
    }

    /// Updates the joints in which all pairs hold, and marks those that still do.
    pub fn update_holding(&mut self, search: SearchContext<'_>, configuration: &Configuration<'_>) {
        let runs = self.joint_forces.runs(&mut self.patches, TOGETHER);
        runs.into_par_iter().for_each(|run| {
            dispatch!(search.level, simd => update_run(simd, run, configuration, search.context));
        });
    }
}

/// Updates the joints of one task in which all pairs hold.
#[simd]
fn update_run<S: Simd>(
    simd: S,
    run: PatchRun<'_>,
    configuration: &Configuration<'_>,
    context: PairContext<'_>,
) {
    for (patch, forces) in run.each() {
        patch.holds = patch.bond.is_some()
            && patch.pairs().all(|pair| pair.failure.is_none())
            && hold(simd, patch, configuration, context, forces);
    }
}

/// Updates the tractions of a joint of which all pairs hold. Returns true if they still do.
#[simd]
fn hold<S: Simd>(
    simd: S,
    patch: &mut Patch,
    configuration: &Configuration<'_>,
    context: PairContext<'_>,
    forces: &mut [Vec3],
) -> bool {
    let law = patch.law(context);
    let check = law.zip(patch.divisor(configuration, context));
    patch.update_axes(configuration);
    let axes = PairAxes::new(simd, &patch.frame());
    let stiffness = patch.surface.stiffness.components();
    let stiffness = [splat(simd, stiffness[0]), splat(simd, stiffness[1])];
    let motions = patch.rigid_motions(configuration);
    let Patch { fixed, points, .. } = patch;
    let (mut forces, mut failed) = (PointForces::new(forces), false);
    for number in 0..points.len().div_ceil(LANES) {
        let first = LANES * number;
        let (mut own_points, mut own_fixed) = (None, None);
        let n = LANES.min(points.len() - first);
        let fixed = first_four(&fixed[first..], &mut own_fixed);
        let four = first_four_mut(&mut points[first..], &mut own_points);
        let relative = relative_positions(fixed, configuration, &motions);
        let own = from_origins(simd, four, axes.along(simd, &relative));
        let traction = elastic_traction(stiffness, own);
        let each = axes.forces(traction, areas(simd, four));
        let elastic = ElasticLanes::new(traction, own);
        for lane in 0..n {
            let state = &mut four[lane].pair.state;
            (state.traction, state.gap) = elastic.of(lane);
            forces.add(first + lane, &fixed[lane], &motions, &relative[lane], each[lane]);
        }
        if let Some((law, divisor)) = check {
            let (s, t) = (traction[1] / divisor, traction[2] / divisor);
            let (normal, shear_squared) =
                (Lanes::from(traction[0] / divisor), Lanes::from(s * s + t * t));
            failed |= law.any_failure(&normal.0, &shear_squared.0);
        }
        if let Some(four) = own_points {
            points[first..].copy_from_slice(&four[..n]);
        }
    }
    patch.set_forces(forces);
    !failed
}
