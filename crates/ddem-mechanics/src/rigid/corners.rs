//! Corners of the parts of a rigid body (§8).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{MassProperties, Pose, SpatialVector};

/// Number, mean and second moments of points, which have equal weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerMoments {
    count: f64,
    /// Mean of the points `[m]`.
    mean: Vector3<f64>,
    /// Inverse of `Σ (|d|² 1 − d dᵀ)` with the vectors d from the mean `[1/m²]`.
    inverse: Matrix3<f64>,
}

/// Corners of a part of a rigid body. They are not symmetric about its centre of mass.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PartCorners {
    /// Vectors from the centre of mass of the body at rest `[m]`.
    pub(super) arms: [Vector3<f64>; 8],
    own: CornerMoments,
    /// Moments of the corners of all parts of the body.
    body: CornerMoments,
}

impl CornerMoments {
    /// Moments of vectors from the centre of mass `[m]`.
    #[must_use]
    pub fn new(arms: &[Vector3<f64>]) -> Self {
        let count = arms.len() as f64;
        let mean = arms.iter().sum::<Vector3<f64>>() / count;
        let moment: Matrix3<f64> =
            arms.iter().map(|arm| (arm - mean) * (arm - mean).transpose()).sum();
        let spread = Matrix3::identity() * moment.trace() - moment;
        // Points on a line cannot give a rotation; NaN stops the run at once.
        let inverse = spread.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        Self { count, mean, inverse }
    }

    /// Velocity of the centre of mass and angular velocity nearest to velocities v of the points, of
    /// which the sums `Σ v` and `Σ R r × v` are given.
    fn twist_of_sums(&self, turn: &UnitQuaternion<f64>, sums: SpatialVector) -> SpatialVector {
        let (mean, v) = (turn * self.mean, sums.linear / self.count);
        let moment = sums.angular - mean.cross(&sums.linear);
        let angular = turn * (self.inverse * turn.inverse_transform_vector(&moment));
        SpatialVector { linear: v - angular.cross(&mean), angular }
    }
}

impl PartCorners {
    /// Corner forces as in [`MassProperties::corner_forces`]: `f_i = F/n + θ × (r_i − r̄)` with the
    /// mean arm r̄ of the n corners of all parts.
    pub(super) fn forces(
        &self,
        turn: &UnitQuaternion<f64>,
        wrench: SpatialVector,
    ) -> SpatialVector {
        let CornerMoments { count, mean, inverse } = self.body;
        let mean = turn * mean;
        let torque = wrench.angular - mean.cross(&wrench.linear);
        let angular = turn * (inverse * turn.inverse_transform_vector(&torque));
        SpatialVector { linear: wrench.linear / count - angular.cross(&mean), angular }
    }

    /// Velocity of the centre of mass and angular velocity nearest to velocities of the corners.
    pub(super) fn twist(
        &self,
        turn: &UnitQuaternion<f64>,
        velocities: &[Vector3<f64>; 8],
    ) -> SpatialVector {
        let mut sums = SpatialVector::default();
        for (arm, v) in self.arms.iter().zip(velocities) {
            sums.linear += v;
            sums.angular += (turn * arm).cross(v);
        }
        self.own.twist_of_sums(turn, sums)
    }
}

impl MassProperties {
    /// The same mass and inertia for a part of a body with corners at these arms. `body` are the
    /// moments of the corners of all parts.
    #[must_use]
    pub fn with_corners(self, arms: [Vector3<f64>; 8], body: CornerMoments) -> Self {
        let own = CornerMoments::new(&arms);
        Self { part: Some(Box::new(PartCorners { arms, own, body })), ..self }
    }
}

impl Pose {
    /// Pose with the velocity and momentum nearest to velocities of the corners of all parts of a body
    /// `[m/s]`, of which the sums `Σ v` and `Σ R r × v` are given. `mass_properties` are those of any
    /// part.
    #[must_use]
    pub fn with_velocity_sums(
        mut self,
        mass_properties: &MassProperties,
        sums: SpatialVector,
    ) -> Self {
        if let Some(part) = &mass_properties.part {
            let twist = part.body.twist_of_sums(&self.turn, sums);
            self.velocity = twist.linear;
            self.momentum = mass_properties.momentum(&self.turn, twist.angular);
        }
        self
    }
}
