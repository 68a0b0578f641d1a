//! Pistons, columns and other blasts with exact answers.

use super::record::Tolerance::Relative;
use super::record::{at_most, check, of};
use super::shared::{example, run};

#[test]
fn gas_accelerates_piston_exactly() {
    let case = of("blast_piston");
    let run = run(&example(case.deck));
    let way = run.probes.series("way.z");
    let speed = run.probes.series("speed.z");
    let (mass, pressure, volume) = (2400.0 * 0.995, 1e6, 1.01_f64);
    let energy = |x: f64| pressure * volume / 0.4 * (1.0 - (volume / (volume + x)).powf(0.4));
    let exact = |x: f64| (2.0 * energy(x) / mass).sqrt();
    let pairs = || way.iter().zip(&speed).filter(|(way, _)| way[1] > 0.1);
    let worst = pairs().map(|(x, v)| (v[1] / exact(x[1]) - 1.0).abs()).fold(0.0, f64::max);
    at_most(case, "largest relative difference of v(x), from x = 0.1 m on", 5e-3, worst);
    let x = run.last("way.z");
    assert!((1.4..1.9).contains(&x), "it goes far: {x}");
    check(case, "speed at the end [m/s]", exact(x), run.last("speed.z"), Relative(5e-3));
    let work = *run.energy.column("external_work").last().expect("a row");
    check(case, "work of the gas [J]", energy(x), work, Relative(1e-2));
    let kinetic = *run.energy.column("kinetic").last().expect("a row");
    check(case, "kinetic energy [J]", energy(x), kinetic, Relative(1e-2));
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
    at_most(case, "largest difference from p(t - x/c)/(rho c) / peak", 2e-2, most);
}
