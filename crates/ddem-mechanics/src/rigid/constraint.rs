//! Constraint of a rigid block's six degrees of freedom by supports at its corners.
//!
//! A support prescribes the velocity of one corner along one axis, `e·v + (r × e)·ω`. The supports
//! of a block span a subspace of its motions. In this subspace they prescribe the velocity and
//! exert the reaction that it needs, as at any node. The other motions are free.

use nalgebra::{Matrix6, SymmetricEigen, UnitQuaternion, Vector3, Vector6};

use super::{MassProperties, RigidCoefficients, SpatialVector};

/// Fraction of the largest eigenvalue below which a motion is free.
const NOTHING: f64 = 1e-9;

/// Held motions and their prescribed velocities. Rotations are scaled by the size of the block.
#[derive(Clone, Debug)]
pub struct RigidConstraint {
    /// Orthonormal motions; the first `count` of them are held.
    motions: [Vector6<f64>; 6],
    count: usize,
    /// Pseudoinverse `(Σ c cᵀ)⁺` over the rows c of the supports.
    inverse: Matrix6<f64>,
    /// Velocities nearest to the prescribed ones.
    target: Vector6<f64>,
    size: f64,
}

impl RigidConstraint {
    /// Constraint by supports, each with its arm, axis and velocity; `None` without supports.
    #[inline]
    pub fn new(
        size: f64,
        supports: impl Iterator<Item = (Vector3<f64>, usize, f64)>,
    ) -> Option<Self> {
        let (mut gram, mut asked) = (Matrix6::zeros(), Vector6::zeros());
        for (arm, axis, velocity) in supports {
            let row = row(size, arm, axis);
            gram += row * row.transpose();
            asked += row * velocity;
        }
        if gram == Matrix6::zeros() {
            return None;
        }
        let SymmetricEigen { eigenvalues, eigenvectors } = gram.symmetric_eigen();
        let least = NOTHING * eigenvalues.max();
        let (mut motions, mut count) = ([Vector6::zeros(); 6], 0);
        let mut inverse = Matrix6::zeros();
        for (value, vector) in eigenvalues.iter().zip(eigenvectors.column_iter()) {
            if *value > least {
                motions[count] = vector.into_owned();
                inverse += vector * vector.transpose() / *value;
                count += 1;
            }
        }
        Some(Self { motions, count, inverse, target: inverse * asked, size })
    }

    /// True if all six motions are held.
    pub(super) fn is_whole(&self) -> bool {
        self.count == 6
    }

    /// Velocities nearest to the prescribed ones.
    #[inline]
    pub fn target(&self) -> SpatialVector {
        self.velocity(self.target)
    }

    /// Wrench with which held motions reach the target under (M2). `free` are the velocities at the
    /// end of the step without it.
    #[inline]
    pub fn reaction_wrench(
        &self,
        mass_properties: &MassProperties,
        coefficients: &RigidCoefficients,
        turn: &UnitQuaternion<f64>,
        free: SpatialVector,
    ) -> SpatialVector {
        let missing = self.target - self.scaled(free);
        let added = |k: usize| {
            let wrench = self.force(self.motions[k]);
            self.scaled(coefficients.accelerations(mass_properties, turn, &wrench))
        };
        let added: [Vector6<f64>; 6] = std::array::from_fn(added);
        // A unit diagonal decouples the motions that are not held.
        let matrix = Matrix6::from_fn(|i, k| match (i < self.count && k < self.count, i == k) {
            (true, _) => self.motions[i].dot(&added[k]),
            (false, same) => f64::from(u8::from(same)),
        });
        let required = Vector6::from_fn(|i, _| self.motions[i].dot(&missing));
        // Held motions are independent; otherwise NaN stops the run.
        let parts = matrix.lu().solve(&required).unwrap_or_else(|| Vector6::repeat(f64::NAN));
        let sum = (0..self.count).map(|k| self.motions[k] * parts[k]).sum();
        self.force(sum)
    }

    /// Part of a reaction wrench that the support with this arm and axis carries `[N]`.
    #[inline]
    pub fn reaction(&self, answer: SpatialVector, arm: Vector3<f64>, axis: usize) -> f64 {
        let scaled = self.scaled_wrench(answer);
        row(self.size, arm, axis).dot(&(self.inverse * scaled))
    }

    /// Velocities with the held motions set to their targets, so that rounding causes no drift.
    #[inline]
    pub fn enforce(&self, twist: SpatialVector) -> SpatialVector {
        if self.is_whole() {
            return self.target();
        }
        let mut scaled = self.scaled(twist);
        for motion in &self.motions[..self.count] {
            scaled += motion * motion.dot(&(self.target - scaled));
        }
        self.velocity(scaled)
    }

    /// Projection onto the motions that are not held. Rotations are scaled by the size of the
    /// block.
    #[inline]
    pub fn free(&self) -> Matrix6<f64> {
        let held = self.motions[..self.count].iter();
        Matrix6::identity() - held.map(|motion| motion * motion.transpose()).sum::<Matrix6<f64>>()
    }

    /// Wrench without its part on held motions.
    #[inline]
    pub fn without(&self, wrench: SpatialVector) -> SpatialVector {
        let mut scaled = self.scaled_wrench(wrench);
        for motion in &self.motions[..self.count] {
            scaled -= motion * motion.dot(&scaled);
        }
        self.force(scaled)
    }

    fn scaled(&self, twist: SpatialVector) -> Vector6<f64> {
        SpatialVector { angular: twist.angular * self.size, ..twist }.to_vector()
    }

    fn scaled_wrench(&self, wrench: SpatialVector) -> Vector6<f64> {
        SpatialVector { angular: wrench.angular / self.size, ..wrench }.to_vector()
    }

    fn velocity(&self, scaled: Vector6<f64>) -> SpatialVector {
        let SpatialVector { linear, angular } = SpatialVector::from_vector(&scaled);
        SpatialVector { linear, angular: angular / self.size }
    }

    fn force(&self, scaled: Vector6<f64>) -> SpatialVector {
        let SpatialVector { linear, angular } = SpatialVector::from_vector(&scaled);
        SpatialVector { linear, angular: angular * self.size }
    }
}

/// Row `(e, r × e / size)` of a support.
fn row(size: f64, arm: Vector3<f64>, axis: usize) -> Vector6<f64> {
    let along = Vector3::ith(axis, 1.0);
    SpatialVector { linear: along, angular: arm.cross(&along) / size }.to_vector()
}
