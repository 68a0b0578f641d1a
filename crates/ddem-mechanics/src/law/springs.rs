//! Force of a failed point over time: springs and friction of its law, a dashpot, and a correction
//! of its energy, so that the point returns no more energy than it has taken.
//!
//! The step of (M2) does half of a force's work over the displacement increment before it and half
//! over the one after it. A linear spring `T = k δ` conserves `k δ²/2` exactly in this way. Faces
//! that meet or part within a step do not: the pressure at the end of a contact does work until the
//! next step, when the faces are already apart.
//!
//! The *energy excess* of a point is the energy that it has taken beyond its spring energy and the
//! work of friction. If it is negative (a deficit), a correction traction against the last
//! displacement increment recovers the difference. An excess that is left when the faces part is
//! returned by the same traction with the opposite sign.

use fearless_simd::{Simd, f64x4};
use nalgebra::Vector3;

use super::points::{Displacements, Loss, Points};
use super::response::respond;
use super::strengths::Strengths;
use super::{JointDisplacement, JointLaw, PointLoss, PointState, SpringStiffness, Traction};
use crate::math::lanes::splat;
use crate::math::number::Number;

/// Largest correction traction, as a fraction of the spring stiffness times the displacement
/// increment of a step. Faces that part within a step have at most this deficit.
const LARGEST_CORRECTION: f64 = 0.25;

/// Springs and dashpots of failed points.
#[derive(Clone, Copy, Debug)]
pub struct PointSprings<N = f64> {
    /// Normal and shear stiffness of the springs `[Pa/m]`.
    pub stiffness: [N; 2],
    /// Coefficient of the dashpots `[Pa s/m]`.
    pub dashpot: N,
    /// Time since the last update of the points `[s]`; 0 in relaxation. `None` keeps the present
    /// dashpot tractions, as for points that are new at their place.
    pub time_step: Option<f64>,
}

impl<N: Number> PointSprings<N> {
    /// Updates the states and the tractions of points, by springs and dashpots, for displacements.
    /// Returns the losses since the last update `[J/m²]`.
    #[inline(always)]
    pub fn update_points(
        &self,
        law: &(impl Strengths<N> + ?Sized),
        displacement: Displacements<N>,
        points: &mut Points<N>,
    ) -> Loss<N> {
        let zero = self.dashpot.like(0.0);
        let du = displacement[0] - (points.gap + points.applied_dilation);
        let last = [points.dashpot, points.correction];
        if let Some(time_step) = self.time_step {
            // The dashpot is set before the springs, because friction depends on it.
            points.dashpot = if time_step > 0.0 { self.dashpot * du / time_step } else { zero };
            points.correction = zero;
        }
        let mut loss = respond(law, self.stiffness, displacement, points);
        // Friction that returns energy would create it, so the energy excess decreases. In a
        // relaxation it only undoes slip that overshot.
        let given = N::select(points.relaxing, zero, loss.friction.or_less(zero));
        loss.friction = loss.friction - given;
        points.energy_excess = points.energy_excess + (loss.contact + given);
        loss.contact = zero;
        let Some(time_step) = self.time_step else { return loss };
        if time_step == 0.0 {
            // In relaxation damping takes the loss of faces that meet within a step.
            (loss.damping, points.energy_excess) = (points.energy_excess, zero);
            return loss;
        }
        loss.damping = self.apply_dashpot(du, time_step, last, points);
        loss
    }

    /// Updates the added tractions after increments along the normal; the array has those of the
    /// last step. Returns the energy that the dashpots take over it.
    #[inline(always)]
    fn apply_dashpot(
        &self,
        du: N,
        time_step: f64,
        [dashpot, correction]: [N; 2],
        points: &mut Points<N>,
    ) -> N {
        let zero = du.like(0.0);
        let pressed = zero.exceeds(points.gap);
        points.dashpot = points.dashpot_traction();
        let work = (dashpot + points.dashpot) * 0.5 * du;
        let mut dissipated = zero;
        let damped = self.dashpot.exceeds(zero);
        if N::any(damped) {
            // On the way back it returns at most the energy that its last force took half a step
            // early.
            let back = dashpot * 0.5 * dashpot * time_step / self.dashpot;
            dissipated = N::select(damped, work.or_more(-back), zero);
        }
        points.energy_excess = points.energy_excess + (work - dissipated + correction * 0.5 * du);
        let corrected = zero.exceeds(points.energy_excess) | (du.exceeds(zero) & pressed);
        self.correct_energy(corrected, du, points);
        dissipated
    }

    /// Sets the correction tractions that bring the energy excesses to zero after increments along
    /// the normal. Half of their work is done over this increment, half over the next one.
    #[inline(always)]
    fn correct_energy(&self, corrected: N::Mask, du: N, points: &mut Points<N>) {
        // The square of a tiny increment may be zero.
        let square = du * du;
        let corrected = corrected & square.exceeds(du.like(0.0));
        if !N::any(corrected) {
            return;
        }
        let most = self.stiffness[0] * LARGEST_CORRECTION;
        let correction = (-points.energy_excess / square).or_more(-most).or_less(most);
        let excess = points.energy_excess + correction * 0.5 * du * du;
        points.energy_excess = N::select(corrected, excess, points.energy_excess);
        points.correction = N::select(corrected, correction * du, points.correction);
    }
}

impl PointSprings {
    /// Springs and dashpot of one point.
    pub fn new(stiffness: SpringStiffness, dashpot: f64, time_step: Option<f64>) -> Self {
        Self { stiffness: stiffness.components(), dashpot, time_step }
    }

    /// The same springs and dashpots for four points.
    #[inline(always)]
    pub fn four<S: Simd>(&self, simd: S) -> PointSprings<f64x4<S>> {
        let [normal, shear] = self.stiffness;
        PointSprings {
            stiffness: [splat(simd, normal), splat(simd, shear)],
            dashpot: splat(simd, self.dashpot),
            time_step: self.time_step,
        }
    }

    /// Updates the state and the tractions of one point, by springs and dashpot, for a displacement.
    /// Returns the losses since the last update `[J/m²]`.
    #[inline(always)]
    pub fn update<L: JointLaw + ?Sized>(
        &self,
        law: &L,
        displacement: JointDisplacement,
        state: &mut PointState,
    ) -> PointLoss {
        let JointDisplacement { normal, shear } = displacement;
        let mut points = Points::one(state);
        let loss = self.update_points(law, [normal, shear.x, shear.y], &mut points);
        points.store(state);
        loss.into()
    }

    /// Corrects the losses of a point that has just failed. The lost part of the previous traction
    /// does not do its half of the work over the last increment `du` `[m]`, along the normal and
    /// both tangents. A gain becomes a deficit of the point.
    pub fn begin_failure(
        &self,
        previous_traction: Traction,
        du: Vector3<f64>,
        loss: &mut PointLoss,
        state: &mut PointState,
    ) {
        let normal = previous_traction.normal - state.traction.normal;
        let shear = previous_traction.shear - state.traction.shear;
        let lost = loss.friction + loss.fracture - 0.5 * (normal * du.x + shear.dot(&du.yz()));
        loss.friction = loss.friction.min(lost.max(0.0));
        loss.fracture = lost.max(0.0) - loss.friction;
        state.energy_excess += lost.min(0.0);
        let moves = self.time_step.is_some_and(|step| step > 0.0);
        let mut points = Points::one(state);
        self.correct_energy(moves && state.energy_excess < 0.0, du.x, &mut points);
        points.store(state);
    }
}

impl<N: Number> Points<N> {
    /// Normal tractions of the dashpots `[Pa]`. They act on faces in compression only, and never
    /// pull together with the springs.
    #[inline(always)]
    pub(super) fn dashpot_traction(&self) -> N {
        let zero = self.gap.like(0.0);
        N::select(zero.exceeds(self.gap), self.dashpot.or_less(-self.normal), zero)
    }
}

impl PointState {
    /// Traction of springs, dashpot and energy correction together `[Pa]`.
    pub fn total_traction(&self) -> Traction {
        let Traction { normal, shear } = self.traction;
        Traction { normal: normal + self.added_tractions[0] + self.added_tractions[1], shear }
    }

    /// Energy per unit area, in the springs and the energy excess `[J/m²]`.
    pub fn stored(&self, shear_stiffness: f64) -> f64 {
        Points::one(self).stored(shear_stiffness)
    }
}
