//! Strength of one point of a joint (§5): formulas of a point, without mesh or loop over pairs.
//!
//! A [`JointLaw`] gives the tractions at which a bonded point fails and the strength of a failed
//! point. A custom law is one file that gives strengths as functions of the normal traction.
//! Springs, friction and softening are the same for all laws (`law/response.rs`), because energies,
//! time steps and factors of safety rely on them.
//!
//! ```
//! use std::sync::Arc;
//!
//! use ddem_mechanics::law::JointLaw;
//!
//! /// Patton's law of saw teeth: faces slide over them at low pressure and shear them off at high
//! /// pressure.
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
//! `Model::set_law` of `ddem-core` assigns it to a joint.
//!
//! Tension and opening are positive; the normal points from side a to side b.

mod barton;
mod blended;
mod check;
mod mohr_coulomb;
pub mod points;
mod reduced;
mod response;
pub mod springs;
pub mod strengths;
#[cfg(test)]
mod tests;

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::math::lanes::LANES;

pub use barton::Barton;
pub use blended::BlendedLaw;
pub use check::check;
pub use mohr_coulomb::MohrCoulomb;
pub use reduced::ReducedLaw;

/// Traction that side b exerts on side a of a joint `[Pa]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traction {
    /// Normal traction `T_n`, tension positive `[Pa]`.
    pub normal: f64,
    /// Shear traction `T_s` in the plane of the joint `[Pa]`.
    pub shear: Vector2<f64>,
}

/// Displacement of side b relative to side a, from the position without spring force `[m]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointDisplacement {
    /// Normal component, opening positive `[m]`.
    pub normal: f64,
    /// Component in the plane of the joint `[m]`.
    pub shear: Vector2<f64>,
}

/// Stiffness of the springs of a failed point `[Pa/m]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpringStiffness {
    /// Normal stiffness k_n `[Pa/m]`.
    pub normal: f64,
    /// Shear stiffness k_s `[Pa/m]`.
    pub shear: f64,
}

impl SpringStiffness {
    /// Normal and shear stiffness `[Pa/m]`.
    #[inline(always)]
    pub fn components(self) -> [f64; 2] {
        [self.normal, self.shear]
    }

    /// Stiffness against displacements in space, for a unit normal `[Pa/m]`.
    #[inline]
    pub fn matrix(self, normal: &Vector3<f64>) -> Matrix3<f64> {
        let across = normal * normal.transpose();
        Matrix3::identity() * self.shear + across * (self.normal - self.shear)
    }
}

/// Failure mode of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FailureMode {
    /// The shear strength was exceeded, eq. (12).
    Shear,
    /// The tensile strength was exceeded.
    Tension,
}

/// State of a failed point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointState {
    /// Slip s of side b relative to side a `[m]`.
    pub slip: Vector2<f64>,
    /// Opening due to slip over the roughness, `tan ψ` per unit of slip `[m]`.
    pub dilation: f64,
    /// Damage: 0 at the peak strength, 1 at the residual strength, 2 if the faces have parted and
    /// the residual cohesion is lost.
    pub damage: f64,
    /// Distance of the faces, negative in compression `[m]`.
    pub gap: f64,
    /// Dilation included in the gap, that of the previous step `[m]`.
    pub applied_dilation: f64,
    /// Traction of the springs at the last step `[Pa]`.
    pub traction: Traction,
    /// Normal tractions at the last step besides that of the spring: of the dashpot and of the
    /// energy correction `[Pa]`.
    pub added_tractions: [f64; 2],
    /// Energy taken so far in excess of the spring energy and the losses, per unit area `[J/m²]`.
    pub energy_excess: f64,
    /// Last equilibrium. A relaxation maps slip and damage from it, so that neither keeps an
    /// overshoot. `None` in motion, where both continue from the last step.
    pub equilibrium: Option<Equilibrium>,
}

/// State of a failed point in equilibrium, from which a relaxation continues.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium {
    /// Slip s of side b relative to side a `[m]`.
    pub slip: Vector2<f64>,
    /// Opening due to slip over the roughness `[m]`.
    pub dilation: f64,
    /// Damage, as in [`PointState::damage`].
    pub damage: f64,
    /// Distance of the faces `[m]`.
    pub gap: f64,
}

impl PointState {
    /// Stores the present state as equilibrium.
    pub fn set_equilibrium(&mut self) {
        let Self { slip, dilation, damage, gap, .. } = *self;
        self.equilibrium = Some(Equilibrium { slip, dilation, damage, gap });
    }
}

/// Energy lost by a point per unit area `[J/m²]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointLoss {
    /// Loss by friction, less the work of dilation against the normal traction.
    pub friction: f64,
    /// Loss by fracture.
    pub fracture: f64,
    /// Loss of faces that meet or part within a step; it changes the energy excess of the point.
    pub contact: f64,
    /// Loss by the dashpot.
    pub damping: f64,
}

/// Softening after failure; values of 0 are brittle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Softening {
    /// Inelastic opening at which no tension is left, `2 G_I / σ_t` `[m]`.
    pub opening: f64,
    /// Fracture energy G_II `[J/m²]`. Only the residual strength is left after a slip of
    /// `2 G_II / (peak − residual)`.
    pub sliding: f64,
}

/// Damage of faces that have parted: only friction is left.
const PARTED: f64 = 2.0;

/// Damage of faces with a gap `[m]` in an equilibrium: those that have parted and are closed have their
/// residual cohesion again.
#[must_use]
pub fn damage_at_equilibrium(damage: f64, gap: f64) -> f64 {
    if damage >= PARTED && gap < 0.0 { 1.0 } else { damage }
}

/// Tolerance of the shear strength relative to the normal traction and the tensile strength.
/// Without it rounding would make a joint without shear strength fail in pure tension.
const ROUNDING: f64 = 1e-9;

/// Strength of a joint before and after failure.
pub trait JointLaw: Debug + Send + Sync {
    /// Tensile strength σ_t `[Pa]`.
    fn tension(&self) -> f64;

    /// Shear strength of a bonded point under a normal traction `[Pa]`, not negative.
    fn peak(&self, normal: f64) -> f64;

    /// Shear strength of a failed, closed point under a normal traction `[Pa]`, not negative.
    fn residual(&self, normal: f64) -> f64;

    /// True if a bonded point carries load without pressure.
    fn is_cohesive(&self) -> bool {
        self.tension() > 0.0 || self.peak(0.0) > 0.0
    }

    /// False if a pair that has failed always carries as much as a bonded one: strength without
    /// tension that is the same after failure. Pairs that shed load fail one after
    /// another in a relaxation, the others at once.
    fn sheds_load(&self) -> bool {
        true
    }

    /// Opening per unit of slip, `tan ψ`.
    fn tan_dilation(&self) -> f64 {
        0.0
    }

    /// Shear strength of two bare faces of the joint in compression under a normal traction `[Pa]`.
    /// It is not negative, and 0 without compression. Contacts that replace joints after large slip
    /// or opening use it. The default is the residual strength without its cohesion. Contacts do
    /// not dilate.
    fn contact_strength(&self, normal: f64) -> f64 {
        (self.residual(normal) - self.residual(0.0)).max(0.0)
    }

    /// Tangent of the friction angle of contacts, if [`contact_strength`](Self::contact_strength)
    /// is proportional to the pressure. Contacts then do not evaluate the strength at every point.
    /// With `None` they do.
    fn tan_contact_friction(&self) -> Option<f64> {
        None
    }

    /// Softening from peak to residual strength; `None` is brittle.
    fn softening(&self) -> Option<Softening> {
        None
    }

    /// Mode in which a bonded point fails under a traction, eq. (12). This and the following
    /// methods derive from [`tension`](Self::tension) and [`peak`](Self::peak); laws do not
    /// override them.
    #[doc(alias = "eq 12")]
    fn failure(&self, normal: f64, shear: f64) -> Option<FailureMode> {
        if normal > self.tension() {
            Some(FailureMode::Tension)
        } else {
            let rounding = ROUNDING * (normal.abs() + self.tension());
            (shear > self.peak(normal) + rounding).then_some(FailureMode::Shear)
        }
    }

    /// [`peak`](Self::peak) of four points. One call serves all, so that the loop is compiled for each
    /// law.
    fn peaks(&self, normal: [f64; LANES]) -> [f64; LANES] {
        normal.map(|normal| self.peak(normal))
    }

    /// [`residual`](Self::residual) of four points.
    fn residuals(&self, normal: [f64; LANES]) -> [f64; LANES] {
        normal.map(|normal| self.residual(normal))
    }

    /// True if one of several points fails, from their normal tractions and the squares of their
    /// shear tractions. One call serves many points, so that the loop is compiled for each law.
    fn any_failure(&self, normal: &[f64], shear_squared: &[f64]) -> bool {
        let tension = self.tension();
        let mut any = false;
        for (&normal, &shear_squared) in normal.iter().zip(shear_squared) {
            let peak = self.peak(normal) + ROUNDING * (normal.abs() + tension);
            any |= (normal > tension) | (shear_squared > peak * peak);
        }
        any
    }

    /// Smallest divisor of a traction with which a bonded point does not fail, within 0.1 %; 1 if
    /// the point does not fail.
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

/// Laws of joints by their number; with `None` the joint never fails.
pub type Laws = Vec<Option<Arc<dyn JointLaw>>>;
