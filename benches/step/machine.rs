//! Limits of this machine: memory bandwidth, and peaks of the units that add and multiply.

use std::hint::black_box;
use std::time::Instant;

use fearless_simd::{Level, Simd, SimdBase, dispatch, f64x4};
use fearless_simd_macros::simd;
use rayon::ThreadPool;
use serde_json::{Map, Value, json};

use crate::timing::{Pace, SliceRates, rates};

/// Independent chains of operations: more than the units can have in flight.
const CHAINS: usize = 12;
/// Operations of each chain in a task.
const LENGTH: usize = 20_000;

/// Arrays and threads with which the limits are measured.
pub(crate) struct Machine {
    pace: Pace,
    arrays: [Vec<f64>; 3],
    pools: [ThreadPool; 2],
    /// Best triad so far, for one and two threads `[B/s]`.
    triads: [f64; 2],
}

fn pool(threads: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

impl Machine {
    pub(crate) fn new(pace: Pace) -> Self {
        let arrays = [0.0, 1.0, 2.0].map(|value| vec![value; pace.array]);
        let mut machine = Self { pace, arrays, pools: [1, 2].map(pool), triads: [0.0; 2] };
        // The first triads fill the page tables.
        (1..=2).for_each(|threads| _ = machine.triad(threads));
        machine
    }

    /// Measures with some threads, and the triad before and after it.
    pub(crate) fn beside(
        &mut self,
        threads: usize,
        measure: impl FnOnce(&ThreadPool) -> SliceRates,
    ) -> SliceRates {
        let before = self.triad(threads);
        let found = measure(&self.pools[threads - 1]);
        let triad = before.max(self.triad(threads));
        self.triads[threads - 1] = self.triads[threads - 1].max(triad);
        SliceRates { triad, ..found }
    }

    /// STREAM triad `a = b + 3 c`: three numbers of 8 bytes, best of twenty `[B/s]`.
    fn triad(&mut self, threads: usize) -> f64 {
        let [a, b, c] = &mut self.arrays;
        let grain = (a.len() / 64).max(1);
        self.pools[threads - 1].install(|| {
            best(20, || chunks(a, [black_box(b), c], grain, &|a, b, c| *a = b + 3.0 * c))
                * 24.0
                * c.len() as f64
        })
    }

    /// Copy `a = b`: two numbers of 8 bytes, best of twenty `[B/s]`.
    fn copy(&mut self, threads: usize) -> f64 {
        let [a, b, _] = &mut self.arrays;
        let grain = (a.len() / 64).max(1);
        self.pools[threads - 1].install(|| {
            best(20, || chunks(a, [black_box(b), b], grain, &|a, b, _| *a = *b))
                * 16.0
                * b.len() as f64
        })
    }

    /// All limits, in 10⁹ bytes or operations a second.
    pub(crate) fn limits(&mut self) -> Value {
        let mut limits = Map::new();
        for threads in [1, 2] {
            let triad = self.triad(threads).max(self.triads[threads - 1]);
            let copy = self.copy(threads);
            let [add, multiply] = [false, true].map(|multiplies| {
                let pool = &self.pools[threads - 1];
                let task = || peak(Level::new(), multiplies);
                let run = || {
                    if threads == 1 { task() } else { _ = rayon::join(task, task) }
                };
                let found = pool.install(|| rates(self.pace, run));
                found.best * (threads * CHAINS * LENGTH * 4) as f64
            });
            for (name, rate) in
                [("triad", triad), ("copy", copy), ("add", add), ("multiply", multiply)]
            {
                limits.insert(format!("{name}/{threads} threads"), json!(rate / 1e9));
            }
        }
        Value::Object(limits)
    }
}

/// Calls of an operation per second, in the shortest of several calls.
fn best(calls: usize, mut operation: impl FnMut()) -> f64 {
    let seconds = (0..calls).map(|_| {
        let start = Instant::now();
        operation();
        start.elapsed().as_secs_f64()
    });
    1.0 / seconds.fold(f64::INFINITY, f64::min).max(1e-9)
}

/// Applies an operation to three arrays, in parallel by chunks of at most `grain` numbers.
fn chunks(
    a: &mut [f64],
    [b, c]: [&[f64]; 2],
    grain: usize,
    operation: &(impl Fn(&mut f64, &f64, &f64) + Sync),
) {
    if a.len() <= grain {
        a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| operation(a, b, c));
        return;
    }
    let half = a.len() / 2;
    let ((low, high), (b, b_high), (c, c_high)) =
        (a.split_at_mut(half), b.split_at(half), c.split_at(half));
    rayon::join(
        || chunks(low, [b, c], grain, operation),
        || chunks(high, [b_high, c_high], grain, operation),
    );
}

/// Runs independent chains of additions or multiplications of four numbers.
fn peak(level: Level, multiplies: bool) {
    let sum = dispatch!(level, simd => run_chains(simd, black_box(1e-9), multiplies));
    black_box(sum);
}

#[simd]
fn run_chains<S: Simd>(simd: S, by: f64, multiplies: bool) -> f64 {
    let mut chains: [f64x4<S>; CHAINS] =
        std::array::from_fn(|i| f64x4::splat(simd, 1.0 + i as f64));
    if multiplies {
        let by = f64x4::splat(simd, 1.0 + by);
        for _ in 0..LENGTH {
            chains.iter_mut().for_each(|chain| *chain *= by);
        }
    } else {
        let by = f64x4::splat(simd, by);
        for _ in 0..LENGTH {
            chains.iter_mut().for_each(|chain| *chain += by);
        }
    }
    let mut sum = f64x4::splat(simd, 0.0);
    chains.iter().for_each(|chain| sum += *chain);
    sum.as_slice().iter().sum()
}
