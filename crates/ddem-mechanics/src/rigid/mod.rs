//! One rigid block, its mass properties and its pose (§8): formulas of a block, without mesh or
//! loop over blocks.
//!
//! The eight corners of a rigid block have displacements and velocities like any node, and most
//! forces act on them. This module has the six degrees of freedom behind them. The angular momentum
//! is stored in space axes, so that only a torque changes it. The rotation is a quaternion.

mod constraint;
mod corners;
mod field;
mod fit;

use nalgebra::{Matrix3, Quaternion, SymmetricEigen, UnitQuaternion, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use crate::math::leapfrog::coefficients;

pub use constraint::RigidConstraint;
pub use corners::CornerMoments;
use corners::PartCorners;
pub use field::{CornerArms, LinearField, SpatialLanes, resultants, set_at_corners};

/// Mass, inertia and shape of a rigid block.
#[derive(Clone, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass `[kg]`.
    pub mass: f64,
    /// Half edge vectors at rest `[m]`.
    pub half: [Vector3<f64>; 3],
    /// Inertia about the centroid at rest, `∫ (x² 1 − x xᵀ) ρ dV` `[kg m²]`.
    pub inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
    /// Translational stiffness of all its joints along each axis `[N/m]`.
    pub stiffness: Vector3<f64>,
    /// Corners of a part of a rigid body; `None` if they are those of the half edges.
    part: Option<Box<PartCorners>>,
}

/// Position and motion of a rigid block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Displacement of the centroid `[m]`.
    pub shift: Vector3<f64>,
    /// Rotation from the reference position.
    pub turn: UnitQuaternion<f64>,
    /// Velocity of the centroid `[m/s]`.
    pub velocity: Vector3<f64>,
    /// Angular momentum in space axes `[kg m²/s]`.
    pub momentum: Vector3<f64>,
}

/// A force and its torque about the centroid, or a velocity and an angular velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpatialVector {
    /// Force `[N]` or velocity `[m/s]`.
    pub linear: Vector3<f64>,
    /// Torque `[N m]` or angular velocity `[rad/s]`.
    pub angular: Vector3<f64>,
}

impl SpatialVector {
    /// All six components, the linear ones first.
    #[inline]
    pub fn to_vector(self) -> Vector6<f64> {
        let Self { linear: a, angular: b } = self;
        Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
    }

    /// Spatial vector of six components, the linear ones first.
    #[inline]
    pub fn from_vector(v: &Vector6<f64>) -> Self {
        Self { linear: v.fixed_rows::<3>(0).into(), angular: v.fixed_rows::<3>(3).into() }
    }
}

/// Motion of a rigid block in one step.
#[derive(Clone, Copy, Debug)]
pub struct RigidIncrement {
    turn: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    time_step: f64,
}

/// Coefficients of a rigid block's step (M2), `v⁺ = a v + b F`, for the translation along each axis
/// and for the angular momentum.
#[derive(Clone, Copy, Debug)]
pub struct RigidCoefficients {
    /// Time h between the half steps before and after `[s]`.
    pub interval: f64,
    /// Damping rates `c/m` of the translation along each axis and of the rotation `[1/s]`.
    pub rates: [f64; 4],
}

impl MassProperties {
    /// Mass properties of a parallelepiped with these edges.
    #[inline]
    pub fn new(mass: f64, edges: [Vector3<f64>; 3], stiffness: Vector3<f64>) -> Self {
        let half = edges.map(|edge| edge * 0.5);
        let inertia = turned_spread(half) * (mass / 3.0);
        // A block without volume cannot rotate; NaN stops the run at once.
        let inverse = inertia.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        Self { mass, half, inertia, inverse, stiffness, part: None }
    }

    /// Mass properties of the parallelepiped with an inertia about the centre of mass `[kg m²]`.
    #[must_use]
    pub fn with_inertia(mass: f64, inertia: &Matrix3<f64>, stiffness: Vector3<f64>) -> Self {
        let moment = Matrix3::identity() * (0.5 * inertia.trace()) - inertia;
        let SymmetricEigen { eigenvalues, eigenvectors } = moment.symmetric_eigen();
        let edge = |k: usize| {
            eigenvectors.column(k).into_owned() * (12.0 * eigenvalues[k].max(0.0) / mass).sqrt()
        };
        Self::new(mass, [edge(0), edge(1), edge(2)], stiffness)
    }

    /// Vector from the centre of mass to a corner at rest `[m]`. Bit d of its number is set at the
    /// upper end of edge d.
    #[inline]
    pub fn arm(&self, corner: usize) -> Vector3<f64> {
        if let Some(part) = &self.part {
            return part.arms[corner];
        }
        let sign = |d: usize| if corner >> d & 1 == 1 { 1.0 } else { -1.0 };
        self.half[0] * sign(0) + self.half[1] * sign(1) + self.half[2] * sign(2)
    }

    /// Angular velocity for an angular momentum at a rotation `[rad/s]`.
    #[inline]
    pub fn angular_velocity(
        &self,
        turn: &UnitQuaternion<f64>,
        momentum: Vector3<f64>,
    ) -> Vector3<f64> {
        turn * (self.inverse * turn.inverse_transform_vector(&momentum))
    }

    /// Angular momentum for an angular velocity at a rotation `[kg m²/s]`.
    #[inline]
    pub fn momentum(&self, turn: &UnitQuaternion<f64>, spin: Vector3<f64>) -> Vector3<f64> {
        turn * (self.inertia * turn.inverse_transform_vector(&spin))
    }

    /// Corner forces `f_i = g + θ × r_i` that are equivalent to a wrench, given by g and θ. Equal
    /// masses at the eight corners have three times the inertia of the block. The forces on a part of
    /// a body are equivalent together with those on all other parts.
    #[inline]
    pub fn corner_forces(
        &self,
        turn: &UnitQuaternion<f64>,
        wrench: SpatialVector,
    ) -> SpatialVector {
        if let Some(part) = &self.part {
            return part.forces(turn, wrench);
        }
        let angular = self.angular_velocity(turn, wrench.angular) * (self.mass / 24.0);
        SpatialVector { linear: wrench.linear / 8.0, angular }
    }

    /// Square root `I^{-½}` of the inverse inertia. It scales rotations so that all have the same
    /// inertia.
    #[inline]
    pub fn inverse_root(&self) -> Matrix3<f64> {
        let SymmetricEigen { eigenvalues, eigenvectors } = self.inverse.symmetric_eigen();
        let roots = eigenvalues.map(|value| value.max(0.0).sqrt());
        eigenvectors * Matrix3::from_diagonal(&roots) * eigenvectors.transpose()
    }

    /// Length that makes torques comparable with forces `[m]`.
    #[inline]
    pub fn size(&self) -> f64 {
        (self.half.iter().map(Vector3::norm_squared).sum::<f64>() / 3.0).sqrt()
    }
}

/// Matrix `Σ_d (|h_d|² 1 − h_d h_dᵀ)` of the half edges.
fn turned_spread(half: [Vector3<f64>; 3]) -> Matrix3<f64> {
    let moment: Matrix3<f64> = half.iter().map(|h| h * h.transpose()).sum();
    Matrix3::identity() * moment.trace() - moment
}

/// Displacement `(R − 1) x` by a rotation, accurate relative to its own size.
#[inline]
pub fn turned_away(turn: &UnitQuaternion<f64>, x: &Vector3<f64>) -> Vector3<f64> {
    let axis = turn.vector();
    let twice = axis.cross(x) * 2.0;
    twice * turn.w + axis.cross(&twice)
}

/// Matrix `R − 1` of a rotation, accurate relative to its own size.
#[inline]
pub fn minus_identity(turn: &UnitQuaternion<f64>) -> Matrix3<f64> {
    let axis = turn.vector().into_owned();
    let across = axis * axis.transpose() - Matrix3::from_diagonal_element(axis.norm_squared());
    (across + axis.cross_matrix() * turn.w) * 2.0
}

/// Rotation by a rotation vector, accurate at any length.
fn turn_by(rotation: Vector3<f64>) -> UnitQuaternion<f64> {
    let half = 0.25 * rotation.norm_squared();
    // cos x and sin x / x from x², by series for small x.
    let (cos, sinc) = if half < 1e-3 {
        let cos =
            1.0 - half / 2.0 * (1.0 - half / 12.0 * (1.0 - half / 30.0 * (1.0 - half / 56.0)));
        let sinc =
            1.0 - half / 6.0 * (1.0 - half / 20.0 * (1.0 - half / 42.0 * (1.0 - half / 72.0)));
        (cos, sinc)
    } else {
        let angle = half.sqrt();
        (libm::cos(angle), libm::sin(angle) / angle)
    };
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, rotation * (0.5 * sinc)))
}

impl Pose {
    /// Pose with zero velocity and momentum.
    #[inline]
    pub fn resting(self) -> Self {
        Self { velocity: Vector3::zeros(), momentum: Vector3::zeros(), ..self }
    }

    /// Displacement of the corner at an arm `[m]`.
    #[inline]
    pub fn displacement(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.shift + turned_away(&self.turn, arm)
    }

    /// Velocity and angular velocity.
    #[inline]
    pub fn twist(&self, mass_properties: &MassProperties) -> SpatialVector {
        SpatialVector {
            linear: self.velocity,
            angular: mass_properties.angular_velocity(&self.turn, self.momentum),
        }
    }

    /// Pose with the velocities after a step under a wrench.
    #[inline]
    pub fn accelerated(
        &self,
        mass_properties: &MassProperties,
        coefficients: &RigidCoefficients,
        wrench: &SpatialVector,
    ) -> Self {
        let mut next = *self;
        for k in 0..3 {
            let [keep, push] = coefficients.coefficients(coefficients.rates[k]);
            next.velocity[k] =
                keep * self.velocity[k] + push / mass_properties.mass * wrench.linear[k];
        }
        let [keep, push] = coefficients.coefficients(coefficients.rates[3]);
        next.momentum = self.momentum * keep + wrench.angular * push;
        next
    }

    /// Pose after a time step, and the motion in it. The block rotates about the axis of its
    /// angular velocity at half time. The scheme is leap-frog, of second order, and conserves
    /// momentum exactly.
    #[inline]
    pub fn moved(
        &self,
        mass_properties: &MassProperties,
        time_step: f64,
    ) -> (Self, RigidIncrement) {
        let mut spin = mass_properties.angular_velocity(&self.turn, self.momentum);
        // Each iteration for the state at half time reduces the error by (ω Δt)².
        for _ in 0..4 {
            let halfway = turn_by(spin * (0.5 * time_step)) * self.turn;
            spin = mass_properties.angular_velocity(&halfway, self.momentum);
        }
        let du =
            RigidIncrement { turn: turn_by(spin * time_step), velocity: self.velocity, time_step };
        (self.along(&du), du)
    }

    /// Pose after an increment.
    fn along(&self, du: &RigidIncrement) -> Self {
        let turn = (du.turn * self.turn).into_inner();
        Self {
            shift: self.shift + du.velocity * du.time_step,
            turn: UnitQuaternion::new_unchecked(renormalised(turn)),
            ..*self
        }
    }

    /// Pose rotated for a time at the angular velocity of its momentum.
    #[inline]
    pub fn turned_on(&self, mass_properties: &MassProperties, time: f64) -> Self {
        let spin = mass_properties.angular_velocity(&self.turn, self.momentum);
        Self { turn: turn_by(spin * time) * self.turn, ..*self }
    }

    /// Pose with velocities interpolated towards those of another pose.
    #[inline]
    pub fn between(&self, other: &Self, fraction: f64) -> Self {
        Self {
            velocity: self.velocity * (1.0 - fraction) + other.velocity * fraction,
            momentum: self.momentum * (1.0 - fraction) + other.momentum * fraction,
            ..*self
        }
    }

    /// Pose with the velocities of another pose minus its own.
    #[inline]
    pub fn plus_velocities(&self, other: &Self) -> Self {
        let velocity = other.velocity - self.velocity;
        Self { velocity, momentum: other.momentum - self.momentum, ..*self }
    }

    /// Kinetic energy `½ v⁻ m v⁺` of translation and rotation, from this pose before and another
    /// pose after `[J]`.
    #[inline]
    pub fn kinetic(&self, after: &Self, mass_properties: &MassProperties) -> f64 {
        let shift = mass_properties.mass * self.velocity.dot(&after.velocity);
        let spin = mass_properties.angular_velocity(&self.turn, self.momentum).dot(&after.momentum);
        0.5 * (shift + spin)
    }
}

impl RigidIncrement {
    /// Mean velocities of the corners: their displacements over the time step `[m/s]`. `turn` is the
    /// rotation before the step.
    #[inline]
    pub fn velocities(&self, turn: &UnitQuaternion<f64>) -> LinearField {
        let rotation = turn.to_rotation_matrix().into_inner();
        let gradient = minus_identity(&self.turn) * rotation / self.time_step;
        LinearField { value: self.velocity, gradient }
    }
}

/// Quaternion scaled to unit length by one Newton step, so that rounding errors do not accumulate.
fn renormalised(q: Quaternion<f64>) -> Quaternion<f64> {
    q * (1.5 - 0.5 * q.norm_squared())
}

impl RigidCoefficients {
    /// Coefficients `a` and `b` for a unit mass at a damping rate.
    #[inline]
    pub fn coefficients(&self, rate: f64) -> [f64; 2] {
        coefficients(1.0 / self.interval, rate)
    }

    /// Velocities that a wrench adds in one step.
    #[inline]
    pub fn accelerations(
        &self,
        mass_properties: &MassProperties,
        turn: &UnitQuaternion<f64>,
        w: &SpatialVector,
    ) -> SpatialVector {
        let push = |k: usize| self.coefficients(self.rates[k])[1];
        let linear = Vector3::from([0, 1, 2].map(|k| push(k) / mass_properties.mass * w.linear[k]));
        SpatialVector {
            linear,
            angular: mass_properties.angular_velocity(turn, w.angular) * push(3),
        }
    }
}

#[cfg(test)]
mod tests;
