//! State of one point or of four side by side, as the formulas of failed points use it.

use fearless_simd::{Simd, f64x4, mask64x4};
use nalgebra::Vector2;

use super::{PointLoss, PointState, Traction};
use crate::math::lanes::{LANES, Lanes, mask_of, splat};
use crate::math::number::Number;

/// Displacement of sides b relative to sides a: along the normal and both tangents `[m]`.
pub type Displacements<N> = [N; 3];

/// [`PointState`] of one or four points. Vectors in the plane of the joint have two components.
#[derive(Clone, Copy)]
pub struct Points<N: Number> {
    /// Slip `[m]`.
    pub slip: [N; 2],
    /// Opening due to slip `[m]`.
    pub dilation: N,
    /// Damage.
    pub damage: N,
    /// Distance of the faces `[m]`.
    pub gap: N,
    /// Dilation in the gap `[m]`.
    pub applied_dilation: N,
    /// Normal traction of the springs `[Pa]`.
    pub normal: N,
    /// Shear traction of the springs `[Pa]`.
    pub shear: [N; 2],
    /// Normal traction of the dashpots `[Pa]`.
    pub dashpot: N,
    /// Normal traction of the energy correction `[Pa]`.
    pub correction: N,
    /// Energy excess `[J/m²]`.
    pub energy_excess: N,
    /// Points that a relaxation moves on from an equilibrium.
    pub relaxing: N::Mask,
    /// Last equilibrium; zero for points without one.
    pub equilibrium: LastEquilibrium<N>,
}

/// [`super::Equilibrium`] of one or four points.
#[derive(Clone, Copy)]
pub struct LastEquilibrium<N> {
    /// Slip `[m]`.
    pub slip: [N; 2],
    /// Opening due to slip `[m]`.
    pub dilation: N,
    /// Damage.
    pub damage: N,
    /// Distance of the faces `[m]`.
    pub gap: N,
}

/// [`PointLoss`] of one or four points `[J/m²]`.
#[derive(Clone, Copy)]
pub struct Loss<N> {
    /// Loss by friction.
    pub friction: N,
    /// Loss by fracture.
    pub fracture: N,
    /// Loss of faces that meet or part.
    pub contact: N,
    /// Loss by the dashpots.
    pub damping: N,
}

impl<N: Number> Points<N> {
    /// Traction of springs, dashpots and energy correction together: normal and shear `[Pa]`.
    #[inline(always)]
    pub fn total_traction(&self) -> [N; 3] {
        [self.normal + self.dashpot + self.correction, self.shear[0], self.shear[1]]
    }

    /// Energy per unit area, in the springs and the energy excess `[J/m²]`.
    #[inline(always)]
    pub fn stored(&self, shear_stiffness: N) -> N {
        let [s, t] = self.shear;
        self.normal * 0.5 * self.gap + (s * s + t * t) * 0.5 / shear_stiffness + self.energy_excess
    }
}

impl Points<f64> {
    /// The state of one point.
    #[inline(always)]
    pub fn one(state: &PointState) -> Self {
        let equilibrium = state.equilibrium.unwrap_or_default();
        let [dashpot, correction] = state.added_tractions;
        Self {
            slip: state.slip.into(),
            dilation: state.dilation,
            damage: state.damage,
            gap: state.gap,
            applied_dilation: state.applied_dilation,
            normal: state.traction.normal,
            shear: state.traction.shear.into(),
            dashpot,
            correction,
            energy_excess: state.energy_excess,
            relaxing: state.equilibrium.is_some(),
            equilibrium: LastEquilibrium {
                slip: equilibrium.slip.into(),
                dilation: equilibrium.dilation,
                damage: equilibrium.damage,
                gap: equilibrium.gap,
            },
        }
    }

    /// Stores the state of the point.
    #[inline(always)]
    pub fn store(&self, state: &mut PointState) {
        state.slip = self.slip.into();
        state.dilation = self.dilation;
        state.damage = self.damage;
        state.gap = self.gap;
        state.applied_dilation = self.applied_dilation;
        state.traction = Traction { normal: self.normal, shear: self.shear.into() };
        state.added_tractions = [self.dashpot, self.correction];
        state.energy_excess = self.energy_excess;
    }
}

/// One number of each of four points.
#[inline(always)]
fn four<T>([a, b, c, d]: [&T; LANES], of: impl Fn(&T) -> f64) -> Lanes {
    Lanes([of(a), of(b), of(c), of(d)])
}

impl<S: Simd> Points<f64x4<S>> {
    /// The states of four points.
    #[inline(always)]
    pub fn four(simd: S, states: [&PointState; LANES]) -> Self {
        let shear = [
            four(states, |state| state.traction.shear.x).load(simd),
            four(states, |state| state.traction.shear.y).load(simd),
        ];
        let slip = [
            four(states, |state| state.slip.x).load(simd),
            four(states, |state| state.slip.y).load(simd),
        ];
        let (relaxing, equilibrium) = LastEquilibrium::four(simd, states);
        Self {
            slip,
            dilation: four(states, |state| state.dilation).load(simd),
            damage: four(states, |state| state.damage).load(simd),
            gap: four(states, |state| state.gap).load(simd),
            applied_dilation: four(states, |state| state.applied_dilation).load(simd),
            normal: four(states, |state| state.traction.normal).load(simd),
            shear,
            dashpot: four(states, |state| state.added_tractions[0]).load(simd),
            correction: four(states, |state| state.added_tractions[1]).load(simd),
            energy_excess: four(states, |state| state.energy_excess).load(simd),
            relaxing,
            equilibrium,
        }
    }

    /// The four points in memory.
    #[inline(always)]
    pub fn in_memory(&self) -> FourPoints {
        FourPoints {
            slip: [Lanes::from(self.slip[0]), Lanes::from(self.slip[1])],
            dilation: Lanes::from(self.dilation),
            damage: Lanes::from(self.damage),
            gap: Lanes::from(self.gap),
            applied_dilation: Lanes::from(self.applied_dilation),
            normal: Lanes::from(self.normal),
            shear: [Lanes::from(self.shear[0]), Lanes::from(self.shear[1])],
            added: [Lanes::from(self.dashpot), Lanes::from(self.correction)],
            energy_excess: Lanes::from(self.energy_excess),
        }
    }
}

impl<S: Simd> LastEquilibrium<f64x4<S>> {
    /// The last equilibriums of four points, and the points that have one.
    #[inline(always)]
    fn four(simd: S, states: [&PointState; LANES]) -> (mask64x4<S>, Self) {
        let [a, b, c, d] = states;
        let last = [&a.equilibrium, &b.equilibrium, &c.equilibrium, &d.equilibrium];
        let is_set = [last[0].is_some(), last[1].is_some(), last[2].is_some(), last[3].is_some()];
        let zero = splat(simd, 0.0);
        let mut four_last = Self { slip: [zero; 2], dilation: zero, damage: zero, gap: zero };
        if is_set != [false; LANES] {
            let of = |at: usize| last[at].unwrap_or_default();
            let (a, b, c, d) = (of(0), of(1), of(2), of(3));
            let last = [&a, &b, &c, &d];
            four_last = Self {
                slip: [
                    four(last, |last| last.slip.x).load(simd),
                    four(last, |last| last.slip.y).load(simd),
                ],
                dilation: four(last, |last| last.dilation).load(simd),
                damage: four(last, |last| last.damage).load(simd),
                gap: four(last, |last| last.gap).load(simd),
            };
        }
        (mask_of(simd, is_set), four_last)
    }
}

/// Four points in memory, to store them one by one.
pub struct FourPoints {
    slip: [Lanes; 2],
    dilation: Lanes,
    damage: Lanes,
    gap: Lanes,
    applied_dilation: Lanes,
    normal: Lanes,
    shear: [Lanes; 2],
    added: [Lanes; 2],
    energy_excess: Lanes,
}

impl FourPoints {
    /// Stores the state of the point in a lane. Its last equilibrium stays.
    #[inline(always)]
    pub fn store(&self, lane: usize, state: &mut PointState) {
        state.slip = Vector2::new(self.slip[0].0[lane], self.slip[1].0[lane]);
        state.dilation = self.dilation.0[lane];
        state.damage = self.damage.0[lane];
        state.gap = self.gap.0[lane];
        state.applied_dilation = self.applied_dilation.0[lane];
        let shear = Vector2::new(self.shear[0].0[lane], self.shear[1].0[lane]);
        state.traction = Traction { normal: self.normal.0[lane], shear };
        state.added_tractions = [self.added[0].0[lane], self.added[1].0[lane]];
        state.energy_excess = self.energy_excess.0[lane];
    }
}

impl<S: Simd> Loss<f64x4<S>> {
    /// Losses of the four points one by one `[J/m²]`.
    #[inline(always)]
    pub fn each(self) -> [PointLoss; LANES] {
        let (friction, fracture) = (Lanes::from(self.friction), Lanes::from(self.fracture));
        let (contact, damping) = (Lanes::from(self.contact), Lanes::from(self.damping));
        [0, 1, 2, 3].map(|lane| PointLoss {
            friction: friction.0[lane],
            fracture: fracture.0[lane],
            contact: contact.0[lane],
            damping: damping.0[lane],
        })
    }
}

impl From<Loss<f64>> for PointLoss {
    #[inline(always)]
    fn from(Loss { friction, fracture, contact, damping }: Loss<f64>) -> Self {
        Self { friction, fracture, contact, damping }
    }
}
