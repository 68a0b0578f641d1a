//! V10 with joints that break: pieces that fly apart keep their momentum.

use super::energy::closes;
use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{check, consistent, of};
use super::rotation::invariants;
use super::shared::{deck, example, run, simulation};
use ddem_deck::TimeStep;
use nalgebra::Vector3;

fn flight(name: &str) {
    let case = of(name);
    let text = example(name);
    let stage = deck(&text).stage[0].clone();
    let mut simulation = simulation(&text);
    let duration = stage.duration.expect("a duration");
    let damping = stage.damping.unwrap_or_default();
    simulation.start(damping, TimeStep::Auto, Some(duration)).expect("a stable step");
    let (p0, l0, _) = invariants(&mut simulation);
    let [mut momentum, mut angular] = [0.0_f64; 2];
    // The step becomes shorter when the first pair fails.
    while simulation.steps_left() != Some(0) {
        simulation.step().expect("finite numbers");
        if simulation.steps().is_multiple_of(20) || simulation.steps_left() == Some(0) {
            let (p, l, _) = invariants(&mut simulation);
            momentum = momentum.max((p - p0).norm() / p0.norm());
            angular = angular.max((l - l0).norm() / l0.norm());
        }
    }
    consistent(case, "momentum: largest relative change", 0.0, momentum, Of(1.0, 1e-12));
    consistent(case, "angular momentum: largest relative change", 0.0, angular, Of(1.0, 1e-11));
    // The centre of mass keeps its velocity.
    let model = simulation.model();
    let mass = |node: usize| model.mass(node);
    let total: f64 = (0..model.n_nodes()).map(mass).sum();
    let moved = |node: usize| mass(node) * Vector3::from(simulation.displacement(node));
    let travel: Vector3<f64> = (0..model.n_nodes()).map(moved).sum::<Vector3<f64>>() / total;
    let expected = p0 / total * duration;
    let what =
        "displacement of the centre of mass, expected: momentum at the start / mass × time [m]";
    consistent(case, what, expected.norm(), travel.norm(), Relative(1e-9));
    assert!((travel - expected).norm() < 1e-9 * expected.norm(), "it moves elsewhere");
    let failed = simulation.failed_pairs().iter().sum::<u64>();
    check(case, "failed pairs", 12.0 * 9.0, failed as f64, Absolute(0.0));
    closes(case, "", &run(&text));
}

#[test]
fn blocks_parted_at_spring_joint_keep_momentum() {
    flight("v10_apart_spring");
}

#[test]
fn blocks_parted_at_thick_joint_keep_momentum() {
    flight("v10_apart_thick");
}
