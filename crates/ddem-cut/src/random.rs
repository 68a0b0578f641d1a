//! Random numbers that are the same on every platform.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Stream of random numbers of one cut.
#[derive(Clone, Debug)]
pub struct RandomStream(ChaCha8Rng);

impl RandomStream {
    /// Stream of a seed and a number; streams with other numbers are independent.
    #[must_use]
    pub fn new(seed: u64, number: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut generator = ChaCha8Rng::from_seed(key);
        generator.set_stream(number);
        Self(generator)
    }

    /// Number from 0, included, to 1, excluded.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Number with mean 0 and standard deviation 1 of the normal distribution.
    pub fn normal(&mut self) -> f64 {
        let (radius, angle) = (self.uniform(), self.uniform());
        libm::sqrt(-2.0 * libm::log(1.0 - radius)) * libm::cos(std::f64::consts::TAU * angle)
    }

    /// Number of random events of which a given number is expected: Poisson's law.
    pub fn poisson(&mut self, expected: f64) -> usize {
        // Distances between events are exponential.
        let mut next = || -libm::log(1.0 - self.uniform());
        let (mut number, mut sum) = (0, next());
        while sum < expected {
            number += 1;
            sum += next();
        }
        number
    }

    /// Unit vector of the Fisher distribution with concentration κ around a unit vector.
    pub fn fisher(&mut self, mean: &Vector3<f64>, concentration: f64) -> Vector3<f64> {
        let (share, angle) = (self.uniform(), std::f64::consts::TAU * self.uniform());
        let cosine = fisher_cosine(concentration, share);
        let sine = libm::sqrt((1.0 - cosine * cosine).max(0.0));
        let [first, second] = across(mean);
        let (sin, cos) = libm::sincos(angle);
        mean * cosine + (first * cos + second * sin) * sine
    }
}

/// Cosine of the angle to the mean that a share `1 − u` of the Fisher distribution does not exceed.
pub(crate) fn fisher_cosine(concentration: f64, u: f64) -> f64 {
    // Small concentrations lose all digits in `u + (1 − u) exp(−2κ)`.
    let less = (1.0 - u) * libm::expm1(-2.0 * concentration);
    (1.0 + libm::log1p(less) / concentration).clamp(-1.0, 1.0)
}

/// Two unit vectors that form a right-handed triad with a unit vector, `first × second = vector`.
pub(crate) fn across(vector: &Vector3<f64>) -> [Vector3<f64>; 2] {
    // The axis along the smallest part is far from parallel.
    let axis = Vector3::ith(vector.iamin(), 1.0);
    let first = axis.cross(vector).normalize();
    [first, vector.cross(&first)]
}
