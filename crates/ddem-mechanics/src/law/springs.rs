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

use nalgebra::Vector3;

use super::response::respond;
use super::{JointDisplacement, JointLaw, PointLoss, PointState, SpringStiffness, Traction};

/// Largest correction traction, as a fraction of the spring stiffness times the displacement
/// increment of a step. Faces that part within a step have at most this deficit.
const LARGEST_CORRECTION: f64 = 0.25;

/// Springs and dashpot of a failed point.
#[derive(Clone, Copy, Debug)]
pub struct PointSprings {
    /// Stiffness of the springs `[Pa/m]`.
    pub stiffness: SpringStiffness,
    /// Coefficient of the dashpot `[Pa s/m]`.
    pub dashpot: f64,
    /// Time since the last update of the point `[s]`; 0 in relaxation. `None` keeps the present
    /// dashpot traction, as for a point that is new at its place.
    pub time_step: Option<f64>,
}

impl PointSprings {
    /// Updates the state and the tractions of a point, by springs and dashpot, for a displacement.
    /// Returns the losses since the last update `[J/m²]`.
    #[inline(always)]
    pub fn update<L: JointLaw + ?Sized>(
        &self,
        law: &L,
        displacement: JointDisplacement,
        state: &mut PointState,
    ) -> PointLoss {
        let du = displacement.normal - (state.gap + state.applied_dilation);
        let last = state.added_tractions;
        if let Some(time_step) = self.time_step {
            // The dashpot is set before the springs, because friction depends on it.
            let dashpot = if time_step > 0.0 { self.dashpot * du / time_step } else { 0.0 };
            state.added_tractions = [dashpot, 0.0];
        }
        let mut loss = respond(law, self.stiffness, displacement, state);
        // Friction that returns energy would create it, so the energy excess decreases. In a
        // relaxation it only undoes slip that overshot.
        let given = if state.equilibrium.is_some() { 0.0 } else { loss.friction.min(0.0) };
        loss.friction -= given;
        state.energy_excess += loss.contact + given;
        loss.contact = 0.0;
        let Some(time_step) = self.time_step else { return loss };
        if time_step == 0.0 {
            // In relaxation damping takes the loss of faces that meet within a step.
            loss.damping = std::mem::take(&mut state.energy_excess);
            return loss;
        }
        loss.damping = self.apply_dashpot(du, time_step, last, state);
        loss
    }

    /// Updates the added tractions after an increment along the normal; the array has those of the
    /// last step. Returns the energy that the dashpot takes over it.
    fn apply_dashpot(
        &self,
        du: f64,
        time_step: f64,
        [dashpot, correction]: [f64; 2],
        state: &mut PointState,
    ) -> f64 {
        let pressed = state.gap < 0.0;
        state.added_tractions[0] = state.dashpot_traction();
        let work = 0.5 * (dashpot + state.added_tractions[0]) * du;
        // On the way back it returns at most the energy that its last force took half a step early.
        let back = 0.5 * dashpot * dashpot * time_step / self.dashpot;
        let dissipated = if self.dashpot > 0.0 { work.max(-back) } else { 0.0 };
        state.energy_excess += work - dissipated + 0.5 * correction * du;
        if state.energy_excess < 0.0 || (du > 0.0 && pressed) {
            self.correct_energy(du, state);
        }
        dissipated
    }

    /// Sets the correction traction that brings the energy excess to zero after an increment along
    /// the normal. Half of its work is done over this increment, half over the next one.
    fn correct_energy(&self, du: f64, state: &mut PointState) {
        if du == 0.0 {
            return;
        }
        let most = LARGEST_CORRECTION * self.stiffness.normal;
        let correction = (-state.energy_excess / (du * du)).max(-most).min(most);
        state.energy_excess += 0.5 * correction * du * du;
        state.added_tractions[1] = correction * du;
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
        if state.energy_excess < 0.0 && self.time_step.is_some_and(|step| step > 0.0) {
            self.correct_energy(du.x, state);
        }
    }
}

impl PointState {
    /// Traction of the dashpot `[Pa]`. It acts on faces in compression only, and never pulls
    /// together with the spring.
    pub(super) fn dashpot_traction(&self) -> f64 {
        if self.gap < 0.0 { self.added_tractions[0].min(-self.traction.normal) } else { 0.0 }
    }

    /// Traction of springs, dashpot and energy correction together `[Pa]`.
    pub fn total_traction(&self) -> Traction {
        let Traction { normal, shear } = self.traction;
        Traction { normal: normal + self.added_tractions[0] + self.added_tractions[1], shear }
    }
}
