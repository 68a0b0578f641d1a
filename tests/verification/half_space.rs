//! V13: a force on a half space (Lamb; Pekeris 1955), with viscous sides and bottom.

use std::f64::consts::PI;

use super::boundaries::closes;
use super::record::Tolerance::{Absolute, Relative};
use super::record::{check, of};
use super::shared::{example, run};

const SHEAR: f64 = 7.2e9;
const DENSITY: f64 = 2400.0;
/// Force on the whole half space [N].
const FORCE: f64 = 4e6;
/// Rise time of the force [s].
const RISE: f64 = 4e-3;
/// Edge of the model [m].
const SIZE: f64 = 16.0;

/// Displacement of the surface under a step force divided by the static one, at τ = c_S t/r, for
/// Poisson's ratio 1/4.
fn step(tau: f64) -> f64 {
    let root = 3.0_f64.sqrt();
    let x = tau * tau;
    let rayleigh = ((3.0 * root + 5.0) / (0.75 + root / 4.0 - x)).sqrt();
    if tau <= 1.0 / root {
        0.0
    } else if tau < 1.0 {
        let last = ((3.0 * root - 5.0) / (x + root / 4.0 - 0.75)).sqrt();
        (6.0 - (3.0 / (x - 0.25)).sqrt() - rayleigh + last) / 12.0
    } else if tau < 0.5 * (3.0 + root).sqrt() {
        (6.0 - rayleigh) / 6.0
    } else {
        1.0
    }
}

/// The same while the force rises as (1 − cos πt/T)/2.
fn exact(time: f64, arrival: f64) -> f64 {
    const PARTS: usize = 4000;
    let part = |i: usize| {
        let s = (i as f64 + 0.5) / PARTS as f64;
        step((time - s * RISE) / arrival) * (PI * s).sin() * PI / 2.0 / PARTS as f64
    };
    (0..PARTS).map(part).sum()
}

/// Time at which the surface has risen by a part of its final displacement, between two samples.
fn rises(samples: &[[f64; 2]], part: f64) -> f64 {
    let after = samples.iter().position(|[_, w]| *w < -part).expect("it rises");
    let ([t0, w0], [t1, w1]) = (samples[after - 1], samples[after]);
    t0 + (t1 - t0) * (-part - w0) / (w1 - w0)
}

/// Time of that rise in the exact solution, by bisection between two times.
fn exact_rise(part: f64, arrival: f64, [from, to]: [f64; 2]) -> f64 {
    let (mut low, mut high) = (from, to);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        *(if exact(middle, arrival) < -part { &mut high } else { &mut low }) = middle;
    }
    assert!(low > from && high < to, "it rises within {from} to {to}");
    high
}

#[test]
fn force_on_half_space_matches_lamb() {
    let case = of("v13_half_space");
    let run = run(&example(case.deck));
    let (slow, fast) = ((SHEAR / DENSITY).sqrt(), (3.0 * SHEAR / DENSITY).sqrt());
    for (probe, r) in
        [("near", 4.2), ("middle", 6.0), ("far", 7.8), ("askew", 4.2 * 2.0_f64.sqrt())]
    {
        // F (1 − ν)/(2π G r), downwards.
        let resting = 0.75 * FORCE / (2.0 * PI * SHEAR * r);
        let samples = run.probes.series(&format!("{probe}.z"));
        let ways: Vec<[f64; 2]> = samples.iter().map(|[t, w]| [*t, -w / resting]).collect();
        // From the end of the Rayleigh wave until a reflection from the sides could have changed
        // the mean.
        let from = 1.0877 * r / slow + RISE + 2e-4;
        let to = 1.5 * SIZE / slow;
        let rest: Vec<f64> =
            ways.iter().filter(|[t, _]| (from..to).contains(t)).map(|[_, w]| *w).collect();
        let mean = rest.iter().sum::<f64>() / rest.len() as f64 * resting;
        let what = format!("static settlement at r = {r:.2} m, mean after the Rayleigh wave [m]");
        check(case, &what, resting, mean, Relative(1.5e-2));
        let back = (2.0 * SIZE - r) / fast;
        let early = ways.iter().filter(|[t, _]| *t < back);
        let away = early.map(|[t, w]| (w - exact(*t, r / slow)).abs()).fold(0.0, f64::max);
        let what = format!("largest difference from Pekeris / static settlement, r = {r:.2} m");
        check(case, &what, 0.0, away, Absolute(4e-2));
        if probe == "middle" {
            let what = "P wave: time at which the surface has risen by 0.4 % of it, r = 6 m [s]";
            let time = exact_rise(4e-3, r / slow, [r / fast, r / slow]);
            check(case, what, time, rises(&ways, 4e-3), Relative(3e-2));
        }
    }
    // Dashpots carry no force at rest, so the whole model sinks at this speed in the end.
    let exact = -FORCE / 4.0 / (DENSITY * SIZE * SIZE * (fast + 2.0 * slow));
    let ways = run.probes.series("middle.z");
    let [[t0, w0], [t1, w1]] = [ways[ways.len() * 3 / 4], ways[ways.len() - 1]];
    let speed = (w1 - w0) / (t1 - t0);
    check(case, "speed at which all of it sinks in the end [m/s]", exact, speed, Relative(3e-2));
    closes(case, "", &run);
}
