//! Friction of contacts, taken from the residual strength of the joints of the two faces.
//!
//! A law whose strength is proportional to the pressure is reduced to a tangent, and so are two
//! such laws. Other laws are evaluated at every point by their number, so that a saved state can
//! store them.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use ddem_mechanics::law::{JointLaw, Laws};

/// Numbers of a face's previous and present law, between which strengths are interpolated.
type LawNumbers = [u16; 2];

/// Friction of a face from its joint; for an edge, the mean of the two adjacent faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FaceFriction {
    /// Tangent of the friction angle, if it is the same at all pressures.
    pub(super) tan: Option<f64>,
    laws: [Option<LawNumbers>; 2],
}

impl FaceFriction {
    /// Friction of a face whose joint has a law with this number; `None` without a law.
    pub(super) fn new(laws: &Laws, number: usize) -> Option<Self> {
        let law = laws.get(number)?.as_deref()?;
        let number = u16::try_from(number).ok()?;
        Some(Self { tan: law.tan_contact_friction(), laws: [Some([number; 2]), None] })
    }

    /// Friction interpolated from `before` to this one by the fraction `fraction`.
    pub(super) fn after(self, before: Self, fraction: f64) -> Self {
        let tan = self.tan.zip(before.tan).map(|(new, old)| old + (new - old) * fraction);
        let numbers = before.laws[0].zip(self.laws[0]).map(|([_, old], [_, new])| [old, new]);
        Self { tan, laws: [numbers, None] }
    }

    /// Mean friction of the two faces at an edge.
    pub(super) fn mean(self, other: Self) -> Self {
        let tan = self.tan.zip(other.tan).map(|(a, b)| 0.5 * (a + b));
        Self { tan, laws: [self.laws[0], other.laws[0]] }
    }

    /// Numbers that identify it: tangent, and the number of the law if there is no tangent.
    pub(super) fn key(this: Option<Self>) -> [f64; 2] {
        let Some(Self { tan, laws: [numbers, _] }) = this else { return [-1.0; 2] };
        let number = numbers.filter(|_| tan.is_none()).map_or(-1.0, |[_, now]| f64::from(now));
        [tan.unwrap_or(-1.0), number]
    }
}

/// Friction of two faces in contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Friction {
    /// Tangent of the friction angle.
    Angle(f64),
    /// Strength of the weaker of two laws.
    Laws(WeakerStrength),
}

/// Smaller strength of two blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeakerStrength {
    /// Laws of the faces of each block: one, or two at an edge.
    sides: [[Option<LawNumbers>; 2]; 2],
    /// Fraction of the way from the previous laws to the present ones.
    fraction: f64,
    /// Ratio of the point areas to the areas on which the faces press. It is set for the points in
    /// compression when they are made. Points that come into compression later have unscaled areas,
    /// but use the same ratio.
    stretch: f64,
}

impl Default for Friction {
    fn default() -> Self {
        Self::Angle(0.0)
    }
}

impl Friction {
    /// Friction of two faces. Some strengths may be a fraction `fraction` of the way from previous
    /// ones. `None` without a law.
    pub(super) fn of([a, b]: [Option<FaceFriction>; 2], fraction: f64) -> Option<Self> {
        let tan = match (a, b) {
            (Some(a), Some(b)) => a.tan.zip(b.tan).map(|(a, b)| a.min(b)),
            (a, b) => a.or(b)?.tan,
        };
        let sides = [a, b].map(|side| side.map_or([None; 2], |side| side.laws));
        Some(tan.map_or(Self::Laws(WeakerStrength { sides, fraction, stretch: 1.0 }), Self::Angle))
    }

    /// True if a contact carries shear.
    pub(super) fn has_friction(&self) -> bool {
        !matches!(self, Self::Angle(tan) if *tan <= 0.0)
    }

    /// Sets the ratio of the point areas to the areas on which the faces press. Laws are evaluated
    /// at the pressure on the latter.
    pub(super) fn set_stretch(&mut self, to: f64) {
        if let Self::Laws(strengths) = self {
            strengths.stretch = to;
        }
    }

    /// Ratio of the point areas to the areas on which the faces press; 1 if no law is used.
    pub(super) fn stretch(&self) -> f64 {
        match self {
            Self::Angle(_) => 1.0,
            Self::Laws(strengths) => strengths.stretch,
        }
    }

    /// Shear strength under a normal traction `[Pa]`, which is at most 0.
    pub fn strength(&self, laws: &[Option<Arc<dyn JointLaw>>], normal: f64) -> f64 {
        match self {
            Self::Angle(tan) => -normal * tan,
            Self::Laws(strengths) => strengths.at(laws, normal),
        }
    }

    /// True if its values are in range and all its numbers have a law.
    pub fn is_sound(&self, laws: &[Option<Arc<dyn JointLaw>>]) -> bool {
        match self {
            Self::Angle(tan) => *tan >= 0.0 && tan.is_finite(),
            Self::Laws(WeakerStrength { sides, fraction, stretch }) => {
                let mut numbers = sides.iter().flatten().flatten().flatten().peekable();
                let any = numbers.peek().is_some();
                let known =
                    |&number: &u16| laws.get(usize::from(number)).is_some_and(Option::is_some);
                any && (0.0..=1.0).contains(fraction)
                    && *stretch > 0.0
                    && stretch.is_finite()
                    && numbers.all(known)
            }
        }
    }
}

impl WeakerStrength {
    /// Shear strength under a normal traction `[Pa]`.
    fn at(&self, laws: &[Option<Arc<dyn JointLaw>>], normal: f64) -> f64 {
        if normal >= 0.0 {
            return 0.0;
        }
        // Every number has a law; otherwise NaN stops the run.
        let strength_of = |number: u16| {
            let law = laws.get(usize::from(number)).and_then(Option::as_deref);
            let strength = |law: &dyn JointLaw| law.contact_strength(normal * self.stretch);
            law.map_or(f64::NAN, |law| strength(law) / self.stretch)
        };
        let of_face = |[before, now]: LawNumbers| {
            let new = strength_of(now);
            if before == now {
                return new;
            }
            let old = strength_of(before);
            old + (new - old) * self.fraction
        };
        let of_side = |side: &[Option<LawNumbers>; 2]| match side.map(|face| face.map(of_face)) {
            [Some(a), Some(b)] => Some(0.5 * (a + b)),
            [a, b] => a.or(b),
        };
        match self.sides.each_ref().map(of_side) {
            [Some(a), Some(b)] if b < a => b,
            [a, b] => a.or(b).unwrap_or(f64::NAN),
        }
    }
}

/// Law of a contact: friction without bond.
#[derive(Clone, Copy, Debug)]
pub(super) struct BareFaces<'a> {
    pub(super) strengths: WeakerStrength,
    pub(super) laws: &'a [Option<Arc<dyn JointLaw>>],
}

impl JointLaw for BareFaces<'_> {
    fn tension(&self) -> f64 {
        0.0
    }

    fn peak(&self, normal: f64) -> f64 {
        self.residual(normal)
    }

    fn residual(&self, normal: f64) -> f64 {
        self.strengths.at(self.laws, normal)
    }
}
