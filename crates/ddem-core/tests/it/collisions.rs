//! Collisions of loose blocks: conserved quantities, penetration, and no passing through.

use ddem_core::{Energy, RunError, Simulation};
use ddem_deck::{Damping, Deck, TimeStep};

use crate::decks::*;
use crate::unbonded_blocks::*;

fn start(simulation: &mut Simulation, damping: Damping) {
    simulation.start(damping, TimeStep::Auto, None).unwrap_or_else(|error| panic!("{error}"));
}

fn steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Eight blocks around the origin that fly towards it. `kind` 0: rigid, 1: deformable, 2: both.
fn swarm(seed: u64, kind: usize) -> Deck {
    let mut random = Random::new(seed);
    let pieces: Vec<Piece> = (0..8)
        .map(|i: usize| {
            let side = |d: usize| if i >> d & 1 == 1 { 1.0 } else { -1.0 };
            let centre = Vec3::new(side(0), side(1), side(2)) * 1.1 + random.vector() * 0.05;
            Piece {
                centre,
                edges: Vec3::repeat(1.0) + random.vector() * 0.3,
                turn: any_turn(&mut random),
                divisions: [0, 1 + i as u32 % 3, (i as u32 % 4).min(2)][kind],
                velocity: centre * -2.0 + random.vector(),
                spin: random.vector() * 2.0,
                ..Piece::default()
            }
        })
        .collect();
    of(&mass_properties(1e8), &pieces)
}

/// Kinetic energy plus the energy of springs and elements.
fn held(energy: Energy) -> f64 {
    energy.kinetic + energy.strain_bodies + energy.strain_joints
}

/// Changes of energies and momenta, relative to the start.
#[derive(Clone, Copy, Debug, Default)]
struct ConservationErrors {
    /// Largest growth of the mechanical energy, and largest error of the energy balance.
    grown: f64,
    balance: f64,
    /// Mechanical energy at the end.
    left: f64,
    /// Changes of momentum and angular momentum.
    momenta: [f64; 2],
    /// Largest penetration of two blocks `[m]`.
    deepest: f64,
}

/// Continues for a time and evaluates everything every few steps.
fn followed(simulation: &mut Simulation, time: f64, every: usize) -> ConservationErrors {
    let (before, sizes) = momenta(simulation);
    let first = held(simulation.energy());
    let mut kept = ConservationErrors::default();
    for _ in 0..(time / simulation.time_step()) as usize / every {
        steps(simulation, every);
        let energy = simulation.energy();
        kept.left = held(energy) / first;
        kept.grown = kept.grown.max(kept.left - 1.0);
        kept.balance = kept.balance.max(energy.balance.abs() / first);
        kept.deepest = kept.deepest.max(deepest(&all_corners(simulation), 0).0);
    }
    let (after, _) = momenta(simulation);
    kept.momenta = [0, 1].map(|k| (after[k] - before[k]).norm() / sizes[k]);
    assert!(kept.momenta[0] < 1e-13 && kept.momenta[1] < 5e-12, "{kept:?}");
    kept
}

#[test]
fn collisions_conserve_momentum_and_gain_no_energy() {
    for (kind, friction, seed) in
        (0..3).flat_map(|kind| [(kind, 0.0, 1), (kind, 0.0, 2), (kind, 30.0, 1), (kind, 30.0, 3)])
    {
        let mut deck = swarm(seed, kind);
        deck.contact.friction = Some(friction);
        let mut simulation = simulation(&deck);
        start(&mut simulation, Damping::None);
        let kept = followed(&mut simulation, 1.0, 2);
        println!("kind {kind}, friction {friction}, seed {seed}: {kept:?}");
        assert!(kept.grown < 1e-3 && kept.balance < 0.01, "{kept:?}");
        let left = if friction > 0.0 { 0.3..0.8 } else { 0.98..1.0005 };
        assert!(left.contains(&kept.left), "{kept:?}");
    }
}

/// With short steps all gains and losses of energy are booked.
#[test]
fn energies_balance_in_collisions_with_short_steps() {
    let mut random = Random::new(8);
    let (mut grown, mut balance) = (0.0_f64, 0.0_f64);
    for _ in 0..20 {
        let (pieces, _) = throw(&mut random, [0, 0]);
        let mut deck = of(&mass_properties(1e8), &pieces);
        deck.contact.friction = Some(0.0);
        let mut simulation = simulation(&deck);
        start(&mut simulation, Damping::None);
        let step = TimeStep::Seconds(0.1 * simulation.time_step());
        let start = simulation.start(Damping::None, step, None);
        start.unwrap_or_else(|error| panic!("{error}"));
        let kept = followed(&mut simulation, 1.2, 10);
        (grown, balance) = (grown.max(kept.grown), balance.max(kept.balance));
    }
    println!("grown {grown:.1e}, balance {balance:.1e}");
    assert!(grown < 1e-5 && balance < 1e-5, "{grown} {balance}");
}

/// Outcome of a throw.
#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    Back,
    BlockTooFast,
    DeepPenetration,
    Through,
    Diverged,
}

/// Small block thrown at the middle of a thin plate, at a fraction of the largest displacement per
/// step.
fn at_plate(random: &mut Random, part_of_limit: f64, kinds: [u32; 2], held: bool) -> (End, f64) {
    let thin = 0.1;
    let plate = Piece {
        edges: Vec3::new(2.0, 2.0, thin),
        turn: any_turn(random),
        divisions: kinds[0],
        held,
        ..Piece::default()
    };
    let normal = plate.turn * Vec3::z();
    let aside = plate.turn * Vec3::new(random.next(), random.next(), 0.0) * 0.3;
    let small = Piece {
        centre: normal * 0.45 + aside,
        edges: Vec3::new(0.2, 0.25, 0.3),
        turn: any_turn(random),
        divisions: kinds[1],
        ..Piece::default()
    };
    let deck = of(&mass_properties(1e8), &[plate, small]);
    let mut probe = simulation(&deck);
    start(&mut probe, Damping::None);
    let speed = part_of_limit * 0.25 * thin / probe.time_step();
    let thrown = Piece { velocity: -normal * speed, ..small };
    let mut simulation = simulation(&of(&mass_properties(1e8), &[plate, thrown]));
    start(&mut simulation, Damping::None);
    let count = (2.0 / (speed * simulation.time_step())) as usize + 100;
    let mut deep = 0.0_f64;
    for _ in 0..count {
        match simulation.step() {
            Ok(()) => {}
            Err(RunError::BlockTooFast { block, step, .. }) => {
                assert!(block == 1 || kinds != [0, 0], "block {block}");
                assert_eq!(step, simulation.steps());
                return (End::BlockTooFast, deep);
            }
            Err(RunError::DeepPenetration { blocks, .. }) => {
                assert_eq!(blocks, [0, 1]);
                return (End::DeepPenetration, deep);
            }
            Err(RunError::Diverged { .. }) => return (End::Diverged, deep),
            Err(error) => panic!("{error}"),
        }
        let [plate, small] = [0, 1].map(|block| corners(&simulation, block));
        deep = deep.max(overlap(&plate, &small));
        let up = (plate[1] - plate[0]).cross(&(plate[2] - plate[0])).normalize();
        let away = middle(&small) - middle(&plate);
        let aside = (away - up * up.dot(&away)).norm();
        if up.dot(&away) < -0.2 && aside < 0.9 {
            return (End::Through, deep);
        }
    }
    (End::Back, deep)
}

#[test]
fn no_block_passes_through_thin_plate() {
    let mut random = Random::new(4);
    for (kinds, held) in [[0, 0], [2, 0], [0, 2], [2, 2]]
        .into_iter()
        .flat_map(|kinds| [(kinds, true), (kinds, false)])
    {
        for part_of_limit in [0.005, 0.1, 0.3, 0.6, 0.95] {
            for _ in 0..if part_of_limit > 0.05 { 5 } else { 2 } {
                let (end, deep) = at_plate(&mut random, part_of_limit, kinds, held);
                let what = format!("{kinds:?} {held} {part_of_limit}: {end:?}, {deep}");
                let stopped = end == End::BlockTooFast || end == End::DeepPenetration;
                assert!(end == End::Back || (part_of_limit > 0.05 && stopped), "{what}");
            }
        }
    }
    // Faster than the program can follow.
    for kinds in [[0, 0], [2, 2]] {
        for _ in 0..5 {
            assert_eq!(at_plate(&mut random, 1.1, kinds, true).0, End::BlockTooFast, "{kinds:?}");
        }
    }
}

/// The largest speed of a block does not depend on its direction.
#[test]
fn speed_limit_is_the_same_in_every_direction() {
    let mut random = Random::new(6);
    let other = Piece { centre: Vec3::new(50.0, 0.0, 0.0), ..Piece::default() };
    let ways = [Vec3::x(), Vec3::new(1.0, 1.0, 1.0), Vec3::new(-1.0, 1.0, 0.0), random.vector()];
    for (way, divisions) in ways.into_iter().flat_map(|way| [(way, 0), (way, 2)]) {
        let run_at = |part: f64| {
            let at_rest = Piece { divisions, ..Piece::default() };
            let mut probe = simulation(&of(&mass_properties(1e8), &[at_rest, other]));
            start(&mut probe, Damping::None);
            let velocity = way.normalize() * (part * 0.25 / probe.time_step());
            let thrown = Piece { velocity, ..at_rest };
            let mut simulation = simulation(&of(&mass_properties(1e8), &[thrown, other]));
            start(&mut simulation, Damping::None);
            simulation.step()
        };
        assert_eq!(run_at(0.999), Ok(()), "{way}");
        match run_at(1.001) {
            Err(RunError::BlockTooFast { block: 0, distance, edge, .. }) => {
                assert!((distance / edge - 0.25 * 1.001).abs() < 1e-9, "{distance} {edge}");
            }
            other => panic!("{way} {divisions}: {other:?}"),
        }
    }
}

/// Two blocks thrown at each other in random positions, and the line between them.
fn throw(random: &mut Random, kinds: [u32; 2]) -> ([Piece; 2], Vec3) {
    let along = random.vector().normalize();
    let aside = random.vector() * 0.3;
    let pieces = [-1.0, 1.0].map(|side| Piece {
        centre: along * (1.3 * side) + aside * side,
        edges: Vec3::repeat(1.0) + random.vector() * 0.3,
        turn: any_turn(random),
        divisions: kinds[usize::from(side > 0.0)],
        velocity: along * (-2.0 * side),
        ..Piece::default()
    });
    (pieces, along)
}

/// The blocks meet at corners, edges and faces.
#[test]
fn no_block_passes_through_another() {
    let mut random = Random::new(8);
    for (kinds, throws) in [([0, 0], 200), ([0, 2], 40), ([1, 2], 40)] {
        let (mut deepest, mut grown, mut balance, mut met) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
        for number in 0..throws {
            let (pieces, along) = throw(&mut random, kinds);
            let mut simulation = simulation(&of(&mass_properties(1e8), &pieces));
            start(&mut simulation, Damping::None);
            let kept = followed(&mut simulation, 1.2, 4);
            grown = grown.max(kept.grown);
            balance = balance.max(kept.balance);
            deepest = deepest.max(kept.deepest);
            if kept.deepest <= 0.0 {
                continue;
            }
            met += 1;
            // The blocks rebound or turn past each other; they do not pass along the line through
            // each other.
            let all = all_corners(&simulation);
            let apart = middle(&all[1]) - middle(&all[0]);
            let beside = (apart - along * along.dot(&apart)).norm();
            let through = apart.dot(&along) < 0.0 && beside < 0.5;
            assert!(!through, "throw {number} of {kinds:?}: {apart}");
        }
        println!(
            "{kinds:?}: {met} met, {deepest:.3} deep, energy +{grown:.1e}, balance {balance:.1e}"
        );
        assert!(met > throws / 2 && deepest < 0.2, "{met} {deepest}");
        assert!(grown < 2e-3 && balance < 0.02, "{grown} {balance}");
    }
}
