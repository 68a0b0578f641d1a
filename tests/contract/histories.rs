//! Loads and supports over time.

use super::decks::MATTER;
use super::shared::{edited, run};

/// One free block of 2400 kg, pushed evenly at all nodes, moves as a point mass.
const POINT: &str = "
[[blocks]]
name = 'block'
size = [1.0, 1.0, 1.0]
divisions = 1
material = 'rock'
[[load]]
where = { set = 'block' }
force = [2400.0, 0.0, 0.0]
history = HISTORY
from = 'push'
UNTIL
[[stage]]
name = 'wait'
kind = 'dynamic'
duration = 0.1
time_step = 1e-4
[[stage]]
name = 'push'
kind = 'dynamic'
duration = 0.4
time_step = 1e-4
[[stage]]
name = 'go'
kind = 'dynamic'
duration = 0.2
time_step = 1e-4
[[probe]]
name = 'way'
at = [0.0, 0.0, 0.0]
quantity = 'displacement'
every = 0.1
[[probe]]
name = 'pace'
at = [0.0, 0.0, 0.0]
quantity = 'velocity'
every = 0.1
";

fn point(history: &str, until: &str) -> String {
    let text = edited(&format!("{MATTER}{POINT}"), "HISTORY", history);
    edited(&text, "UNTIL", until)
}

/// Velocities along x at 0, 0.1, … 0.7 s, exact for accelerations that are linear in time.
#[track_caller]
fn assert_pace(text: &str, exact: [f64; 8]) {
    let run = run(text);
    let found = run.probes.series("pace.x");
    assert_eq!(found.len(), 8);
    for (i, ([time, v], exact)) in found.iter().zip(exact).enumerate() {
        assert!((time - 0.1 * i as f64).abs() < 1e-9, "sample {i} at {time}");
        assert!((v - exact).abs() < 1e-6, "{v} instead of {exact} at {time}");
    }
}

#[test]
fn ramp_starts_with_its_stage_and_ends_with_another() {
    // a = t/0.2, then 1; zero from the start of `go`.
    let ramp = "{ ramp = 0.2 }";
    assert_pace(&point(ramp, "until = 'go'"), [0.0, 0.0, 0.025, 0.1, 0.2, 0.3, 0.3, 0.3]);
    assert_pace(&point(ramp, ""), [0.0, 0.0, 0.025, 0.1, 0.2, 0.3, 0.4, 0.5]);
}

#[test]
fn table_is_linear_between_rows_and_constant_outside() {
    // 1 until 0.1, linear to −1 at 0.3, and constant afterwards.
    let table = "{ table = [[0.1, 1.0], [0.3, -1.0]] }";
    let exact = [0.0, 0.0, 0.1, 0.15, 0.1, 0.0, -0.1, -0.2];
    assert_pace(&point(table, ""), exact);
}

#[test]
fn load_without_history_acts_at_once() {
    let text = edited(&point("", ""), "history = \n", "");
    assert_pace(&text, [0.0, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
}

/// Column whose end is driven.
const DRIVEN: &str = "
[[blocks]]
size = [2.0, 1.0, 1.0]
count = [2, 1, 1]
divisions = 2
material = 'rock'
joint = 'seam'
[[fix]]
where = { x = 0.0 }
axes = 'xyz'
[[fix]]
where = { x = 2.0 }
axes = 'xy'
velocity = [0.02, -0.01, 0.0]
from = 'pull'
until = 'free'
[[fix]]
where = { x = 2.0 }
axes = 'z'
velocity = [0.0, 0.0, 0.03]
history = { table = [[0.0, 0.0], [1e-3, 1.0]] }
from = 'pull'
until = 'free'
[[stage]]
name = 'rest'
kind = 'dynamic'
duration = 1e-3
[[stage]]
name = 'pull'
kind = 'dynamic'
duration = 3e-3
damping = { ratio = 0.02 }
[[stage]]
name = 'free'
kind = 'dynamic'
duration = 1e-3
[[probe]]
name = 'end'
at = [2.0, 0.5, 1.0]
quantity = 'displacement'
every = 1e-4
[[probe]]
name = 'wall'
where = { x = 0.0 }
quantity = 'displacement'
every = 1e-4
";

#[test]
fn driven_supports_follow_history_and_release() {
    let run = run(&format!("{MATTER}{DRIVEN}"));
    let series = ["x", "y", "z"].map(|axis| run.probes.series(&format!("end.{axis}")));
    for [time, x] in &series[0] {
        let pulled = (time - 1e-3).clamp(0.0, 3e-3);
        if *time <= 4e-3 + 1e-12 {
            assert!((x - 0.02 * pulled).abs() < 1e-15, "{x:e} at {time}");
        } else {
            assert!((x - 0.02 * 3e-3).abs() > 1e-9, "still held at {time}");
        }
    }
    for [time, y] in series[1].iter().filter(|[time, _]| *time <= 4e-3 + 1e-12) {
        assert!((y + 0.01 * (time - 1e-3).max(0.0)).abs() < 1e-15, "{y:e} at {time}");
    }
    // ∫ of a linear rise to 1 in 1 ms, by the midpoints of the steps: exact except in the step in
    // which the rise ends.
    let step = run.summary.stages[1].time_step;
    let tolerance = 0.03 * 1e3 * step * step / 8.0 + 1e-14;
    for [time, z] in series[2].iter().filter(|[time, _]| *time <= 4e-3 + 1e-12) {
        let t = (time - 1e-3).max(0.0);
        let exact = 0.03 * if t < 1e-3 { 500.0 * t * t } else { t - 5e-4 };
        assert!((z - exact).abs() < tolerance, "{z:e} instead of {exact:e} at {time}");
    }
    let wall = run.probes.column("wall.x");
    assert!(wall.iter().all(|x| *x == 0.0));
    let balance = run.energy.column("balance");
    let work = run.energy.column("external_work");
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let off = largest(&balance) / largest(&work);
    println!("balance {off:.1e} of the work of the supports");
    assert!(off < 1e-6, "balance off by {off:e} of the work of the supports");
}
