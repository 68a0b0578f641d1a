//! Constraint of a rigid block's six degrees of freedom by supports at its corners.
//!
//! A support asks for the velocity of one corner along one axis, `e·v + (r × e)·ω`. All that the
//! supports of a block ask for span a part of its motions; there they prescribe the velocity and
//! answer with what is missing, as at any node, and the rest of the motions is free.

use nalgebra::{Matrix6, SymmetricEigen, UnitQuaternion, Vector3, Vector6};

use super::{MassProperties, RigidCoefficients, SpatialVector};

/// Part of the largest eigenvalue below which a motion is not held.
const NOTHING: f64 = 1e-9;

/// The motions that are held, and what is asked of them. Turns count with the size of the block.
#[derive(Clone, Debug)]
pub struct RigidConstraint {
    /// Orthonormal motions, the first `count` of them held.
    motions: [Vector6<f64>; 6],
    count: usize,
    /// `(Σ c cᵀ)⁺` over the supports.
    inverse: Matrix6<f64>,
    /// The velocities that come nearest to what is asked.
    target: Vector6<f64>,
    size: f64,
}

impl RigidConstraint {
    /// Of supports, each with its arm, axis and velocity; `None` without any.
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

    /// Every motion is held.
    pub(super) fn is_whole(&self) -> bool {
        self.count == 6
    }

    /// The velocities nearest to what is asked.
    #[inline]
    pub fn target(&self) -> SpatialVector {
        self.velocity(self.target)
    }

    /// The wrench that makes held motions reach the target under (M2), given the velocities that
    /// the step would end with without it.
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
        // Motions that are not held stay out with a unit diagonal.
        let matrix = Matrix6::from_fn(|i, k| match (i < self.count && k < self.count, i == k) {
            (true, _) => self.motions[i].dot(&added[k]),
            (false, same) => f64::from(u8::from(same)),
        });
        let wanted = Vector6::from_fn(|i, _| self.motions[i].dot(&missing));
        // Held motions are independent of each other; were they not, the run would stop.
        let parts = matrix.lu().solve(&wanted).unwrap_or_else(|| Vector6::repeat(f64::NAN));
        let sum = (0..self.count).map(|k| self.motions[k] * parts[k]).sum();
        self.force(sum)
    }

    /// Part of an answering wrench that the support with this arm and axis bears `[N]`.
    #[inline]
    pub fn reaction(&self, answer: SpatialVector, arm: Vector3<f64>, axis: usize) -> f64 {
        let SpatialVector { linear, angular } = answer;
        let scaled = joined(linear, angular / self.size);
        row(self.size, arm, axis).dot(&(self.inverse * scaled))
    }

    /// Velocities with the held motions as they are asked for: no rounding lets them creep.
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

    /// The projection on motions that are not held; turns count with the size of the block.
    #[inline]
    pub fn free(&self) -> Matrix6<f64> {
        let held = self.motions[..self.count].iter();
        Matrix6::identity() - held.map(|motion| motion * motion.transpose()).sum::<Matrix6<f64>>()
    }

    /// A wrench without what acts on held motions.
    #[inline]
    pub fn without(&self, wrench: SpatialVector) -> SpatialVector {
        let mut scaled = joined(wrench.linear, wrench.angular / self.size);
        for motion in &self.motions[..self.count] {
            scaled -= motion * motion.dot(&scaled);
        }
        self.force(scaled)
    }

    fn scaled(&self, twist: SpatialVector) -> Vector6<f64> {
        joined(twist.linear, twist.angular * self.size)
    }

    fn velocity(&self, scaled: Vector6<f64>) -> SpatialVector {
        let (linear, angular) = parted(scaled);
        SpatialVector { linear, angular: angular / self.size }
    }

    fn force(&self, scaled: Vector6<f64>) -> SpatialVector {
        let (linear, angular) = parted(scaled);
        SpatialVector { linear, angular: angular * self.size }
    }
}

/// `(e, r × e / size)`.
fn row(size: f64, arm: Vector3<f64>, axis: usize) -> Vector6<f64> {
    let along = Vector3::ith(axis, 1.0);
    joined(along, arm.cross(&along) / size)
}

fn joined(a: Vector3<f64>, b: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

fn parted(v: Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]))
}
