//! Sets of joints: planes at distances along a mean normal.

use nalgebra::Vector3;

use crate::plane::CutPlane;
use crate::random::{RandomStream, fisher_cosine};

/// Share of the planes whose tilt is larger than the range of distances allows for. Such a plane may
/// be missing if it starts far outside of the region.
const RARE: f64 = 0.01;

/// Number of the stream of the gap around the origin for the first cut. Lower ones belong to the
/// sides of the origin.
const GAP_STREAM: u64 = 1 << 40;

/// Set of joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSet {
    /// Mean unit normal.
    pub normal: Vector3<f64>,
    /// Concentration κ of the Fisher distribution of the normals; `None` if planes are parallel.
    pub fisher: Option<f64>,
    /// Distances between planes along the mean normal.
    pub spacing: Spacing,
    /// Point on the first plane, or for exponential distances on the line along which they count
    /// `[m]`.
    pub origin: Vector3<f64>,
}

/// Distances between the planes of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spacing {
    /// The same distance everywhere `[m]`.
    Constant(f64),
    /// All distances within `mean ± spread` are equally frequent.
    Even {
        /// Mean `[m]`.
        mean: f64,
        /// Largest deviation `[m]`.
        spread: f64,
    },
    /// Exponential distribution above a least distance.
    Exponential {
        /// Mean `[m]`, the least distance included.
        mean: f64,
        /// Least distance `[m]`.
        least: f64,
    },
    /// Lognormal distribution above a least distance.
    Lognormal {
        /// Mean `[m]`, the least distance included.
        mean: f64,
        /// Standard deviation `[m]`.
        deviation: f64,
        /// Least distance `[m]`.
        least: f64,
    },
}

impl Spacing {
    /// Mean distance `[m]`.
    #[must_use]
    pub fn mean(&self) -> f64 {
        match *self {
            Self::Constant(mean)
            | Self::Even { mean, .. }
            | Self::Exponential { mean, .. }
            | Self::Lognormal { mean, .. } => mean,
        }
    }

    /// Next distance `[m]`. Each law takes the same count of numbers every time.
    pub fn draw(&self, numbers: &mut RandomStream) -> f64 {
        match *self {
            Self::Constant(distance) => distance,
            Self::Even { mean, spread } => mean + spread * (2.0 * numbers.uniform() - 1.0),
            Self::Exponential { mean, least } => {
                least - (mean - least) * libm::log(1.0 - numbers.uniform())
            }
            Self::Lognormal { mean, deviation, least } => {
                let rest = mean - least;
                let ratio = deviation / rest;
                let variance = libm::log1p(ratio * ratio);
                let exponent = libm::sqrt(variance) * numbers.normal() - variance / 2.0;
                least + rest * libm::exp(exponent)
            }
        }
    }
}

impl JointSet {
    /// Range of distances from the origin along the normal `[m]` that planes through a body may
    /// have. It reaches beyond the body by as much as tilted planes may come back.
    fn range(&self, corners: &[Vector3<f64>]) -> [f64; 2] {
        let offsets = corners.iter().map(|corner| corner - self.origin);
        let along = offsets.clone().map(|offset| self.normal.dot(&offset));
        let aside = offsets
            .map(|offset| (offset - self.normal * self.normal.dot(&offset)).norm())
            .fold(0.0, f64::max);
        let beyond = self.fisher.map_or(0.0, |concentration| {
            let cosine = fisher_cosine(concentration, RARE).max(0.1);
            aside * libm::sqrt(1.0 - cosine * cosine) / cosine
        });
        let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
            [low.min(at), high.max(at)]
        });
        [low - beyond, high + beyond]
    }

    /// Number of planes to expect, those that tilt away from the body included.
    #[must_use]
    pub fn expected(&self, corners: &[Vector3<f64>]) -> f64 {
        let [low, high] = self.range(corners);
        1.0 + (high - low) / self.spacing.mean()
    }

    /// Number of planes to expect between the origin and the far end of a body.
    #[must_use]
    pub fn from_origin(&self, corners: &[Vector3<f64>]) -> f64 {
        let [low, high] = self.range(corners);
        low.abs().max(high.abs()) / self.spacing.mean()
    }

    /// Planes through a body with these corners, in order along the normal. One of them passes
    /// through the origin; only with exponential distances the origin is a random point between two
    /// planes. The planes on each side of it depend only on the seed and the number of the cut, not
    /// on the body.
    #[must_use]
    pub fn planes(
        &self,
        corners: &[Vector3<f64>],
        seed: u64,
        cut: u32,
        joined: bool,
    ) -> Vec<CutPlane> {
        let [low, high] = self.range(corners);
        let [first_below, first_above] = self.first(seed, cut);
        let mut planes = self.side(seed, cut, joined, first_below, [-high, -low], -1.0);
        planes.reverse();
        planes.extend(self.side(seed, cut, joined, first_above, [low, high], 1.0));
        let meets = |plane: &CutPlane| {
            let heights = || corners.iter().map(|corner| plane.height(corner));
            heights().any(|height| height <= 0.0) && heights().any(|height| height >= 0.0)
        };
        planes.retain(meets);
        planes
    }

    /// Distances from the origin to the first planes below and above `[m]`; `None` below stands for
    /// a drawn one, after a plane in the origin.
    fn first(&self, seed: u64, cut: u32) -> [Option<f64>; 2] {
        let Spacing::Exponential { mean, least } = self.spacing else { return [None, Some(0.0)] };
        // Wide gaps hold a random point more often than narrow ones: their distribution there is
        // that of the distances times the distance. Above `least` it is a mixture of sums of one
        // and of two exponential numbers.
        let mut numbers = RandomStream::new(seed, GAP_STREAM + u64::from(cut));
        let [share, one, two, at] = [(); 4].map(|()| numbers.uniform());
        let exponential = |u: f64| -(mean - least) * libm::log(1.0 - u);
        let second = if share * mean < least { 0.0 } else { exponential(two) };
        let gap = least + exponential(one) + second;
        [Some(gap * (1.0 - at)), Some(gap * at)]
    }

    /// Planes on one side of the origin, outward, at distances within a range. The plane through
    /// the origin belongs to the upper side.
    fn side(
        &self,
        seed: u64,
        cut: u32,
        joined: bool,
        first: Option<f64>,
        [start, end]: [f64; 2],
        sign: f64,
    ) -> Vec<CutPlane> {
        let stream = 2 * u64::from(cut) + u64::from(sign > 0.0);
        let mut numbers = RandomStream::new(seed, stream);
        let mut planes = Vec::new();
        let mut distance = first.unwrap_or_else(|| self.spacing.draw(&mut numbers));
        while distance <= end {
            let normal = match self.fisher {
                Some(concentration) => numbers.fisher(&self.normal, concentration),
                None => self.normal,
            };
            if distance >= start {
                let through = self.origin + self.normal * (sign * distance);
                planes.extend(CutPlane::new(normal, through, cut, joined));
            }
            distance += self.spacing.draw(&mut numbers);
        }
        planes
    }
}
