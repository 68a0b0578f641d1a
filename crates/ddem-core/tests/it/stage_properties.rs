//! Joints and materials that change at the start of a stage.

use ddem_core::{Simd, Simulation};
use ddem_deck::*;

use crate::decks::*;

const G: f64 = 9.81;

fn dynamic(name: &str) -> Stage {
    Stage { kind: StageKind::Dynamic, duration: Some(1.0), ..relax_stage(name) }
}

/// Springs with friction only.
fn dry(friction: f64) -> Joint {
    Joint {
        normal_stiffness: Some(1e9),
        shear_stiffness: Some(1e9),
        friction: Some(friction),
        ..Joint::default()
    }
}

/// Slab on a bed inclined at 20 degrees. It holds at a friction angle of 40 degrees, slides at 10
/// and is braked at 40 again. Slab and bed are one set, or two sets with a nonconforming joint.
fn slab(sets: bool, body: Body) -> Deck {
    let mut deck = deck([1, 1, if sets { 1 } else { 2 }], [2.0, 2.0, 1.0], 1, 0.0);
    deck.joints = [("seam".to_owned(), dry(40.0)), ("wet".to_owned(), dry(10.0))].into();
    deck.blocks[0].body = body;
    if sets {
        deck.blocks[0].size = Some([2.0, 2.0, 0.5]);
        let bed =
            BlockSet { origin: [0.0, 0.0, -0.5], count: Some([2, 2, 1]), ..deck.blocks[0].clone() };
        deck.blocks.push(bed);
    }
    let bed = if sets { [-0.5, 0.0] } else { [0.0, 0.5] };
    let level = if sets { 0.0 } else { 0.5 };
    deck.fix.push(fix(Where { z: Some(Extent::Range(bed)), ..Where::default() }, "xyz"));
    if body == Body::Deformable {
        // The selection excludes the slab's lower nodes.
        let [low, high] = bed;
        deck.fix[0].r#where.z = Some(Extent::Range([low, high - 0.1]));
    }
    let angle = 20.0_f64.to_radians();
    deck.model.gravity = [G * angle.sin(), 0.0, -G * angle.cos()];
    deck.stage = vec![relax_stage("rest"), dynamic("slide"), dynamic("brake")];
    let (from, until) = (Some("slide".to_owned()), Some("brake".to_owned()));
    let joint = Some("wet".to_owned());
    deck.assign.push(Assign { r#where: plane(2, level), joint, from, until, ..Assign::default() });
    deck
}

fn relax(simulation: &mut Simulation) {
    simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..100_000 {
        let relaxed = simulation.relax_step(1e-9).unwrap_or_else(|error| panic!("{error}"));
        if relaxed == ddem_core::Relaxed::Done {
            return simulation.finish_relaxation();
        }
    }
    panic!("no equilibrium");
}

/// Mean velocity of the upper face along x after a time.
fn after(simulation: &mut Simulation, time: f64) -> f64 {
    let steps = (time / simulation.time_step()).round() as u64;
    for _ in 0..steps {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    let model = simulation.model();
    let top = points(model).iter().map(|x| x.z).fold(f64::NEG_INFINITY, f64::max);
    let nodes = plane(2, top).nodes(model).unwrap();
    let sum: f64 = nodes.iter().map(|&node| simulation.velocity(node as usize)[0]).sum();
    sum / nodes.len() as f64
}

fn start(simulation: &mut Simulation) {
    let damping = Damping::None;
    let started = simulation.start(damping, TimeStep::Seconds(5e-5), None);
    started.unwrap_or_else(|error| panic!("{error}"));
}

/// v = g (sin β − cos β tan φ) t with the friction of each stage, for joints and for contacts.
#[test]
fn slab_slides_with_friction_of_the_stage() {
    let angle = 20.0_f64.to_radians();
    let pull = |friction: f64| G * (angle.sin() - angle.cos() * friction.to_radians().tan());
    for sets in [false, true] {
        let mut simulation = simulation(&slab(sets, Body::Rigid));
        relax(&mut simulation);
        let failed = simulation.failed_pairs();
        assert_eq!(failed, [0, 0], "{sets}");
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        start(&mut simulation);
        let fast = after(&mut simulation, 0.5);
        // The elastic displacement of the springs comes first.
        let exact = 0.5 * pull(10.0);
        assert!((fast / exact - 1.0).abs() < 0.01, "{sets}: {fast} {exact}");
        simulation.enter(2).unwrap_or_else(|error| panic!("{error}"));
        start(&mut simulation);
        let braked = after(&mut simulation, 0.1);
        let exact = fast + 0.1 * pull(40.0);
        assert!((braked - exact).abs() < 0.01 * (fast - exact), "{sets}: {braked} {exact}");
        let still = after(&mut simulation, 1.0);
        assert!(still.abs() < 1e-2, "{sets}: {still}");
        let energy = simulation.energy();
        assert!(energy.balance.abs() < 1e-3 * energy.friction, "{sets}: {energy:?}");
    }
}

/// A run that resumes from a state saved in any stage gives the same bits.
#[test]
fn reassigned_model_resumes_with_same_bits() {
    for (sets, body) in [(false, Body::Deformable), (true, Body::Deformable), (true, Body::Rigid)] {
        let deck = slab(sets, body);
        let run = |save: [bool; 3]| {
            let mut simulation = simulation(&deck);
            for (stage, save) in save.into_iter().enumerate() {
                simulation.enter(stage).unwrap_or_else(|error| panic!("{error}"));
                start(&mut simulation);
                after(&mut simulation, 0.02);
                if save {
                    let saved = simulation.save();
                    let again = Simulation::restore(model(&deck), Simd::default(), &saved);
                    simulation = again.unwrap_or_else(|error| panic!("{error}"));
                }
                after(&mut simulation, 0.02);
            }
            let mut seen = bits(&simulation.displacements());
            seen.extend(bits(&simulation.tractions()));
            seen.extend(simulation.energy().values().map(f64::to_bits));
            seen
        };
        let whole = run([false; 3]);
        for save in [[true, false, false], [false, true, false], [false, false, true], [true; 3]] {
            assert_eq!(whole, run(save), "{sets} {body:?} {save:?}");
        }
    }
}

/// A block hangs from a rock layer until the layer loses its strength; then the block falls.
#[test]
fn layer_that_loses_strength_fails() {
    let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 2, 0.01);
    let strong = deck.joints["seam"].clone();
    let weak = Joint { tension: Some(1.0), ..strong };
    deck.joints.insert("weak".into(), weak);
    deck.fix.push(fix(plane(2, 2.0), "xyz"));
    deck.model.gravity = [0.0, 0.0, -10.0];
    deck.stage = vec![relax_stage("hang"), dynamic("fall")];
    let (joint, from) = (Some("weak".to_owned()), Some("fall".to_owned()));
    deck.assign.push(Assign { joint, from, ..Assign::default() });
    let mut simulation = simulation(&deck);
    relax(&mut simulation);
    assert_eq!(simulation.failed_pairs(), [0, 0]);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    let started = simulation.start(Damping::None, TimeStep::Auto, Some(0.2));
    started.unwrap_or_else(|error| panic!("{error}"));
    // The springs need shorter steps than the layer, so the number of steps is not known in
    // advance.
    while simulation.time() < 0.2 - 1e-9 {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    assert_eq!(simulation.failed_pairs(), [0, 9]);
    let lower = 0..simulation.model().n_nodes() / 2;
    let mean = lower.clone().map(|node| simulation.displacement(node)[2]).sum::<f64>();
    let mean = mean / lower.len() as f64;
    assert!((mean / (-0.5 * 10.0 * 0.04) - 1.0).abs() < 1e-3, "{mean}");
}

const ROCK: Material = Material { density: 2000.0, young: 1e9, poisson: 0.0 };
const SOAKED: Material = Material { density: 2500.0, young: 5e8, poisson: 0.0 };

/// Column that is soaked in the second of three stages.
fn column() -> Deck {
    let mut deck = deck([1, 1, 1], [1.0, 1.0, 2.0], 4, 0.01);
    deck.materials.insert("rock".into(), ROCK);
    deck.materials.insert("soaked".into(), SOAKED);
    deck.fix.push(fix(plane(2, 0.0), "xyz"));
    deck.model.gravity = [0.0, 0.0, -10.0];
    deck.stage = vec![relax_stage("dry"), relax_stage("wet"), relax_stage("dry again")];
    let (from, until) = (Some("wet".to_owned()), Some("dry again".to_owned()));
    let material = Some("soaked".to_owned());
    deck.assign.push(Assign { material, from, until, ..Assign::default() });
    deck
}

/// A column settles under its weight by ρ g H²/(2 E) of its material in each stage. This also holds
/// when the program skips stages and after a resume.
#[test]
fn column_settles_with_material_of_the_stage() {
    let deck = column();
    let mut simulation = simulation(&deck);
    let start = simulation.save();
    // Going back to an earlier stage uses the saved state of the start.
    let stages =
        [(0, ROCK), (1, SOAKED), (2, ROCK), (0, ROCK), (2, ROCK), (1, SOAKED), (1, SOAKED)];
    for (stage, of) in stages {
        if stage < simulation.stage() {
            assert!(simulation.enter(stage).is_err());
            let again = Simulation::restore(model(&deck), Simd::default(), &start);
            simulation = again.unwrap_or_else(|error| panic!("{error}"));
        }
        simulation.enter(stage).unwrap_or_else(|error| panic!("{error}"));
        let again = Simulation::restore(model(&deck), Simd::default(), &simulation.save());
        simulation = again.unwrap_or_else(|error| panic!("{error}"));
        relax(&mut simulation);
        let top = simulation.model().nearest_node([0.0, 0.0, 2.0]);
        let exact = -of.density * 10.0 * 4.0 / (2.0 * of.young);
        let found = simulation.displacement(top)[2];
        assert!((found / exact - 1.0).abs() < 1e-6, "{stage}: {found} {exact}");
        let energy = simulation.energy();
        assert!(energy.balance.abs() < 1e-9 * energy.strain_bodies, "{energy:?}");
    }
}

/// A release fades only the forces of the excavated blocks, not the effect of a new material
/// elsewhere.
#[test]
fn release_fades_only_forces_of_excavated_blocks() {
    let mut deck = column();
    let beside = BlockSet {
        origin: [5.0, 0.0, 0.0],
        count: Some([1, 1, 2]),
        name: Some("dug".into()),
        ..deck.blocks[0].clone()
    };
    deck.blocks.push(beside);
    deck.joints.insert(
        "seam".into(),
        Joint { thickness: 0.01, material: Some("rock".into()), ..Joint::default() },
    );
    deck.assign[0].r#where.x = Some(Extent::Range([0.0, 1.0]));
    let upper = Where {
        x: Some(Extent::Range([5.0, 6.0])),
        z: Some(Extent::Range([1.0, 2.0])),
        ..Where::default()
    };
    let (from, release) = (Some("wet".to_owned()), Some(1e9));
    deck.remove.push(Remove { r#where: upper, from, release, ..Remove::default() });
    deck.stage[1] = dynamic("wet");
    let mut simulation = simulation(&deck);
    relax(&mut simulation);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    let forces = simulation.forces();
    let (mut soaked, mut excavated) = (0.0, 0.0);
    for (x, force) in points(simulation.model()).iter().zip(&forces) {
        let size = if x.z > 0.0 { force[2].abs() } else { 0.0 };
        *(if x.x < 2.0 { &mut soaked } else { &mut excavated }) += size;
    }
    // The stress is half of ρ g (H − z), and the weight grows by a quarter.
    let exact = 10.0 * (2000.0 * 0.5 + 500.0) * 2.0 * (1.0 - 0.125);
    assert!((soaked / exact - 1.0).abs() < 1e-6, "{soaked} {exact}");
    assert!(excavated < 1e-5 * exact, "{excavated}");
}

/// Translating and spinning blocks keep their velocities when their mass changes.
#[test]
fn moving_blocks_keep_velocity_when_mass_changes() {
    for body in [Body::Rigid, Body::Deformable] {
        let mut deck = column();
        deck.blocks[0].body = body;
        (deck.model.gravity, deck.fix) = ([0.0; 3], Vec::new());
        deck.stage = vec![dynamic("dry"), dynamic("wet")];
        deck.assign[0].until = None;
        let velocity = Some([1.0, -2.0, 0.5]);
        let spin = Some([3.0, 1.0, -2.0]);
        deck.initial.push(Initial { velocity, spin, ..Initial::default() });
        let mut simulation = simulation(&deck);
        let started = simulation.start(Damping::None, TimeStep::Seconds(1e-4), None);
        started.unwrap_or_else(|error| panic!("{error}"));
        after(&mut simulation, 0.01);
        let nodes = 0..simulation.model().n_nodes();
        let velocities = |simulation: &mut Simulation| -> Vec<[f64; 3]> {
            nodes.clone().map(|node| simulation.velocity(node)).collect()
        };
        simulation.synchronise();
        let before = velocities(&mut simulation);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        let energy = simulation.energy();
        for (a, b) in before.iter().zip(velocities(&mut simulation)) {
            assert!((Vec3::from(*a) - Vec3::from(b)).norm() < 1e-12, "{body:?}: {a:?} {b:?}");
        }
        after(&mut simulation, 0.01);
        let later = simulation.energy();
        assert!(
            (later.kinetic / energy.kinetic - 1.0).abs() < 1e-2,
            "{body:?}: {energy:?} {later:?}"
        );
        assert!(later.balance.abs() < 1e-6 * later.kinetic, "{body:?}: {later:?}");
    }
}

/// Sets without a joint stay in contact even if a later stage assigns a joint everywhere.
#[test]
fn contacts_never_become_joints() {
    let mut deck = slab(true, Body::Rigid);
    deck.blocks[0].joint = None;
    deck.assign[0].r#where = Where::default();
    let mut simulation = simulation(&deck);
    assert_eq!(simulation.model().n_pairs(), 4 * 4);
    relax(&mut simulation);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(simulation.model().pairs().map(|pair| pair.joint).collect::<Vec<_>>(), [1; 16]);
}

#[test]
fn invalid_assignments_are_refused() {
    let change = |change: &dyn Fn(&mut Deck)| {
        let mut deck = slab(true, Body::Rigid);
        change(&mut deck);
        deck
    };
    let wet = |joint: Joint| change(&|deck| drop(deck.joints.insert("wet".into(), joint.clone())));
    let stiffer = Joint { normal_stiffness: Some(2e9), ..dry(10.0) };
    let words = ["assign[0].joint", "`wet`", "`seam`", "stage `slide`", "only strengths"];
    refused(&wet(stiffer), &words);
    refused(&wet(Joint { thickness: 0.001, ..dry(10.0) }), &words);
    let nowhere = change(&|deck| deck.assign[0].r#where = plane(2, 7.0));
    refused(&nowhere, &["assign[0].where", "no joint"]);
    let never = change(&|deck| deck.assign[0].until = Some("slide".into()));
    refused(&never, &["assign[0].until", "never in force"]);
    let without = change(&|deck| deck.blocks[0].joint = None);
    refused(&without, &["assign[0].where", "no joint"]);
    let ends = change(&|deck| (deck.blocks[0].joint, deck.assign[0].from) = (None, None));
    refused(&ends, &["assign[0].joint", "cannot add or remove joints"]);
    let stays = wet(Joint { friction: None, ..dry(10.0) });
    refused(&stays, &["assign[0].joint", "never does"]);
    // Other assignments of the same stage do not matter.
    let other = change(&|deck| {
        let (material, from) = (Some("clay".to_owned()), Some("slide".to_owned()));
        deck.assign.insert(0, Assign { material, from, ..Assign::default() });
        deck.joints.insert("wet".into(), Joint { thickness: 0.001, ..dry(10.0) });
    });
    refused(&other, &["assign[1].joint"]);
}

/// Laws are numbered in 16 bits, and the laws between two joints also need numbers.
#[test]
fn too_many_pairs_of_joint_laws_are_refused() {
    let mut deck = slab(false, Body::Rigid);
    deck.stage = vec![relax_stage("rest"), relax_stage("slide"), relax_stage("brake")];
    let start = |deck: &Deck, increments: u32| {
        let mut simulation = simulation(deck);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        simulation.start_relaxation(increments).map_err(|error| error.to_string())
    };
    deck.joints.extend((2..65_533).map(|number| (format!("unused {number:05}"), dry(30.0))));
    assert_eq!(start(&deck, 2), Ok(()));
    deck.joints.insert("unused last".into(), dry(30.0));
    let error = start(&deck, 2).expect_err("no number is left");
    assert!(
        error.contains("needs 65535 joint laws") && error.contains("`increments = 1`"),
        "{error}"
    );
    assert_eq!(start(&deck, 1), Ok(()));
}
