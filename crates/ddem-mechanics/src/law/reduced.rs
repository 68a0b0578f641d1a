//! Strengths reduced by a factor.

use std::sync::Arc;

use super::{JointLaw, Softening};

/// Law with the strengths of another law divided by a factor: cohesion, tension and the tangents of
/// the friction angles. Dilation is kept, but is limited to the reduced friction.
#[derive(Clone, Debug)]
pub struct ReducedLaw {
    /// Law with the full strengths.
    pub law: Arc<dyn JointLaw>,
    /// Divisor of the strengths.
    pub factor: f64,
}

impl JointLaw for ReducedLaw {
    fn tension(&self) -> f64 {
        self.law.tension() / self.factor
    }

    fn peak(&self, normal: f64) -> f64 {
        self.law.peak(normal) / self.factor
    }

    fn residual(&self, normal: f64) -> f64 {
        self.law.residual(normal) / self.factor
    }

    fn sheds_load(&self) -> bool {
        self.law.sheds_load()
    }

    fn tan_dilation(&self) -> f64 {
        // Slope of the strength at low pressure.
        let friction = self.law.residual(-1.0) - self.law.residual(0.0);
        self.law.tan_dilation().min(friction / self.factor)
    }

    fn contact_strength(&self, normal: f64) -> f64 {
        self.law.contact_strength(normal) / self.factor
    }

    fn tan_contact_friction(&self) -> Option<f64> {
        self.law.tan_contact_friction().map(|tan| tan / self.factor)
    }

    fn softening(&self) -> Option<Softening> {
        self.law.softening()
    }
}
