//! Mohr–Coulomb with a tension cut-off, eq. (12), and linear softening.

use super::{JointLaw, Softening};
use crate::deck::Joint;

/// Shear strength `c − T_n tan φ`, tensile strength `σ_t`, eq. (12).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MohrCoulomb {
    /// Cohesion c `[Pa]`.
    pub cohesion: f64,
    /// `tan φ`.
    pub tan_friction: f64,
    /// Tensile strength σ_t `[Pa]`.
    pub tension: f64,
    /// Cohesion after failure c_r `[Pa]`.
    pub residual_cohesion: f64,
    /// `tan φ_r` after failure.
    pub tan_residual_friction: f64,
    /// `tan ψ`.
    pub tan_dilation: f64,
    /// Softening; `None` is brittle.
    pub softening: Option<Softening>,
}

impl MohrCoulomb {
    /// Of a joint of a deck; strengths left out are 0.
    #[must_use]
    pub fn new(joint: &Joint) -> Self {
        let [cohesion, friction, tension] =
            [joint.cohesion, joint.friction, joint.tension].map(|x| x.unwrap_or(0.0));
        let residual_cohesion = joint.residual_cohesion.unwrap_or(0.0);
        let tan = |degrees: f64| libm::tan(degrees.to_radians());
        let softening = joint.fracture_energy.map(|[opening, sliding]| Softening {
            // Without tensile strength there is nothing to soften.
            opening: if tension > 0.0 { 2.0 * opening / tension } else { 0.0 },
            sliding,
        });
        Self {
            cohesion,
            tan_friction: tan(friction),
            tension,
            residual_cohesion,
            tan_residual_friction: tan(joint.residual_friction.unwrap_or(friction)),
            tan_dilation: tan(joint.dilation.unwrap_or(0.0)),
            softening,
        }
    }
}

impl JointLaw for MohrCoulomb {
    fn tension(&self) -> f64 {
        self.tension
    }

    fn peak(&self, normal: f64) -> f64 {
        (self.cohesion - normal * self.tan_friction).max(0.0)
    }

    fn residual(&self, normal: f64) -> f64 {
        (self.residual_cohesion - normal * self.tan_residual_friction).max(0.0)
    }

    fn tan_dilation(&self) -> f64 {
        self.tan_dilation
    }

    fn tan_contact_friction(&self) -> f64 {
        self.tan_residual_friction
    }

    fn softening(&self) -> Option<Softening> {
        self.softening
    }
}
