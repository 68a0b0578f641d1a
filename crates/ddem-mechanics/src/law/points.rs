//! State of one point or of four side by side, as the formulas of failed points use it.

use super::{PointLoss, PointState, Traction};
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

impl From<Loss<f64>> for PointLoss {
    #[inline(always)]
    fn from(Loss { friction, fracture, contact, damping }: Loss<f64>) -> Self {
        Self { friction, fracture, contact, damping }
    }
}
