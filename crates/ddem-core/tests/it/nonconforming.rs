//! Nonconforming joints that fail and slide, and resume with the same bits.

use ddem_core::{FIELDS, Relaxed, Saved, Simd, Simulation};
use ddem_deck::*;

use crate::decks::*;
use crate::refine::{layers, range, refine};

/// Blocks with a weak joint between an upper half and a split lower half.
fn halves() -> Deck {
    let mut deck = layers(0.0);
    deck.refine = vec![refine(range(2, 0.0, 1.0), 2)];
    deck.blocks[0].count = Some([2, 2, 2]);
    deck.blocks[0].size = Some([2.0, 2.0, 2.0]);
    let weak = Joint {
        cohesion: Some(1e5),
        tension: Some(5e4),
        friction: Some(30.0),
        ..deck.joints["seam"].clone()
    };
    deck.joints.insert("weak".into(), weak);
    deck.assign.push(Assign {
        r#where: plane(2, 1.0),
        joint: Some("weak".into()),
        ..Assign::default()
    });
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck
}

/// Pulled up slowly, the joint fails at its tensile strength as force over area.
#[test]
fn nonconforming_joint_fails_at_tensile_strength() {
    let strongest = |traction: f64| {
        let mut deck = halves();
        // Lateral supports make the stress uniform.
        deck.fix = vec![fix(plane(2, 0.0), "xyz"), fix(Where::default(), "xy")];
        let pull = Some([0.0, 0.0, traction]);
        deck.load.push(Load { r#where: plane(2, 2.0), traction: pull, ..Load::default() });
        deck.stage = vec![relax_stage("pull")];
        let mut simulation = simulation(&deck);
        simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
        let done = (0..20_000).find_map(|_| match simulation.relax_step(1e-7) {
            Ok(Relaxed::Done) => Some(true),
            Ok(_) => None,
            Err(_) => Some(false),
        });
        (done == Some(true), simulation.failed_pairs())
    };
    assert_eq!(strongest(0.995 * 5e4), (true, [0, 0]));
    let (held, failed) = strongest(1.005 * 5e4);
    assert!(!held && failed[1] > 0 && failed[0] == 0, "{failed:?}");
}

/// Sheared beyond its strength, the joint slides, and friction and fracture energies balance.
#[test]
fn nonconforming_joint_slides_with_friction() {
    let mut deck = halves();
    deck.model.gravity = [0.0, 0.0, -10.0];
    let region = Where { z: Some(Extent::Range([1.0, 2.0])), ..Where::default() };
    deck.load.push(Load { r#where: region, force: Some([5e5, 0.0, 0.0]), ..Load::default() });
    let mut simulation = simulation(&deck);
    let started = simulation.start(Damping::None, TimeStep::Auto, Some(0.05));
    started.unwrap_or_else(|error| panic!("{error}"));
    while simulation.steps_left() != Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    // Each of the 16 split blocks has 3 × 3 nodes there.
    assert_eq!(simulation.failed_pairs().iter().sum::<u64>(), 16 * 9);
    let energy = simulation.energy();
    assert!(energy.friction > 0.0 && energy.fracture > 0.0, "{energy:?}");
    assert!(energy.balance.abs() < 1e-2 * energy.kinetic, "{energy:?}");
}

/// Without contacts, joints keep their pairs for any slip. This holds for conforming joints beside
/// nonconforming ones, too.
#[test]
fn joints_keep_pairs_without_contact_search() {
    for split in [true, false] {
        let mut deck = halves();
        deck.model.gravity = [0.0, 0.0, -10.0];
        deck.model.contact = Some(false);
        if !split {
            // A conforming joint beside a nonconforming one.
            deck.refine = vec![refine(range(0, 0.0, 1.0), 2)];
            deck.joints.values_mut().for_each(|joint| joint.cohesion = Some(1e3));
        }
        let region = Where { z: Some(Extent::Range([1.0, 2.0])), ..Where::default() };
        deck.load.push(Load { r#where: region, force: Some([1e6, 0.0, 0.0]), ..Load::default() });
        let mut simulation = simulation(&deck);
        let started = simulation.start(Damping::None, TimeStep::Auto, None);
        started.unwrap_or_else(|error| panic!("{error}"));
        let top = plane(2, 2.0).nodes(simulation.model()).unwrap()[0] as usize;
        while simulation.displacement(top).iter().all(|u| u.abs() < 0.4) {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        assert_eq!(simulation.contact_counts().near, 0);
        let released = FIELDS.iter().find(|field| field.name == "released");
        let released =
            released.map(|field| simulation.snapshot().values(field)).unwrap_or_default();
        assert!(released.len() == simulation.model().n_pairs());
        assert!(released.iter().all(|&released| released == 0.0));
    }
}

fn state(simulation: &mut Simulation) -> (Vec<u64>, Vec<u64>, [u64; 2]) {
    let bits = |v: Vec<[f64; 3]>| v.into_iter().flatten().map(f64::to_bits).collect();
    (bits(simulation.displacements()), bits(simulation.tractions()), simulation.failed_pairs())
}

/// One block on four offset blocks of another set, with a weak joint between the sets.
fn sets(body: Body) -> Deck {
    let mut deck = deck([2, 2, 1], [2.0, 2.0, 1.0], 1, 0.0);
    let spring = |strength: f64| Joint {
        normal_stiffness: Some(1e11),
        shear_stiffness: Some(4e10),
        cohesion: Some(2.0 * strength),
        tension: Some(strength),
        friction: Some(30.0),
        ..Joint::default()
    };
    deck.joints = [("seam".to_owned(), spring(1e9)), ("weak".to_owned(), spring(5e4))].into();
    deck.blocks[0].body = body;
    deck.blocks.push(BlockSet {
        origin: [0.3, 0.4, 1.0],
        size: Some([1.4, 1.2, 0.8]),
        count: None,
        joint: Some(JointChoice::All("weak".into())),
        ..deck.blocks[0].clone()
    });
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck
}

/// Evaluating, saving and resuming at any step of breaking and sliding changes no bit. The joints
/// lie at split blocks and between sets, of deformable and of rigid blocks.
#[test]
fn nonconforming_joints_resume_with_same_bits() {
    let rigid = || {
        let mut deck = halves();
        (deck.blocks[0].body, deck.blocks[0].divisions) = (Body::Rigid, 1);
        deck
    };
    for deck in [halves(), rigid(), sets(Body::Deformable), sets(Body::Rigid)] {
        check_resume(deck);
    }
}

fn check_resume(mut deck: Deck) {
    deck.model.gravity = [0.0, 0.0, -10.0];
    let region = Where { z: Some(Extent::Range([1.0, 2.0])), ..Where::default() };
    deck.load.push(Load { r#where: region, force: Some([2e6, 0.0, 3e5]), ..Load::default() });
    let start = || {
        let mut simulation = simulation(&deck);
        let started = simulation.start(Damping::None, TimeStep::Auto, Some(0.05));
        started.unwrap_or_else(|error| panic!("{error}"));
        simulation
    };
    let (mut plain, mut again) = (start(), start());
    for k in 0..700 {
        plain.step().unwrap_or_else(|error| panic!("{error}"));
        again.step().unwrap_or_else(|error| panic!("{error}"));
        if k % 50 == 3 {
            again.energy();
            let saved: Saved = again.save();
            let restored = Simulation::restore(model(&deck), Simd::default(), &saved);
            again = restored.unwrap_or_else(|error| panic!("{error}"));
        }
    }
    assert!(plain.failed_pairs() != [0, 0]);
    assert!(state(&mut plain) == state(&mut again));
}
