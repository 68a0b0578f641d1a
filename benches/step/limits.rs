//! Limits of this machine: memory bandwidth, and peaks of the units that add and multiply.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput};
use fearless_simd::{Level, Simd, SimdBase, dispatch, f64x4, f64x8};
use fearless_simd_macros::simd;

use crate::{THREADS, pool};

/// Numbers in each array of the memory bandwidth: more than the caches hold.
const ARRAY: usize = 1 << 24;
/// Independent chains of operations: more than the units can have in flight.
const CHAINS: usize = 12;
/// Operations of each chain in a task.
const LENGTH: usize = 1_000_000;

/// STREAM triad `a = b + 3 c` and copy `a = b`, in bytes; the best rate is the bandwidth.
pub(crate) fn memory(criterion: &mut Criterion) {
    let [mut a, b, c] = [0.0, 1.0, 2.0].map(|value| vec![value; ARRAY]);
    let mut group = criterion.benchmark_group("memory");
    for threads in THREADS {
        let pool = pool(threads);
        group.throughput(Throughput::Bytes(24 * ARRAY as u64));
        group.bench_function(BenchmarkId::new("triad", threads), |bencher| {
            pool.install(|| {
                bencher.iter(|| chunks(&mut a, [black_box(&b), &c], &|a, b, c| *a = b + 3.0 * c));
            });
        });
        group.throughput(Throughput::Bytes(16 * ARRAY as u64));
        group.bench_function(BenchmarkId::new("copy", threads), |bencher| {
            pool.install(|| {
                bencher.iter(|| chunks(&mut a, [black_box(&b), &b], &|a, b, _| *a = *b));
            });
        });
    }
    group.finish();
}

/// Additions and multiplications of four and of eight numbers at once, in numbers.
pub(crate) fn arithmetic(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("arithmetic");
    for threads in THREADS {
        let pool = pool(threads);
        for (name, multiplies, lanes) in [
            ("add", false, 4),
            ("multiply", true, 4),
            ("add eight", false, 8),
            ("multiply eight", true, 8),
        ] {
            group.throughput(Throughput::Elements((threads * CHAINS * LENGTH * lanes) as u64));
            let task = || peak(Level::new(), multiplies, lanes);
            group.bench_function(BenchmarkId::new(name, threads), |bencher| {
                pool.install(|| {
                    bencher
                        .iter(|| if threads == 1 { task() } else { _ = rayon::join(task, task) });
                });
            });
        }
    }
    group.finish();
}

/// Applies an operation to three arrays, in parallel by chunks.
fn chunks(a: &mut [f64], [b, c]: [&[f64]; 2], operation: &(impl Fn(&mut f64, &f64, &f64) + Sync)) {
    if a.len() <= ARRAY / 64 {
        a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| operation(a, b, c));
        return;
    }
    let half = a.len() / 2;
    let ((low, high), (b, b_high), (c, c_high)) =
        (a.split_at_mut(half), b.split_at(half), c.split_at(half));
    rayon::join(|| chunks(low, [b, c], operation), || chunks(high, [b_high, c_high], operation));
}

/// Runs independent chains of additions or multiplications of four or eight numbers.
fn peak(level: Level, multiplies: bool, lanes: usize) {
    let by = black_box(1e-9);
    let sum = match lanes {
        4 => dispatch!(level, simd => run_fours(simd, by, multiplies)),
        _ => dispatch!(level, simd => run_eights(simd, by, multiplies)),
    };
    black_box(sum);
}

#[simd]
fn run_fours<S: Simd>(simd: S, by: f64, multiplies: bool) -> f64 {
    run_chains::<S, f64x4<S>>(simd, by, multiplies)
}

#[simd]
fn run_eights<S: Simd>(simd: S, by: f64, multiplies: bool) -> f64 {
    run_chains::<S, f64x8<S>>(simd, by, multiplies)
}

#[inline(always)]
fn run_chains<S: Simd, V: SimdBase<S, Element = f64>>(simd: S, by: f64, multiplies: bool) -> f64 {
    let mut chains: [V; CHAINS] = std::array::from_fn(|i| V::splat(simd, 1.0 + i as f64));
    if multiplies {
        let by = V::splat(simd, 1.0 + by);
        for _ in 0..LENGTH {
            chains.iter_mut().for_each(|chain| *chain *= by);
        }
    } else {
        let by = V::splat(simd, by);
        for _ in 0..LENGTH {
            chains.iter_mut().for_each(|chain| *chain += by);
        }
    }
    let mut sum = V::splat(simd, 0.0);
    chains.iter().for_each(|chain| sum += *chain);
    sum.as_slice().iter().sum()
}
