//! A pair of points of a joint or a contact: bonded, failed, sliding or open (§5).

use std::borrow::Borrow;
use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::losses::Losses;
use ddem_mechanics::law::springs::PointSprings;
use ddem_mechanics::law::{
    FailureMode, JointDisplacement, JointLaw, PointLoss, PointState, SpringStiffness, Traction,
};
use ddem_mechanics::math::number::Number;

/// Slip or opening of a failed pair, as a fraction of the spacing of pairs, beyond which the
/// remaining bonded pairs fail too: the joint has rotated too far for node pairs.
pub(super) const ROTATED: f64 = 0.5;

/// A pair of points of a joint, also of a released one, or of two blocks in contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointPoint {
    /// Tributary area of the springs `[m²]`; 0 if elements or a contact carry the load.
    pub area: f64,
    /// Position of side b relative to side a at which the springs carry nothing, along the joint's
    /// own axes `[m]`. In lattices it is a displacement from the position at rest.
    pub origin: Vector3<f64>,
    /// Failure; `None` for bonded pairs and for points of contacts.
    pub failure: Option<PairFailure>,
    /// State of the springs.
    pub state: PointState,
}

/// Failure of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairFailure {
    /// Failure mode.
    pub mode: FailureMode,
    /// Time of failure `[s]`.
    pub time: f64,
}

/// Check of bonded pairs for failure.
#[derive(Clone, Copy, Debug, Default)]
pub enum FailureCheck<'a> {
    /// No pair fails.
    #[default]
    None,
    /// Overloaded pairs fail.
    Overloaded,
    /// Pairs of the most loaded joints fail if their load is large enough, and pairs of any joint that
    /// shed no load.
    MostLoaded {
        /// Pairs of blocks of the joints, by pack and lane, sorted.
        joints: &'a [[(usize, usize); 2]],
        /// Least load of a pair that fails, relative to its strength.
        least: f64,
    },
}

impl FailureCheck<'_> {
    /// Divisor of the tractions of a joint between two blocks, by pack and lane; `None`: no pair
    /// fails.
    pub fn divisor(self, law: Option<&dyn JointLaw>, blocks: [(usize, usize); 2]) -> Option<f64> {
        match self {
            Self::None => None,
            Self::Overloaded => Some(1.0),
            Self::MostLoaded { joints, least } => {
                let is_one = || joints.binary_search(&blocks).is_ok();
                (!law.is_some_and(JointLaw::sheds_load) || is_one()).then_some(least)
            }
        }
    }
}

/// Check of the bonded pairs of one joint.
#[derive(Clone, Copy, Debug, Default)]
pub struct JointCheck {
    /// Divisor of the tractions; `None`: no pair fails.
    pub divisor: Option<f64>,
    /// True if the joint has rotated: pairs with cohesion or tension that can carry the traction
    /// also fail, in shear.
    pub has_rotated: bool,
}

/// Context of one pass over the pairs of joints.
#[derive(Clone, Copy, Debug, Default)]
pub struct PairContext<'a> {
    /// Check for failure.
    pub failure_check: FailureCheck<'a>,
    /// True if joints that have rotated release their bonded pairs, so that contacts can replace
    /// the joints.
    pub releases_rotated_joints: bool,
    /// True if slip continues from the last equilibrium, not from the last step.
    pub relaxing: bool,
    /// True if failed pairs and contacts have no dashpots.
    pub undamped: bool,
    /// Present time `[s]`.
    pub time: f64,
    /// Time since the last evaluation `[s]`: 0 in relaxation, `None` in the first half step of a
    /// stage.
    pub time_step: Option<f64>,
    /// Laws of the joints, by their number.
    pub laws: &'a [Option<Arc<dyn JointLaw>>],
}

impl<'a> PairContext<'a> {
    /// Law with a number; `None`: the joint never fails.
    #[inline]
    pub fn law(&self, number: u16) -> Option<&'a dyn JointLaw> {
        self.laws.get(usize::from(number))?.as_deref()
    }

    /// Springs and dashpot of failed pairs.
    pub(super) fn springs(&self, stiffness: SpringStiffness, dashpot: f64) -> PointSprings {
        let dashpot = if self.undamped { 0.0 } else { dashpot };
        PointSprings::new(stiffness, dashpot, self.time_step)
    }
}

impl JointPoint {
    /// Mode in which a bonded pair fails under a traction; `None` if it does not fail.
    pub(super) fn fails<L: JointLaw + ?Sized>(
        &self,
        law: &L,
        JointCheck { divisor, has_rotated }: JointCheck,
        traction: Traction,
    ) -> Option<FailureMode> {
        let factor = divisor.filter(|_| self.failure.is_none())?;
        let failure = law.failure(traction.normal / factor, traction.shear.norm() / factor);
        failure.or((has_rotated && law.is_cohesive()).then_some(FailureMode::Shear))
    }

    /// Marks a bonded pair as failed if it fails under a traction at a `time`. Returns true if it
    /// does.
    pub(super) fn fail<L: JointLaw + ?Sized>(
        &mut self,
        law: &L,
        check: JointCheck,
        traction: Traction,
        time: f64,
        losses: &mut Losses,
    ) -> bool {
        let mode = self.fails(law, check, traction);
        if let Some(mode) = mode {
            self.failure = Some(PairFailure { mode, time });
            losses.failed[usize::from(mode == FailureMode::Tension)] += 1;
        }
        mode.is_some()
    }

    /// Starts the law at a traction and a gap `[m]`.
    pub(super) fn begin(&mut self, traction: Traction, gap: f64) {
        self.state = PointState { traction, gap, ..PointState::default() };
    }

    /// Updates the tractions of the springs for the vector `relative_position` between the sides.
    /// Without a law they are elastic. Returns the losses `[J/m²]`. `du` is the displacement
    /// increment of the last step; it is given for a pair that has just failed.
    #[inline(always)]
    pub(super) fn update<L: JointLaw + ?Sized>(
        &mut self,
        law: Option<&L>,
        springs: &PointSprings,
        relative_position: Vector3<f64>,
        du: Option<Vector3<f64>>,
    ) -> PointLoss {
        let own = relative_position - self.origin;
        let Some(law) = law else {
            let [normal, shear] = springs.stiffness;
            let stiffness = SpringStiffness { normal, shear };
            (self.state.traction, self.state.gap) = (elastic(stiffness, own), own.x);
            return PointLoss::default();
        };
        let previous_traction = self.state.traction;
        let displacement = JointDisplacement { normal: own.x, shear: own.yz() };
        let mut loss = springs.update(law, displacement, &mut self.state);
        if let Some(du) = du {
            springs.begin_failure(previous_traction, du, &mut loss, &mut self.state);
        }
        loss
    }

    /// Elastic tractions for the vector `relative_position` between the sides `[Pa]`.
    pub(super) fn elastic(
        &self,
        stiffness: SpringStiffness,
        relative_position: Vector3<f64>,
    ) -> Traction {
        elastic(stiffness, relative_position - self.origin)
    }

    /// Stores the present state as equilibrium if none is stored.
    pub(super) fn set_equilibrium(&mut self) {
        if self.state.equilibrium.is_none() {
            self.state.set_equilibrium();
        }
    }

    /// Removes the springs permanently. Slip and opening remain.
    pub fn remove_springs(&mut self) {
        self.area = 0.0;
        self.state.traction = Traction::default();
        (self.state.added_tractions, self.state.energy_excess) = ([0.0; 2], 0.0);
    }

    /// Energy deficit: energy returned in excess `[J]`, at most 0.
    pub(super) fn energy_deficit(&self) -> f64 {
        self.area * self.state.energy_excess.min(0.0)
    }
}

/// True if a failed pair of a joint has slid or opened so far that the joint has rotated about its
/// bonded pairs. `spacing` is the spacing of the pairs `[m]`.
pub fn has_rotated(
    points: impl IntoIterator<Item = impl Borrow<JointPoint>>,
    spacing: f64,
) -> bool {
    points.into_iter().any(|point| {
        let JointPoint { failure, state, .. } = point.borrow();
        failure.is_some() && state.gap.max(state.slip.norm()) > ROTATED * spacing
    })
}

/// Elastic tractions for the displacement `own` of side b along the joint's own axes `[Pa]`.
#[inline(always)]
fn elastic(stiffness: SpringStiffness, own: Vector3<f64>) -> Traction {
    let [normal, s, t] = elastic_traction(stiffness.components(), own.into());
    Traction { normal, shear: Vector2::new(s, t) }
}

/// Elastic tractions of one or four points along the axes, for the displacements `own` `[Pa]`.
#[inline(always)]
pub(super) fn elastic_traction<N: Number>([normal, shear]: [N; 2], [x, y, z]: [N; 3]) -> [N; 3] {
    [normal * x, shear * y, shear * z]
}

/// Normal and shear components of a vector along the joint's own axes.
pub(super) fn components(v: Vector3<f64>) -> Traction {
    Traction { normal: v.x, shear: v.yz() }
}

/// Vector along the joint's own axes with given normal and shear components.
pub fn vector(normal: f64, shear: Vector2<f64>) -> Vector3<f64> {
    Vector3::new(normal, shear.x, shear.y)
}
