//! Tests of sets that touch, on the command line: messages about joined and unjoined sets.

use super::harness::*;

/// Set `block` on a bed of 3 × 3 blocks, and a loose block beside it.
const BED: &str = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
thickness = 0.01
material = 'rock'
[model]
gravity = [0, 0, -9.81]
[[blocks]]
name = 'bed'
size = [3, 3, 1]
count = [3, 3, 1]
divisions = 1
material = 'rock'
joint = 'seam'
[[blocks]]
name = 'block'
origin = [0, 0.5, 1.0]
size = [2, 2, 1]
count = [2, 2, 1]
divisions = 1
material = 'rock'
joint = 'seam'
[[blocks]]
name = 'loose'
origin = [2, 1, 1]
size = [1, 1, 1]
divisions = 1
material = 'rock'
[[fix]]
where = { set = 'bed' }
axes = 'xyz'
[[stage]]
name = 'settle'
kind = 'dynamic'
duration = 1e-4
";

const JOINED: &str = "sets `bed` and `block` are joined by joint `seam` over 8 faces";
const TOUCH: &str =
    "sets `bed` and `loose` touch over 1 face without a joint: their blocks interact by contact";

#[test]
fn report_lists_joined_and_touching_sets() {
    let desk = Desk::new();
    desk.write("bed.toml", BED);
    let outcome = desk.run("bed.toml --check");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    for line in [format!("joined         {JOINED}"), format!("touching       {TOUCH}")] {
        assert!(outcome.stdout.lines().any(|own| own == line), "{}", outcome.stdout);
    }
    let outcome = desk.run("bed.toml --out a");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    for line in [JOINED, TOUCH] {
        assert!(outcome.stderr.lines().any(|own| own == line), "{}", outcome.stderr);
    }
    let summary: serde_json::Value = serde_json::from_slice(&desk.read("a/summary.json")).unwrap();
    let first = serde_json::json!({ "sets": ["bed", "block"], "joint": "seam", "faces": 8 });
    let second = serde_json::json!({ "sets": ["bed", "loose"], "joint": null, "faces": 1 });
    let third = serde_json::json!({ "sets": ["block", "loose"], "joint": null, "faces": 2 });
    assert_eq!(summary["interfaces"], serde_json::json!([first, second, third]));
}

/// A gap of half the joint's thickness gives a warning instead of a joint.
#[test]
fn unfilled_gap_warns() {
    let desk = Desk::new();
    desk.write("bed.toml", &BED.replace("[0, 0.5, 1.0]", "[0, 0.5, 1.005]"));
    for arguments in ["bed.toml --check", "bed.toml --out a"] {
        let outcome = desk.run(arguments);
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        let warning = "warning: blocks[1]: sets `bed` and `block` are not joined over 8 faces: there is a gap of \
                       5.000e-3 m, but joint `seam` is 1.000e-2 m thick; joints join sets that touch, or whose \
                       gap is as wide as the joint is thick [joint-does-not-fill]";
        assert!(outcome.stderr.lines().any(|own| own == warning), "{}", outcome.stderr);
        let message = outcome.stdout + &outcome.stderr;
        assert!(!message.contains("are joined by joint"), "{message}");
    }
    // A gap that the joint fills.
    desk.write("bed.toml", &BED.replace("[0, 0.5, 1.0]", "[0, 0.5, 1.01]"));
    let outcome = desk.run("bed.toml --check");
    assert!(outcome.stdout.contains(JOINED) && !outcome.stderr.contains("bed"), "{outcome:?}");
}
