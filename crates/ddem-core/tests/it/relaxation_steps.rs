//! Number of steps of a relaxation: it hardly grows with the number of blocks.

use ddem_core::Simulation;
use ddem_deck::Body;

use crate::decks::*;

/// Steps to equilibrium of a set of blocks of a metre under their weight, held where `x` along
/// `axis` is zero.
fn steps(count: [u32; 3], axis: usize) -> (u64, Simulation) {
    let mut deck = deck(count, count.map(f64::from), 2, 0.01);
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.fix.push(fix(plane(axis, 0.0), "xyz"));
    let mut simulation = simulation(&deck);
    let steps = simulation.relax(1e-5, 5000).unwrap_or_else(|error| panic!("{error}"));
    (steps, simulation)
}

fn largest(simulation: &Simulation) -> f64 {
    let u = simulation.displacements();
    u.iter().flatten().fold(0.0, |most, x| most.max(x.abs()))
}

#[test]
fn steps_hardly_grow_with_the_number_of_blocks() {
    let (small, _) = steps([6; 3], 2);
    let (large, simulation) = steps([12; 3], 2);
    println!("{small} and {large} steps");
    assert!(small < 100 && 2 * large <= 3 * small, "{small} and {large} steps");
    // The same equilibrium as with a smaller tolerance.
    let (_, mut exact) = steps([12; 3], 2);
    exact.relax(1e-9, 5000).unwrap_or_else(|error| panic!("{error}"));
    assert!((largest(&simulation) / largest(&exact) - 1.0).abs() < 1e-3);
}

#[test]
fn steps_hardly_grow_with_the_number_of_rigid_blocks() {
    let steps = |edge: u32| {
        let mut deck = deck([edge; 3], [f64::from(edge); 3], 1, 0.01);
        deck.blocks[0].body = Body::Rigid;
        deck.model.gravity = [0.0, 0.0, -9.81];
        deck.fix.push(fix(plane(2, 0.0), "xyz"));
        let mut simulation = simulation(&deck);
        simulation.relax(1e-5, 5000).unwrap_or_else(|error| panic!("{error}"))
    };
    let (few, many) = (steps(6), steps(12));
    println!("{few} and {many} steps");
    // Without smooth motions they take more than a hundred.
    assert!(few < 80 && many < 80, "{few} and {many} steps");
}

/// A wall of one block in thickness, and a beam that bends: functions over many blocks that are
/// soft in one direction and stiff in another.
#[test]
fn steps_grow_slowly_in_thin_models() {
    for (small, large, axis) in [([8, 1, 8], [16, 1, 16], 2), ([12, 2, 2], [24, 2, 2], 0)] {
        let [few, many] = [small, large].map(|count| steps(count, axis).0);
        println!("{large:?}: {few} and {many} steps");
        assert!(few < 250 && 2 * many <= 5 * few, "{large:?}: {few} and {many} steps");
    }
}
