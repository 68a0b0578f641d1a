//! §5: what one point of a joint bears. Formulas of a point; no mesh, no loop over pairs.
//!
//! A [`JointLaw`] says at which tractions a bonded point fails and what a failed point still
//! bears. A law of your own is one file of strengths as functions of the normal traction. The springs with friction and
//! softening are the same for all laws (`law/response.rs`): energies, time steps and factors of safety rely on them.
//!
//! ```
//! use std::sync::Arc;
//!
//! use ddem_mechanics::law::JointLaw;
//!
//! /// Patton's saw teeth: slips over them up to a pressure, shears them off beyond.
//! #[derive(Debug)]
//! struct Patton { tan_teeth: f64, cohesion: f64, tan_friction: f64 }
//!
//! impl JointLaw for Patton {
//!     fn tension(&self) -> f64 {
//!         0.0
//!     }
//!     fn peak(&self, normal: f64) -> f64 {
//!         let over = -normal * self.tan_teeth;
//!         over.min(self.cohesion - normal * self.tan_friction).max(0.0)
//!     }
//!     fn residual(&self, normal: f64) -> f64 {
//!         (-normal * self.tan_friction).max(0.0)
//!     }
//! }
//!
//! let teeth = Patton { tan_teeth: 1.2, cohesion: 2e5, tan_friction: 0.6 };
//! assert_eq!(teeth.peak(-1e5), 1.2e5);
//! ```
//!
//! `Model::set_law` of `ddem-core` gives it to a joint.
//!
//! Tension and opening are positive; the normal points from side a to side b.

mod barton;
mod blended;
mod check;
mod mohr_coulomb;
mod reduced;
pub mod response;
pub mod springs;
#[cfg(test)]
mod tests;

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

pub use barton::Barton;
pub use blended::BlendedLaw;
pub use check::check;
pub use mohr_coulomb::MohrCoulomb;
pub use reduced::ReducedLaw;

/// Traction on side a of a joint, from side b `[Pa]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traction {
    /// Normal traction `T_n`, tension positive `[Pa]`.
    pub normal: f64,
    /// Shear traction `T_s`, in the joint's own plane `[Pa]`.
    pub shear: Vector2<f64>,
}

/// Displacement of side b against side a, from where the springs bear nothing `[m]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Opening {
    /// Along the normal, opening positive `[m]`.
    pub normal: f64,
    /// In the joint's own plane `[m]`.
    pub shear: Vector2<f64>,
}

/// Stiffness of the springs of a failed point `[Pa/m]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpringStiffness {
    /// k_n `[Pa/m]`.
    pub normal: f64,
    /// k_s `[Pa/m]`.
    pub shear: f64,
}

/// Failure mode of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FailureMode {
    /// The shear strength was passed, eq. (12).
    Shear,
    /// The tensile strength was passed.
    Tension,
}

/// State of a failed point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointState {
    /// Slip s of side b against side a `[m]`.
    pub slip: Vector2<f64>,
    /// Opening that slip over the roughness has made, `tan ψ` for each unit of slip `[m]`.
    pub dilation: f64,
    /// Part of the peak strength that is lost: 0 at the peak, 1 where the residual is left, 2 where the faces
    /// have parted and the residual has no cohesion any more.
    pub damage: f64,
    /// Distance of the faces, negative where they press on each other `[m]`.
    pub gap: f64,
    /// The dilation that is in the gap: that of the step before `[m]`.
    pub lifted: f64,
    /// Traction of the springs at the last step `[Pa]`.
    pub traction: Traction,
    /// Normal tractions at the last step, of the dashpot and of what settles the account `[Pa]`.
    pub drag: [f64; 2],
    /// Energy taken so far beyond what the springs hold and what is lost, for each unit of area `[J/m²]`.
    pub account: f64,
    /// The last equilibrium, from which a relaxation maps slip and damage, so that neither keeps what
    /// it overshoots; `None` in motion, where both go on from the last step.
    pub equilibrium: Option<Equilibrium>,
}

/// State of a failed point in an equilibrium, from which a relaxation goes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium {
    /// Slip s of side b against side a `[m]`.
    pub slip: Vector2<f64>,
    /// Opening that slip over the roughness has made `[m]`.
    pub dilation: f64,
    /// Part of the peak strength that is lost.
    pub damage: f64,
    /// Distance of the faces `[m]`.
    pub gap: f64,
}

impl PointState {
    /// Takes the present state for an equilibrium.
    pub fn set_equilibrium(&mut self) {
        let Self { slip, dilation, damage, gap, .. } = *self;
        self.equilibrium = Some(Equilibrium { slip, dilation, damage, gap });
    }
}

/// Energy that a point has lost for each unit of area `[J/m²]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointLoss {
    /// To friction, less the work of dilation against the normal traction.
    pub friction: f64,
    /// To fracture.
    pub fracture: f64,
    /// To faces that meet or part within a step; it goes to the account of the point.
    pub contact: f64,
    /// To the dashpot.
    pub damping: f64,
}

/// Softening after failure; 0 is brittle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Softening {
    /// Inelastic opening after which no tension is left, `2 G_I / σ_t` `[m]`.
    pub opening: f64,
    /// G_II `[J/m²]`: nothing but the residual is left after a slip of
    /// `2 G_II / (peak − residual)`.
    pub sliding: f64,
}

/// Shear that is only rounding beside the normal traction and the tensile strength does not make
/// a joint without shear strength fail in pure tension.
const ROUNDING: f64 = 1e-9;

/// The strength of a joint, before and after failure.
pub trait JointLaw: Debug + Send + Sync {
    /// Tensile strength σ_t `[Pa]`.
    fn tension(&self) -> f64;

    /// Shear strength of a bonded point under a normal traction `[Pa]`, not negative.
    fn peak(&self, normal: f64) -> f64;

    /// Shear strength of a failed, closed point under a normal traction `[Pa]`, not negative.
    fn residual(&self, normal: f64) -> f64;

    /// True if a bonded point bears load without pressure.
    fn bonds(&self) -> bool {
        self.tension() > 0.0 || self.peak(0.0) > 0.0
    }

    /// `tan ψ`: opening for each unit of slip.
    fn tan_dilation(&self) -> f64 {
        0.0
    }

    /// Shear strength of two bare faces of the joint that press on each other with a normal traction `[Pa]`, not
    /// negative, and nothing where nothing presses. Contacts have it, which take the place of joints that have slid far
    /// or opened. By default it is the residual strength without its cohesion. Contacts do not dilate.
    fn contact_strength(&self, normal: f64) -> f64 {
        (self.residual(normal) - self.residual(0.0)).max(0.0)
    }

    /// Tangent of the friction angle of contacts, where [`contact_strength`](Self::contact_strength) is proportional
    /// to the pressure: contacts then need not ask for it at every point. `None`: they ask.
    fn tan_contact_friction(&self) -> Option<f64> {
        None
    }

    /// Softening from peak to residual strength; `None`: brittle.
    fn softening(&self) -> Option<Softening> {
        None
    }

    /// Mode in which a bonded point fails under a traction, eq. (12).
    #[doc(alias = "eq 12")]
    fn failure(&self, normal: f64, shear: f64) -> Option<FailureMode> {
        if normal > self.tension() {
            Some(FailureMode::Tension)
        } else {
            let rounding = ROUNDING * (normal.abs() + self.tension());
            (shear > self.peak(normal) + rounding).then_some(FailureMode::Shear)
        }
    }

    /// True if any of some points fails, from their normal tractions and the squares of their shear
    /// tractions. One call serves many points: the loop is compiled for each law.
    fn any_failure(&self, normal: &[f64], shear_squared: &[f64]) -> bool {
        let tension = self.tension();
        let mut any = false;
        for (&normal, &shear_squared) in normal.iter().zip(shear_squared) {
            let peak = self.peak(normal) + ROUNDING * (normal.abs() + tension);
            any |= (normal > tension) | (shear_squared > peak * peak);
        }
        any
    }

    /// By what a traction of a bonded point can be divided until it no longer fails, to a part in
    /// a thousand; 1 when it does not fail.
    fn overload(&self, normal: f64, shear: f64) -> f64 {
        let fails = |by: f64| self.failure(normal / by, shear / by).is_some();
        if !fails(1.0) {
            return 1.0;
        }
        let (mut low, mut high) = (1.0, 2.0);
        while fails(high) && high < 1e12 {
            (low, high) = (high, 2.0 * high);
        }
        while high - low > 1e-3 * low {
            let middle = 0.5 * (low + high);
            if fails(middle) { low = middle } else { high = middle }
        }
        high
    }
}

/// Laws of joints by their number; `None` never fails.
pub type Laws = Vec<Option<Arc<dyn JointLaw>>>;
