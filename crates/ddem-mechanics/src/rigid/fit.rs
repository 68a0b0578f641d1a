//! Rigid motion nearest to given motions of the corners of a block.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{MassProperties, Pose, turned_away};

impl Pose {
    /// Pose with the translation and rotation nearest to displacements of the corners `[m]`.
    pub fn from_corners(
        mut self,
        mass_properties: &MassProperties,
        displacements: &[Vector3<f64>; 8],
    ) -> Self {
        self.shift = displacements.iter().sum::<Vector3<f64>>() / 8.0;
        let mut stretch = Matrix3::zeros();
        for (corner, u) in displacements.iter().enumerate() {
            let arm = mass_properties.arm(corner);
            stretch += (arm + u - self.shift) * arm.transpose();
        }
        // Division by the moments of the corners removes the influence of the block's shape.
        let edges = Matrix3::from_columns(&mass_properties.half);
        let round = edges.try_inverse().map(|inverse| stretch * inverse.transpose() * inverse);
        self.turn = rotation(displacements, round);
        self
    }

    /// Pose with the translation and rotation nearest to displacements of points `[m]`, given the vectors
    /// to them from the centre of mass at rest `[m]`.
    #[must_use]
    pub fn from_points(mut self, arms: &[Vector3<f64>], displacements: &[Vector3<f64>]) -> Self {
        let mean = |of: &[Vector3<f64>]| of.iter().sum::<Vector3<f64>>() / of.len() as f64;
        let (middle, moved) = (mean(arms), mean(displacements));
        let (mut stretch, mut moment) = (Matrix3::zeros(), Matrix3::zeros());
        for (arm, u) in arms.iter().zip(displacements) {
            let d = arm - middle;
            stretch += (d + u - moved) * d.transpose();
            moment += d * d.transpose();
        }
        self.turn = rotation(displacements, moment.try_inverse().map(|inverse| stretch * inverse));
        self.shift = moved - turned_away(&self.turn, &middle);
        self
    }

    /// Pose with the velocity and momentum nearest to velocities of the corners `[m/s]`.
    pub fn with_corner_velocities(
        mut self,
        mass_properties: &MassProperties,
        velocities: &[Vector3<f64>; 8],
    ) -> Self {
        if let Some(part) = &mass_properties.part {
            let twist = part.twist(&self.turn, velocities);
            self.velocity = twist.linear;
            self.momentum = mass_properties.momentum(&self.turn, twist.angular);
            return self;
        }
        self.velocity = velocities.iter().sum::<Vector3<f64>>() / 8.0;
        // Equal masses at the eight corners have three times the inertia of the block.
        let mut momentum = Vector3::zeros();
        for (corner, v) in velocities.iter().enumerate() {
            let arm = self.turn * mass_properties.arm(corner);
            momentum += arm.cross(&(v - self.velocity)) * (mass_properties.mass / 24.0);
        }
        self.momentum = momentum;
        self
    }
}

/// Rotation in a deformation of some points, whose gradient is given.
fn rotation(displacements: &[Vector3<f64>], gradient: Option<Matrix3<f64>>) -> UnitQuaternion<f64> {
    // Without relative displacements the rotation is exactly the identity.
    if displacements.iter().all(|u| *u == displacements[0]) {
        return UnitQuaternion::identity();
    }
    let turn =
        gradient.map_or_else(Rotation3::identity, |gradient| Rotation3::from_matrix(&gradient));
    UnitQuaternion::from_rotation_matrix(&turn)
}
