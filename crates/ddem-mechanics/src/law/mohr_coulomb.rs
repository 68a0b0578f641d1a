//! Mohr–Coulomb with a tension cut-off, eq. (12), and linear softening.

use super::{JointLaw, Softening};

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

    fn contact_strength(&self, normal: f64) -> f64 {
        (-normal * self.tan_residual_friction).max(0.0)
    }

    fn tan_contact_friction(&self) -> Option<f64> {
        Some(self.tan_residual_friction)
    }

    fn softening(&self) -> Option<Softening> {
        self.softening
    }
}
