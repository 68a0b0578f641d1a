//! Mohr–Coulomb with a tension cut-off, eq. (12), and linear softening.

use super::{JointLaw, Softening};

/// Mohr–Coulomb law with the shear strength `c − T_n tan φ` and the tensile strength `σ_t`,
/// eq. (12).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MohrCoulomb {
    /// Cohesion c `[Pa]`.
    pub cohesion: f64,
    /// Tangent of the friction angle, `tan φ`.
    pub tan_friction: f64,
    /// Tensile strength σ_t `[Pa]`.
    pub tension: f64,
    /// Cohesion after failure c_r `[Pa]`.
    pub residual_cohesion: f64,
    /// Tangent of the friction angle after failure, `tan φ_r`.
    pub tan_residual_friction: f64,
    /// Tangent of the dilation angle, `tan ψ`.
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

    fn sheds_load(&self) -> bool {
        self.tension > 0.0
            || [self.cohesion, self.tan_friction]
                != [self.residual_cohesion, self.tan_residual_friction]
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
