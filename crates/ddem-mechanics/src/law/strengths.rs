//! Strengths of one point, or of four side by side that may have different laws.

use fearless_simd::{Simd, f64x4, mask64x4};

use super::{JointLaw, Softening};
use crate::math::lanes::{LANES, Lanes, splat};
use crate::math::number::Number;

/// Strengths of one or four points, from their [`JointLaw`].
pub trait Strengths<N: Number> {
    /// Tensile strength σ_t `[Pa]`.
    fn tensile(&self) -> N;

    /// Shear strength of bonded points under normal tractions `[Pa]`.
    fn peak_at(&self, normal: N) -> N;

    /// Shear strength of failed, closed points under normal tractions `[Pa]`.
    fn residual_at(&self, normal: N) -> N;

    /// Shear strength of failed, closed points without pressure `[Pa]`.
    fn residual_cohesion(&self) -> N;

    /// Opening per unit of slip, `tan ψ`.
    fn dilatancy(&self) -> N;

    /// Softening, and the lanes that have it; the others are brittle.
    fn softens(&self) -> ([N; 2], N::Mask);
}

impl<L: JointLaw + ?Sized> Strengths<f64> for L {
    #[inline(always)]
    fn tensile(&self) -> f64 {
        self.tension()
    }

    #[inline(always)]
    fn peak_at(&self, normal: f64) -> f64 {
        self.peak(normal)
    }

    #[inline(always)]
    fn residual_at(&self, normal: f64) -> f64 {
        self.residual(normal)
    }

    #[inline(always)]
    fn residual_cohesion(&self) -> f64 {
        self.residual(0.0)
    }

    #[inline(always)]
    fn dilatancy(&self) -> f64 {
        self.tan_dilation()
    }

    #[inline(always)]
    fn softens(&self) -> ([f64; 2], bool) {
        let given = self.softening();
        let Softening { opening, sliding } = given.unwrap_or_default();
        ([opening, sliding], given.is_some())
    }
}

/// Laws of four points side by side. Strengths that do not depend on the traction are kept in
/// registers.
pub struct LaneLaws<'a, S: Simd> {
    laws: [Option<&'a dyn JointLaw>; LANES],
    /// Law of all lanes that have one, if it is the same.
    one: Option<&'a dyn JointLaw>,
    tension: f64x4<S>,
    residual_cohesion: f64x4<S>,
    tan_dilation: f64x4<S>,
    softening: [f64x4<S>; 2],
    softens: mask64x4<S>,
}

impl<'a, S: Simd> LaneLaws<'a, S> {
    /// The laws of four points, by their numbers. Points without a law have no strength, or any if
    /// all others have the same law.
    #[inline(always)]
    pub fn new(
        simd: S,
        numbers: [u16; LANES],
        law: impl Fn(u16) -> Option<&'a dyn JointLaw>,
    ) -> Self {
        let laws = numbers.map(law);
        let first = laws.iter().position(Option::is_some).unwrap_or(0);
        let same = (0..LANES).all(|lane| laws[lane].is_none() || numbers[lane] == numbers[first]);
        let one = laws[first].filter(|_| same);
        let each = |of: &dyn Fn(&dyn JointLaw) -> f64| match one {
            Some(law) => splat(simd, of(law)),
            None => Lanes(laws.map(|law| law.map_or(0.0, of))).load(simd),
        };
        let softening = |law: &dyn JointLaw| law.softening().unwrap_or_default();
        Self {
            laws,
            one,
            tension: each(&|law| law.tension()),
            residual_cohesion: each(&|law| law.residual(0.0)),
            tan_dilation: each(&|law| law.tan_dilation()),
            softening: [each(&|law| softening(law).opening), each(&|law| softening(law).sliding)],
            softens: each(&|law| f64::from(u8::from(law.softening().is_some())))
                .exceeds(splat(simd, 0.0)),
        }
    }

    /// Law of all lanes that have one, if it is the same.
    pub fn of_all(&self) -> Option<&'a dyn JointLaw> {
        self.one
    }

    /// Strengths of the lanes under normal tractions `[Pa]`; `four` gives those of four points with
    /// one law.
    #[inline(always)]
    fn under(
        &self,
        normal: f64x4<S>,
        four: impl Fn(&dyn JointLaw, [f64; LANES]) -> [f64; LANES],
    ) -> f64x4<S> {
        let normal: [f64; LANES] = normal.into();
        if let Some(law) = self.one {
            return Lanes(four(law, normal)).load(self.tension.simd);
        }
        let mut strengths = [0.0; LANES];
        for (lane, strength) in strengths.iter_mut().enumerate() {
            if let Some(law) = self.laws[lane] {
                *strength = four(law, [normal[lane]; LANES])[0];
            }
        }
        Lanes(strengths).load(self.tension.simd)
    }
}

impl<S: Simd> Strengths<f64x4<S>> for LaneLaws<'_, S> {
    #[inline(always)]
    fn tensile(&self) -> f64x4<S> {
        self.tension
    }

    #[inline(always)]
    fn peak_at(&self, normal: f64x4<S>) -> f64x4<S> {
        self.under(normal, |law, normal| law.peaks(normal))
    }

    #[inline(always)]
    fn residual_at(&self, normal: f64x4<S>) -> f64x4<S> {
        self.under(normal, |law, normal| law.residuals(normal))
    }

    #[inline(always)]
    fn residual_cohesion(&self) -> f64x4<S> {
        self.residual_cohesion
    }

    #[inline(always)]
    fn dilatancy(&self) -> f64x4<S> {
        self.tan_dilation
    }

    #[inline(always)]
    fn softens(&self) -> ([f64x4<S>; 2], mask64x4<S>) {
        (self.softening, self.softens)
    }
}

#[cfg(test)]
mod tests;
