//! A block that turns about the last pairs of a joint that hold: they let go before it gets into
//! the other block.

use ddem_core::Simulation;
use ddem_core::deck::*;

use crate::decks::*;
use crate::loose::{all_corners, deepest};

/// A block on another, or on the eight that it is split into, is pressed on its lower edge at x = 1, and
/// spins about it.
fn hinge(split: bool, divisions: u32) -> Simulation {
    let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], divisions, 0.02);
    deck.model.kinematics = Kinematics::Corotational;
    let weak = Joint {
        cohesion: Some(1e9),
        friction: Some(45.0),
        tension: Some(2e5),
        ..deck.joints["seam"].clone()
    };
    deck.joints.insert("seam".into(), weak);
    if split {
        let z = Some(Extent::Range([0.0, 1.0]));
        deck.refine = vec![Refine { region: Where { z, ..Where::default() }, factor: 2 }];
    }
    let lower = Where { z: Some(Extent::Range([0.0, 0.99])), ..Where::default() };
    deck.fix = vec![fix(lower, "xyz")];
    let (x, z) = (Some(Extent::Range([0.999, 1.0])), Some(Extent::Range([1.005, 1.015])));
    let edge = Where { x, z, ..Where::default() };
    let force = Some([0.0, 0.0, -4e6]);
    let history = Some(History::Ramp(0.002));
    deck.load.push(Load { region: edge, force, history, ..Load::default() });
    let mut simulation = simulation(&deck);
    let started = simulation.start(Damping::Local(0.8), TimeStep::Auto, Some(0.01));
    started.unwrap_or_else(|error| panic!("{error}"));
    while simulation.steps_left() != Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    assert_eq!(simulation.fragments().len(), 1);
    let centre = Vec3::new(1.0, 0.0, 1.01);
    let model = simulation.model();
    let spun = |node: usize| {
        let x = Vec3::from(model.point(node)) - centre;
        if x.z < -0.005 { [0.0; 3] } else { Vec3::new(0.0, 5.0, 0.0).cross(&x).into() }
    };
    let velocities: Vec<[f64; 3]> = (0..model.n_nodes()).map(spun).collect();
    simulation.set_velocities(&velocities);
    let started = simulation.start(Damping::None, TimeStep::Auto, Some(0.6));
    started.unwrap_or_else(|error| panic!("{error}"));
    simulation
}

#[test]
fn a_joint_that_turns_lets_go() {
    for (split, divisions) in [(false, 1), (false, 3), (true, 1), (true, 2)] {
        let mut simulation = hinge(split, divisions);
        let (mut worst, mut until) = (f64::NEG_INFINITY, 0.0);
        while simulation.steps_left() != Some(0) {
            simulation.step().unwrap_or_else(|error| panic!("{split} {divisions}: {error}"));
            if simulation.steps().is_multiple_of(50) {
                if simulation.fragments().len() == 1 {
                    until = simulation.time();
                }
                worst = worst.max(deepest(&all_corners(&simulation), 0).0);
            }
        }
        let energy = simulation.energy();
        println!("{split} {divisions}: held until {until} s, {worst} m in each other, {energy:?}");
        // It was pressed for 0.01 s, and has then turned at 5 rad/s by half the spacing of its pairs.
        assert!(until < 0.01 + 1.3 * (0.5 / 5.0), "{split} {divisions}: held until {until} s");
        assert!(worst < 0.03, "{split} {divisions}: {worst} m in each other");
        assert!(energy.balance.abs() < 1e-5 * energy.kinetic, "{energy:?}");
    }
}
