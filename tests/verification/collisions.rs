//! V10: blocks that hit each other and a wall.

use ddem_core::Simulation;
use ddem_deck::TimeStep;
use nalgebra::Vector3;

use super::energy::closes;
use super::incline_contact::body;
use super::record::Tolerance::{Of, Relative};
use super::record::{at_most, between, check, consistent, of};
use super::rotation::invariants;
use super::shared::{Run, deck, edited, example, run, simulation};

fn last(run: &Run, probe: &str) -> Vector3<f64> {
    Vector3::from(["x", "y", "z"].map(|axis| run.last(&format!("{probe}.{axis}"))))
}

/// Momentum, and angular momentum about the origin. Eight equal masses at the corners have three
/// times the moment of inertia of a rigid block about any axis.
fn momenta(simulation: &mut Simulation, first: usize) -> [Vector3<f64>; 2] {
    let velocities = simulation.velocities();
    let nodes = velocities.len();
    let mut sums = [Vector3::zeros(); 2];
    for block in [0..first, first..nodes] {
        let rigid = block.len() == 8;
        let of = |node: usize| {
            let at = Vector3::from(simulation.model().point(node));
            let x = at + Vector3::from(simulation.displacement(node));
            (simulation.model().mass(node), x, Vector3::from(velocities[node]))
        };
        let matter: Vec<_> = block.map(of).collect();
        let mass: f64 = matter.iter().map(|(m, ..)| m).sum();
        let centre = matter.iter().map(|(m, x, _)| x * *m).sum::<Vector3<f64>>() / mass;
        let momentum: Vector3<f64> = matter.iter().map(|(m, _, v)| v * *m).sum();
        let spin: Vector3<f64> = matter.iter().map(|(m, x, v)| (x - centre).cross(&(v * *m))).sum();
        sums[0] += momentum;
        sums[1] += centre.cross(&momentum) + spin / if rigid { 3.0 } else { 1.0 };
    }
    sums
}

/// Runs the deck and returns the largest changes of both momenta as parts of their sizes.
fn changes(text: &str, first: usize) -> [f64; 2] {
    let stage = deck(text).stage[0].clone();
    let mut simulation = simulation(text);
    let damping = stage.damping.unwrap_or_default();
    let steps = simulation.start(damping, TimeStep::Auto, stage.duration).expect("a stable step");
    let before = momenta(&mut simulation, first);
    let mut most = [0.0_f64; 2];
    for step in 1..=steps {
        simulation.step().expect("finite numbers");
        if step % 20 == 0 || step == steps {
            let now = momenta(&mut simulation, first);
            for k in 0..2 {
                most[k] = most[k].max((now[k] - before[k]).norm() / before[k].norm());
            }
        }
    }
    most
}

/// Kinetic energy in the frame of the common centre of mass `[J]`, and reduced mass `[kg]`, of the
/// blocks of `v10_collide`.
const RELATIVE: f64 = 388.25;
const REDUCED: f64 = 150.0;

#[test]
fn collision_of_two_blocks_is_exact() {
    let case = of("v10_collide");
    let rigid = example(case.deck);
    let both = body(&rigid, "first", "deformable");
    let one = edited(&rigid, "\"rigid\"                     # the first", "\"deformable\"");
    let kinds = [("rigid", rigid), ("deformable", both), ("deformable on rigid", one)];
    for (kind, text) in kinds {
        let first = if kind == "rigid" { 8 } else { 27 };
        let [momentum, angular] = changes(&text, first);
        let what = format!("momentum: largest relative change, {kind}");
        consistent(case, &what, 0.0, momentum, Of(1.0, 1e-12));
        let what = format!("angular momentum: largest relative change, {kind}");
        consistent(case, &what, 0.0, angular, Of(1.0, 1e-12));
        let run = run(&text);
        if kind == "rigid" {
            let centre = (last(&run, "first") + last(&run, "second")) / 2.0;
            for (axis, exact) in [(0, 0.3), (1, 0.015), (2, 0.0)] {
                let what = format!("displacement of the centre, {} [m]", ["x", "y", "z"][axis]);
                check(case, &what, exact, centre[axis], Of(0.3, 1e-9));
            }
        }
        let [a, b] = [("first", [-0.55, 0.05, 0.15]), ("second", [0.05, 0.35, 0.25])]
            .map(|(name, at)| Vector3::from(at) + last(&run, name));
        let parting = last(&run, "second_speed") - last(&run, "first_speed");
        let speed = (b - a).normalize().dot(&parting);
        let what = format!("speed at which they part, {kind} [m/s]");
        between(case, &what, speed, [0.0, (2.0 * RELATIVE / REDUCED).sqrt()]);
        closes(case, &format!(", {kind}"), &run);
    }
}

/// Origins and axes of the cube of `v10_wall`.
fn positions(text: &str) -> [(&'static str, String); 3] {
    let line = |start: &str| {
        let mut lines = text.lines().skip_while(|line| !line.contains("name = \"cube\""));
        lines.find(|line| line.starts_with(start)).expect("the line").to_owned()
    };
    let put = |origin: &str, axes: &str| {
        edited(&edited(text, &line("origin"), origin), &line("axes"), axes)
    };
    let face = put("origin = [0.002, -0.25, -0.25]", "");
    let edge = put(
        "origin = [0.3555533906, -0.25, -0.3535533906]",
        "axes = [[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]",
    );
    [("face on", face), ("edge on", edge), ("corner on", text.to_owned())]
}

/// Momentum of the cube along x at the end of the flight [kg m/s].
fn momentum(text: &str) -> f64 {
    let stage = deck(text).stage[0].clone();
    let mut simulation = simulation(text);
    let step = stage.time_step.unwrap_or(TimeStep::Auto);
    let steps = simulation.start(stage.damping.unwrap_or_default(), step, stage.duration);
    for _ in 0..steps.expect("a stable step") {
        simulation.step().expect("finite numbers");
    }
    invariants(&mut simulation).0.x
}

#[test]
fn cube_rebounds_from_wall() {
    let case = of("v10_wall");
    let mass = 300.0;
    for (how, text) in positions(&example(case.deck)) {
        for kind in ["rigid", "deformable"] {
            let text = body(&text, "cube", kind);
            let run = run(&text);
            let what = format!("{how}, {kind}");
            let impulse = 1e-5 * run.probes.column("wall.x").iter().sum::<f64>();
            let gained = momentum(&text) + 5.0 * mass;
            let name = format!("impulse of the wall, expected: change of momentum, {what} [N s]");
            consistent(case, &name, gained, impulse, Relative(1e-6));
            let back = gained / mass - 5.0;
            let speed = format!("comes back at, {what} [m/s]");
            match kind {
                "rigid" => check(case, &speed, 5.0, back, Relative(1e-3)),
                _ => between(case, &speed, back, [4.9, 5.0]),
            }
            let sideways = run.last("cube.y").hypot(run.last("cube.z"));
            at_most(case, &format!("sideways, {what} [m/s]"), 5e-6, sideways);
            closes(case, &format!(", {what}"), &run);
        }
    }
}
