//! Changes that a relaxation follows: slip, large rotations, and supports and strengths that change
//! by increments.

use super::record::Tolerance::{Of, Relative};
use super::record::{check, consistent, of};
use super::shared::{Frames, Run, edited, example, run};

/// Slip in the middle of the crack.
const SLIP: f64 = 4.0 * (1.0 - 0.25 * 0.25) / 18e9 * 1e6;

fn slip(run: &Run) -> f64 {
    let joints = Frames::open(run.path("joints.vtkhdf"));
    let slips = joints.last_vectors("slip");
    let middle = joints.points().into_iter().zip(slips);
    let middle = middle.filter(|(x, s)| x[0].abs() < 0.02 && x[2].abs() < 0.02 && s[0] != 0.0);
    let middle: Vec<f64> = middle.map(|(_, s)| s[0].abs()).collect();
    assert!(!middle.is_empty(), "nothing has slipped in the middle");
    middle.iter().sum::<f64>() / middle.len() as f64
}

/// A relaxation that overshot the equilibrium and kept that state would exceed the exact slip.
#[test]
fn crack_slip_converges_with_the_mesh() {
    let case = of("relax_crack");
    let text = example(case.deck);
    for (divisions, allowed) in [(1, 0.08), (2, 0.04), (4, 0.02)] {
        let run = run(&edited(&text, "divisions = 1", &format!("divisions = {divisions}")));
        let what = format!("slip in the middle [m], elements of a/{}", 4 * divisions);
        let found = slip(&run);
        check(case, &what, SLIP, found, Relative(allowed));
        assert!(found < SLIP, "the mesh is stiffer: {found} is more than {SLIP}");
    }
}

#[test]
fn crack_slip_equals_slow_motion() {
    let case = of("relax_crack");
    // Thicker layers permit longer steps.
    let text = example(case.deck).replace("thickness = 0.001", "thickness = 0.01");
    let (before, _) = text.split_once("name = \"slip\"").expect("the last stage");
    let slow = "name = \"slip\"\nkind = \"dynamic\"\nduration = 0.1\ndamping = { mass = 3000.0 }\n";
    let slow = slip(&run(&format!("{before}{slow}")));
    consistent(case, "slip [m], expected: slow motion", slow, slip(&run(&text)), Relative(0.01));
}

#[test]
fn beam_under_large_rotation_is_exact() {
    let case = of("relax_bend");
    let run = run(&example(case.deck));
    check(case, "tip, u_z [m]", -12.060735, run.last("tip.z"), Relative(0.01));
    check(case, "tip, u_x [m]", -5.067054, run.last("tip.x"), Relative(0.015));
    check(case, "force of the wall, z [N]", 1.1e7, run.last("wall.z"), Relative(1e-5));
}

#[test]
fn support_displacement_stretches_bar() {
    let case = of("relax_stretch");
    for increments in [1, 5] {
        let text =
            edited(&example(case.deck), "increments = 5", &format!("increments = {increments}"));
        let run = run(&text);
        let check = |what: &str, exact: f64, column: &str| {
            let what = format!("{what}, {increments} increments");
            check(case, &what, exact, run.last(column), Relative(1e-6));
        };
        check("force [N]", 4.5e6, "pull.x");
        check("end, u_x [m]", 1e-3, "end.x");
        check("middle, u_x [m]", 5e-4, "middle.x");
        check("side, u_y [m]", -6.25e-5, "side.y");
    }
}

/// True for the near and the far joint if all pairs have failed.
fn failed(run: &Run) -> [bool; 2] {
    let joints = Frames::open(run.path("joints.vtkhdf"));
    let states = joints.last_scalars("state");
    [1.0, 2.0].map(|plane: f64| {
        let at = joints.points().into_iter().zip(&states);
        at.filter(|(x, _)| (x[0] - plane).abs() < 0.1).all(|(_, state)| *state != 0.0)
    })
}

#[test]
fn strengths_decrease_by_increments() {
    let case = of("relax_weaken");
    let text = example(case.deck);
    let by_parts = run(&text);
    check(case, "force of the wall at the end [N]", 0.0, by_parts.last("wall.x"), Of(1e6, 1e-6));
    assert_eq!(failed(&by_parts), [false, true], "the far joint is the first beyond its strength");
    // The table has the forces of the wall at the end of each stage.
    let pulled = by_parts.probes.column("wall.x");
    let most = pulled.iter().fold(0.0_f64, |most, f| most.max(-f));
    check(case, "force of the wall before [N]", 1e6, most, Relative(1e-6));
    let at_once = run(&edited(&text, "increments = 10", "increments = 1"));
    assert_eq!(failed(&at_once), [true, false], "at once it is the one that is farther beyond");
    // At increment 3 the strength left is 1.02 MPa and nothing fails; at increment 4 it is 0.96
    // MPa.
    for (parts, fails) in [(0.3, false), (0.4, true)] {
        let [near, far] = [(2.0, 0.5), (1.2, 0.6)].map(|(a, b)| (a + (b - a) * parts) * 1e6);
        let text = edited(&text, "tension = 0.5e6", &format!("tension = {near}"));
        let text = edited(&text, "tension = 0.6e6", &format!("tension = {far}"));
        let run = run(&edited(&text, "increments = 10", "increments = 1"));
        assert_eq!(failed(&run), [false, fails]);
    }
}

#[test]
fn contacts_are_as_exact_far_from_the_origin() {
    let case = of("relax_far");
    let text = example(case.deck);
    let rigid = edited(&text, "material = \"rock\"", "material = \"rock\"\nbody = \"rigid\"");
    let weight = 2.0 * 2400.0 * 9.81;
    for (text, what) in [(text, "deformable"), (rigid, "rigid")] {
        let found = run(&text).last("ground.z");
        check(case, &format!("force of the ground, z, {what} [N]"), weight, found, Relative(1e-8));
    }
}
