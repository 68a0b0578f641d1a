//! Strengths on their way from one joint to another.

use std::sync::Arc;

use super::{JointLaw, Softening};

/// The law of a joint that takes the place of another by parts: cohesion, tension and the tangents of the angles are
/// `old + (new − old) part`. Whether it softens, and how, is that of the new one.
#[derive(Clone, Debug)]
pub struct BlendedLaw {
    /// Of the old joint and of the new one.
    pub laws: [Arc<dyn JointLaw>; 2],
    /// Part of the way, from 0 to 1.
    pub part: f64,
}

impl BlendedLaw {
    fn mix(&self, of: impl Fn(&dyn JointLaw) -> f64) -> f64 {
        let [old, new] = [of(&*self.laws[0]), of(&*self.laws[1])];
        old + (new - old) * self.part
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
