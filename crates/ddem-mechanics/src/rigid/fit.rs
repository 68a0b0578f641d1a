//! The rigid motion that is nearest to what the corners of a block are said to do.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{MassProperties, Pose};

impl Pose {
    /// With the shift and the turn of displacements of the corners `[m]`.
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
        // Along its own axes a long block is as round as any.
        let edges = Matrix3::from_columns(&mass_properties.half);
        let round = edges.try_inverse().map(|inverse| stretch * inverse.transpose() * inverse);
        let turn = round.map_or_else(Rotation3::identity, |round| Rotation3::from_matrix(&round));
        // No motion is no turn, to the last bit.
        let still = displacements.iter().all(|u| *u == displacements[0]);
        self.turn = if still {
            UnitQuaternion::identity()
        } else {
            UnitQuaternion::from_rotation_matrix(&turn)
        };
        self
    }

    /// With the velocities of velocities of the corners `[m/s]`.
    pub fn with_corner_velocities(
        mut self,
        mass_properties: &MassProperties,
        velocities: &[Vector3<f64>; 8],
    ) -> Self {
        self.velocity = velocities.iter().sum::<Vector3<f64>>() / 8.0;
        // Eight equal points resist turning three times as much as the block does.
        let mut momentum = Vector3::zeros();
        for (corner, v) in velocities.iter().enumerate() {
            let arm = self.turn * mass_properties.arm(corner);
            momentum += arm.cross(&(v - self.velocity)) * (mass_properties.mass / 24.0);
        }
        self.momentum = momentum;
        self
    }
}
