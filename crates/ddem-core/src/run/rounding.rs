//! Detection of unbalanced forces in a relaxation that are only rounding and cannot decrease (§7).

use super::Simulation;
use crate::error::RunError;
use crate::state::RelaxationProgress;
use ddem_joint::contact::ContactPoint;
use ddem_mechanics::law::SpringStiffness;
use ddem_mesh::Vec3;

/// Multiple of the rounding of the displacements below which an unbalanced force counts as
/// rounding: a force is the sum of several products with them. Observed values are one half to
/// three.
const ROUNDED: f64 = 8.0;

/// Successive checks without a decrease after which possible rounding counts as rounding.
pub(crate) const ROUNDING_CHECKS: u64 = 10;
/// Fraction of the former ratio below which the ratio counts as decreased.
const LESS: f64 = 0.7;

impl Simulation {
    /// Checks if the unbalanced forces are only rounding: the model is at rest, or they have not
    /// decreased for some time. Then the tolerance cannot be reached, which is an error. Returns
    /// true instead if they are within the tolerance of the largest forces applied so far, as after
    /// unloading.
    pub(super) fn check_rounding(
        &self,
        progress: &mut RelaxationProgress,
        tolerance: f64,
        at_rest: bool,
    ) -> Result<bool, RunError> {
        let out_of_reach = self.only_rounding(tolerance);
        let ratio = self.last.ratio();
        let falls = progress.rounded == 0 || ratio < LESS * progress.least;
        progress.rounded = match (&out_of_reach, falls) {
            (None, _) => 0,
            (Some(_), true) => 1,
            (Some(_), false) => progress.rounded + 1,
        };
        if falls {
            progress.least = ratio;
        }
        let stays = progress.rounded >= ROUNDING_CHECKS || at_rest;
        match out_of_reach.filter(|_| stays && ratio > tolerance) {
            Some(_) if self.last.free <= tolerance * tolerance * progress.most => Ok(true),
            Some(error) => Err(error),
            None => Ok(false),
        }
    }

    /// Error of a relaxation whose unbalanced force is only rounding. Displacements, and the vectors
    /// between the sides of contacts and nonconforming joints, are accurate to a fraction of 2⁻⁵³, and
    /// forces to that times their stiffness.
    fn only_rounding(&self, tolerance: f64) -> Option<RunError> {
        let packs = &self.model.packs;
        let (mut sum, mut most) = (0.0, (0.0, 0));
        for (index, pack) in packs.packs.iter().enumerate() {
            let class = self.model.assembly.pack_inertia[index] as usize;
            let stiffness = &self.model.assembly.inertia[class].diagonal;
            for (u, k) in self.state.u[3 * pack.start..].iter().zip(stiffness) {
                for lane in 0..pack.filled {
                    let force = 0.5 * f64::EPSILON * k.0[lane] * u.0[lane].abs();
                    sum += force * force;
                    if force > most.0 {
                        most = (force, pack.blocks[lane] as usize);
                    }
                }
            }
        }
        let mut between_nodes = true;
        for (block, force) in self.rounding_of_contacts() {
            sum += force * force;
            if force > most.0 {
                (most, between_nodes) = ((force, block), false);
            }
        }
        // A tolerance below one rounding error requests all steps.
        if tolerance < f64::EPSILON || self.last.free > ROUNDED * ROUNDED * sum {
            return None;
        }
        let (force, block) = most;
        let ratio = self.last.ratio();
        let joint = self.stiffest_joint(block).filter(|_| between_nodes);
        let block = self.model.whole_block(block);
        Some(RunError::UnreachableTolerance { ratio, tolerance, block, force, joint })
    }

    /// Rounding forces of contacts and nonconforming joints, due to the displacements of their blocks and the
    /// vectors between their sides: block and force `[N]`.
    fn rounding_of_contacts(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.state.contacts.patches.iter().map(|patch| {
            let moved = |block: u32| {
                let first = self.model.geometry.blocks[block as usize].first_node as usize;
                Vec3::from(self.model.get(&self.state.u, first)).abs()
            };
            let [a, b] = patch.blocks;
            let at = moved(a).sup(&moved(b));
            let normal = patch.axes_now[0].abs();
            let along = normal.map(|n| (1.0 - n * n).max(0.0).sqrt());
            let area = |point: &ContactPoint| {
                if patch.may_carry_force(point) { point.pair.area * point.pair.area } else { 0.0 }
            };
            let areas = patch.points.iter().map(area).sum::<f64>().sqrt();
            let between = patch.points.iter().map(|point| point.pair.origin.abs());
            let between = between.fold(Vec3::zeros(), |most, origin| most.sup(&origin));
            let (normal, along) =
                (normal.dot(&at).max(between.x), along.dot(&at).max(between.y.max(between.z)));
            let SpringStiffness { normal: stiff, shear } = patch.surface.stiffness;
            let force = f64::EPSILON * areas * (stiff * normal + shear * along);
            (a as usize, force)
        })
    }
}
