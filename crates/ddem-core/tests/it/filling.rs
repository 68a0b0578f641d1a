//! A box is filled with cubes: none leaves the box, none stays inside another, and energy only
//! decreases.

use ddem_deck::{ContactTable, Damping, Deck, TimeStep};

use crate::decks::*;
use crate::unbonded_blocks::*;

/// Distance between the centres of the cubes at the start `[m]`.
const PITCH: f64 = 1.45;

/// Box of five fixed walls of thickness 0.5 around `[0, width]² × [0, height]`.
fn walls(deck: &mut Deck, width: f64, height: f64) {
    let (w, t) = (width, 0.5);
    let (around, h) = (w + 2.0 * t, height + t);
    let middle = height / 2.0 - t / 2.0;
    for (centre, edges) in [
        ([w / 2.0, w / 2.0, -t / 2.0], [w, w, t]),
        ([-t / 2.0, w / 2.0, middle], [t, around, h]),
        ([w + t / 2.0, w / 2.0, middle], [t, around, h]),
        ([w / 2.0, -t / 2.0, middle], [w, t, h]),
        ([w / 2.0, w + t / 2.0, middle], [w, t, h]),
    ] {
        let (centre, edges) = (Vec3::from(centre), Vec3::from(edges));
        add(deck, &Piece { centre, edges, held: true, ..Piece::default() });
    }
}

/// Inner width of the box for n cubes `[m]`.
fn width(n: u32) -> f64 {
    f64::from(n) * PITCH + 0.1
}

/// n³ slightly rotated cubes of edge 1 above the floor of a box.
fn filled_box(n: u32, divisions: u32, young: f64) -> Deck {
    let mut deck = mass_properties(young);
    walls(&mut deck, width(n), width(n) + 1.0);
    let mut random = Random::new(u64::from(n));
    for i in 0..n * n * n {
        let at = [i % n, i / n % n, i / (n * n)].map(|c| PITCH * (f64::from(c) + 0.5) + 0.05);
        add(
            &mut deck,
            &Piece {
                centre: Vec3::from(at) + random.vector() * 0.03,
                turn: {
                    let angle = 0.2 + 0.15 * random.next();
                    random.rotation(angle)
                },
                divisions,
                ..Piece::default()
            },
        );
    }
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck
}

/// Result of filling a box.
#[derive(Debug, Default)]
struct Filled {
    steps: usize,
    seconds: f64,
    grown: f64,
    deepest: f64,
    deep_at_rest: f64,
    speed: f64,
    contacts: usize,
    outside: usize,
}

/// Lets the cubes fall for one time and come to rest for another; evaluates everything every
/// `every` steps.
fn fall(deck: &Deck, width: f64, times: [f64; 2], every: usize) -> Filled {
    let mut simulation = simulation(deck);
    let held =
        |e: ddem_core::Energy| e.kinetic + e.strain_bodies + e.strain_joints - e.external_work;
    let mut found = Filled::default();
    let (mut lowest, mut fell) = (f64::INFINITY, 0.0_f64);
    for (alpha, time) in [0.1, 0.8].into_iter().zip(times) {
        let start = simulation.start(Damping::Local(alpha), TimeStep::Auto, None);
        start.unwrap_or_else(|error| panic!("{error}"));
        let count = (time / simulation.time_step()) as usize;
        found.steps += count;
        for at in 0..count {
            let clock = std::time::Instant::now();
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
            found.seconds += clock.elapsed().as_secs_f64();
            if at % every == 0 || at + 1 == count {
                let energy = simulation.energy();
                fell = fell.max(energy.external_work.abs());
                lowest = lowest.min(held(energy));
                found.grown = found.grown.max(held(energy) - lowest);
                found.deep_at_rest = deepest(&all_corners(&simulation), 5).0;
                found.deepest = found.deepest.max(found.deep_at_rest);
            }
        }
    }
    found.grown /= fell;
    let all = all_corners(&simulation);
    let inside = |x: &Vec3| {
        let limit = 0.02;
        let side = -limit..width + limit;
        side.contains(&x.x) && side.contains(&x.y) && x.z > -limit
    };
    found.outside = all[5..].iter().filter(|x| !x.iter().all(inside)).count();
    let velocities = simulation.velocities();
    found.speed = velocities.iter().flatten().fold(0.0, |most: f64, v| most.max(v.abs()));
    found.contacts = contacts(&mut simulation)[0];
    found
}

/// Drops n³ cubes into a box and checks the result.
fn dropped(n: u32, divisions: u32, young: f64, (times, every): ([f64; 2], usize)) -> Filled {
    let mut deck = filled_box(n, divisions, young);
    deck.contact = ContactTable { restitution: Some(0.2), ..ContactTable::default() };
    let found = fall(&deck, width(n), times, every);
    let per_step = 1e3 * found.seconds / found.steps as f64;
    println!("{n}³ cubes, divisions {divisions}: {per_step:.3} ms a step, {found:?}");
    assert_eq!(found.outside, 0);
    assert!(found.deep_at_rest < 0.01, "{found:?}");
    assert!(found.grown < 1e-6, "{found:?}");
    // Speed of the fastest node; a fall of 5 µm gives as much.
    assert!(found.speed < 1e-2, "{found:?}");
    found
}

#[test]
fn rigid_cubes_fill_a_box() {
    let found = dropped(4, 0, 2e8, ([2.5, 1.0], 40));
    assert!(found.deepest < 0.03, "{found:?}");
}

#[test]
fn deformable_cubes_fill_a_box() {
    let found = dropped(3, 1, 1e8, ([2.0, 1.0], 20));
    assert!(found.deepest < 0.1, "{found:?}");
    let found = dropped(2, 2, 1e8, ([1.5, 1.0], 20));
    assert!(found.deepest < 0.1, "{found:?}");
}

#[test]
#[ignore = "takes minutes"]
fn a_thousand_rigid_cubes_fill_a_box() {
    dropped(10, 0, 1e9, ([4.0, 2.0], 100));
}

/// The cubes are stiff enough for the pressure at the base, where faces meet only in part. The last
/// cube on top rocks on its neighbours until 9 s.
#[test]
#[ignore = "takes minutes"]
fn a_thousand_deformable_cubes_fill_a_box() {
    dropped(10, 1, 4e8, ([3.0, 8.0], 100));
}
