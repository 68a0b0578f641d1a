//! Number of steps of a relaxation: it hardly grows with the number of blocks.

use ddem_core::Simulation;
use ddem_deck::*;

use crate::decks::*;

/// Steps to equilibrium of a set of blocks of a metre under their weight, held where `x` along
/// `axis` is zero.
fn steps(count: [u32; 3], axis: usize, rigid: bool) -> (u64, Simulation) {
    let mut deck = deck(count, count.map(f64::from), if rigid { 1 } else { 2 }, 0.01);
    deck.model.gravity = [0.0, 0.0, -9.81];
    if rigid {
        deck.blocks[0].body = Body::Rigid;
    }
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
    let (small, _) = steps([6; 3], 2, false);
    let (large, simulation) = steps([12; 3], 2, false);
    println!("{small} and {large} steps");
    assert!(small < 100 && 2 * large <= 3 * small, "{small} and {large} steps");
    // The same equilibrium as with a smaller tolerance.
    let (_, mut exact) = steps([12; 3], 2, false);
    exact.relax(1e-9, 5000).unwrap_or_else(|error| panic!("{error}"));
    assert!((largest(&simulation) / largest(&exact) - 1.0).abs() < 1e-3);
}

/// A wall of one block in thickness, and a column that bends: functions over many blocks that are
/// soft in one direction and stiff in another.
#[test]
fn steps_hardly_grow_in_thin_models() {
    for rigid in [false, true] {
        for (small, large, axis) in
            [([8, 1, 8], [16, 1, 16], 2), ([12, 2, 2], [24, 2, 2], 0), ([10, 1, 1], [20, 1, 1], 0)]
        {
            let [few, many] = [small, large].map(|count| steps(count, axis, rigid).0);
            println!("{large:?}, rigid {rigid}: {few} and {many} steps");
            assert!(few < 250 && many <= 2 * few, "{large:?}: {few} and {many} steps");
        }
    }
}
