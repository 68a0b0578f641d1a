//! The force of a failed point on its way through time: springs and friction of its law, a dashpot, and
//! an account that lets the point give back no more energy than it has taken.
//!
//! The step of (M2) does half of a force's work on the way before and half on the way after. A linear
//! spring `T = k δ` keeps `k δ²/2` exactly so, but faces that meet or part within a step do not: the
//! pressure at the end of a contact goes on working until the next step, when the faces are already
//! apart. The *account* of a point is what it has taken beyond what its springs hold and friction has
//! used. Where it would fall below nothing, a drag against the last way takes the difference back.

use nalgebra::Vector2;

use super::{JointLaw, Loss, Memory, Opening, Stiffness, Traction};

/// Largest drag that pays a debt, as a part of the spring's stiffness times the way of a step: what faces
/// that part within a step can owe at most.
const MOST_DRAG: f64 = 0.25;

/// Springs and dashpot of a failed point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bearing {
    pub(crate) stiffness: Stiffness,
    /// Of the dashpot `[Pa s/m]`.
    pub(crate) dashpot: f64,
    /// Time since the last look at the point, 0 in relaxation `[s]`; none for a point that is new where it
    /// is, and goes on with the drag that it has.
    pub(crate) time_step: Option<f64>,
}

impl Bearing {
    /// Traction of a point at an opening, left in its memory as that of the springs and the drag; returns
    /// what it loses on the way there `[J/m²]`.
    pub(crate) fn act<L: JointLaw + ?Sized>(
        &self,
        law: &L,
        opening: Opening,
        memory: &mut Memory,
    ) -> Loss {
        let before = memory.opening(self.stiffness);
        let mut loss = law.respond(self.stiffness, opening, memory);
        // Friction that gives would be energy from nowhere.
        let given = loss.friction.min(0.0);
        loss.friction -= given;
        memory.account += loss.contact + given;
        loss.contact = 0.0;
        let Some(time_step) = self.time_step else { return loss };
        if time_step == 0.0 {
            memory.drag = Traction::default();
            loss.contact = std::mem::take(&mut memory.account);
            return loss;
        }
        let way =
            Opening { normal: opening.normal - before.normal, shear: opening.shear - before.shear };
        loss.damping = self.resist(way, time_step, memory);
        loss
    }

    /// Drag after a way; returns what the dashpot takes on it.
    fn resist(&self, way: Opening, time_step: f64, memory: &mut Memory) -> f64 {
        let pressed = memory.gap < 0.0;
        let before = std::mem::take(&mut memory.drag);
        if pressed && self.dashpot > 0.0 {
            // Together with the spring it never pulls.
            let normal = self.dashpot * way.normal / time_step;
            memory.drag.normal = normal.min(-memory.traction.normal);
        }
        let work = before.half_work(way) + memory.drag.half_work(way);
        let taken = if self.dashpot > 0.0 { work.max(0.0) } else { 0.0 };
        memory.account += work - taken;
        // Half of the work of what settles the account is done now, half on the way that comes.
        let settles = memory.account < 0.0 || (way.normal > 0.0 && pressed);
        if settles && way.normal != 0.0 {
            let most = MOST_DRAG * self.stiffness.normal;
            let drag = (-memory.account / (way.normal * way.normal)).max(-most).min(most);
            memory.account += 0.5 * drag * way.normal * way.normal;
            memory.drag.normal += drag * way.normal;
        }
        taken
    }
}

impl Memory {
    /// The opening at the last look.
    fn opening(&self, stiffness: Stiffness) -> Opening {
        Opening {
            normal: self.gap + self.lifted,
            shear: self.slip + self.traction.shear / stiffness.shear,
        }
    }

    /// Traction of springs, dashpot and drag together `[Pa]`.
    pub(crate) fn borne(&self) -> Traction {
        Traction {
            normal: self.traction.normal + self.drag.normal,
            shear: self.traction.shear + self.drag.shear,
        }
    }
}

impl Traction {
    /// Half of its work on a way `[J/m²]`.
    fn half_work(self, way: Opening) -> f64 {
        0.5 * (self.normal * way.normal + Vector2::dot(&self.shear, &way.shear))
    }
}
