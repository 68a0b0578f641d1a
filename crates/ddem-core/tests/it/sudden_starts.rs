//! Energies when a motion starts at once.

use ddem_core::Simulation;
use ddem_deck::{Damping, Deck, Fix, Kinematics, TimeStep, Where};

use crate::decks::*;
use crate::unbonded_blocks::*;

fn start(simulation: &mut Simulation, damping: Damping) {
    simulation.start(damping, TimeStep::Auto, None).unwrap_or_else(|error| panic!("{error}"));
}

fn step(simulation: &mut Simulation) {
    simulation.step().unwrap_or_else(|error| panic!("{error}"));
}

/// A support that sets a mass in motion at once does the work m v²/2.
#[test]
fn sudden_support_does_work_of_half_m_v_squared() {
    for divisions in [0, 1, 2] {
        let mut deck = of(&mass_properties(1e9), &[Piece { divisions, ..Piece::default() }]);
        let velocity = Some([0.3, -0.4, 1.2]);
        deck.fix.push(Fix { axes: "xyz".into(), velocity, ..Fix::default() });
        let mut simulation = simulation(&deck);
        start(&mut simulation, Damping::None);
        assert_eq!(simulation.energy().kinetic, 0.0);
        for _ in 0..10 {
            step(&mut simulation);
        }
        let energy = simulation.energy();
        let wanted = 0.5 * 2400.0 * (0.09 + 0.16 + 1.44);
        assert!((energy.kinetic / wanted - 1.0).abs() < 1e-12, "{energy:?}");
        assert!((energy.external_work / wanted - 1.0).abs() < 1e-12, "{energy:?}");
        assert!(energy.balance.abs() < 1e-10 * wanted, "{energy:?}");
    }
}

/// Blocks that fly, rotate and have weight, some of them driven, with and without damping.
fn thrown(seed: u64, divisions: u32) -> Deck {
    let mut random = Random::new(seed);
    let pieces: Vec<Piece> = (0..4)
        .map(|i| Piece {
            centre: Vec3::new(5.0 * f64::from(i), 0.0, 0.0),
            edges: Vec3::repeat(1.0) + random.vector() * 0.3,
            turn: any_turn(&mut random),
            divisions,
            velocity: random.vector() * f64::from(i % 2),
            spin: random.vector() * f64::from(i / 2),
            ..Piece::default()
        })
        .collect();
    let mut deck = of(&mass_properties(1e9), &pieces);
    // Small kinematics are linear: energies of deformable blocks balance to rounding.
    deck.model.kinematics = Kinematics::Small;
    deck.model.gravity = random.vector().scale(10.0).into();
    let region = Where { set: Some("piece 0".into()), ..Where::default() };
    let velocity = Some(random.vector().into());
    deck.fix.push(Fix { r#where: region, axes: "xyz".into(), velocity, ..Fix::default() });
    deck
}

/// Kinetic energy at a start is never negative, and the work of a start is balanced.
#[test]
fn kinetic_energy_is_never_negative_at_start() {
    let dampings = [
        Damping::None,
        Damping::Mass(20.0),
        Damping::Local(0.3),
        Damping::Ratio(0.1),
        Damping::Stiffness(1e-5),
    ];
    for (seed, divisions) in (1..6).flat_map(|seed| [(seed, 0), (seed, 2)]) {
        let damping = dampings[seed as usize % 5];
        let mut simulation = simulation(&thrown(seed, divisions));
        start(&mut simulation, damping);
        let before = simulation.energy();
        assert!(before.kinetic >= 0.0, "{before:?}");
        let velocities = simulation.velocities();
        let of = |(node, v): (usize, &[f64; 3])| {
            0.5 * simulation.model().mass(node) * Vec3::from(*v).norm_squared()
        };
        let exact: f64 = if divisions > 0 {
            velocities.iter().enumerate().map(of).sum()
        } else {
            before.kinetic
        };
        assert!((before.kinetic - exact).abs() <= 1e-12 * exact, "{before:?} {exact}");
        let mut most = 0.0_f64;
        for at in 0..60 {
            step(&mut simulation);
            if at == 30 {
                // A different step from here on: velocities are advanced to the full step and then
                // by half a new step.
                let half = TimeStep::Seconds(0.5 * simulation.time_step());
                let start = simulation.start(damping, half, None);
                start.unwrap_or_else(|error| panic!("{error}"));
                assert!(simulation.energy().kinetic >= 0.0);
            }
            let energy = simulation.energy();
            most = most.max(energy.balance.abs() / energy.kinetic.max(energy.external_work.abs()));
        }
        let order = if divisions > 0 { 1e-10 } else { 1e-4 };
        println!("{seed} {divisions} {damping:?}: balance {most:.1e}");
        assert!(most < order, "{seed} {divisions} {damping:?}: {most}");
    }
}

/// A block that starts to spin rings; stiffness damping takes this energy, but no momentum.
#[test]
fn stiffness_damping_conserves_momentum() {
    let piece = Piece {
        edges: Vec3::new(1.0, 1.3, 0.7),
        turn: any_turn(&mut Random::new(3)),
        divisions: 2,
        velocity: Vec3::new(3.0, -2.0, 1.0),
        spin: Vec3::new(20.0, 10.0, -15.0),
        ..Piece::default()
    };
    let mut simulation = simulation(&of(&mass_properties(1e9), &[piece]));
    start(&mut simulation, Damping::Stiffness(2e-4));
    let moved = |simulation: &mut Simulation| {
        [simulation.momentum(), simulation.angular_momentum()].map(Vec3::from)
    };
    let [p, l] = moved(&mut simulation);
    let mut taken = Vec::new();
    for _ in 0..4 {
        (0..500).for_each(|_| step(&mut simulation));
        let energy = simulation.energy();
        // As without damping: spinning costs second order in the step.
        assert!(energy.balance.abs() < 5e-5 * energy.kinetic, "{energy:?}");
        taken.push(energy.damping);
    }
    let [p_now, l_now] = moved(&mut simulation);
    assert!((p_now - p).norm() < 1e-12 * p.norm(), "{p} {p_now}");
    assert!((l_now - l).norm() < 1e-9 * l.norm(), "{l} {l_now}");
    // Little is lost later, when the block tumbles and its strain rotates within it.
    assert!(taken[0] > 10.0 && taken[3] - taken[2] < 1e-2 * taken[0], "{taken:?}");
}
