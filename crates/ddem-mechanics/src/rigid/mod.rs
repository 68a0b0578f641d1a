//! §8: one rigid block, its matter and its pose. Formulas of a block; no mesh, no loop over blocks.
//!
//! A rigid block is carried by its eight corners, which have displacements and velocities like any
//! node: what acts on it acts on them. Here are the six degrees of freedom behind them. The momentum
//! of the turning is kept in space, so that nothing but a torque changes it, and the turn is a
//! quaternion.

mod constraint;
mod fit;

use nalgebra::{Matrix3, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::math::leapfrog::coefficients;

pub use constraint::RigidConstraint;

/// Mass, inertia and shape of a rigid block.
#[derive(Clone, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass `[kg]`.
    pub mass: f64,
    /// Half of the three edges at rest `[m]`.
    pub half: [Vector3<f64>; 3],
    /// Inertia about the centroid at rest, `∫ (x² 1 − x xᵀ) ρ dV` `[kg m²]`.
    pub inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
    /// Stiffness of all its joints against a shift along each axis `[N/m]`.
    pub stiffness: Vector3<f64>,
}

/// Position and motion of a rigid block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Displacement of the centroid `[m]`.
    pub shift: Vector3<f64>,
    /// Turn from the reference position.
    pub turn: UnitQuaternion<f64>,
    /// Velocity of the centroid `[m/s]`.
    pub velocity: Vector3<f64>,
    /// Momentum of the turning, in space `[kg m²/s]`.
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

/// Motion of a rigid block in one step.
#[derive(Clone, Copy, Debug)]
pub struct RigidIncrement {
    turn: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    time_step: f64,
}

/// Coefficients of a rigid block's step, (M2): `v⁺ = a v + b F`, for the translation along each axis and for the
/// angular momentum.
#[derive(Clone, Copy, Debug)]
pub struct RigidCoefficients {
    /// h, the time between the half steps before and after `[s]`.
    pub interval: f64,
    /// Damping `c/m` of the shift along each axis and of the turning `[1/s]`.
    pub rates: [f64; 4],
}

impl MassProperties {
    /// Of a parallelepiped with these edges.
    #[inline]
    pub fn new(mass: f64, edges: [Vector3<f64>; 3], stiffness: Vector3<f64>) -> Self {
        let half = edges.map(|edge| edge * 0.5);
        let inertia = turned_spread(half) * (mass / 3.0);
        // A block without volume cannot turn: a run with one diverges at once.
        let inverse = inertia.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        Self { mass, half, inertia, inverse, stiffness }
    }

    /// From the centroid to a corner at rest (bit d: at the upper end of edge d) `[m]`.
    #[inline]
    pub fn arm(&self, corner: usize) -> Vector3<f64> {
        let sign = |d: usize| if corner >> d & 1 == 1 { 1.0 } else { -1.0 };
        self.half[0] * sign(0) + self.half[1] * sign(1) + self.half[2] * sign(2)
    }

    /// Angular velocity of a momentum of turning at a turn.
    #[inline]
    pub fn angular_velocity(
        &self,
        turn: &UnitQuaternion<f64>,
        momentum: Vector3<f64>,
    ) -> Vector3<f64> {
        turn * (self.inverse * turn.inverse_transform_vector(&momentum))
    }

    /// Angular momentum at a rotation, of an angular velocity.
    #[inline]
    pub fn momentum(&self, turn: &UnitQuaternion<f64>, spin: Vector3<f64>) -> Vector3<f64> {
        turn * (self.inertia * turn.inverse_transform_vector(&spin))
    }

    /// Forces on the corners, `f_i = F/8 + θ × r_i`, that are equivalent to a wrench: θ such that
    /// their torque is right. Eight corners resist turning three times as much as the block.
    #[inline]
    pub fn corner_forces(
        &self,
        turn: &UnitQuaternion<f64>,
        wrench: SpatialVector,
    ) -> SpatialVector {
        let angular = self.angular_velocity(turn, wrench.angular) * (self.mass / 24.0);
        SpatialVector { linear: wrench.linear / 8.0, angular }
    }

    /// `I^{-½}`: turns in which every momentum weighs the same.
    #[inline]
    pub fn inverse_root(&self) -> Matrix3<f64> {
        let SymmetricEigen { eigenvalues, eigenvectors } = self.inverse.symmetric_eigen();
        let roots = eigenvalues.map(|value| value.max(0.0).sqrt());
        eigenvectors * Matrix3::from_diagonal(&roots) * eigenvectors.transpose()
    }

    /// Length that makes torques comparable to forces `[m]`.
    #[inline]
    pub fn size(&self) -> f64 {
        (self.half.iter().map(Vector3::norm_squared).sum::<f64>() / 3.0).sqrt()
    }
}

/// `Σ_d (|h_d|² 1 − h_d h_dᵀ)`.
fn turned_spread(half: [Vector3<f64>; 3]) -> Matrix3<f64> {
    let moment: Matrix3<f64> = half.iter().map(|h| h * h.transpose()).sum();
    Matrix3::identity() * moment.trace() - moment
}

/// `(R − 1) x`, to rounding of itself.
#[inline]
pub fn turned_away(turn: &UnitQuaternion<f64>, x: &Vector3<f64>) -> Vector3<f64> {
    let axis = turn.vector();
    let twice = axis.cross(x) * 2.0;
    twice * turn.w + axis.cross(&twice)
}

/// The turn by a rotation vector, however short.
fn turn_by(rotation: Vector3<f64>) -> UnitQuaternion<f64> {
    let half = 0.25 * rotation.norm_squared();
    // cos x and sin x / x from x².
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
    /// The pose at rest.
    #[inline]
    pub fn resting(self) -> Self {
        Self { velocity: Vector3::zeros(), momentum: Vector3::zeros(), ..self }
    }

    /// Displacement of a corner `[m]`.
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

    /// Velocities after a step under a wrench.
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

    /// Pose after a time, and the motion there: the block turns about the axis of its angular velocity at
    /// half time. Leap-frog: second order, and momentum is kept exactly.
    #[inline]
    pub fn moved(
        &self,
        mass_properties: &MassProperties,
        time_step: f64,
    ) -> (Self, RigidIncrement) {
        let mut spin = mass_properties.angular_velocity(&self.turn, self.momentum);
        // Halfway there is found in a few rounds: each is better by (ω Δt)².
        for _ in 0..4 {
            let halfway = turn_by(spin * (0.5 * time_step)) * self.turn;
            spin = mass_properties.angular_velocity(&halfway, self.momentum);
        }
        let du =
            RigidIncrement { turn: turn_by(spin * time_step), velocity: self.velocity, time_step };
        (self.along(&du), du)
    }

    /// The pose after a way.
    fn along(&self, du: &RigidIncrement) -> Self {
        let turn = (du.turn * self.turn).into_inner();
        Self {
            shift: self.shift + du.velocity * du.time_step,
            turn: UnitQuaternion::new_unchecked(renormalised(turn)),
            ..*self
        }
    }

    /// Turned on by a time, with the momentum it has.
    #[inline]
    pub fn turned_on(&self, mass_properties: &MassProperties, time: f64) -> Self {
        let spin = mass_properties.angular_velocity(&self.turn, self.momentum);
        Self { turn: turn_by(spin * time) * self.turn, ..*self }
    }

    /// The pose with velocities interpolated towards those of another.
    #[inline]
    pub fn between(&self, other: &Self, part: f64) -> Self {
        Self {
            velocity: self.velocity * (1.0 - part) + other.velocity * part,
            momentum: self.momentum * (1.0 - part) + other.momentum * part,
            ..*self
        }
    }

    /// The pose with the difference of another's velocities to its own.
    #[inline]
    pub fn plus_velocities(&self, other: &Self) -> Self {
        let velocity = other.velocity - self.velocity;
        Self { velocity, momentum: other.momentum - self.momentum, ..*self }
    }

    /// `½ v⁻ m v⁺` and the same of the turning, of this pose before and another after.
    #[inline]
    pub fn kinetic(&self, after: &Self, mass_properties: &MassProperties) -> f64 {
        let shift = mass_properties.mass * self.velocity.dot(&after.velocity);
        let spin = mass_properties.angular_velocity(&self.turn, self.momentum).dot(&after.momentum);
        0.5 * (shift + spin)
    }
}

impl RigidIncrement {
    /// Mean velocity of the point at an arm before: its displacement over the time.
    #[inline]
    pub fn velocity(&self, arm: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + turned_away(&self.turn, arm) / self.time_step
    }
}

/// Unit length again, by one step of Newton's: what rounding adds never grows.
fn renormalised(q: Quaternion<f64>) -> Quaternion<f64> {
    q * (1.5 - 0.5 * q.norm_squared())
}

impl RigidCoefficients {
    /// Coefficients `a` and `b` for a unit mass at a damping rate.
    #[inline]
    pub fn coefficients(&self, rate: f64) -> [f64; 2] {
        coefficients(1.0 / self.interval, rate)
    }

    /// Accelerations that a wrench would make count: velocities that it adds.
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
