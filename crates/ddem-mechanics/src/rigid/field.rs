//! Linear fields at the corners of four rigid blocks side by side (§8).

use fearless_simd::Simd;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{Pose, SpatialVector, minus_identity};
use crate::math::lanes::{LANES, Lanes, Matrix, add, cross, load, load_at, store_at, times, zero};

/// Vectors from the centroids of four blocks to their corners at rest `[m]`.
pub type CornerArms = [[Lanes; 3]; 8];

/// Field `v + G r` on a block, with the vectors r from its centroid, or another point, at rest.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinearField {
    /// Value v at that point.
    pub value: Vector3<f64>,
    /// Gradient G.
    pub gradient: Matrix3<f64>,
}

/// Spatial vectors of four blocks.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpatialLanes {
    /// Forces `[N]`, or sums of velocities `[m/s]`.
    pub linear: [Lanes; 3],
    /// Torques `[N m]`, or moments of velocities `[m²/s]`.
    pub angular: [Lanes; 3],
}

impl SpatialLanes {
    /// Spatial vector of the block in a lane.
    #[inline]
    pub fn of(&self, lane: usize) -> SpatialVector {
        let own = |v: &[Lanes; 3]| Vector3::from(v.map(|c| c.0[lane]));
        SpatialVector { linear: own(&self.linear), angular: own(&self.angular) }
    }
}

impl LinearField {
    /// Velocities or forces `v + ω × R r` at a rotation R.
    #[inline]
    pub fn of_twist(twist: SpatialVector, turn: &UnitQuaternion<f64>) -> Self {
        let rotation = turn.to_rotation_matrix().into_inner();
        Self { value: twist.linear, gradient: twist.angular.cross_matrix() * rotation }
    }

    /// Displacements in a pose.
    #[inline]
    pub fn of_pose(pose: &Pose) -> Self {
        Self { value: pose.shift, gradient: minus_identity(&pose.turn) }
    }

    /// Value at the end of a vector at rest.
    #[inline]
    pub fn at(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.value + self.gradient * arm
    }
}

/// Sets a nodal field to the fields of four blocks, with vectors r from their centroids.
#[inline(always)]
pub fn set_at_corners<S: Simd>(
    simd: S,
    arms: &CornerArms,
    fields: &[LinearField; LANES],
    out: &mut [Lanes],
) {
    let value = [0, 1, 2].map(|c| Lanes(fields.map(|field| field.value[c])).load(simd));
    let gradient: Matrix<S> = [0, 1, 2]
        .map(|i| [0, 1, 2].map(|k| Lanes(fields.map(|field| field.gradient[(i, k)])).load(simd)));
    for (corner, arm) in arms.iter().enumerate() {
        store_at(out, 3 * corner, add(value, times(&gradient, load(simd, arm))));
    }
}

/// Sums `Σ f` and `Σ R r × f` over the corners of four blocks with the rotations R.
#[inline(always)]
pub fn resultants<S: Simd>(
    simd: S,
    arms: &CornerArms,
    rotation: &Matrix<S>,
    f: &[Lanes],
) -> SpatialLanes {
    let [mut force, mut torque] = [zero(simd); 2];
    for (corner, arm) in arms.iter().enumerate() {
        let on = load_at(simd, f, 3 * corner);
        force = add(force, on);
        torque = add(torque, cross(times(rotation, load(simd, arm)), on));
    }
    SpatialLanes { linear: force.map(Lanes::from), angular: torque.map(Lanes::from) }
}
