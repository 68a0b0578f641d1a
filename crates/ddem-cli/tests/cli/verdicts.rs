//! Tests of the verdicts of stages: at rest, fails, undecided.

use serde_json::Value;

use super::harness::*;

/// Deck of a block on a plane of 30 degrees, with a friction angle and the keys of its first stage.
/// Gravity is rotated instead of the plane.
pub(super) fn slope(friction: f64, stage: &str) -> String {
    format!(
        "
[model]
gravity = [4.905, 0, -8.495709]
[contact]
friction = {friction:?}
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[[blocks]]
name = 'base'
origin = [-1, -0.5, -0.5]
size = [5, 2, 0.5]
divisions = 2
material = 'rock'
[[blocks]]
name = 'block'
size = [1, 1, 1]
divisions = 2
material = 'rock'
[[fix]]
where = {{ set = 'base' }}
axes = 'xyz'
[[stage]]
name = 'weight'
{stage}
[[stage]]
name = 'after'
kind = 'dynamic'
duration = 0.03
"
    )
}

/// Runs the slope and returns its exit status, its standard error and the stages of its summary.
fn run_slope(friction: f64, stage: &str) -> (Option<i32>, String, Vec<Value>) {
    let desk = Desk::new();
    desk.write("slope.toml", &slope(friction, stage));
    let outcome = desk.run("slope.toml");
    let summary: Value =
        serde_json::from_slice(&desk.read("results/slope/summary.json")).expect("a summary");
    for name in ["checkpoint.h5", "blocks.vtkhdf"] {
        assert!(desk.path("results/slope").join(name).exists(), "{name}");
    }
    let stages = summary["stages"].as_array().expect("stages").clone();
    (outcome.status, outcome.stderr, stages)
}

const RELAX: &str = "kind = 'relax'";
const TO_REST: &str =
    "kind = 'dynamic'\nduration = 3.0\nuntil_rest = true\ndamping = { local = 0.8 }";

#[test]
fn sliding_block_fails_and_is_named() {
    for kind in [RELAX, TO_REST] {
        let (status, message, stages) = run_slope(25.0, kind);
        assert_eq!(status, Some(1), "{message}");
        let error = "error: stage `weight`: there is no equilibrium: 1 block keeps moving: block 1 (set `block`), ";
        assert!(message.contains(error), "{message}");
        assert_eq!((stages.len(), &stages[0]["verdict"]), (1, &Value::from("fails")));
        assert!(stages[0]["steps"].as_u64().is_some_and(|steps| steps < 60_000), "{stages:?}");
        let moving = stages[0]["moving"].as_array().expect("blocks");
        assert_eq!(moving.len(), 1);
        assert_eq!((&moving[0]["set"], &moving[0]["index"]), (&"block".into(), &1.into()));
        assert!(moving[0]["distance"].as_f64().is_some_and(|way| way > 1e-6), "{moving:?}");
        assert!(moving[0]["direction"][0].as_f64().is_some_and(|x| x > 0.99), "{moving:?}");
    }
}

#[test]
fn block_held_by_friction_is_at_rest() {
    for kind in [RELAX, TO_REST] {
        let (status, message, stages) = run_slope(35.0, kind);
        assert_eq!(status, Some(0), "{message}");
        assert_eq!(
            (stages.len(), &stages[0]["verdict"]),
            (2, &Value::from("at rest")),
            "{message}"
        );
        assert_eq!(stages[0]["moving"].as_array().map(Vec::len), Some(0));
        assert!(message.contains("weight: at rest after"), "{message}");
    }
}

/// An accelerating block is not at rest even while it is slow, nor is a block that a load keeps
/// pushing.
#[test]
fn accelerating_block_is_not_at_rest() {
    let push = "[[load]]\nwhere = { set = 'block', side = 'x-' }\ntraction = [4e3, 0, 0]\n\
                history = { ramp = 0.3 }";
    for (friction, stage) in [(29.0, TO_REST.to_owned()), (35.0, format!("{TO_REST}\n{push}"))] {
        let (status, message, stages) = run_slope(friction, &stage);
        assert_eq!((status, &stages[0]["verdict"]), (Some(1), &"fails".into()), "{message}");
    }
}

/// A falling block that lands comes to rest. A block that is still falling at the end fails.
#[test]
fn falling_block_fails_unless_it_lands() {
    for (height, duration, status, verdict) in [
        (0.05, 3.0, Some(0), "at rest"),
        (0.6, 3.0, Some(0), "at rest"),
        (0.6, 0.3, Some(1), "fails"),
    ] {
        let stage = format!("kind = 'dynamic'\nduration = {duration:?}\nuntil_rest = true");
        let deck = slope(60.0, &stage)
            .replace("size = [1, 1, 1]", &format!("origin = [0, 0, {height}]\nsize = [1, 1, 1]"));
        let desk = Desk::new();
        desk.write("slope.toml", &deck.replace("[4.905, 0, -8.495709]", "[0, 0, -9.81]"));
        let outcome = desk.run("slope.toml");
        let summary: Value =
            serde_json::from_slice(&desk.read("results/slope/summary.json")).expect("a summary");
        assert_eq!(
            (outcome.status, &summary["stages"][0]["verdict"]),
            (status, &verdict.into()),
            "{}",
            outcome.stderr
        );
    }
}

#[test]
fn run_continues_after_failure_if_asked() {
    let (status, message, stages) = run_slope(25.0, "kind = 'relax'\non_failure = 'continue'");
    assert_eq!((status, stages.len()), (Some(0), 2), "{message}");
    assert_eq!(stages[0]["verdict"], "fails");
    assert!(
        message.contains("warning: stage[0]: stage `weight`: there is no equilibrium"),
        "{message}"
    );
    assert!(message.contains("[failed-stage]"), "{message}");
}

#[test]
fn too_few_steps_are_undecided() {
    let (status, message, stages) = run_slope(35.0, "kind = 'relax'\nmax_steps = 20");
    assert_eq!((status, stages.len()), (Some(1), 1), "{message}");
    assert_eq!(stages[0]["verdict"], "undecided");
    assert!(message.contains("not in equilibrium after 20 steps"), "{message}");
}

/// tan 35°/tan 30° = 1.21279.
#[test]
fn safety_stage_gives_factor_of_safety() {
    let relaxed = "kind = 'relax'\n[[stage]]\nname = 'safety'\nkind = 'safety'";
    let (status, message, stages) = run_slope(35.0, relaxed);
    assert_eq!((status, stages.len()), (Some(0), 3), "{message}");
    let safety = &stages[1];
    let factor = safety["factor"].as_f64().expect("a factor");
    assert!((factor / 1.21279 - 1.0).abs() < 5e-3, "{message}");
    let [stable, unstable] = [0, 1].map(|k| safety["bracket"][k].as_f64().expect("an end"));
    assert!(stable < factor && factor < unstable && unstable - stable < 0.005, "{safety}");
    assert_eq!((&safety["kind"], &safety["verdict"]), (&"safety".into(), &"at rest".into()));
    assert_eq!(safety["moving"][0]["set"], "block");
    assert!(message.contains("safety: factor of safety 1.21"), "{message}");
    // The search leaves the state of the model unchanged.
    assert_eq!(stages[2]["verdict"], "at rest");
    let (_, message, stages) = run_slope(35.0, &format!("{relaxed}\nbracket = [2, 3]"));
    assert_eq!((&stages[1]["factor"], &stages[1]["verdict"]), (&Value::Null, &"at rest".into()));
    assert!(
        message.contains("the blocks fail with the smallest factor, 2; lower the first number of `bracket` [factor-below-bracket]"),
        "{message}"
    );
}

/// tan 20°/tan 30° = 0.63041: a slope that fails has a factor of safety, too. It refers to the
/// state before the failure.
#[test]
fn failing_slope_has_factor_below_one() {
    let relaxed = "kind = 'relax'\n[[stage]]\nname = 'safety'\nkind = 'safety'";
    let (status, message, stages) = run_slope(20.0, relaxed);
    assert_eq!((status, stages.len()), (Some(0), 3), "{message}");
    assert_eq!(stages[0]["verdict"], "fails");
    assert!(
        message.contains("the factor of safety refers to the state at the start of `weight`"),
        "{message}"
    );
    let factor = stages[1]["factor"].as_f64().expect("a factor");
    assert!((factor / 0.63041 - 1.0).abs() < 5e-3, "{message}");
    // A given `on_failure` is kept.
    let stop = relaxed.replacen("'relax'", "'relax'\non_failure = 'stop'", 1);
    let (status, message, stages) = run_slope(20.0, &stop);
    assert_eq!((status, stages.len()), (Some(1), 1), "{message}");
}

/// tan 30°/tan 30° = 1: the search also divides the default friction of contacts.
#[test]
fn search_reduces_default_contact_friction() {
    let desk = Desk::new();
    let slope = slope(30.0, "kind = 'safety'\nbracket = [0.9, 1.2]");
    desk.write("slope.toml", &slope.replace("friction = 30.0", ""));
    desk.run("slope.toml");
    let summary: Value =
        serde_json::from_slice(&desk.read("results/slope/summary.json")).expect("a summary");
    let factor = summary["stages"][0]["factor"].as_f64().expect("a factor");
    assert!((factor - 1.0).abs() < 5e-3, "{factor}");
}

/// Trials that end too early give no factor.
#[test]
fn undecided_trials_give_no_factor() {
    let search = "kind = 'relax'\n[[stage]]\nname = 'safety'\nkind = 'safety'\nmax_steps = 10";
    let (_, message, stages) = run_slope(35.0, search);
    assert_eq!((&stages[1]["factor"], &stages[1]["verdict"]), (&Value::Null, &"at rest".into()));
    assert_eq!(stages[1]["bracket"], serde_json::json!([null, null]));
    assert!(
        message.contains("there is no factor of safety: the trial with strengths / 0.5"),
        "{message}"
    );
}

/// A column of rigid blocks with tan α = 0.2 stands, because tan α is below b/h = 0.25. The
/// cohesion of its joint does not change that.
#[test]
fn cohesion_does_not_topple_rigid_blocks() {
    let column = |cohesion: f64| {
        slope(40.0, RELAX)
            .replace("[4.905, 0, -8.495709]", "[1.92, 0, -9.6]")
            .replace(
                "[contact]\n",
                "[joints.joint]\nnormal_stiffness = 1e10\nshear_stiffness = 5e9\n",
            )
            .replace("friction = 40.0", &format!("friction = 40.0\ncohesion = {cohesion:?}"))
            .replace(
                "size = [1, 1, 1]\ndivisions = 2",
                "size = [1, 1, 8]\ncount = [1, 1, 2]\nbody = 'rigid'\njoint = 'joint'",
            )
            .replace(
                "origin = [-1, -0.5, -0.5]\nsize = [5, 2, 0.5]",
                "origin = [-1, -0.5, -9]\nsize = [5, 2, 0.5]",
            )
            + "[[fix]]\nwhere = { z = 0.0, set = 'block' }\naxes = 'xyz'\n"
    };
    for cohesion in [0.0, 1.0, 1e5] {
        let desk = Desk::new();
        desk.write("column.toml", &column(cohesion));
        let outcome = desk.run("column.toml");
        assert!(outcome.stderr.contains("weight: at rest"), "{cohesion}: {}", outcome.stderr);
    }
}

#[test]
fn search_without_strengths_is_refused() {
    let desk = Desk::new();
    let slope = slope(35.0, "kind = 'safety'").replace("[model]", "[model]\ncontact = false");
    desk.write("slope.toml", &slope.replace("[contact]\nfriction = 35.0\n", ""));
    let outcome = desk.run("slope.toml");
    assert_eq!(outcome.status, Some(2), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("there is no strength to divide"), "{}", outcome.stderr);
}

#[test]
fn invalid_search_is_refused() {
    let desk = Desk::new();
    for (keys, words) in [
        ("bracket = [2, 1]", "two factors above 0, the smaller one first"),
        ("joints = ['seam']", "there is no joint named `seam`"),
        ("duration = 1.0", "`duration` is a key of dynamic stages"),
        ("resolution = 0", "`resolution` is 0 but must be above 0"),
        ("joints = []", "`joints` is empty: no strength would be divided"),
    ] {
        desk.write("slope.toml", &slope(35.0, &format!("kind = 'safety'\n{keys}")));
        let outcome = desk.run("slope.toml");
        assert_eq!(outcome.status, Some(2), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(words), "{}", outcome.stderr);
    }
}
