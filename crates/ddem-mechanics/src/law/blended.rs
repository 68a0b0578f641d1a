//! Interpolation between the strengths of two joints.

use std::sync::Arc;

use super::{JointLaw, Softening};

/// Law of a joint that replaces another in increments: cohesion, tension and the tangents of the
/// angles are `old + (new − old) fraction`. The softening is that of the new joint.
#[derive(Clone, Debug)]
pub struct BlendedLaw {
    /// Laws of the old joint and of the new one.
    pub laws: [Arc<dyn JointLaw>; 2],
    /// Fraction of the way from the old joint to the new one, from 0 to 1.
    pub fraction: f64,
}

impl BlendedLaw {
    fn mix(&self, of: impl Fn(&dyn JointLaw) -> f64) -> f64 {
        let [old, new] = [of(&*self.laws[0]), of(&*self.laws[1])];
        old + (new - old) * self.fraction
    }
}

impl JointLaw for BlendedLaw {
    fn tension(&self) -> f64 {
        self.mix(|law| law.tension())
    }

    fn peak(&self, normal: f64) -> f64 {
        self.mix(|law| law.peak(normal))
    }

    fn residual(&self, normal: f64) -> f64 {
        self.mix(|law| law.residual(normal))
    }

    fn sheds_load(&self) -> bool {
        self.laws.iter().any(|law| law.sheds_load())
    }

    fn tan_dilation(&self) -> f64 {
        self.mix(|law| law.tan_dilation())
    }

    fn contact_strength(&self, normal: f64) -> f64 {
        self.mix(|law| law.contact_strength(normal))
    }

    fn softening(&self) -> Option<Softening> {
        self.laws[1].softening()
    }
}
