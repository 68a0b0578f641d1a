//! V14: outgoing waves, incoming waves, and level ground beside the model.

use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{Case, at_most, check, consistent, of};
use super::shared::{Run, edited, example, run};

/// Largest absolute value from a time on.
fn largest_after(samples: &[[f64; 2]], time: f64) -> f64 {
    let late = samples.iter().filter(|[t, _]| *t >= time);
    late.fold(0.0, |most: f64, [_, v]| most.max(v.abs()))
}

/// Checks that the energies include the losses of dashpots and the work of waves.
pub(crate) fn closes(case: Case, what: &str, run: &Run) {
    let largest = |column: &str| largest_after(&run.energy.series(column), 0.0);
    let error = largest("balance") / largest("external_work");
    let what = format!("energy balance / external work{what}");
    consistent(case, &what, 0.0, error, Of(1.0, 1e-9));
}

/// Time and value of the sample that is largest after multiplication by a sign, within a range of
/// times.
fn peak(samples: &[[f64; 2]], sign: f64, [from, to]: [f64; 2]) -> [f64; 2] {
    let within = samples.iter().filter(|[t, _]| (from..=to).contains(t));
    let highest = within.max_by(|a, b| (sign * a[1]).total_cmp(&(sign * b[1])));
    *highest.expect("samples in that time")
}

fn leaves(deck: &str, axis: &str, [speed, peak, length]: [f64; 3]) {
    let case = of(deck);
    let run = run(&example(deck));
    let mid = run.probes.series(&format!("mid.{axis}"));
    let passed = (10.5 + speed * length) / speed;
    let back = 29.5 / speed;
    assert!(passed < back, "what comes back is apart from what passes");
    check(case, "peak velocity of the pulse [m/s]", peak, largest_after(&mid, 0.0), Relative(1e-2));
    let reflected = largest_after(&mid, back) / largest_after(&mid, 0.0);
    at_most(case, "reflected amplitude / peak", 1e-2, reflected);
    let energy = |column: &str| *run.energy.column(column).last().expect("a row");
    let left = energy("kinetic") + energy("strain_bodies") + energy("strain_joints");
    at_most(case, "energy left / work done", 1e-4, left / energy("external_work"));
    closes(case, "", &run);
}

#[test]
fn viscous_boundary_absorbs_compression_wave() {
    leaves("v14_p", "x", [3000.0, 1e6 / (2400.0 * 3000.0), 4e-3]);
}

#[test]
fn viscous_boundary_absorbs_shear_wave() {
    let speed = (7.2e9_f64 / 2400.0).sqrt();
    leaves("v14_s", "y", [speed, 1e5 / (2400.0 * speed), 6e-3]);
}

/// Velocity of a sin² pulse of 6 ms at a time.
fn pulse(time: f64) -> f64 {
    let part = (time / 6e-3).clamp(0.0, 1.0);
    (std::f64::consts::PI * part).sin().powi(2)
}

#[test]
fn incoming_wave_doubles_at_free_surface() {
    let case = of("v14_wave");
    let shear = example(case.deck);
    let free = edited(&shear, "axes = \"yz\"", "axes = \"xy\"");
    let press = edited(&free, "velocity = [0.1, 0.0, 0.0]", "velocity = [0.0, 0.0, 0.1]");
    for (wave, text, axis, speed) in
        [("shear", shear, "x", (7.2e9_f64 / 2400.0).sqrt()), ("compression", press, "z", 3000.0)]
    {
        doubles(case, wave, &text, axis, speed);
    }
}

/// Checks that a wave from below moves the surface at `z = 20 m` twice as fast.
fn doubles(case: Case, wave: &str, text: &str, axis: &str, speed: f64) {
    let run = run(text);
    let surface = run.probes.series(&format!("surface.{axis}"));
    let highest = largest_after(&surface, 0.0);
    check(case, &format!("peak of the surface, {wave} [m/s]"), 0.2, highest, Relative(1e-2));
    let away = |[t, v]: &[f64; 2]| (v - 0.2 * pulse(t - 20.0 / speed)).abs();
    let most = surface.iter().map(away).fold(0.0, f64::max);
    let what = format!("largest difference of the surface from 2 v, {wave} [m/s]");
    check(case, &what, 0.0, most, Absolute(4e-3));
    let way = run.last(&format!("way.{axis}"));
    check(case, &format!("way of the surface, {wave} [m]"), 6e-4, way, Relative(1e-3));
    closes(case, &format!(", {wave}"), &run);
}

#[test]
fn incoming_wave_passes_through_cells() {
    let case = of("cells_wave");
    let text = example(case.deck);
    doubles(case, "shear", &text, "x", (7.2e9_f64 / 2400.0).sqrt());
    // Local damping does not act on the wave itself.
    let damped = edited(&text, "damping = \"none\"", "damping = { local = 1e-6 }");
    doubles(case, "shear, damped", &damped, "x", (7.2e9_f64 / 2400.0).sqrt());
}

fn peaks(run: &Run) -> [[f64; 2]; 2] {
    let middle = run.probes.series("middle.x");
    let first = peak(&middle, 1.0, [0.0, 0.025]);
    [first, peak(&middle, -1.0, [0.025, 0.045])]
}

#[test]
fn free_field_sides_act_as_level_ground() {
    let case = of("v14_free_field");
    let text = example(case.deck);
    let run = run(&text);
    let [hard, soft] = [(7.2e9_f64, 2400.0), (1.8e9_f64, 2000.0)];
    let speed = |(shear, density): (f64, f64)| (shear / density).sqrt();
    let impedance = |(shear, density): (f64, f64)| (shear * density).sqrt();
    let (z1, z2) = (impedance(hard), impedance(soft));
    let first = 0.2 * 2.0 * z1 / (z1 + z2);
    let at = 8.0 / speed(hard) + 8.0 / speed(soft) + 3e-3;
    let [[t1, v1], [t2, v2]] = peaks(&run);
    check(case, "first peak of the surface [m/s]", first, v1, Relative(1e-2));
    check(case, "time of the first peak [s]", at, t1, Relative(1e-2));
    let second = first * (z2 - z1) / (z2 + z1);
    check(case, "second peak [m/s]", second, v2, Relative(1e-2));
    let at = at + 16.0 / speed(soft);
    check(case, "time of the second peak [s]", at, t2, Relative(1e-2));
    let [middle, side] = ["middle.x", "side.x"].map(|column| run.probes.series(column));
    let apart = middle.iter().zip(&side).map(|(a, b)| (a[1] - b[1]).abs()).fold(0.0, f64::max);
    at_most(case, "largest difference of side and middle / peak", 1e-5, apart / v1);
    let risen = largest_after(&run.probes.series("side.z"), 0.0);
    at_most(case, "largest velocity of the side along z / peak", 1e-5, risen / v1);
    closes(case, "", &run);
    // The same with dashpots only at the sides: these resist the motion that the free field
    // supports.
    let bare = super::shared::run(&edited(&text, "free-field\"", "viscous\""));
    let [[_, held], _] = peaks(&bare);
    at_most(case, "first peak with viscous sides / with a free field", 0.5, held / v1);
}
