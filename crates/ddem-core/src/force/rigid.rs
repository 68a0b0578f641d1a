//! Conversion between forces on the corners of rigid blocks and their six degrees of freedom (§8).

use crate::model::conditions::SupportedAxis;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::{
    MassProperties, Pose, RigidCoefficients, RigidConstraint, SpatialVector,
};
use ddem_mesh::Vec3;

/// Rigid block of a pack: mass properties, pose and lane.
#[derive(Clone, Copy)]
pub(crate) struct RigidBlock<'a> {
    pub(crate) mass_properties: &'a MassProperties,
    pub(crate) pose: &'a Pose,
    pub(crate) lane: usize,
}

impl RigidBlock<'_> {
    /// Resultant of the corner forces: force `[N]` and torque about the centroid `[N m]`.
    pub(crate) fn resultant(&self, f: &[Lanes]) -> SpatialVector {
        let mut sum = SpatialVector::default();
        for corner in 0..8 {
            let force = at(f, corner, self.lane);
            sum.linear += force;
            sum.angular += self.arm(corner).cross(&force);
        }
        sum
    }

    /// Vector from the centroid to a corner in the present pose `[m]`.
    fn arm(&self, corner: usize) -> Vec3 {
        self.pose.turn * self.mass_properties.arm(corner)
    }

    /// Sets the corner forces to those equivalent to a wrench.
    pub(crate) fn set_forces(&self, wrench: SpatialVector, f: &mut [Lanes]) {
        self.set_twist(self.mass_properties.corner_forces(&self.pose.turn, wrench), f);
    }

    /// Adds the corner forces equivalent to a torque.
    pub(crate) fn add_torque(&self, torque: &[Lanes; 3], f: &mut [Lanes]) {
        let wrench =
            SpatialVector { angular: at(torque, 0, self.lane), ..SpatialVector::default() };
        let turn = self.mass_properties.corner_forces(&self.pose.turn, wrench).angular;
        for corner in 0..8 {
            let force = turn.cross(&self.arm(corner));
            (0..3).for_each(|c| f[3 * corner + c].0[self.lane] += force[c]);
        }
    }

    /// Sets a field at the corners to that of a rigid motion, `v + ω × r`.
    pub(crate) fn set_twist(&self, twist: SpatialVector, field: &mut [Lanes]) {
        for corner in 0..8 {
            let value = twist.linear + twist.angular.cross(&self.arm(corner));
            (0..3).for_each(|c| field[3 * corner + c].0[self.lane] = value[c]);
        }
    }

    /// Constraint by the supports at the corners; `None` without supports.
    pub(crate) fn constraint(
        &self,
        supports: &[SupportedAxis],
        velocities: &[[f64; 3]],
        first: usize,
    ) -> Option<RigidConstraint> {
        let own = supports.iter().filter(|support| usize::from(support.lane) == self.lane);
        let asked = own.map(|support| {
            let axis = usize::from(support.axis);
            (self.arm(corner(support, first)), axis, velocities[support.fix as usize][axis])
        });
        RigidConstraint::new(self.mass_properties.size(), asked)
    }

    /// Velocities after a step under a wrench, without supports. A relaxation (`rests`) starts from
    /// zero velocities.
    pub(crate) fn free(
        &self,
        coefficients: &RigidCoefficients,
        wrench: &SpatialVector,
        rests: bool,
    ) -> SpatialVector {
        let Self { mass_properties, pose, .. } = *self;
        let start = if rests { Pose { turn: pose.turn, ..Pose::default() } } else { *pose };
        start.accelerated(mass_properties, coefficients, wrench).twist(mass_properties)
    }

    /// Computes the reactions of the supports `[N]` that correct the velocities `free`, those
    /// without supports. Returns the wrench of the reactions.
    pub(crate) fn react(
        &self,
        constraint: &RigidConstraint,
        coefficients: &RigidCoefficients,
        free: SpatialVector,
        supports: &[SupportedAxis],
        first: usize,
        reactions: &mut [f64],
    ) -> SpatialVector {
        let Self { mass_properties, pose, lane } = *self;
        let answer = constraint.reaction_wrench(mass_properties, coefficients, &pose.turn, free);
        for (support, reaction) in supports.iter().zip(reactions) {
            if usize::from(support.lane) == lane {
                let arm = self.arm(corner(support, first));
                *reaction = constraint.reaction(answer, arm, usize::from(support.axis));
            }
        }
        answer
    }
}

/// Corner that a support holds.
fn corner(support: &SupportedAxis, first: usize) -> usize {
    (support.at as usize - first) / 3
}

/// Value of a field at a corner.
pub(crate) fn at(field: &[Lanes], corner: usize, lane: usize) -> Vec3 {
    Vec3::from([0, 1, 2].map(|c| field[3 * corner + c].0[lane]))
}
