//! Pistons, columns and other blasts with exact answers.

use super::record::Tolerance::{Absolute, Relative};
use super::record::{check, of};
use super::shared::{example, run};

/// Mass of the piston `[kg]`, pressure `[Pa]` and volume `[m³]` of the gas at the start.
const PISTON: [f64; 3] = [2400.0 * 0.995, 1e6, 1.01];

/// Way and speed of the piston at a time, from its equation of motion `m x'' = p0 (V0/(V0 + x))^γ A`
/// with steps of fourth order.
fn piston(time: f64) -> [f64; 2] {
    let [mass, pressure, volume] = PISTON;
    let steps = 10_000;
    let step = time / f64::from(steps);
    let slope = |[x, v]: [f64; 2]| [v, pressure * (volume / (volume + x)).powf(1.4) / mass];
    let mut state = [0.0; 2];
    for _ in 0..steps {
        let on = |k: [f64; 2], part: f64| [0, 1].map(|i| state[i] + part * step * k[i]);
        let k1 = slope(state);
        let k2 = slope(on(k1, 0.5));
        let k3 = slope(on(k2, 0.5));
        let k4 = slope(on(k3, 1.0));
        state = [0, 1].map(|i| state[i] + step / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
    state
}

#[test]
fn gas_accelerates_piston_exactly() {
    let case = of("blast_piston");
    let run = run(&example(case.deck));
    let [mass, pressure, volume] = PISTON;
    let energy = |x: f64| pressure * volume / 0.4 * (1.0 - (volume / (volume + x)).powf(0.4));
    let [way, speed] = piston(0.1);
    assert!((0.5 * mass * speed * speed / energy(way) - 1.0).abs() < 1e-12, "the work is motion");
    check(case, "way at the end [m]", way, run.last("way.z"), Relative(5e-3));
    check(case, "speed at the end [m/s]", speed, run.last("speed.z"), Relative(5e-3));
    let work = *run.energy.column("external_work").last().expect("a row");
    check(case, "work of the gas [J]", energy(way), work, Relative(1e-2));
    let kinetic = *run.energy.column("kinetic").last().expect("a row");
    check(case, "kinetic energy [J]", energy(way), kinetic, Relative(1e-2));
    let (ways, speeds) = (run.probes.series("way.z"), run.probes.series("speed.z"));
    let pairs = ways.iter().zip(&speeds).filter(|(way, _)| way[1] > 0.1);
    let of_way = |x: f64| (2.0 * energy(x) / mass).sqrt();
    let worst = pairs.map(|(x, v)| (v[1] / of_way(x[1]) - 1.0).abs()).fold(0.0, f64::max);
    let what = "largest relative difference of v from that of x, from x = 0.1 m on";
    check(case, what, 0.0, worst, Absolute(5e-3));
}

/// Largest value.
fn peak(samples: &[[f64; 2]]) -> f64 {
    samples.iter().fold(0.0, |peak: f64, [_, v]| peak.max(*v))
}

/// A pulse of two exponentials with a peak of 1.
fn pulse(time: f64, [alpha, beta]: [f64; 2]) -> f64 {
    let at = (beta / alpha).ln() / (beta - alpha);
    let bare = |time: f64| (-alpha * time).exp() - (-beta * time).exp();
    if time > 0.0 { bare(time) / bare(at) } else { 0.0 }
}

#[test]
fn blast_pulse_travels_along_column() {
    let case = of("blast_column");
    let run = run(&example(case.deck));
    let seen = run.probes.series("mid.x");
    let exact = 1e7 / 7.2e6;
    check(case, "peak velocity after 30 elements [m/s]", exact, peak(&seen), Relative(2e-2));
    let away = |[t, v]: &[f64; 2]| (v / exact - pulse(t - 7.5 / 3000.0, [100.0, 300.0])).abs();
    let most = seen.iter().map(away).fold(0.0, f64::max);
    let what = "largest difference from p(t - x/c)/(rho c) / peak";
    check(case, what, 0.0, most, Absolute(2e-2));
}
