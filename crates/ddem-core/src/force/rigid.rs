//! §8: from forces on the corners of rigid bodies to their six degrees of freedom, and back.

use crate::model::conditions::Support;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::{Gait, Hold, Matter, Pose, Wrench};
use ddem_mesh::Vec3;

/// One body of a pack: its matter, its pose, its lane.
#[derive(Clone, Copy)]
pub(crate) struct Member<'a> {
    pub(crate) matter: &'a Matter,
    pub(crate) pose: &'a Pose,
    pub(crate) lane: usize,
}

impl Member<'_> {
    /// What the forces on its corners amount to.
    pub(crate) fn resultant(&self, f: &[Lanes]) -> Wrench {
        let mut sum = Wrench::default();
        for corner in 0..8 {
            let force = at(f, corner, self.lane);
            sum.linear += force;
            sum.angular += self.arm(corner).cross(&force);
        }
        sum
    }

    /// From the centroid to a corner `[m]`.
    fn arm(&self, corner: usize) -> Vec3 {
        self.pose.turn * self.matter.arm(corner)
    }

    /// Sets the forces on the corners to those that are equivalent to a wrench.
    pub(crate) fn set_forces(&self, wrench: Wrench, f: &mut [Lanes]) {
        self.set_twist(self.matter.equivalent(&self.pose.turn, wrench), f);
    }

    /// Adds forces on the corners that are equivalent to a torque.
    pub(crate) fn add_torque(&self, torque: &[Lanes; 3], f: &mut [Lanes]) {
        let wrench = Wrench { angular: at(torque, 0, self.lane), ..Wrench::default() };
        let turn = self.matter.equivalent(&self.pose.turn, wrench).angular;
        for corner in 0..8 {
            let force = turn.cross(&self.arm(corner));
            (0..3).for_each(|c| f[3 * corner + c].0[self.lane] += force[c]);
        }
    }

    /// Sets a field at the corners to that of a rigid motion, `v + ω × r`.
    pub(crate) fn set_twist(&self, twist: Wrench, field: &mut [Lanes]) {
        for corner in 0..8 {
            let value = twist.linear + twist.angular.cross(&self.arm(corner));
            (0..3).for_each(|c| field[3 * corner + c].0[self.lane] = value[c]);
        }
    }

    /// What the supports at its corners hold.
    pub(crate) fn hold(
        &self,
        supports: &[Support],
        velocities: &[[f64; 3]],
        first: usize,
    ) -> Option<Hold> {
        let own = supports.iter().filter(|support| usize::from(support.lane) == self.lane);
        let asked = own.map(|support| {
            let axis = usize::from(support.axis);
            (self.arm(corner(support, first)), axis, velocities[support.fix as usize][axis])
        });
        Hold::new(self.matter.size(), asked)
    }

    /// Velocities after a step under a wrench without supports; from rest in a relaxation, which has none.
    pub(crate) fn free(&self, gait: &Gait, wrench: &Wrench, rests: bool) -> Wrench {
        let Self { matter, pose, .. } = *self;
        let start = if rests { Pose { turn: pose.turn, ..Pose::default() } } else { *pose };
        start.pushed(matter, gait, wrench).twist(matter)
    }

    /// Reactions of its supports to the velocities that it would have without them `[N]`; returns their wrench.
    pub(crate) fn react(
        &self,
        hold: &Hold,
        gait: &Gait,
        free: Wrench,
        supports: &[Support],
        first: usize,
        reactions: &mut [f64],
    ) -> Wrench {
        let Self { matter, pose, lane } = *self;
        let answer = hold.answer(matter, gait, &pose.turn, free);
        for (support, reaction) in supports.iter().zip(reactions) {
            if usize::from(support.lane) == lane {
                let arm = self.arm(corner(support, first));
                *reaction = hold.reaction(answer, arm, usize::from(support.axis));
            }
        }
        answer
    }
}

/// The corner that a support holds.
fn corner(support: &Support, first: usize) -> usize {
    (support.at as usize - first) / 3
}

/// Value of a field at a corner.
pub(crate) fn at(field: &[Lanes], corner: usize, lane: usize) -> Vec3 {
    Vec3::from([0, 1, 2].map(|c| field[3 * corner + c].0[lane]))
}
