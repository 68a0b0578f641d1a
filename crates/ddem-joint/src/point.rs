//! §5: one pair of points of a joint, bonded, failed, sliding or open; whichever faces the joint is between.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::losses::Losses;
use ddem_mechanics::law::bearing::Bearing;
use ddem_mechanics::law::{JointLaw, Loss, Memory, Mode, Opening, Stiffness, Traction};

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
    pub failure: Option<Failure>,
    /// Of the springs.
    pub memory: Memory,
}

/// Failure of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// In shear or in tension.
    pub mode: Mode,
    /// When it failed `[s]`.
    pub time: f64,
}

/// How to look at the pairs in one pass over the joints.
#[derive(Clone, Copy, Debug, Default)]
pub struct Look<'a> {
    /// Pairs fail whose traction, divided by this, is still beyond their strength; `None`: none.
    pub failing: Option<f64>,
    /// Whether joints that have turned about the pairs that hold let go of these: a contact takes over.
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

impl<'a> Look<'a> {
    /// A law by its number; `None`: the joint never fails.
    #[inline]
    pub fn law(&self, number: u16) -> Option<&'a dyn JointLaw> {
        self.laws.get(usize::from(number))?.as_deref()
    }

    /// Springs and dashpot of failed pairs.
    pub(super) fn bearing(&self, stiffness: Stiffness, dashpot: f64) -> Bearing {
        let dashpot = if self.undamped { 0.0 } else { dashpot };
        Bearing { stiffness, dashpot, time_step: self.time_step }
    }
}

impl JointPoint {
    /// Mode in which a bonded pair fails under a traction; in shear, too, if its joint has `turned`.
    pub(super) fn fails<L: JointLaw + ?Sized>(
        &self,
        law: &L,
        look: Look<'_>,
        traction: Traction,
        turned: bool,
    ) -> Option<Mode> {
        let factor = look.failing.filter(|_| self.failure.is_none())?;
        let failure = law.failure(traction.normal / factor, traction.shear.norm() / factor);
        failure.or((turned && law.bonds()).then_some(Mode::Shear))
    }

    /// Lets a bonded pair fail under a traction. Returns true if it fails now.
    pub(super) fn fail<L: JointLaw + ?Sized>(
        &mut self,
        law: &L,
        look: Look<'_>,
        traction: Traction,
        turned: bool,
        losses: &mut Losses,
    ) -> bool {
        let mode = self.fails(law, look, traction, turned);
        if let Some(mode) = mode {
            self.failure = Some(Failure { mode, time: look.time });
            losses.failed[usize::from(mode == Mode::Tension)] += 1;
        }
        mode.is_some()
    }

    /// The law begins where the springs bear a traction over a gap `[m]`.
    pub(super) fn begin(&mut self, traction: Traction, gap: f64) {
        self.memory = Memory { traction, gap, ..Memory::default() };
    }

    /// Tractions of the springs where the sides are `apart`, by a law or, without one, elastic; returns what is lost
    /// `[J/m²]`. `way` is how the sides moved in the last step, of a pair that has just failed.
    #[inline(always)]
    pub(super) fn act<L: JointLaw + ?Sized>(
        &mut self,
        law: Option<&L>,
        bearing: &Bearing,
        apart: Vector3<f64>,
        way: Option<Vector3<f64>>,
    ) -> Loss {
        let own = apart - self.origin;
        let Some(law) = law else {
            (self.memory.traction, self.memory.gap) = (elastic(bearing.stiffness, own), own.x);
            return Loss::default();
        };
        let bore = self.memory.traction;
        let opening = Opening { normal: own.x, shear: own.yz() };
        let mut loss = bearing.act(law, opening, &mut self.memory);
        if let Some(way) = way {
            bearing.break_off(bore, way, &mut loss, &mut self.memory);
        }
        loss
    }

    /// Elastic tractions where the sides are `apart` `[Pa]`.
    pub(super) fn elastic(&self, stiffness: Stiffness, apart: Vector3<f64>) -> Traction {
        elastic(stiffness, apart - self.origin)
    }

    /// Takes the present state for an equilibrium, if it knows none.
    pub(super) fn settle(&mut self) {
        if self.memory.settled.is_none() {
            self.memory.settle();
        }
    }

    /// Takes the springs out, for good. How far it has slid and opened stays.
    pub fn let_go(&mut self) {
        self.area = 0.0;
        self.memory.traction = Traction::default();
        (self.memory.drag, self.memory.account) = ([0.0; 2], 0.0);
    }

    /// Energy that it has given and not taken: its account below nothing `[J]`.
    pub(super) fn debt(&self) -> f64 {
        self.area * self.memory.account.min(0.0)
    }
}

/// True where one of the failed pairs of a joint has gone so far from its partner that the joint has turned about
/// the others, whose spacing is given `[m]`.
pub fn turned<'a>(points: impl IntoIterator<Item = &'a JointPoint>, spacing: f64) -> bool {
    let mut failed = points.into_iter().filter(|point| point.failure.is_some());
    failed.any(|JointPoint { memory, .. }| memory.gap.max(memory.slip.norm()) > TURNED * spacing)
}

fn elastic(stiffness: Stiffness, own: Vector3<f64>) -> Traction {
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
