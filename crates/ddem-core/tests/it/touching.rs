//! What is told of contacts and of momenta.

use ddem_core::Simulation;
use ddem_core::deck::{Damping, TimeStep};

use crate::decks::*;
use crate::loose::*;

/// A brick of 1 × 2 × 3 m about a point, that flies and spins about z.
fn brick(divisions: u32) -> Piece {
    Piece {
        centre: Vec3::new(4.0, -1.0, 2.0),
        edges: Vec3::new(1.0, 2.0, 3.0),
        divisions,
        velocity: Vec3::new(0.5, 2.0, -1.0),
        spin: Vec3::new(0.0, 0.0, 1.5),
        ..Piece::default()
    }
}

/// Of a rigid brick `m v` and `x × m v + I ω`, I of a parallelepiped; of a deformable one I is that
/// of its lumped masses, `(1 + 2/n²)` times as much.
#[test]
fn momenta_of_a_brick_are_those_of_mechanics() {
    for divisions in 0..4 {
        let piece = brick(divisions);
        let mut simulation = simulation(&of(&matter(1e9), &[piece]));
        let mass = 2400.0 * 6.0;
        let lumped = if divisions == 0 { 1.0 } else { 1.0 + 2.0 / f64::from(divisions).powi(2) };
        let spin = piece.spin * (mass / 12.0 * (1.0 + 4.0) * lumped);
        let [p, l] = [piece.velocity * mass, piece.centre.cross(&piece.velocity) * mass + spin];
        let check = |simulation: &mut Simulation, tolerance: f64| {
            let told = [simulation.momentum(), simulation.angular_momentum()].map(Vec3::from);
            assert!((told[0] - p).norm() < tolerance * p.norm(), "{divisions}: {told:?} {p}");
            assert!((told[1] - l).norm() < tolerance * l.norm(), "{divisions}: {told:?} {l}");
        };
        check(&mut simulation, 1e-14);
        let started = simulation.start(Damping::None, TimeStep::Auto, None);
        started.unwrap_or_else(|error| panic!("{error}"));
        (0..500).for_each(|_| simulation.step().unwrap_or_else(|error| panic!("{error}")));
        check(&mut simulation, 1e-13);
        simulation.settle();
        check(&mut simulation, 1e-13);
    }
}
