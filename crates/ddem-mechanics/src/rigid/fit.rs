//! Rigid motion nearest to given motions of the corners of a block.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{MassProperties, Pose};

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
        let turn = round.map_or_else(Rotation3::identity, |round| Rotation3::from_matrix(&round));
        // Without relative displacements the rotation is exactly the identity.
        let still = displacements.iter().all(|u| *u == displacements[0]);
        self.turn = if still {
            UnitQuaternion::identity()
        } else {
            UnitQuaternion::from_rotation_matrix(&turn)
        };
        self
    }

    /// Pose with the velocity and momentum nearest to velocities of the corners `[m/s]`.
    pub fn with_corner_velocities(
        mut self,
        mass_properties: &MassProperties,
        velocities: &[Vector3<f64>; 8],
    ) -> Self {
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
