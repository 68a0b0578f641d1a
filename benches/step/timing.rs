//! Best and median rate of a repeated operation.

use std::time::{Duration, Instant};

/// Effort of a measurement.
#[derive(Clone, Copy)]
pub(crate) struct Pace {
    /// Wall time of a measurement.
    pub(crate) total: Duration,
    /// Least wall time of a slice, of which the best one counts. It is short, so that other
    /// programs leave some slices undisturbed.
    pub(crate) slice: Duration,
    /// Least number of slices.
    pub(crate) slices: usize,
    /// Largest model.
    pub(crate) most_nodes: usize,
    /// Numbers in the arrays of the memory bandwidth.
    pub(crate) array: usize,
    /// True to write the results to a file.
    pub(crate) records: bool,
}

impl Pace {
    /// Pace of `cargo bench`.
    pub(crate) const FULL: Self = Self {
        total: Duration::from_millis(2000),
        slice: Duration::from_millis(5),
        slices: 7,
        most_nodes: usize::MAX,
        array: 1 << 23,
        records: true,
    };
    /// Pace of `cargo bench -- --quick`.
    pub(crate) const QUICK: Self = Self { total: Duration::from_millis(300), ..Self::FULL };
    /// Pace of `cargo test`: every small row once.
    pub(crate) const TRIAL: Self = Self {
        total: Duration::ZERO,
        slice: Duration::ZERO,
        slices: 1,
        most_nodes: 1000,
        array: 1 << 10,
        records: false,
    };
}

/// Operations per second in the best slice and in the median one.
#[derive(Clone, Copy)]
pub(crate) struct SliceRates {
    pub(crate) best: f64,
    pub(crate) median: f64,
    /// Best triad in the same seconds `[B/s]`.
    pub(crate) triad: f64,
}

/// Rates of an operation in slices of time.
pub(crate) fn rates(pace: Pace, mut operation: impl FnMut()) -> SliceRates {
    operation();
    let (begun, mut rates) = (Instant::now(), Vec::new());
    while rates.len() < pace.slices || begun.elapsed() < pace.total {
        let (start, mut count) = (Instant::now(), 0.0);
        loop {
            operation();
            count += 1.0;
            let spent = start.elapsed();
            if spent >= pace.slice {
                rates.push(count / spent.as_secs_f64().max(1e-9));
                break;
            }
        }
    }
    rates.sort_by(f64::total_cmp);
    SliceRates { best: rates[rates.len() - 1], median: rates[rates.len() / 2], triad: 0.0 }
}
