//! Increments of a relaxation: slip stored only at equilibrium, strengths and supports. A resume
//! from a checkpoint within an increment gives the same bits.

use ddem_core::{Relaxed, Simd, Simulation};
use ddem_deck::*;

use crate::damage::withstands_damage;
use crate::decks::*;

const TOLERANCE: f64 = 1e-7;

fn dry(friction: f64) -> Joint {
    let k = Some(1e12);
    Joint { normal_stiffness: k, shear_stiffness: k, friction: Some(friction), ..Joint::default() }
}

/// Block that is pressed down, loses friction and is pushed sideways by a support. It belongs to
/// the set of its base, or to a set of its own on a wider base with a nonconforming joint.
fn pushed(body: Body, sets: bool) -> Deck {
    let mut deck = deck([1, 1, if sets { 1 } else { 2 }], [1.0; 3], 2, 0.0);
    deck.joints = [("seam".to_owned(), dry(40.0)), ("wet".to_owned(), dry(10.0))].into();
    deck.blocks[0].body = body;
    // Nothing bulges and rotations are small, so friction acts against the push only.
    deck.model.kinematics = Kinematics::Small;
    deck.materials.insert("rock".into(), Material { density: 2400.0, young: 18e9, poisson: 0.0 });
    let mut level = 0.5;
    if sets {
        level = 0.0;
        let bed = BlockSet {
            origin: [-0.25, -0.25, -0.5],
            size: Some([1.5, 1.5, 0.5]),
            ..deck.blocks[0].clone()
        };
        deck.blocks.push(bed);
    }
    let bottom = if sets { -0.5 } else { 0.0 };
    deck.fix.push(fix(plane(2, bottom), "xyz"));
    deck.model.gravity = [0.0, 0.0, -9.81];
    let push = Some([2e-4, 0.0, 0.0]);
    deck.fix.push(Fix { displacement: push, from: Some("push".into()), ..fix(plane(2, 1.0), "x") });
    deck.load.push(Load { r#where: plane(2, 1.0), pressure: Some(1e6), ..Load::default() });
    deck.stage = vec![relax_stage("rest"), relax_stage("push")];
    deck.assign.push(Assign {
        r#where: plane(2, level),
        joint: Some("wet".into()),
        from: Some("push".into()),
        ..Assign::default()
    });
    deck
}

fn stage(simulation: &mut Simulation, stage: usize, increments: u32) {
    simulation.enter(stage).unwrap_or_else(|error| panic!("{error}"));
    simulation.start_relaxation(increments).unwrap_or_else(|error| panic!("{error}"));
}

fn step(simulation: &mut Simulation) -> bool {
    let relaxed = simulation.relax_step(TOLERANCE).unwrap_or_else(|error| panic!("{error}"));
    relaxed == Relaxed::Done
}

/// Relaxes to the end; saves and restores the simulation every `every` steps.
fn go(simulation: &mut Simulation, deck: &Deck, every: u64) {
    for i in 1..100_000 {
        if step(simulation) {
            return simulation.finish_relaxation();
        }
        if i % every == 0 {
            let saved = simulation.save();
            *simulation = Simulation::restore(model(deck), Simd::default(), &saved)
                .unwrap_or_else(|error| panic!("{error}"));
        }
    }
    panic!("not in equilibrium");
}

fn top(simulation: &Simulation) -> Vec<u32> {
    plane(2, 1.0).nodes(simulation.model()).unwrap()
}

#[test]
fn support_slides_block_against_residual_friction() {
    for (body, sets) in [(Body::Deformable, false), (Body::Rigid, false), (Body::Deformable, true)]
    {
        let mut deck = pushed(body, sets);
        // Without contacts the pairs keep their partners.
        deck.model.contact = Some(false);
        let mut simulation = simulation(&deck);
        stage(&mut simulation, 0, 1);
        go(&mut simulation, &deck, u64::MAX);
        let before = simulation.displacements();
        // Slip is straight within each increment; many increments follow its turn into the push
        // direction.
        stage(&mut simulation, 1, 40);
        go(&mut simulation, &deck, u64::MAX);
        let (top, after) = (top(&simulation), simulation.displacements());
        for &node in &top {
            let way = after[node as usize][0] - before[node as usize][0];
            // In a rotating block the error is the square of the rotation.
            let most = if body == Body::Rigid { 1e-8 } else { 1e-15 };
            assert!((way - 2e-4).abs() < most, "{body:?}, sets {sets}: {way:e}");
        }
        let height = if sets { 1.0 } else { 0.5 };
        let exact = (1e6 + 2400.0 * 9.81 * height) * 10.0_f64.to_radians().tan();
        let force = simulation.reaction(&top)[0];
        println!("{body:?}, sets {sets}: {force:e} N of {exact:e} N");
        assert!((force / exact - 1.0).abs() < 1e-4, "{body:?}, sets {sets}: {force:e} {exact:e}");
    }
}

#[test]
fn checkpoint_within_increment_changes_no_bit() {
    for (body, sets) in [(Body::Deformable, false), (Body::Rigid, false), (Body::Deformable, true)]
    {
        let deck = pushed(body, sets);
        let run = |every: u64| {
            let mut simulation = simulation(&deck);
            stage(&mut simulation, 0, 1);
            go(&mut simulation, &deck, every);
            stage(&mut simulation, 1, 3);
            go(&mut simulation, &deck, every);
            let mut seen = bits(&simulation.displacements());
            seen.extend(simulation.energy().values().map(f64::to_bits));
            seen.push(simulation.steps());
            seen
        };
        assert!(run(u64::MAX) == run(17), "{body:?}, sets {sets}");
    }
}

/// The block moves by 2e-4 m for any number of increments, and only in the stage in which the
/// support takes effect.
#[test]
fn support_displacement_is_applied_once() {
    let deck = pushed(Body::Deformable, false);
    let mut simulation = simulation(&deck);
    stage(&mut simulation, 0, 1);
    go(&mut simulation, &deck, u64::MAX);
    let node = top(&simulation)[0] as usize;
    let before = simulation.displacements()[node][0];
    stage(&mut simulation, 1, 3);
    go(&mut simulation, &deck, u64::MAX);
    simulation.relax(TOLERANCE, 10_000).unwrap_or_else(|error| panic!("{error}"));
    assert!((simulation.displacements()[node][0] - before - 2e-4).abs() < 1e-15);
}

#[test]
fn displacement_needs_relax_stage_and_fixed_direction() {
    let message = |change: &dyn Fn(&mut Deck)| {
        let mut deck = pushed(Body::Deformable, false);
        change(&mut deck);
        let error = deck.build().err().unwrap_or_else(|| panic!("it was taken"));
        error.faults.iter().map(|f| format!("{}: {}", f.place, f.message)).collect::<String>()
    };
    let free = message(&|deck| deck.fix[1].displacement = Some([0.0, 1e-3, 0.0]));
    assert!(free.contains("fix[1].displacement[1]: a displacement of 0.001 along y"), "{free}");
    let both = message(&|deck| deck.fix[1].velocity = Some([1.0, 0.0, 0.0]));
    assert!(both.contains("`displacement` cannot be combined with `velocity`"), "{both}");
    let dynamic = message(&|deck| {
        deck.stage[1].kind = StageKind::Dynamic;
        deck.stage[1].duration = Some(1.0);
    });
    assert!(dynamic.contains("stage `push`, in which the support comes into force, is dynamic"));
    let wild = message(&|deck| deck.fix[1].displacement = Some([f64::NAN, 0.0, 0.0]));
    assert!(wild.contains("fix[1].displacement"), "{wild}");
}

/// A support lifts a block by d: the support does the work m g d, and gravity takes it.
#[test]
fn lifting_support_works_against_gravity() {
    for body in [Body::Rigid, Body::Deformable] {
        let mut deck = deck([1; 3], [1.0; 3], 2, 0.01);
        deck.blocks[0].body = body;
        deck.model.gravity = [0.0, 0.0, -9.81];
        let lift = Some([0.0, 0.0, 0.1]);
        deck.fix.push(Fix {
            displacement: lift,
            from: Some("lift".into()),
            ..fix(Where::default(), "xyz")
        });
        deck.fix.push(Fix { until: Some("lift".into()), ..fix(Where::default(), "xyz") });
        deck.stage = vec![relax_stage("rest"), relax_stage("lift")];
        let mut simulation = simulation(&deck);
        stage(&mut simulation, 0, 1);
        go(&mut simulation, &deck, u64::MAX);
        let before = simulation.energy();
        stage(&mut simulation, 1, 4);
        go(&mut simulation, &deck, u64::MAX);
        let after = simulation.energy();
        // The difference excludes the work of gravity when the weight was applied.
        let work = 2400.0 * 9.81 * 0.1;
        for (what, off) in [
            ("work of all", after.external_work - before.external_work),
            ("balance", after.balance - before.balance),
        ] {
            assert!(off.abs() < 1e-6 * work, "{body:?}: {what} {off:e} of {work:e}");
        }
    }
}

#[test]
fn damaged_relaxation_states_are_refused_or_run() {
    for (body, sets) in [(Body::Rigid, false), (Body::Deformable, true)] {
        let deck = pushed(body, sets);
        let mut simulation = simulation(&deck);
        stage(&mut simulation, 0, 1);
        go(&mut simulation, &deck, u64::MAX);
        stage(&mut simulation, 1, 3);
        (0..40).for_each(|_| assert!(!step(&mut simulation)));
        withstands_damage(&deck, &simulation.save(), 300);
    }
}
