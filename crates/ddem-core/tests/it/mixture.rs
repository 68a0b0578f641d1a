//! Rigid and deformable blocks, breaking and released joints, and contacts together. Threads,
//! instruction sets, evaluations, saving and resuming do not change a bit.

use ddem_core::{FIELDS, FORCE, Field, Simd, Simulation};
use ddem_deck::*;

use crate::damage::withstands_damage;
use crate::decks::*;
use crate::unbonded_blocks::{Piece, add, any_turn, contacts, mass_properties};

/// Two jointed walls on a floor, a rigid one with springs and a deformable one with layers. Blocks
/// are thrown at them.
pub(crate) fn mixture(kinematics: Kinematics) -> Deck {
    let mut deck = mass_properties(1e8);
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.model.kinematics = kinematics;
    let spring = Joint {
        normal_stiffness: Some(2e8),
        shear_stiffness: Some(1e8),
        cohesion: Some(2e4),
        tension: Some(1e4),
        friction: Some(30.0),
        residual_friction: Some(20.0),
        ..Joint::default()
    };
    let section = Joint {
        thickness: 0.02,
        material: Some("stuff".into()),
        normal_stiffness: None,
        shear_stiffness: None,
        ..spring.clone()
    };
    deck.joints = [("spring".to_owned(), spring), ("seam".to_owned(), section)].into();
    let floor = Piece {
        centre: Vec3::new(2.0, 0.5, -0.25),
        edges: Vec3::new(8.0, 6.0, 0.5),
        held: true,
        ..Piece::default()
    };
    add(&mut deck, &floor);
    for (y, body, joint) in [(0.0, Body::Rigid, "spring"), (1.2, Body::Deformable, "seam")] {
        deck.blocks.push(BlockSet {
            name: Some(joint.into()),
            origin: [0.0, y, 0.0],
            size: Some([3.0, 0.8, 2.0]),
            count: Some([3, 1, 2]),
            divisions: 2,
            material: "stuff".into(),
            joint: Some(JointChoice::All(joint.into())),
            body,
            ..BlockSet::default()
        });
    }
    // One block of each wall is split, which makes nonconforming joints of both kinds.
    for set in ["spring", "seam"] {
        let x = Some(Extent::Range([1.0, 2.0]));
        let z = Some(Extent::Range([1.0, 2.0]));
        let region = Where { set: Some(set.into()), x, z, ..Where::default() };
        deck.refine.push(Refine { r#where: region, factor: 2 });
    }
    let mut random = Random::new(5);
    for i in 0..5 {
        let x = 0.4 + 0.55 * f64::from(i);
        let centre = Vec3::new(x, if i % 2 == 0 { -1.0 } else { 2.9 }, 1.0 + 0.2 * random.next());
        let way = if i % 2 == 0 { 9.0 } else { -9.0 };
        add(
            &mut deck,
            &Piece {
                centre,
                edges: Vec3::repeat(0.6) + random.vector() * 0.1,
                turn: any_turn(&mut random),
                divisions: i % 3,
                velocity: Vec3::new(0.0, way, 0.0) + random.vector(),
                spin: random.vector() * 3.0,
                ..Piece::default()
            },
        );
    }
    deck.contact.damping = Some(0.1);
    deck
}

const KINDS: [Kinematics; 2] = [Kinematics::Corotational, Kinematics::Small];

fn started(deck: &Deck, simd: Simd, damping: Damping) -> Simulation {
    let mut simulation = Simulation::with_simd(model(deck), simd);
    let start = simulation.start(damping, TimeStep::Auto, None);
    start.unwrap_or_else(|error| panic!("{error}"));
    simulation
}

fn step(simulation: &mut Simulation, steps: usize) {
    for _ in 0..steps {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Checks that two simulations have the same state, bit by bit.
fn same(a: &Simulation, b: &Simulation, what: &str) {
    assert!(a.save() == b.save(), "{what}");
}

/// Evaluates everything that a simulation offers.
fn evaluate_everything(simulation: &mut Simulation) {
    simulation.energy();
    simulation.velocities();
    let _ = simulation.stresses();
    simulation.tractions();
    simulation.forces();
    simulation.internal_forces();
    simulation.reaction(&[0, 1]);
    let _ = simulation.failed_pairs();
    for field in FIELDS {
        let _ = simulation.snapshot().values(&field);
    }
    simulation.contacts();
    simulation.momentum();
    simulation.contact_counts();
}

const STEPS: usize = 2500;

#[test]
fn mixture_bits_are_independent_of_threads_and_simd() {
    for kinematics in KINDS {
        let deck = mixture(kinematics);
        let run = |simd: Simd, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap_or_else(|error| panic!("{error}")).install(|| {
                let mut simulation = started(&deck, simd, Damping::None);
                step(&mut simulation, STEPS);
                simulation
            })
        };
        let mut first = run(Simd::available()[0].1, 1);
        let [patches, released] = contacts(&mut first);
        let [shear, tension] = first.failed_pairs();
        println!(
            "{kinematics:?}: {patches} contacts, {released} let go, {shear} + {tension} failed, {:?}",
            first.energy()
        );
        assert!(patches > 8 && released > 3, "{patches} {released}");
        let first = run(Simd::available()[0].1, 1);
        for (name, simd) in Simd::available() {
            for threads in [1, 2, 3, 8] {
                if threads > 3 && name != Simd::available()[0].0 {
                    continue;
                }
                same(&first, &run(simd, threads), &format!("{name}, {threads} threads"));
            }
        }
    }
}

#[test]
fn fields_in_pieces_equal_whole_fields() {
    let mut deck = mixture(Kinematics::Corotational);
    deck.model.peaks = true;
    // The fields have more values than one thread fills.
    deck.blocks[2].divisions = 8;
    let mut simulation = started(&deck, Simd::default(), Damping::None);
    step(&mut simulation, STEPS);
    let (n, [patches, _]) = (simulation.model().n_nodes(), contacts(&mut simulation));
    let failed = simulation.failed_pairs();
    assert!(n > 5000 && patches > 0 && failed != [0; 2], "{n} {patches} {failed:?}");
    let mut fields: Vec<Field> = ddem_core::fields(simulation.model()).copied().collect();
    fields.push(FORCE);
    let wholes: Vec<_> = fields.iter().map(|field| simulation.snapshot().values(field)).collect();
    let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    for size in [1, 7, 1000, 4567] {
        let snapshot = simulation.snapshot();
        for (field, whole) in fields.iter().zip(&wholes) {
            let n = snapshot.len(field.on);
            let mut pieces = vec![f64::MAX; n * field.components];
            for first in (0..n).step_by(size) {
                let range = first..n.min(first + size);
                let at = range.start * field.components..range.end * field.components;
                snapshot.fill(field, range, &mut pieces[at]);
            }
            assert!(bits(&pieces) == bits(whole), "{} in pieces of {size}", field.name);
            snapshot.fill(field, n..n, &mut []);
        }
    }
}

#[test]
fn evaluating_mixture_changes_no_bit() {
    for (kinematics, damping) in KINDS.into_iter().zip([Damping::Local(0.1), Damping::None]) {
        let deck = mixture(kinematics);
        let mut plain = started(&deck, Simd::default(), damping);
        let mut evaluated = started(&deck, Simd::default(), damping);
        let mut random = Random::new(3);
        for at in 0..STEPS {
            step(&mut plain, 1);
            step(&mut evaluated, 1);
            if random.next() > 0.3 {
                evaluate_everything(&mut evaluated);
            }
            if at % 25 == 0 || at > STEPS - 3 {
                same(&plain, &evaluated, &format!("step {at}"));
            }
        }
    }
}

#[test]
fn mixture_resumes_from_any_step() {
    for (kinematics, damping) in KINDS.into_iter().zip([Damping::None, Damping::Ratio(0.01)]) {
        let deck = mixture(kinematics);
        let mut whole = started(&deck, Simd::default(), damping);
        let reloaded = |simulation: &Simulation| {
            let restored = Simulation::restore(model(&deck), Simd::default(), &simulation.save());
            restored.unwrap_or_else(|error| panic!("{error}"))
        };
        let mut rebuilt = reloaded(&whole);
        let mut random = Random::new(9);
        let mut from = Vec::new();
        for at in 0..STEPS {
            step(&mut whole, 1);
            step(&mut rebuilt, 1);
            same(&whole, &rebuilt, &format!("step {at}"));
            if at < 5 || random.next() > 0.6 {
                let next = reloaded(&rebuilt);
                same(&rebuilt, &next, &format!("restored at step {at}"));
                rebuilt = next;
            }
            if at % 100 == 50 {
                from.push(reloaded(&whole));
            }
        }
        same(&whole, &rebuilt, "rebuilt");
        for mut other in from {
            let rest = STEPS as u64 - other.steps();
            step(&mut other, rest as usize);
            same(&whole, &other, "saved once");
        }
        whole.synchronise();
        rebuilt.synchronise();
        same(&reloaded(&whole), &rebuilt, "settled");
        for simulation in [&mut whole, &mut rebuilt] {
            let start = simulation.start(Damping::Local(0.3), TimeStep::Auto, Some(0.05));
            start.unwrap_or_else(|error| panic!("{error}"));
            step(simulation, 30);
        }
        same(&whole, &rebuilt, "the next stage");
    }
}

/// Damaged states with rigid blocks, broken joints and contacts.
#[test]
fn damaged_mixture_states_are_refused_or_run() {
    let deck = mixture(Kinematics::Corotational);
    let mut simulation = started(&deck, Simd::default(), Damping::None);
    step(&mut simulation, STEPS);
    withstands_damage(&deck, &simulation.save(), 1000);
}
