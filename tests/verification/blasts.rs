//! What a blast does.

use super::record::Tolerance::{AtMost, Relative};
use super::record::{check, of};
use super::shared::{Run, deck, example, run, simulation};

#[test]
fn a_piston() {
    let case = of("blast_piston");
    let run = run(&example(case.deck));
    let way = run.probes.series("way.z");
    let speed = run.probes.series("speed.z");
    let (mass, pressure, volume) = (2400.0 * 0.995, 1e6, 1.01_f64);
    let energy = |x: f64| pressure * volume / 0.4 * (1.0 - (volume / (volume + x)).powf(0.4));
    let exact = |x: f64| (2.0 * energy(x) / mass).sqrt();
    let pairs = || way.iter().zip(&speed).filter(|(way, _)| way[1] > 0.1);
    let worst = pairs().map(|(x, v)| (v[1] / exact(x[1]) - 1.0).abs()).fold(0.0, f64::max);
    check(case, "largest relative difference of v(x), from x = 0.1 m on", 5e-3, worst, AtMost);
    let x = run.last("way.z");
    assert!((1.4..1.9).contains(&x), "it goes far: {x}");
    check(case, "speed at the end [m/s]", exact(x), run.last("speed.z"), Relative(5e-3));
    let work = *run.energy.column("external_work").last().expect("a row");
    check(case, "work of the gas [J]", energy(x), work, Relative(1e-2));
    let kinetic = *run.energy.column("kinetic").last().expect("a row");
    check(case, "kinetic energy [J]", energy(x), kinetic, Relative(1e-2));
}

/// Largest value and its time.
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
fn a_pulse_in_a_column() {
    let case = of("blast_column");
    let run = run(&example(case.deck));
    let seen = run.probes.series("mid.x");
    let exact = 1e7 / 7.2e6;
    check(case, "peak velocity after 30 elements [m/s]", exact, peak(&seen), Relative(2e-2));
    let away = |[t, v]: &[f64; 2]| (v / exact - pulse(t - 7.5 / 3000.0, [100.0, 300.0])).abs();
    let most = seen.iter().map(away).fold(0.0, f64::max);
    check(case, "largest difference from p(t - x/c)/(rho c) / peak", 2e-2, most, AtMost);
}

/// Radial velocity from a cavity of radius a under the pressure p(t), by the equation of Sharpe and
/// steps of fourth order: largest value at each radius.
fn sharpe(a: f64, pressure: impl Fn(f64) -> f64, radii: &[f64]) -> Vec<f64> {
    let (c, shear, density) = (3000.0, 7.2e9_f64 / 2400.0, 2400.0);
    let second = |t: f64, [f, g]: [f64; 2]| {
        -a * pressure(t) / density - 4.0 * shear / (a * c) * g - 4.0 * shear / (a * a) * f
    };
    let step = 1e-6;
    let (mut state, mut most) = ([0.0; 2], vec![0.0_f64; radii.len()]);
    for i in 0..10_000 {
        let t = f64::from(i) * step;
        let slope = |t: f64, s: [f64; 2]| [s[1], second(t, s)];
        let on = |k: [f64; 2], part: f64| [0, 1].map(|i| state[i] + part * step * k[i]);
        let k1 = slope(t, state);
        let k2 = slope(t + 0.5 * step, on(k1, 0.5));
        let k3 = slope(t + 0.5 * step, on(k2, 0.5));
        let k4 = slope(t + step, on(k3, 1.0));
        for (r, most) in radii.iter().zip(&mut most) {
            *most = most.max(-k1[1] / (c * r) - k1[0] / (r * r));
        }
        state = [0, 1].map(|i| state[i] + step / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
    most
}

#[test]
fn waves_from_a_sphere() {
    let case = of("blast_sphere");
    let text = example(case.deck);
    let volume = simulation(&text).charge(0).expect("a charge").volume;
    let radius = (6.0 * volume / std::f64::consts::PI).cbrt();
    assert_eq!(deck(&text).charge.len(), 1);
    let run: Run = run(&text);
    let radii = [4.0, 6.0, 8.0];
    let exact = sharpe(radius, |t| 1e7 * pulse(t, [500.0, 1500.0]), &radii);
    let along = |name: &str, axes: &[&str]| {
        let parts: Vec<_> =
            axes.iter().map(|axis| run.probes.series(&format!("{name}.{axis}"))).collect();
        let part = (axes.len() as f64).sqrt();
        let sum = |i: usize| parts.iter().map(|s| s[i][1]).sum::<f64>() / part;
        (0..parts[0].len()).map(sum).fold(0.0, f64::max)
    };
    let mean = |r: f64| {
        let parts = [
            along(&format!("axis{r}"), &["x"]),
            along(&format!("edge{r}"), &["x", "y"]),
            along(&format!("corner{r}"), &["x", "y", "z"]),
        ];
        parts.iter().sum::<f64>() / 3.0
    };
    for (r, exact) in radii.iter().zip(&exact) {
        check(case, &format!("peak velocity at {r} m [m/s]"), *exact, mean(*r), Relative(0.3));
    }
    for (i, r) in radii.iter().enumerate().skip(1) {
        let what = format!("peak velocity at {r} m / at 4 m");
        check(case, &what, exact[i] / exact[0], mean(*r) / mean(4.0), Relative(0.08));
    }
}
