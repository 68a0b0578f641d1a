//! The force of a failed point on its way through time: springs and friction of its law, a dashpot, and
//! an account that lets the point give back no more energy than it has taken.
//!
//! The step of (M2) does half of a force's work on the way before and half on the way after. A linear
//! spring `T = k δ` keeps `k δ²/2` exactly so, but faces that meet or part within a step do not: the
//! pressure at the end of a contact goes on working until the next step, when the faces are already
//! apart. The *account* of a point is what it has taken beyond what its springs hold and friction has
//! used. Where it falls below nothing, a drag against the last way takes the difference back; what is left over
//! when the faces part is given back by the same with the other sign.

use nalgebra::Vector3;

use super::response::respond;
use super::{JointLaw, Opening, PointLoss, PointState, SpringStiffness, Traction};

/// Largest drag that settles an account, as a part of the spring's stiffness times the way of a step: what faces
/// that part within a step can owe at most.
const MOST_DRAG: f64 = 0.25;

/// Springs and dashpot of a failed point.
#[derive(Clone, Copy, Debug)]
pub struct PointSprings {
    /// Stiffness of the springs `[Pa/m]`.
    pub stiffness: SpringStiffness,
    /// Of the dashpot `[Pa s/m]`.
    pub dashpot: f64,
    /// Time since the last look at the point, 0 in relaxation `[s]`; none for a point that is new where it
    /// is, and goes on with the drag that it has.
    pub time_step: Option<f64>,
}

impl PointSprings {
    /// Traction of a point at an opening, left in its memory as that of the springs and the drag; returns
    /// what it loses on the way there `[J/m²]`.
    #[inline(always)]
    pub fn update<L: JointLaw + ?Sized>(
        &self,
        law: &L,
        opening: Opening,
        state: &mut PointState,
    ) -> PointLoss {
        let du = opening.normal - (state.gap + state.lifted);
        let last = state.drag;
        if let Some(time_step) = self.time_step {
            // Before the springs, for friction knows it.
            let dashpot = if time_step > 0.0 { self.dashpot * du / time_step } else { 0.0 };
            state.drag = [dashpot, 0.0];
        }
        let mut loss = respond(law, self.stiffness, opening, state);
        // Friction that gives would be energy from nowhere; a relaxation undoes slip that it overshoots.
        let given = if state.equilibrium.is_some() { 0.0 } else { loss.friction.min(0.0) };
        loss.friction -= given;
        state.account += loss.contact + given;
        loss.contact = 0.0;
        let Some(time_step) = self.time_step else { return loss };
        if time_step == 0.0 {
            // What faces that meet within a step lose, no motion in time has lost: damping takes it.
            loss.damping = std::mem::take(&mut state.account);
            return loss;
        }
        loss.damping = self.apply_dashpot(du, time_step, last, state);
        loss
    }

    /// Drag after a way along the normal, with that of the last step; returns what the dashpot takes on it.
    fn apply_dashpot(
        &self,
        du: f64,
        time_step: f64,
        [dashpot, settling]: [f64; 2],
        state: &mut PointState,
    ) -> f64 {
        let pressed = state.gap < 0.0;
        state.drag[0] = state.dashpot();
        let work = 0.5 * (dashpot + state.drag[0]) * du;
        // On the way back it gives what its last force took on the way in, half a step early, and no more.
        let back = 0.5 * dashpot * dashpot * time_step / self.dashpot;
        let taken = if self.dashpot > 0.0 { work.max(-back) } else { 0.0 };
        state.account += work - taken + 0.5 * settling * du;
        if state.account < 0.0 || (du > 0.0 && pressed) {
            self.settle_account(du, state);
        }
        taken
    }

    /// Lets the point bear what brings its account to nothing after a way along the normal. Half of the work is
    /// done now, half on the way that comes.
    fn settle_account(&self, du: f64, state: &mut PointState) {
        if du == 0.0 {
            return;
        }
        let most = MOST_DRAG * self.stiffness.normal;
        let drag = (-state.account / (du * du)).max(-most).min(most);
        state.account += 0.5 * drag * du * du;
        state.drag[1] = drag * du;
    }

    /// A point that has just failed loses what it bore before that could do its half of the work on the last way
    /// `[m]`, along the normal and both tangents. What it would gain so it owes.
    pub fn begin_failure(
        &self,
        bore: Traction,
        du: Vector3<f64>,
        loss: &mut PointLoss,
        state: &mut PointState,
    ) {
        let normal = bore.normal - state.traction.normal;
        let shear = bore.shear - state.traction.shear;
        let lost = loss.friction + loss.fracture - 0.5 * (normal * du.x + shear.dot(&du.yz()));
        loss.friction = loss.friction.min(lost.max(0.0));
        loss.fracture = lost.max(0.0) - loss.friction;
        state.account += lost.min(0.0);
        if state.account < 0.0 && self.time_step.is_some_and(|step| step > 0.0) {
            self.settle_account(du.x, state);
        }
    }
}

impl PointState {
    /// Traction of the dashpot: that of faces that press on each other, which together with the spring never
    /// pulls `[Pa]`.
    pub(super) fn dashpot(&self) -> f64 {
        if self.gap < 0.0 { self.drag[0].min(-self.traction.normal) } else { 0.0 }
    }

    /// Traction of springs and drag together `[Pa]`.
    pub fn total_traction(&self) -> Traction {
        let Traction { normal, shear } = self.traction;
        Traction { normal: normal + self.drag[0] + self.drag[1], shear }
    }
}
