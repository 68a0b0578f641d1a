//! V5: a column of two blocks is pulled until its joint breaks.

use super::energy::closes;
use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{Case, check, of};
use super::shared::{Frames, Run, edited, example, run};

const STRENGTH: f64 = 1e6;
/// λ + 2G of the rock.
const HELD: f64 = 21.6e9;
const YOUNG: f64 = 18e9;
/// Time at which the top has risen by this distance; it starts with a ramp of 0.05 s.
fn time(risen: f64) -> f64 {
    risen / 5e-4 + 0.05 / 2.0
}

/// Largest force up to a time; after failure the blocks ring.
fn peak(run: &Run, until: f64) -> f64 {
    let before = run.probes.series("base.z").into_iter().take_while(|[time, _]| *time <= until);
    before.fold(0.0, |peak: f64, [_, force]| peak.max(-force))
}

fn breaks(case: Case, what: &str, run: &Run, compliance: f64) {
    let joints = Frames::open(run.path("joints.vtkhdf"));
    let times = joints.last_scalars("failure_time");
    let [first, last] = [f64::min, f64::max].map(|f| times.iter().copied().reduce(f).expect("9"));
    let peak = peak(run, last);
    check(case, &format!("peak of the traction [Pa]{what}"), STRENGTH, peak, Relative(5e-3));
    let exact = time(STRENGTH * compliance);
    check(case, &format!("first failure [s]{what}"), exact, first, Relative(5e-3));
    check(case, &format!("last failure [s]{what}"), exact, last, Relative(5e-3));
    assert_eq!(times.len(), 9);
    assert!(joints.last_scalars("state").iter().all(|state| *state == 2.0), "not in tension");
    assert!(joints.last_scalars("open").iter().all(|open| *open == 1.0), "not open");
    assert_eq!([run.summary.failed_pairs.tension, run.summary.failed_pairs.shear], [9, 0]);
    let left = joints.last_vectors("traction").into_flattened();
    let left = left.into_iter().fold(0.0, |most: f64, t| most.max(t.abs()));
    check(case, &format!("traction after it [Pa]{what}"), 0.0, left, Absolute(0.0));
    let force = run.last("base.z").abs();
    check(case, &format!("force at the end [N]{what}"), 0.0, force, Of(STRENGTH, 1e-3));
    closes(case, what, run);
}

#[test]
fn thick_joint_breaks_at_tensile_strength() {
    let case = of("v05_pull_thick");
    breaks(case, "", &run(&example(case.deck)), 1.99 / HELD + 0.01 / 1.2e8);
}

#[test]
fn spring_joint_breaks_at_tensile_strength() {
    let case = of("v05_pull_spring");
    let text = example(case.deck);
    breaks(case, "", &run(&text), 2.0 / HELD + 1.0 / 1e10);
    // Free sides: supports along two edges prevent rotation and drift of the blocks.
    let sides = "[[fix]]                            # nothing moves sideways\naxes = \"xy\"\n";
    let edges = "[[fix]]\nwhere = { x = 0.0, y = 0.0 }\naxes = \"xy\"\n\
                 [[fix]]\nwhere = { x = 1.0, y = 0.0 }\naxes = \"y\"\n";
    let free = run(&edited(&text, sides, edges));
    breaks(case, ", free sides", &free, 2.0 / YOUNG + 1.0 / 1e10);
}

/// Checks that the opening takes the fracture energy.
fn softens(what: &str, text: &str, energy: f64) {
    let case = of("v05_pull_softening");
    let run = run(text);
    let is = |quantity: &str, exact: f64, computed: f64, tolerance| {
        check(case, &format!("{quantity}, {what}"), exact, computed, Relative(tolerance));
    };
    is("peak of the traction [Pa]", STRENGTH, peak(&run, f64::INFINITY), 5e-3);
    let last = |name: &str| *run.energy.column(name).last().expect("a row");
    is("fracture [J]", energy, last("fracture"), 1e-2);
    is("external work [J]", energy, last("external_work"), 1e-2);
    let force = run.last("base.z").abs();
    let end = format!("force at the end [N], {what}");
    check(case, &end, 0.0, force, Of(STRENGTH, 1e-3));
    let joints = Frames::open(run.path("joints.vtkhdf"));
    let damage = joints.last_scalars("damage");
    assert!(damage.iter().all(|damage| *damage == 1.0), "{damage:?}");
    closes(case, &format!(", {what}"), &run);
}

#[test]
fn softening_dissipates_fracture_energy_for_any_divisions() {
    let text = example("v05_pull_softening");
    softens("divisions 2", &text, 200.0);
    softens("divisions 4", &edited(&text, "divisions = 2", "divisions = 4"), 200.0);
}

/// With contacts an opened joint is released, but not before it has softened.
#[test]
fn softening_dissipates_fracture_energy_with_contacts() {
    let text = edited(&example("v05_pull_softening"), "contact = false", "contact = true");
    softens("with contact", &text, 200.0);
    let rigid = "joint = \"seam\"\nbody = \"rigid\"\n";
    softens("rigid blocks", &edited(&text, "joint = \"seam\"\n", rigid), 200.0);
}

#[test]
fn softening_between_cells_dissipates_fracture_energy() {
    let text = example("v05_pull_softening");
    let (from, to) = (text.find("[[blocks]]"), text.find("[[fix]]"));
    let (before, after) = (&text[..from.expect("blocks")], &text[to.expect("supports")..]);
    // An oblique plane divides both blocks into cells that stay joined.
    let cells = "[[region]]\nbox = { from = [0, 0, 0], to = [1, 1, 2] }\nmaterial = \"rock\"\n\
                 [[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 1] }\njoint = \"seam\"\n\
                 [[cut]]\nplane = { dip = 75, dip_direction = 110, through = [0.45, 0.55, 1] }\njoin = true\n\n";
    let text = format!("{before}{cells}{after}");
    softens("cells", &text, 200.0);
    let rigid = "material = \"rock\"\nbody = \"rigid\"\n[[cut]]";
    softens("rigid cells", &edited(&text, "material = \"rock\"\n[[cut]]", rigid), 200.0);
}

#[test]
fn softening_of_thick_joint_dissipates_fracture_energy() {
    let brittle = "tension = 1e6                      # Pa\n";
    let soft = "tension = 1e6\nfracture_energy = [200, 10000]\n";
    let text = edited(&example("v05_pull_thick"), brittle, soft);
    softens("thick joint", &edited(&text, "duration = 0.5 ", "duration = 1.4 "), 200.0);
}

/// Deck whose top moves by another history.
fn going(text: &str, table: &str, duration: f64) -> String {
    let ramp = "history = { ramp = 0.05 }          # s: the top lags by half of it";
    let text = edited(text, ramp, &format!("history = {{ table = {table} }}"));
    let line = text.lines().find(|line| line.starts_with("duration")).expect("a duration");
    text.replace(line, &format!("duration = {duration}"))
}

#[test]
fn softening_unloads_towards_the_origin() {
    let case = of("v05_pull_softening");
    // Up to 0.3 mm, back to 0.075 mm at 1.15 s, and up again until failure is complete.
    let table = "[[0, 0], [0.05, 1], [0.6, 1], [0.7, -1], [1.1, -1], [1.2, 1]]";
    let run = run(&going(&example(case.deck), table, 2.2));
    // The displacement of the top is that of the rock plus that of the joint's softening line,
    // which falls from the peak at 0.1 mm to zero at 0.4 mm: u = 0.4e-3 + T (2/M - 0.3e-3/1e6).
    let most = (0.4e-3 - 0.3e-3) / (0.3e-3 / STRENGTH - 2.0 / HELD);
    let force = run.probes.series("base.z");
    let at = |time: f64| -force.iter().find(|f| f[0] >= time).expect("a sample")[1];
    check(case, "traction at 0.3 mm, turning [Pa]", most, at(0.65), Relative(5e-3));
    let back = most * 0.075 / 0.3;
    check(case, "traction at 0.075 mm, back on the secant [Pa]", back, at(1.15), Relative(5e-3));
    let last = *run.energy.column("fracture").last().expect("a row");
    check(case, "fracture [J], unloaded once", 200.0, last, Relative(1e-2));
    closes(case, ", unloaded once", &run);
}

#[test]
fn broken_joint_closes_without_healing() {
    let case = of("v05_pull_spring");
    // The joint breaks on the way to 0.25 mm; then the top is pushed to -0.1625 mm, and the joint
    // closes at 0.
    let table = "[[0, 0], [0.05, 1], [0.5, 1], [0.6, -1]]";
    let run = run(&going(&example(case.deck), table, 1.4));
    let force = run.probes.series("base.z");
    let open = force.iter().filter(|[time, _]| (0.6..1.0).contains(time)).map(|f| f[1].abs());
    let open = open.fold(0.0, f64::max);
    check(case, "force while it is open [N]", 0.0, open, Of(STRENGTH, 1e-3));
    let exact = 0.1625e-3 / (2.0 / HELD + 1.0 / 1e10);
    check(case, "force when it is closed again [N]", exact, run.last("base.z"), Relative(5e-3));
    let joints = Frames::open(run.path("joints.vtkhdf"));
    assert!(joints.last_scalars("state").iter().all(|state| *state == 2.0), "healed");
    assert!(joints.last_scalars("open").iter().all(|open| *open == 0.0), "open");
    closes(case, ", closed again", &run);
}
