//! Blocks that make contact gain no energy, for any contact, mesh and rock.

use ddem_core::Simulation;
use ddem_deck::Deck;
use ddem_deck::{Assign, BlockSet, Body, Damping, Extent, History, Joint, Load, TimeStep, Where};
use nalgebra::{Rotation3, Unit, Vector3};

use super::record::Tolerance::{Of, Relative};
use super::record::{Case, at_most, check, consistent, of};
use super::rotation::invariants;
use super::shared::{Run, deck, edited, example, run};

/// Energy that blocks may gain, as a part of that at the start.
const NO_GAIN: f64 = 1e-9;

/// Kinetic and strain energy minus the work of loads: largest value and value at the start `[J]`.
pub(super) fn free_energy(run: &Run) -> [f64; 2] {
    let column = |name: &str| run.energy.column(name).to_vec();
    let [kinetic, bodies, joints, work] =
        ["kinetic", "strain_bodies", "strain_joints", "external_work"].map(column);
    let all = (0..kinetic.len()).map(|i| kinetic[i] + bodies[i] + joints[i] - work[i]);
    [all.clone().fold(0.0, f64::max), all.clone().next().expect("a row")]
}

#[test]
fn rebounding_block_never_rises_higher() {
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
        let [most, first] = free_energy(&run);
        at_most(case, &format!("energy gained, {what} [part]"), NO_GAIN, most / first - 1.0);
    }
}

/// `meet_toss` in free fall, undamped, with other divisions and another joint, and one set for each
/// block.
fn weightless(divisions: [u32; 2], thickness: f64, velocity: f64) -> Deck {
    let mut deck = deck(&example("meet_toss"));
    (deck.model.gravity, deck.contact.damping) = ([0.0; 3], Some(0.0));
    let set = BlockSet { size: Some([1.0; 3]), count: Some([1; 3]), ..deck.blocks[0].clone() };
    let lower = BlockSet { divisions: divisions[0], ..set.clone() };
    let origin = [0.0, 0.0, 1.0 + thickness];
    deck.blocks = vec![lower, BlockSet { origin, divisions: divisions[1], ..set }];
    let seam = deck.joints.get_mut("seam").expect("a joint");
    seam.thickness = thickness;
    deck.initial[0].r#where.z = Some(Extent::Range([1.0 + thickness, 3.0]));
    deck.initial[0].velocity = Some([0.0, 0.0, velocity]);
    deck
}

/// Kinetic and strain energy, largest and at the end, as parts of that at the start.
fn energies(deck: &Deck, steps: usize) -> [f64; 2] {
    let mut simulation = Simulation::new(deck.build().expect("a model"));
    simulation.start(Damping::None, TimeStep::Auto, None).expect("a start");
    let first = held(&mut simulation);
    let (mut most, mut last) = (first, first);
    for _ in 0..steps {
        simulation.step().expect("a step");
        last = held(&mut simulation);
        most = most.max(last);
    }
    assert!(simulation.failed_pairs() != [0; 2]);
    [most / first, last / first]
}

/// A joint without strength is compressed from the first step at 1 m/s and then opens. For a few
/// steps a pair owes the energy that it has gained.
#[test]
fn blocks_rebounding_from_joint_gain_no_energy() {
    let case = of("meet_toss");
    for (divisions, thickness) in [
        ([1, 1], 1e-4),
        ([1, 1], 1e-3),
        ([2, 2], 0.01),
        ([4, 4], 1e-3),
        ([4, 4], 0.05),
        ([1, 3], 1e-3),
    ] {
        let mut deck = weightless(divisions, thickness, -1.0);
        deck.fix.clear();
        let what = format!("pressed, divisions {divisions:?}, joint of {} mm", 1e3 * thickness);
        let last = energies(&deck, 600)[1];
        at_most(case, &format!("energy gained at the end, {what} [part]"), NO_GAIN, last - 1.0);
    }
}

/// Springs are compressed from the first step on and fail on the rebound.
#[test]
fn springs_failing_on_rebound_gain_no_energy() {
    let case = of("meet_toss");
    for (divisions, stiffness, tension, velocity) in
        [(1, 5e8, 0.5e6, 1.0), (2, 4e9, 3e6, 3.0), (3, 4e10, 1e6, 1.0), (4, 4e9, 1.5e6, 3.0)]
    {
        let mut deck = weightless([divisions; 2], 0.0, -velocity);
        deck.fix.clear();
        deck.initial[0].r#where.z = Some(Extent::Range([1.0, 2.0]));
        let mut set = deck.blocks.swap_remove(0);
        (set.size, set.count) = (Some([1.0, 1.0, 2.0]), Some([1, 1, 2]));
        deck.blocks = vec![set];
        let seam = deck.joints.get_mut("seam").expect("a joint");
        (seam.thickness, seam.material) = (0.0, None);
        (seam.normal_stiffness, seam.shear_stiffness) = (Some(stiffness), Some(0.4 * stiffness));
        (seam.cohesion, seam.tension) = (Some(0.5 * tension), Some(tension));
        let most = energies(&deck, 1500)[0];
        let what = format!("springs of {:.1} GPa/m, divisions {divisions}", 1e-9 * stiffness);
        // A pair of stiff springs that fails within a step owes the energy that it has gained.
        let allowed = if stiffness > 1e10 { 5e-3 } else { NO_GAIN };
        at_most(case, &format!("energy gained, {what} [part]"), allowed, most - 1.0);
    }
}

/// A joint without cohesion is compressed and sheared: pairs begin to slide within a step.
#[test]
fn oblique_impact_loses_friction_work() {
    let case = of("meet_toss");
    for (divisions, thickness) in [(1, 0.01), (1, 0.05), (2, 0.001), (4, 0.01)] {
        let mut deck = weightless([divisions; 2], thickness, -0.3);
        deck.fix.clear();
        deck.initial[0].velocity = Some([1.0, 0.0, -0.3]);
        let seam = deck.joints.get_mut("seam").expect("a joint");
        seam.friction = Some(30.0);
        let mut simulation = Simulation::new(deck.build().expect("a model"));
        simulation.start(Damping::None, TimeStep::Auto, Some(0.01)).expect("a start");
        let first = held(&mut simulation);
        while simulation.steps_left() > Some(0) {
            simulation.step().expect("a step");
        }
        let energy = simulation.energy();
        let what = format!("aslant, divisions {divisions}, joint of {} mm", 1e3 * thickness);
        assert!(energy.friction > 0.02 * first, "{what}");
        let off = energy.contact / first;
        check(case, &format!("made by contact, {what} [part]"), 0.0, off, Of(1.0, 5e-3));
    }
}

/// The lowest of three blocks is fixed, and the highest is thrown. The joint between the upper two
/// holds; the weaker joint below breaks when the shock has passed.
#[test]
fn joint_failing_after_shock_gains_no_energy() {
    let case = of("meet_toss");
    let strengths = [(1, 5e6), (1, 10e6), (1, 20e6), (2, 10e6)];
    // The joint that holds fails at 400 MPa or never.
    let strong = [Some(4e8), None];
    for ((divisions, tension), strong) in
        strengths.into_iter().flat_map(|case| strong.map(|strong| (case, strong)))
    {
        let mut deck = weightless([divisions; 2], 0.01, 5.0);
        let mut set = deck.blocks.swap_remove(0);
        (set.size, set.count) = (Some([1.0, 1.0, 3.0]), Some([1, 1, 3]));
        deck.blocks = vec![set];
        let seam = deck.joints.get_mut("seam").expect("a joint");
        (seam.cohesion, seam.tension) = (Some(5e9), Some(tension));
        let holds = if strong.is_some() { "strong" } else { "elastic" };
        let cohesion = strong.and(seam.cohesion);
        let friction = strong.and(seam.friction);
        let strong = Joint { tension: strong, cohesion, friction, ..seam.clone() };
        deck.joints.insert("strong".into(), strong);
        let region = Where { z: Some(Extent::Plane(2.0)), ..Where::default() };
        deck.assign.push(Assign {
            r#where: region,
            joint: Some("strong".into()),
            ..Assign::default()
        });
        deck.initial[0].r#where.z = Some(Extent::Range([2.0, 3.0]));
        let most = energies(&deck, 600)[0];
        let what =
            format!("three blocks, {holds}, divisions {divisions}, tension {} MPa", 1e-6 * tension);
        at_most(case, &format!("energy gained, {what} [part]"), NO_GAIN, most - 1.0);
    }
}

/// The cubes, with the upper one rotated about an axis by an angle `[degrees]`.
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

/// Kinetic and strain energy `[J]`.
fn held(simulation: &mut Simulation) -> f64 {
    let energy = simulation.energy();
    energy.kinetic + energy.strain_bodies + energy.strain_joints
}

/// Lets the cubes of a deck hit each other and checks energy and momentum.
fn hit(case: Case, what: &str, deck: &Deck) {
    let model = deck.build().unwrap_or_else(|error| panic!("{what}: {error}"));
    let mut simulation = Simulation::new(model);
    let started = simulation.start(Damping::None, TimeStep::Auto, deck.stage[0].duration);
    started.unwrap_or_else(|error| panic!("{what}: {error}"));
    let (first, before) = (held(&mut simulation), invariants(&mut simulation).0);
    let mut most = first;
    while simulation.steps_left() > Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{what}: {error}"));
        most = most.max(held(&mut simulation));
    }
    at_most(case, &format!("energy gained, {what} [part]"), NO_GAIN, most / first - 1.0);
    let off = (invariants(&mut simulation).0 - before).norm() / before.norm();
    consistent(case, &format!("momentum, {what} [part]"), 0.0, off, Of(1.0, 1e-12));
}

#[test]
fn colliding_cubes_gain_no_energy() {
    let case = of("meet_cubes");
    let cubes = deck(&example(case.deck));
    let (edge, skew) = (Vector3::y(), Vector3::new(0.3, 1.0, 0.0));
    let elements = 1.2 * 18e9;
    // Rotation [degrees], divisions of both, contact relative to the elements' stiffness, upper
    // modulus.
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
        hit(case, &format!("{angle}°, {body:?}").to_lowercase(), &deck);
    }
}

/// Two free blocks are pulled apart until their joint breaks and the step becomes shorter.
#[test]
fn separating_blocks_keep_momentum_and_energy() {
    let case = of("meet_toss");
    let (soft, hard) = (Body::Deformable, Body::Rigid);
    for bodies in [[soft, soft], [hard, soft], [soft, hard]] {
        let mut deck = weightless([2, 2], 0.01, 0.0);
        deck.fix.clear();
        deck.initial.clear();
        let seam = deck.joints.get_mut("seam").expect("a joint");
        (seam.cohesion, seam.tension) = (Some(5e6), Some(1e6));
        for (z, pull) in [(0.0, -2e6), (2.01, 2e6)] {
            let region = Where { z: Some(Extent::Plane(z)), ..Where::default() };
            let history = Some(History::Ramp(0.05));
            let traction = Some([0.0, 0.0, pull]);
            deck.load.push(Load { r#where: region, traction, history, ..Load::default() });
        }
        for (set, body) in deck.blocks.iter_mut().zip(bodies) {
            set.body = body;
        }
        let mut simulation = Simulation::new(deck.build().expect("a model"));
        simulation.start(Damping::None, TimeStep::Auto, None).expect("a start");
        let first = simulation.time_step();
        while simulation.time() < 0.04 {
            simulation.step().expect("a step");
        }
        let what = format!("pulled apart, {bodies:?}").to_lowercase();
        assert!(simulation.failed_pairs() != [0; 2] && simulation.time_step() < first, "{what}");
        let kinetic = simulation.energy().kinetic;
        let moment = (2.0 * kinetic * 2.0 * 2400.0).sqrt();
        let off = invariants(&mut simulation).0.norm() / moment;
        consistent(case, &format!("momentum, {what} [part]"), 0.0, off, Of(1.0, 1e-12));
        let off = simulation.energy().imbalance();
        consistent(case, &format!("imbalance, {what} [part]"), 0.0, off, Of(1.0, 1e-3));
    }
}
