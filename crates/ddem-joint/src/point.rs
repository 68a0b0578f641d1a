//! §5: one pair of points of a joint, bonded, failed, sliding or open; whichever faces the joint is between.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::losses::Losses;
use ddem_mechanics::law::springs::PointSprings;
use ddem_mechanics::law::{
    FailureMode, JointLaw, Opening, PointLoss, PointState, SpringStiffness, Traction,
};

/// Part of the spacing of its pairs that a failed pair has slid or opened when all others of its joint
/// fail with it: the joint has turned about them, farther than pairs of points can follow.
const TURNED: f64 = 0.5;

/// A pair of points that a joint holds, or held, or that two blocks in contact have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointPoint {
    /// Area that its springs stand for `[m²]`; 0 where elements bear all, and once a contact does.
    pub area: f64,
    /// From the point on side a to that on side b where the springs bear nothing, along the joint's own axes `[m]`.
    pub origin: Vector3<f64>,
    /// `None` while it is bonded; points of contacts never were.
    pub failure: Option<PairFailure>,
    /// Of the springs.
    pub state: PointState,
}

/// Failure of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairFailure {
    /// In shear or in tension.
    pub mode: FailureMode,
    /// Time of failure `[s]`.
    pub time: f64,
}

/// Context of one pass over the pairs of joints.
#[derive(Clone, Copy, Debug, Default)]
pub struct PairContext<'a> {
    /// Pairs fail whose traction, divided by this, is still beyond their strength; `None`: none.
    pub failure_divisor: Option<f64>,
    /// True if joints that have turned about their bonded pairs release them: a contact takes over.
    pub turning: bool,
    /// Slip goes on from the last equilibrium, not from the last step.
    pub relaxing: bool,
    /// Failed pairs and contacts have no dashpots now.
    pub undamped: bool,
    /// Present time `[s]`.
    pub time: f64,
    /// Time since the last look, 0 in relaxation, none in the first half step of a stage `[s]`.
    pub time_step: Option<f64>,
    /// Laws of the joints.
    pub laws: &'a [Option<Arc<dyn JointLaw>>],
}

impl<'a> PairContext<'a> {
    /// A law by its number; `None`: the joint never fails.
    #[inline]
    pub fn law(&self, number: u16) -> Option<&'a dyn JointLaw> {
        self.laws.get(usize::from(number))?.as_deref()
    }

    /// Springs and dashpot of failed pairs.
    pub(super) fn springs(&self, stiffness: SpringStiffness, dashpot: f64) -> PointSprings {
        let dashpot = if self.undamped { 0.0 } else { dashpot };
        PointSprings { stiffness, dashpot, time_step: self.time_step }
    }
}

impl JointPoint {
    /// Mode in which a bonded pair fails under a traction; in shear, too, if its joint has `turned`.
    pub(super) fn fails<L: JointLaw + ?Sized>(
        &self,
        law: &L,
        context: PairContext<'_>,
        traction: Traction,
        turned: bool,
    ) -> Option<FailureMode> {
        let factor = context.failure_divisor.filter(|_| self.failure.is_none())?;
        let failure = law.failure(traction.normal / factor, traction.shear.norm() / factor);
        failure.or((turned && law.bonds()).then_some(FailureMode::Shear))
    }

    /// Lets a bonded pair fail under a traction. Returns true if it fails now.
    pub(super) fn fail<L: JointLaw + ?Sized>(
        &mut self,
        law: &L,
        context: PairContext<'_>,
        traction: Traction,
        turned: bool,
        losses: &mut Losses,
    ) -> bool {
        let mode = self.fails(law, context, traction, turned);
        if let Some(mode) = mode {
            self.failure = Some(PairFailure { mode, time: context.time });
            losses.failed[usize::from(mode == FailureMode::Tension)] += 1;
        }
        mode.is_some()
    }

    /// The law begins where the springs bear a traction over a gap `[m]`.
    pub(super) fn begin(&mut self, traction: Traction, gap: f64) {
        self.state = PointState { traction, gap, ..PointState::default() };
    }

    /// Tractions of the springs where the sides are `apart`, by a law or, without one, elastic; returns what is lost
    /// `[J/m²]`. `du` is how the sides moved in the last step, of a pair that has just failed.
    #[inline(always)]
    pub(super) fn update<L: JointLaw + ?Sized>(
        &mut self,
        law: Option<&L>,
        springs: &PointSprings,
        apart: Vector3<f64>,
        du: Option<Vector3<f64>>,
    ) -> PointLoss {
        let own = apart - self.origin;
        let Some(law) = law else {
            (self.state.traction, self.state.gap) = (elastic(springs.stiffness, own), own.x);
            return PointLoss::default();
        };
        let previous_traction = self.state.traction;
        let opening = Opening { normal: own.x, shear: own.yz() };
        let mut loss = springs.update(law, opening, &mut self.state);
        if let Some(du) = du {
            springs.begin_failure(previous_traction, du, &mut loss, &mut self.state);
        }
        loss
    }

    /// Elastic tractions where the sides are `apart` `[Pa]`.
    pub(super) fn elastic(&self, stiffness: SpringStiffness, apart: Vector3<f64>) -> Traction {
        elastic(stiffness, apart - self.origin)
    }

    /// Takes the present state for an equilibrium, if it knows none.
    pub(super) fn set_equilibrium(&mut self) {
        if self.state.equilibrium.is_none() {
            self.state.set_equilibrium();
        }
    }

    /// Takes the springs out, for good. How far it has slid and opened stays.
    pub fn remove_springs(&mut self) {
        self.area = 0.0;
        self.state.traction = Traction::default();
        (self.state.drag, self.state.account) = ([0.0; 2], 0.0);
    }

    /// Energy that it has given and not taken: its account below nothing `[J]`.
    pub(super) fn debt(&self) -> f64 {
        self.area * self.state.account.min(0.0)
    }
}

/// True where one of the failed pairs of a joint has gone so far from its partner that the joint has turned about
/// the others, whose spacing is given `[m]`.
pub fn turned<'a>(points: impl IntoIterator<Item = &'a JointPoint>, spacing: f64) -> bool {
    let mut failed = points.into_iter().filter(|point| point.failure.is_some());
    failed.any(|JointPoint { state, .. }| state.gap.max(state.slip.norm()) > TURNED * spacing)
}

fn elastic(stiffness: SpringStiffness, own: Vector3<f64>) -> Traction {
    Traction { normal: stiffness.normal * own.x, shear: own.yz() * stiffness.shear }
}

/// Parts of a vector along the joint's own axes: along the normal and in the plane.
pub(super) fn split(v: Vector3<f64>) -> Traction {
    Traction { normal: v.x, shear: v.yz() }
}

/// A vector along the joint's own axes from its part along the normal and that in the plane.
pub fn joined(normal: f64, shear: Vector2<f64>) -> Vector3<f64> {
    Vector3::new(normal, shear.x, shear.y)
}
