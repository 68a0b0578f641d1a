//! Conversion between forces on the corners of rigid blocks and their six degrees of freedom (§8).

use crate::model::conditions::SupportedAxis;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::{LinearField, MassProperties, Pose, RigidConstraint, SpatialVector};
use ddem_mesh::Vec3;

/// Rigid block of a pack: mass properties, pose and lane.
#[derive(Clone, Copy)]
pub(crate) struct RigidBlock<'a> {
    pub(crate) mass_properties: &'a MassProperties,
    pub(crate) pose: &'a Pose,
    pub(crate) lane: usize,
}

impl<'a> RigidBlock<'a> {
    /// Resultant of the corner forces: force `[N]` and torque about the centroid `[N m]`.
    pub(crate) fn resultant(&self, f: &[Lanes]) -> SpatialVector {
        let mut sum = SpatialVector::default();
        for (corner, arm) in self.arms().iter().enumerate() {
            let force = at(f, corner, self.lane);
            sum.linear += force;
            sum.angular += arm.cross(&force);
        }
        sum
    }

    /// Vectors from the centroid to the corners in the present pose `[m]`.
    fn arms(&self) -> [Vec3; 8] {
        let rotation = self.pose.turn.to_rotation_matrix();
        std::array::from_fn(|corner| rotation * self.mass_properties.arm(corner))
    }

    /// Corner forces equivalent to a wrench.
    pub(crate) fn corner_forces(&self, wrench: SpatialVector) -> LinearField {
        let turn = &self.pose.turn;
        LinearField::of_twist(self.mass_properties.corner_forces(turn, wrench), turn)
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
        for (corner, arm) in self.arms().iter().enumerate() {
            let force = turn.cross(arm);
            (0..3).for_each(|c| f[3 * corner + c].0[self.lane] += force[c]);
        }
    }

    /// Sets a field at the corners to that of a rigid motion, `v + ω × r`.
    pub(crate) fn set_twist(&self, twist: SpatialVector, field: &mut [Lanes]) {
        for (corner, arm) in self.arms().iter().enumerate() {
            let value = twist.linear + twist.angular.cross(arm);
            (0..3).for_each(|c| field[3 * corner + c].0[self.lane] = value[c]);
        }
    }

    /// Arm, axis and velocity of each of its supports.
    pub(crate) fn supported<'b>(
        self,
        supports: &'b [SupportedAxis],
        velocities: &'b [[f64; 3]],
        first: usize,
    ) -> impl Iterator<Item = (Vec3, usize, f64)> + use<'a, 'b> {
        let own = supports.iter().filter(move |support| usize::from(support.lane) == self.lane);
        let arms = self.arms();
        own.map(move |support| {
            let axis = usize::from(support.axis);
            (arms[corner(support, first)], axis, velocities[support.fix as usize][axis])
        })
    }

    /// Computes the reactions of its supports `[N]` from their wrench.
    pub(crate) fn set_reactions(
        &self,
        constraint: &RigidConstraint,
        wrench: SpatialVector,
        supports: &[SupportedAxis],
        first: usize,
        reactions: &mut [f64],
    ) {
        let arms = self.arms();
        for (support, reaction) in supports.iter().zip(reactions) {
            if usize::from(support.lane) == self.lane {
                let arm = arms[corner(support, first)];
                *reaction = constraint.reaction(wrench, arm, usize::from(support.axis));
            }
        }
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
