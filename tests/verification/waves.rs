//! V2: speeds of waves.

use super::record::Tolerance::Relative;
use super::record::{check, of};
use super::shared::{Run, example, run};

/// Moment of the pulse over time divided by its area: its arrival time `[s]`.
fn arrival(samples: &[[f64; 2]]) -> f64 {
    let (mut area, mut moment) = (0.0, 0.0);
    for pair in samples.windows(2) {
        let [[t0, v0], [t1, v1]] = [pair[0], pair[1]];
        area += 0.5 * (t1 - t0) * (v0 + v1);
        moment += 0.5 * (t1 - t0) * (v0 * t0 + v1 * t1);
    }
    moment / area
}

fn peak(samples: &[[f64; 2]]) -> f64 {
    samples.iter().fold(0.0, |peak: f64, [_, v]| peak.max(*v))
}

fn speed(deck: &str, axis: &str, distance: f64, [exact, exact_peak]: [f64; 2]) {
    let case = of(deck);
    let run: Run = run(&example(deck));
    let [near, far] = ["near", "far"].map(|probe| run.probes.series(&format!("{probe}.{axis}")));
    let computed = distance / (arrival(&far) - arrival(&near));
    check(case, "speed [m/s]", exact, computed, Relative(5e-3));
    check(case, "peak velocity, near [m/s]", exact_peak, peak(&near), Relative(1e-2));
    check(case, "peak velocity, far [m/s]", exact_peak, peak(&far), Relative(1e-2));
}

#[test]
fn compression_wave_has_exact_speed() {
    speed("v02_p_wave", "x", 20.0, [3000.0, 1e6 / (2400.0 * 3000.0)]);
}

#[test]
fn shear_wave_has_exact_speed() {
    let exact = (7.2e9_f64 / 2400.0).sqrt();
    speed("v02_s_wave", "y", 20.0, [exact, 1e5 / (2400.0 * exact)]);
}

#[test]
fn bar_wave_has_exact_speed() {
    let exact = (18e9_f64 / 2400.0).sqrt();
    speed("v02_bar_wave", "x", 40.0, [exact, 1e6 / (2400.0 * exact)]);
}
