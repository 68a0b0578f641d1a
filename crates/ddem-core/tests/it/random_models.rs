//! Random small decks: each runs or is refused with a reason.

use ddem_core::{Energy, RunError, Simd, Simulation};
use ddem_deck::*;

use crate::decks::*;
use crate::unbonded_blocks::*;

fn pick<T: Copy>(random: &mut Random, of: &[T]) -> T {
    of[((part(random) * of.len() as f64) as usize).min(of.len() - 1)]
}

fn joint(random: &mut Random) -> Joint {
    let spring = random.next() > 0.0;
    let weak = random.next() > -0.3;
    let strength = pick(random, &[0.0, 1e2, 1e3, 1e4, 1e5]);
    let stiff = |random: &mut Random| Some(10_f64.powf(8.5 + random.next()));
    Joint {
        thickness: if spring { pick(random, &[0.0, 0.01]) } else { 0.02 },
        material: (!spring).then(|| "stuff".into()),
        normal_stiffness: if spring { stiff(random) } else { None },
        shear_stiffness: if spring { stiff(random) } else { None },
        cohesion: weak.then_some(strength),
        friction: weak.then_some(30.0),
        tension: weak.then_some(0.5 * strength),
        residual_friction: weak.then_some(pick(random, &[0.0, 20.0, 30.0])),
        dilation: (weak && random.next() > 0.5).then_some(0.0),
        ..Joint::default()
    }
}

/// One to four lattices on top of each other and some loose blocks. The lattices have gaps, touch,
/// or penetrate each other's joints slightly.
fn random_deck(seed: u64) -> Deck {
    let mut random = Random::new(1000 + seed);
    let random = &mut random;
    let mut deck = mass_properties(pick(random, &[1e7, 1e8, 1e9]));
    deck.model.kinematics = pick(random, &[Kinematics::Corotational, Kinematics::Small]);
    deck.model.gravity = pick(random, &[[0.0; 3], [0.0, 0.0, -9.81], [3.0, -5.0, -100.0]]);
    deck.model.contact = pick(random, &[None, None, Some(true), Some(false)]);
    deck.contact.friction = pick(random, &[None, Some(0.0), Some(60.0)]);
    deck.contact.restitution = pick(random, &[None, Some(0.0), Some(0.5), Some(1.0)]);
    deck.contact.damping = None;
    let mut top = 0.0;
    for set in 0..1 + (3.9 * part(random)) as usize {
        let name = format!("joint {set}");
        deck.joints.insert(name.clone(), joint(random));
        let count = [0, 1, 2].map(|_| 1 + (2.5 * part(random)) as u32);
        let size = [0, 1, 2].map(|d| f64::from(count[d]) * pick(random, &[0.5, 1.0, 1.3]));
        let turn = random.rotation(0.0)
            * nalgebra::Rotation3::from_axis_angle(&Vec3::z_axis(), pick(random, &[0.0, 0.0, 0.4]));
        top += pick(random, &[0.0, 0.0, 1e-9, 1e-3, 0.05]);
        let rigid = random.next() > 0.0;
        deck.blocks.push(BlockSet {
            name: Some(format!("set {set}")),
            origin: [0.3 * random.next(), 0.3 * random.next(), top],
            size: Some(size),
            count: Some(count),
            divisions: pick(random, &[1, 2, 3]),
            body: if rigid { Body::Rigid } else { Body::Deformable },
            material: "stuff".into(),
            joint: Some(JointChoice::All(name)),
            axes: [0, 1, 2].map(|d| <[f64; 3]>::from(turn.matrix().column(d))),
            ..BlockSet::default()
        });
        top += size[2];
    }
    for _ in 0..(2.5 * part(random)) as usize {
        top += 2.0;
        let piece = Piece {
            centre: Vec3::new(0.5, 0.5, top),
            edges: Vec3::repeat(0.8) + random.vector() * 0.4,
            turn: any_turn(random),
            divisions: pick(random, &[0, 1, 2]),
            velocity: Vec3::new(0.0, 0.0, -20.0 * part(random)),
            spin: random.vector() * 5.0,
            ..Piece::default()
        };
        add(&mut deck, &piece);
    }
    if random.next() > -0.5 {
        deck.fix.push(fix(plane(2, deck.blocks[0].origin[2]), "xyz"));
    }
    if random.next() > 0.0 {
        let velocity = Some((random.vector() * 10.0).into());
        let spin = Some((random.vector() * 4.0).into());
        let region = Where { set: Some("set 0".into()), ..Where::default() };
        let centre = Some([0.5; 3]);
        deck.initial.push(Initial {
            r#where: region,
            velocity,
            spin,
            centre,
            ..Initial::default()
        });
    }
    deck
}

/// Runs 200 steps, and the last 100 of them again from a saved state with energies evaluated at
/// every step.
fn run(deck: &Deck, simulation: &mut Simulation, damping: Damping) -> Result<(), RunError> {
    simulation.start(damping, TimeStep::Auto, None)?;
    (0..100).try_for_each(|_| simulation.step())?;
    let again = Simulation::restore(model(deck), Simd::default(), &simulation.save());
    let mut again = again.unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..100 {
        let step = simulation.step();
        again.energy();
        assert_eq!(again.step(), step);
        step?;
    }
    assert!(simulation.save() == again.save(), "it goes on with other bits");
    Ok(())
}

/// Energy balance as a fraction of the largest energy.
fn imbalance(energy: &Energy, first: &Energy) -> f64 {
    let strain = energy.strain_joints + energy.strain_bodies;
    let lost = energy.friction.abs() + energy.damping.abs();
    let size =
        energy.kinetic.max(first.kinetic).max(energy.external_work.abs()).max(strain).max(lost);
    energy.balance.abs() / size.max(1e-9)
}

#[test]
fn random_decks_run_or_are_refused_with_a_reason() {
    let (mut ran, mut stopped, mut refused) = (0, 0, 0);
    let dampings = [Damping::None, Damping::Ratio(0.05), Damping::Mass(5.0), Damping::Local(0.8)];
    for seed in 0..120 {
        let deck = random_deck(seed);
        println!("seed {seed}: {} sets", deck.blocks.len());
        let site = match BuiltDeck::new(&deck) {
            Ok(site) => site,
            Err(error) => {
                println!("  {error}");
                refused += 1;
                continue;
            }
        };
        let model = site.model();
        let _ = site.warnings(&model);
        let mut simulation = Simulation::new(model);
        let first = simulation.energy();
        let ended = run(&deck, &mut simulation, dampings[seed as usize % 4]);
        match ended {
            Ok(()) => {
                ran += 1;
                let energy = simulation.energy();
                assert!(energy.values().iter().all(|x| x.is_finite()), "{energy:?}");
                let off = imbalance(&energy, &first);
                println!(
                    "  {off:.1e} {:?} {:?}",
                    simulation.failed_pairs(),
                    contacts(&mut simulation)
                );
                assert!(off < 0.1, "seed {seed}: {energy:?}");
            }
            Err(error @ (RunError::BlockTooFast { .. } | RunError::DeepPenetration { .. })) => {
                println!("  {error}");
                stopped += 1;
            }
            Err(error) => panic!("seed {seed}: {error}"),
        }
    }
    println!("{ran} ran, {stopped} stopped, {refused} refused");
    assert!(ran > 100 && refused == 0, "{ran} ran, {stopped} stopped, {refused} refused");
}
