//! Blocks that meet make no energy, whatever their contact, mesh and rock.

use ddem_core::deck::{BlockSet, Body, Damping, TimeStep};
use ddem_core::{Deck, Model, Simulation};
use nalgebra::{Rotation3, Unit, Vector3};

use super::record::Tolerance::{Absolute, AtMost, Relative};
use super::record::{Case, check, of};
use super::rotation::invariants;
use super::shared::{Run, deck, edited, example, run};

/// Kinetic and strain energy less the work of loads, at most, at the start and at the end `[J]`.
fn free_energy(run: &Run) -> [f64; 3] {
    let column = |name: &str| run.energy.column(name).to_vec();
    let [kinetic, bodies, joints, work] =
        ["kinetic", "strain_bodies", "strain_joints", "external_work"].map(column);
    let all = (0..kinetic.len()).map(|i| kinetic[i] + bodies[i] + joints[i] - work[i]);
    let [first, last] =
        [all.clone().next(), all.clone().next_back()].map(|energy| energy.expect("a row"));
    [all.fold(0.0, f64::max), first, last]
}

#[test]
fn a_block_that_falls_back_never_rises_higher() {
    let case = of("meet_toss");
    for (divisions, thickness) in
        [(1, 0.01), (2, 0.01), (3, 0.01), (4, 0.01), (2, 0.001), (1, 0.0001), (4, 0.05)]
    {
        let text =
            edited(&example(case.deck), "thickness = 0.01 ", &format!("thickness = {thickness} "));
        let run = run(&edited(&text, "divisions = 3", &format!("divisions = {divisions}")));
        let what = format!("divisions {divisions}, joint of {} mm", 1e3 * thickness);
        let height = run.probes.column("block.z").iter().copied().fold(0.0, f64::max);
        check(case, &format!("height, {what} [m]"), 1.0 / (2.0 * 9.81), height, Relative(0.005));
        let [most, first, _] = free_energy(&run);
        check(case, &format!("energy, {what} [part]"), 1.005, most / first, AtMost);
    }
}

/// Over a joint that has no strength, at 1 m/s from the first step on: it is pressed and parts.
#[test]
fn blocks_that_a_joint_throws_back_make_no_energy() {
    let case = of("meet_toss");
    for (divisions, thickness) in [(1, 0.0001), (1, 0.001), (2, 0.01), (4, 0.001), (4, 0.05)] {
        let text =
            edited(&example(case.deck), "thickness = 0.01 ", &format!("thickness = {thickness} "));
        let text = edited(&text, "divisions = 3", &format!("divisions = {divisions}"));
        let text = edited(&text, "velocity = [0.0, 0.0, 1.0]", "velocity = [0.0, 0.0, -1.0]");
        let text = edited(&text, "duration = 0.8", "duration = 0.01");
        let what = format!("pressed, divisions {divisions}, joint of {} mm", 1e3 * thickness);
        let [most, first, _] = free_energy(&run(&text));
        check(case, &format!("energy, {what} [part]"), 1.005, most / first, AtMost);
        let undamped =
            edited(&text, "[materials.rock]", "[contact]\ndamping = 0.0\n[materials.rock]");
        let [_, first, last] = free_energy(&run(&undamped));
        check(
            case,
            &format!("energy at the end, {what}, undamped [part]"),
            1.005,
            last / first,
            AtMost,
        );
    }
}

/// The cubes, the upper one turned about an axis by an angle `[degrees]`.
fn turned(mut deck: Deck, axis: Vector3<f64>, angle: f64) -> Deck {
    let turn = Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle.to_radians());
    let edges = [0, 1, 2].map(|d| turn * Vector3::ith(d, 1.0));
    let centre = (edges[0] + edges[1] + edges[2]) / 2.0;
    let lowest: f64 = edges.iter().map(|edge| edge.z.min(0.0)).sum();
    let upper = &mut deck.blocks[1];
    upper.axes = edges.map(|edge| edge.into());
    upper.origin = [-centre.x, -centre.y, 0.0005 - lowest];
    deck
}

/// Lets the cubes of a deck hit each other and checks their energy and momentum.
fn hit(case: Case, what: &str, deck: &Deck) {
    let model = Model::new(deck).unwrap_or_else(|error| panic!("{what}: {error}"));
    let mut simulation = Simulation::new(model);
    let started = simulation.start(Damping::None, TimeStep::Auto, deck.stage[0].duration);
    started.unwrap_or_else(|error| panic!("{what}: {error}"));
    let held = |simulation: &mut Simulation| {
        let energy = simulation.energy();
        energy.kinetic + energy.strain_bodies + energy.strain_joints
    };
    let (first, before) = (held(&mut simulation), invariants(&mut simulation).0);
    let mut most = first;
    while simulation.steps_left() > Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{what}: {error}"));
        most = most.max(held(&mut simulation));
    }
    check(case, &format!("energy, {what} [part]"), 1.005, most / first, AtMost);
    let off = (invariants(&mut simulation).0 - before).norm() / before.norm();
    check(case, &format!("momentum, {what} [part]"), 0.0, off, Absolute(1e-12));
}

#[test]
fn cubes_that_hit_each_other_make_no_energy() {
    let case = of("meet_cubes");
    let cubes = deck(&example(case.deck));
    let (edge, skew) = (Vector3::y(), Vector3::new(0.3, 1.0, 0.0));
    let elements = 1.2 * 18e9;
    // Turn [degrees], divisions of both, contact as a part of the elements' stiffness, upper modulus.
    let hits: [(_, f64, [u32; 2], Option<f64>, f64); 12] = [
        (edge, 0.0, [1, 1], Some(100.0), 18e9),
        (edge, 0.0, [2, 3], Some(1.0), 1.8e9),
        (edge, 0.0, [4, 2], None, 18e9),
        (edge, 0.0, [3, 3], Some(0.01), 60e9),
        (edge, 1.0, [2, 2], Some(100.0), 18e9),
        (skew, 1.0, [4, 4], None, 1.8e9),
        (edge, 10.0, [3, 1], Some(1.0), 18e9),
        (skew, 10.0, [2, 4], Some(100.0), 60e9),
        (skew, 10.0, [1, 2], None, 18e9),
        (edge, 45.0, [4, 3], Some(100.0), 18e9),
        (skew, 45.0, [3, 2], Some(1.0), 1.8e9),
        (skew, 45.0, [1, 1], Some(0.01), 18e9),
    ];
    for (axis, angle, [lower, upper], part, young) in hits {
        let mut deck = turned(cubes.clone(), axis, angle);
        (deck.blocks[0].divisions, deck.blocks[1].divisions) = (lower, upper);
        deck.materials.get_mut("upper").expect("a material").young = young;
        deck.contact.normal_stiffness = part.map(|part| part * elements * f64::from(lower));
        let how = part.map_or_else(|| "default".to_owned(), |part| format!("{part} times"));
        let about = if axis == edge { "an edge" } else { "a skew axis" };
        let what = format!(
            "{angle}° about {about}, divisions {lower} and {upper}, {how}, {:.1} GPa",
            1e-9 * young
        );
        hit(case, &what, &deck);
    }
    for (body, angle) in [([Body::Rigid; 2], 45.0), ([Body::Deformable, Body::Rigid], 10.0)] {
        let mut deck = turned(cubes.clone(), skew, angle);
        (deck.blocks[0].body, deck.blocks[1].body) = (body[0], body[1]);
        hit(case, &format!("{angle}°, {body:?}"), &deck);
    }
}

/// A deformable block and a rigid one over a joint without strength: what one gains the other loses.
#[test]
fn blocks_of_both_kinds_keep_their_momentum_when_their_joint_breaks() {
    let case = of("meet_toss");
    for rigid in [0, 1] {
        for thickness in [0.0001, 0.01] {
            let text = edited(&example(case.deck), "[0.0, 0.0, -9.81]", "[0.0, 0.0, 0.0]");
            let text = edited(&text, "velocity = [0.0, 0.0, 1.0]", "velocity = [0.0, 0.0, -1.0]");
            let text = edited(&text, "thickness = 0.01 ", &format!("thickness = {thickness} "));
            let mut deck = deck(&edited(&text, "divisions = 3", "divisions = 1"));
            deck.fix.clear();
            let mut set = deck.blocks[0].clone();
            (set.size, set.count) = (Some([1.0; 3]), Some([1; 3]));
            let upper = BlockSet { origin: [0.0, 0.0, 1.0 + thickness], ..set.clone() };
            deck.blocks = vec![set, upper];
            deck.blocks[rigid].body = Body::Rigid;
            let mut simulation = Simulation::new(Model::new(&deck).expect("a model"));
            simulation.start(Damping::None, TimeStep::Auto, None).expect("a start");
            let before = invariants(&mut simulation).0;
            for _ in 0..400 {
                simulation.step().expect("a step");
            }
            assert!(simulation.failed_pairs() != [0; 2]);
            let off = (invariants(&mut simulation).0 - before).norm() / before.norm();
            let what = format!("block {rigid} rigid, joint of {} mm", 1e3 * thickness);
            check(case, &format!("momentum, {what} [part]"), 0.0, off, Absolute(1e-12));
        }
    }
}
