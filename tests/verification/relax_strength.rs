//! Static stages break joints that are overloaded in equilibrium, and no others.

use super::record::Tolerance::{Absolute, Relative};
use super::record::{check, of};
use super::shared::{Frames, edited, example, run};

const WEIGHT: f64 = 2400.0 * 9.81;

#[test]
fn joint_five_percent_overloaded_breaks() {
    let case = of("relax_strength");
    let run = run(&example(case.deck));
    check(case, "upper wall [N], strength / 1.05", WEIGHT, run.last("upper.z"), Relative(1e-6));
    let lower = run.last("lower.z");
    check(case, "lower wall [N], strength / 1.05", 2.0 * WEIGHT, lower, Relative(1e-6));
    let joints = Frames::open(run.path("joints.vtkhdf"));
    let states = joints.last_scalars("state");
    for (point, state) in joints.points().iter().zip(states) {
        assert_eq!(state, if point[2] > 1.5 { 2.0 } else { 0.0 }, "at {point:?}");
    }
}

#[test]
fn joint_with_five_percent_reserve_changes_no_bit() {
    let case = of("relax_strength");
    let text = edited(&example(case.deck), "tension = 11211.4", "tension = 12391.6");
    let run = run(&text);
    for wall in ["upper.z", "lower.z"] {
        let what = format!("{wall} [N], strength / 0.95");
        check(case, &what, 1.5 * WEIGHT, run.last(wall), Relative(1e-6));
    }
    let failed = run.summary.failed_pairs.shear + run.summary.failed_pairs.tension;
    check(case, "failed pairs, strength / 0.95", 0.0, failed as f64, Absolute(0.0));
    let lines = text.lines();
    let strengths = ["cohesion", "friction", "tension"];
    let strong = lines.filter(|line| !strengths.iter().any(|key| line.starts_with(key)));
    let strong = strong.collect::<Vec<_>>().join("\n");
    let bits = |run: &super::shared::Run| {
        let frames = Frames::open(run.path("blocks.vtkhdf"));
        let u = frames.last_vectors("displacement").into_flattened();
        u.into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    assert!(bits(&run) == bits(&super::shared::run(&strong)), "strength changed the answer");
}
