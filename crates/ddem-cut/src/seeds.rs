//! Seeds of Voronoi cells: random ones, and a grid that finds near ones.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::random::RandomStream;

/// Number of the stream of the seeds of the first cut.
const SEED_STREAM: u64 = 4 << 40;

/// Number of tries for each seed before no more seeds fit.
const TRIES: usize = 200;

/// Random places in a box, all equally frequent, at least a distance from each other. There are fewer than
/// the number if no more fit.
#[must_use]
pub fn voronoi_seeds(
    [low, high]: [Vector3<f64>; 2],
    number: usize,
    least: f64,
    seed: u64,
    cut: u32,
) -> Vec<Vector3<f64>> {
    let mut numbers = RandomStream::new(seed, SEED_STREAM + u64::from(cut));
    let mut seeds: Vec<Vector3<f64>> = Vec::with_capacity(number.min(1 << 20));
    let mut near = HashMap::<[i64; 3], Vec<usize>>::new();
    let key = |x: &Vector3<f64>| {
        [0, 1, 2].map(|d| if least > 0.0 { ((x[d] - low[d]) / least).floor() as i64 } else { 0 })
    };
    let mut tries = number.saturating_mul(TRIES);
    while seeds.len() < number && tries > 0 {
        tries -= 1;
        let shares = Vector3::from([(); 3].map(|()| numbers.uniform()));
        let x = low + (high - low).component_mul(&shares);
        let at = key(&x);
        let free = |i: i64| {
            let cube = [at[0] + i % 3 - 1, at[1] + i / 3 % 3 - 1, at[2] + i / 9 - 1];
            let others = near.get(&cube).into_iter().flatten();
            others.into_iter().all(|&other| (seeds[other] - x).norm() >= least)
        };
        if least <= 0.0 || (0..27).all(free) {
            if least > 0.0 {
                near.entry(at).or_default().push(seeds.len());
            }
            seeds.push(x);
        }
    }
    seeds
}

/// Seeds in equal cubes, about one in each.
pub(crate) struct SeedGrid {
    low: Vector3<f64>,
    edge: f64,
    counts: [i64; 3],
    cubes: Vec<Vec<u32>>,
}

impl SeedGrid {
    pub(crate) fn new(seeds: &[Vector3<f64>]) -> Self {
        let far = Vector3::repeat(f64::INFINITY);
        let (low, high) =
            seeds.iter().fold((far, -far), |(low, high), x| (low.inf(x), high.sup(x)));
        let (low, size) = match seeds {
            [] => (Vector3::zeros(), Vector3::zeros()),
            _ => (low, high - low),
        };
        // Flat sets of seeds have cubes along two axes only, so that there are never many more than seeds.
        let longest = size.amax().max(f64::MIN_POSITIVE);
        let sizes = size.map(|edge| edge.max(1e-3 * longest));
        let edge = libm::cbrt(sizes.product() / seeds.len().max(1) as f64).max(longest * 1e-6);
        let counts = [0, 1, 2].map(|d| (size[d] / edge).floor() as i64 + 1);
        let n = counts.iter().product::<i64>() as usize;
        let mut grid = Self { low, edge, counts, cubes: vec![Vec::new(); n] };
        for (number, seed) in seeds.iter().enumerate() {
            let cube = grid.index(grid.place(seed));
            grid.cubes[cube].push(number as u32);
        }
        grid
    }

    fn index(&self, [i, j, k]: [i64; 3]) -> usize {
        ((k * self.counts[1] + j) * self.counts[0] + i) as usize
    }

    /// Cube of a seed.
    pub(crate) fn place(&self, seed: &Vector3<f64>) -> [i64; 3] {
        let at = |d: usize| ((seed[d] - self.low[d]) / self.edge).floor() as i64;
        [0, 1, 2].map(|d| at(d).clamp(0, self.counts[d] - 1))
    }

    /// Number of the last ring around any cube.
    pub(crate) fn rings(&self) -> i64 {
        self.counts.iter().copied().max().unwrap_or_default()
    }

    /// Distance below which no seed of a ring lies from a seed in the middle cube `[m]`.
    pub(crate) fn least(&self, ring: i64) -> f64 {
        (ring - 1).max(0) as f64 * self.edge
    }

    /// Seeds in the cubes that are `ring` cubes away.
    pub(crate) fn ring(&self, middle: [i64; 3], ring: i64) -> Vec<u32> {
        let range =
            |d: usize| (middle[d] - ring).max(0)..=(middle[d] + ring).min(self.counts[d] - 1);
        let mut found = Vec::new();
        for k in range(2) {
            for j in range(1) {
                for i in range(0) {
                    let away = [i, j, k].iter().zip(middle).map(|(at, of)| (at - of).abs()).max();
                    if away == Some(ring) {
                        found.extend(&self.cubes[self.index([i, j, k])]);
                    }
                }
            }
        }
        found
    }
}
