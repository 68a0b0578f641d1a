//! V9: a rocking block.

use super::energy::closes;
use super::incline::G;
use super::incline_contact::body;
use super::record::Tolerance::Relative;
use super::record::{check, of};
use super::shared::{edited, example, run};

const B: f64 = 0.25;
const H: f64 = 1.0;
const MASS: f64 = 4.0 * B * H * 0.5 * 2400.0;

/// Angle at which the block would fall over.
fn alpha() -> f64 {
    B.atan2(H)
}

/// Half of the diagonal.
fn radius() -> f64 {
    B.hypot(H)
}

/// A quarter of Housner's period for slender blocks.
fn housner(part: f64) -> f64 {
    (1.0 / (1.0 - part)).acosh() / (3.0 * G / (4.0 * radius())).sqrt()
}

/// The same for any block: fall time of a pendulum of inertia I about its edge, with the equation
/// `I θ'' = −m g R sin(α − θ)`. With θ = θ0 (1 − s²) the integrand is smooth.
fn quarter(part: f64, inertia: f64) -> f64 {
    let start = part * alpha();
    let rate = MASS * G * radius() / inertia;
    let steps = 20_000;
    let sum: f64 = (0..steps)
        .map(|i| {
            let s = (f64::from(i) + 0.5) / f64::from(steps);
            let angle = start * (1.0 - s * s);
            let square = 2.0 * rate * ((alpha() - start).cos() - (alpha() - angle).cos());
            2.0 * s * start / square.sqrt()
        })
        .sum();
    sum / f64::from(steps)
}

/// Inertia about the lower edge. Nodal masses of n elements per edge have `1 + 2/n²` times the
/// moment of inertia of the block about its centre; rigid blocks have their own.
fn inertia(divisions: Option<u32>) -> f64 {
    let lumped = divisions.map_or(1.0, |n| 1.0 + 2.0 / f64::from(n * n));
    MASS * radius().powi(2) * (1.0 + lumped / 3.0)
}

/// The deck with another angle and its lower corners in place.
fn leaning(text: &str, part: f64) -> String {
    let (sin, cos) = (part * alpha()).sin_cos();
    let text = edited(text, "0.9925077", &format!("{cos:.10}"));
    let text = edited(&text, "0.1221815", &format!("{sin:.10}"));
    let text = edited(&text, "0.49625385", &format!("{:.10}", 2.0 * B * cos));
    edited(&text, "0.06109075", &format!("{:.10}", 2.0 * B * sin))
}

/// Angles of the base over time.
fn angles(run: &super::shared::Run, part: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = (part * alpha()).sin_cos();
    let [lx, lz, rx, rz] =
        ["left.x", "left.z", "right.x", "right.z"].map(|column| run.probes.series(column));
    let at = |i: usize| {
        let up = rz[i][1] + 2.0 * B * sin - lz[i][1];
        [lx[i][0], up.atan2(rx[i][1] + 2.0 * B * cos - lx[i][1])]
    };
    (0..lx.len()).map(at).collect()
}

/// Time at which the base is level for the first time.
fn level(angles: &[[f64; 2]]) -> f64 {
    let after = angles.iter().position(|[_, angle]| *angle <= 0.0).expect("it falls back");
    let ([t0, a0], [t1, a1]) = (angles[after - 1], angles[after]);
    t0 + (t1 - t0) * a0 / (a0 - a1)
}

/// Energies above the rest position at the tops of the swings, divided by that at the start.
fn swings(angles: &[[f64; 2]]) -> Vec<f64> {
    let height = |angle: f64| (alpha() - angle.abs()).cos() - alpha().cos();
    let start = height(angles[0][1]);
    let top = |w: &&[[f64; 2]]| w[1][1].abs() > w[0][1].abs() && w[1][1].abs() >= w[2][1].abs();
    let tops = angles.windows(3).filter(top).map(|w| height(w[1][1]) / start);
    // The smallest tops are the ringing after an impact.
    tops.filter(|energy| *energy > 0.1).collect()
}

#[test]
fn rigid_block_rocks_as_housner() {
    let case = of("v09_rocking");
    let kept = (1.0 - 1.5 * alpha().sin().powi(2)).powi(2);
    for part in [0.25, 0.5, 0.75] {
        let run = run(&leaning(&example(case.deck), part));
        let angles = angles(&run, part);
        let period = 4.0 * level(&angles);
        let what = format!("θ0/α = {part}");
        let exact = 4.0 * quarter(part, inertia(None));
        check(case, &format!("T, {what}: pendulum [s]"), exact, period, Relative(5e-3));
        let slender = 4.0 * housner(part);
        check(case, &format!("T, {what}: Housner [s]"), slender, period, Relative(1e-2));
        let swings = swings(&angles);
        for (impacts, often) in [(1, "one impact"), (2, "two impacts")] {
            let (exact, left) = (kept.powi(impacts), swings[impacts as usize - 1]);
            let name = format!("energy after {often}, {what}: Housner");
            check(case, &name, exact, left, Relative(5e-2 * f64::from(impacts)));
        }
        closes(case, &format!(", {what}"), &run);
    }
}

#[test]
fn deformable_block_rocks_as_housner() {
    let case = of("v09_rocking");
    let part = 0.5;
    for divisions in [2, 6] {
        let text = leaning(&body(&example(case.deck), "block", "deformable"), part);
        let text = edited(&text, "divisions = 2", &format!("divisions = {divisions}"));
        let text = edited(&text, "young = 18e9", "young = 18e8");
        let run = run(&edited(&text, "duration = 2.5 ", "duration = 0.55"));
        let period = 4.0 * level(&angles(&run, part));
        let what = format!("θ0/α = {part}, {divisions} divisions");
        let exact = 4.0 * quarter(part, inertia(Some(divisions)));
        check(
            case,
            &format!("T, {what}: pendulum of its nodes [s]"),
            exact,
            period,
            Relative(5e-3),
        );
        if divisions == 6 {
            let slender = 4.0 * housner(part);
            check(case, &format!("T, {what}: Housner [s]"), slender, period, Relative(1e-2));
        }
        closes(case, &format!(", {what}"), &run);
    }
}
