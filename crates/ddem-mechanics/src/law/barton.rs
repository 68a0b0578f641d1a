//! Barton's law of rough joints, whose friction angle falls as the normal stress rises.

use super::JointLaw;

/// Largest friction angle that roughness can reach `[degrees]`.
const STEEPEST: f64 = 70.0;

/// Barton's law with the peak shear strength `σ_n tan(φ_r + JRC log₁₀(JCS/σ_n))`, σ_n the
/// compression. The roughness angle is at least 0, and the total angle at most 70°, or φ_r if that
/// is larger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barton {
    /// Joint roughness coefficient JRC.
    pub jrc: f64,
    /// Joint wall compressive strength JCS `[Pa]`.
    pub jcs: f64,
    /// Residual friction angle φ_r `[degrees]`.
    pub residual_friction: f64,
    /// Tensile strength σ_t `[Pa]`.
    pub tension: f64,
    /// Tangent of the dilation angle, `tan ψ`.
    pub tan_dilation: f64,
}

impl JointLaw for Barton {
    fn tension(&self) -> f64 {
        self.tension
    }

    fn peak(&self, normal: f64) -> f64 {
        if normal >= 0.0 {
            return 0.0;
        }
        let roughness = (self.jrc * libm::log10(self.jcs / -normal)).max(0.0);
        let angle = (self.residual_friction + roughness).min(STEEPEST.max(self.residual_friction));
        -normal * libm::tan(angle.to_radians())
    }

    fn residual(&self, normal: f64) -> f64 {
        (-normal * libm::tan(self.residual_friction.to_radians())).max(0.0)
    }

    /// Failure destroys the roughness, so the residual strength is proportional to the pressure.
    fn tan_contact_friction(&self) -> Option<f64> {
        Some(libm::tan(self.residual_friction.to_radians()))
    }

    fn tan_dilation(&self) -> f64 {
        self.tan_dilation
    }
}
