//! Blocks that tumble without friction or damping keep their energy.

use ddem_core::Energy;
use ddem_deck::{Damping, Deck, TimeStep};

use crate::decks::*;
use crate::unbonded_blocks::*;

/// Box of six fixed rigid walls around `[0, width]³`.
fn closed(deck: &mut Deck, width: f64) {
    let (w, t) = (width, 0.5);
    let (m, a) = (w / 2.0, w + 2.0 * t);
    for d in 0..3 {
        for side in [-t / 2.0, w + t / 2.0] {
            let (mut centre, mut edges) = (Vec3::repeat(m), Vec3::repeat(w));
            (centre[d], edges[d]) = (side, t);
            (0..d).for_each(|e| edges[e] = a);
            add(deck, &Piece { centre, edges, held: true, ..Piece::default() });
        }
    }
}

/// One cube that flies and rotates in a box.
fn one(seed: u64, divisions: u32, gravity: f64, young: f64) -> Deck {
    let mut deck = mass_properties(young);
    closed(&mut deck, 2.5);
    let mut random = Random::new(seed);
    add(
        &mut deck,
        &Piece {
            centre: Vec3::repeat(1.25),
            turn: any_turn(&mut random),
            divisions,
            velocity: random.vector().normalize() * 5.0,
            spin: random.vector().normalize() * 4.0,
            ..Piece::default()
        },
    );
    deck.model.gravity = [0.0, 0.0, -gravity];
    deck
}

/// Eight blocks that fly, rotate and collide in a box.
fn eight(seed: u64, divisions: u32, gravity: f64, young: f64) -> Deck {
    let mut deck = mass_properties(young);
    closed(&mut deck, 3.6);
    let mut random = Random::new(seed);
    for i in 0..8 {
        let at = [0, 1, 2].map(|d| if i >> d & 1 == 1 { 2.7 } else { 0.9 });
        add(
            &mut deck,
            &Piece {
                centre: at.into(),
                edges: Vec3::repeat(0.9) + random.vector() * 0.1,
                turn: any_turn(&mut random),
                divisions,
                velocity: random.vector().normalize() * 4.0,
                spin: random.vector().normalize() * 4.0,
                ..Piece::default()
            },
        );
    }
    deck.model.gravity = [0.0, 0.0, -gravity];
    deck
}

/// Changes of the energy as fractions of it.
#[derive(Clone, Copy, Debug, Default)]
struct EnergyChanges {
    /// Energy left at the end.
    left: f64,
    /// Largest rise above the lowest earlier energy.
    grown: f64,
    /// Largest error of the energy balance.
    balance: f64,
    /// Number of times that the blocks touched after not touching.
    impacts: u32,
}

/// Flight for a time without friction or damping, at the automatic step.
fn fly(mut deck: Deck, time: f64) -> EnergyChanges {
    deck.contact.friction = Some(0.0);
    let mut simulation = simulation(&deck);
    let start = simulation.start(Damping::None, TimeStep::Auto, None);
    start.unwrap_or_else(|error| panic!("{error}"));
    let held = |e: Energy| e.kinetic + e.strain_bodies + e.strain_joints - e.external_work;
    let first = held(simulation.energy());
    let (mut kept, mut lowest, mut touching) = (EnergyChanges::default(), first, false);
    for _ in 0..(time / simulation.time_step()) as usize / 8 {
        for _ in 0..8 {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        let energy = simulation.energy();
        assert_eq!((energy.friction, energy.damping, energy.fracture), (0.0, 0.0, 0.0));
        let touches = energy.strain_joints > 1e-9 * first;
        kept.impacts += u32::from(touches && !touching);
        touching = touches;
        kept.left = held(energy) / first;
        kept.grown = kept.grown.max((held(energy) - lowest) / first);
        lowest = lowest.min(held(energy));
        kept.balance = kept.balance.max(energy.balance.abs() / first);
    }
    kept
}

/// Tens of impacts at corners, edges and faces, with penetrations up to 4 % of an edge.
#[test]
fn tumbling_block_keeps_energy() {
    let mut mean = 0.0;
    for (divisions, gravity, seed) in
        (1..=3).flat_map(|seed| [(0, 0.0, seed), (0, 9.81, seed), (2, 0.0, seed), (2, 9.81, seed)])
    {
        let kept = fly(one(seed, divisions, gravity, 1e8), 3.0);
        println!("divisions {divisions}, gravity {gravity}, seed {seed}: {kept:?}");
        assert!(kept.impacts >= 10, "{kept:?}");
        assert!((kept.left - 1.0).abs() < 1e-2, "{kept:?}");
        assert!(kept.grown < 1e-3 && kept.balance < 2e-3, "{kept:?}");
        mean += (1.0 - kept.left) / 12.0;
    }
    assert!(mean < 3e-3, "{mean}");
}

/// The blocks also hit each other. Most energy is lost in contacts that end when an edge slips off
/// the end of another: one of them takes two parts in a hundred at once, all others together one in
/// a thousand.
#[test]
fn colliding_tumbling_blocks_keep_energy() {
    for (divisions, gravity, young, least) in
        [(0, 0.0, 1e9, 0.97), (0, 9.81, 1e9, 0.97), (0, 0.0, 1e8, 0.96), (2, 0.0, 1e8, 0.96)]
    {
        for seed in 1..=3 {
            let kept = fly(eight(seed, divisions, gravity, young), 1.0);
            println!("divisions {divisions}, gravity {gravity}, {young:e} Pa: {kept:?}");
            assert!(kept.left > least && kept.left < 1.002, "{kept:?}");
            assert!(kept.grown < 2e-3 && kept.balance < 1e-2, "{kept:?}");
        }
    }
}
