//! V3: the beam under a line load.

use super::record::Tolerance::{Of, Relative};
use super::record::{at_most, check, of};
use super::shared::{Frames, edited, example, root, run};

fn beam(deck: &str, exact: f64) {
    let case = of(deck);
    let run = run(&example(deck));
    check(case, "u_z below midspan [m]", exact, run.last("mid.z"), Relative(2e-6));
    check(case, "support force, z [N]", 1.8e6, run.last("base.z"), Relative(1e-6));
    for axis in ["base.x", "base.y"] {
        check(case, &format!("{axis} [N]"), 0.0, run.last(axis), Of(1.8e6, 1e-6));
    }
    let text = edited(&example(deck), "tolerance = 1e-8", "tolerance = 1e-6");
    let quick = super::shared::run(&text);
    let what = "steps of relaxation to a ratio of 1e-6";
    at_most(case, what, 5000.0, quick.steps() as f64);
    let what = "u_z below midspan, relaxed to 1e-6 [m]";
    check(case, what, exact, quick.last("mid.z"), Relative(2e-5));
    if deck == "v03_beam" {
        check(case, "u_x at x = 5.995 m [m]", 2.44960e-4, run.last("mid.x"), Relative(5e-6));
        let frames = Frames::open(run.path("blocks.vtkhdf"));
        let error = stored(&frames.points(), &frames.last_vectors("displacement"));
        let what = "stored FEM nodes: largest difference / largest displacement";
        check(case, what, 0.0, error, Of(1.0, 1e-5));
    }
}

/// Largest difference from the stored finite element solution, over its largest value.
fn stored(points: &[[f64; 3]], displacements: &[[f64; 3]]) -> f64 {
    let text = std::fs::read_to_string(root("tests/data/v3_beam_fem.csv")).expect("the solution");
    let (mut most, mut error, mut compared) = (0.0_f64, 0.0_f64, 0);
    for line in text.lines().skip(2) {
        let row: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("numbers")).collect();
        let far = |p: &[f64; 3]| (0..3).map(|c| (p[c] - row[c]).abs()).fold(0.0, f64::max);
        let node = points.iter().position(|p| far(p) < 2e-6).expect("a node at that place");
        for c in 0..3 {
            most = most.max(row[3 + c].abs());
            error = error.max((displacements[node][c] - row[3 + c]).abs());
        }
        compared += 1;
    }
    assert!(compared >= 60);
    error / most
}

#[test]
fn beam_with_joints_of_10_mm_matches_fem() {
    beam("v03_beam", -6.81154e-4);
}

#[test]
fn beam_with_joints_of_1_mm_matches_fem() {
    beam("v03_beam_t0001", -6.80937e-4);
}

#[test]
fn beam_with_joints_of_50_mm_matches_fem() {
    beam("v03_beam_t005", -6.82077e-4);
}
