//! Random networks of fractures: discs by their intensity, sizes and orientations.

use nalgebra::Vector3;

use crate::fracture::Fracture;
use crate::random::RandomStream;

/// Number of the stream of the network of the first cut.
const NETWORK_STREAM: u64 = 2 << 40;

/// Radii of discs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DiscSize {
    /// The same radius `[m]`.
    Constant(f64),
    /// Density proportional to r⁻ᵃ between two radii.
    Power {
        /// Exponent a.
        exponent: f64,
        /// Least radius `[m]`.
        from: f64,
        /// Largest radius `[m]`.
        to: f64,
    },
}

/// Count of discs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DiscCount {
    /// Area of discs in a volume, P32, on average `[1/m]`.
    Intensity(f64),
    /// Number of discs whose centres lie in the box.
    Number(usize),
}

/// Statistics of a network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FractureNetwork {
    /// Count of discs.
    pub count: DiscCount,
    /// Radii.
    pub size: DiscSize,
    /// Mean unit normal.
    pub normal: Vector3<f64>,
    /// Concentration κ of the Fisher distribution of the normals; `None` if discs are parallel.
    pub fisher: Option<f64>,
}

/// Integral of xᵏ between two positive numbers.
fn power_integral(k: f64, [from, to]: [f64; 2]) -> f64 {
    if k == -1.0 {
        return libm::log(to / from);
    }
    (libm::pow(to, k + 1.0) - libm::pow(from, k + 1.0)) / (k + 1.0)
}

impl DiscSize {
    /// Largest radius `[m]`.
    #[must_use]
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Constant(radius) => radius,
            Self::Power { to, .. } => to,
        }
    }

    /// Mean of the square of the radius `[m²]`.
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        match *self {
            Self::Constant(radius) => radius * radius,
            Self::Power { from, to, .. } if from == to => from * from,
            Self::Power { exponent, from, to } => {
                // Radii relative to the least one keep all powers near 1.
                let ends = [1.0, to / from];
                let ratio = power_integral(2.0 - exponent, ends) / power_integral(-exponent, ends);
                from * from * ratio
            }
        }
    }

    /// Next radius `[m]`.
    pub fn draw(&self, numbers: &mut RandomStream) -> f64 {
        match *self {
            Self::Constant(radius) => radius,
            Self::Power { exponent, from, to } => {
                let (u, k) = (numbers.uniform(), 1.0 - exponent);
                let ratio = to / from;
                let drawn = if k == 0.0 {
                    libm::pow(ratio, u)
                } else {
                    libm::pow(1.0 + u * (libm::pow(ratio, k) - 1.0), 1.0 / k)
                };
                (from * drawn).clamp(from, to)
            }
        }
    }
}

impl FractureNetwork {
    /// Box in which the centres lie, for discs in a box from `low` to `high` `[m]`.
    fn centres(&self, [low, high]: [Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
        match self.count {
            // Discs reach into the box from outside.
            DiscCount::Intensity(_) => {
                let reach = self.size.largest();
                [low.add_scalar(-reach), high.add_scalar(reach)]
            }
            DiscCount::Number(_) => [low, high],
        }
    }

    /// Number of discs to expect, those that do not reach the box included.
    #[must_use]
    pub fn expected(&self, bounds: [Vector3<f64>; 2]) -> f64 {
        match self.count {
            DiscCount::Number(number) => number as f64,
            DiscCount::Intensity(intensity) => {
                let [low, high] = self.centres(bounds);
                let volume = (high - low).product();
                intensity * volume / (std::f64::consts::PI * self.size.mean_square())
            }
        }
    }

    /// Discs in a box from `low` to `high` `[m]`.
    #[must_use]
    pub fn fractures(
        &self,
        bounds: [Vector3<f64>; 2],
        seed: u64,
        cut: u32,
        joined: bool,
    ) -> Vec<Fracture> {
        let mut numbers = RandomStream::new(seed, NETWORK_STREAM + u64::from(cut));
        let [low, high] = self.centres(bounds);
        let number = match self.count {
            DiscCount::Number(number) => number,
            DiscCount::Intensity(_) => numbers.poisson(self.expected(bounds)),
        };
        let mut disc = || {
            let at = Vector3::from([(); 3].map(|()| numbers.uniform()));
            let centre = low + (high - low).component_mul(&at);
            let radius = self.size.draw(&mut numbers);
            let normal = match self.fisher {
                Some(concentration) => numbers.fisher(&self.normal, concentration),
                None => self.normal,
            };
            Fracture::disc(centre, normal, radius, cut, joined)
        };
        (0..number).filter_map(|_| disc()).collect()
    }
}
