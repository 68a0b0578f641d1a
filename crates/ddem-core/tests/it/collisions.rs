//! Loose blocks that collide: what is kept, how far they reach into each other, and that nothing
//! passes through.

use ddem_core::deck::{Damping, Deck, TimeStep};
use ddem_core::{RunError, Simulation};

use crate::decks::*;
use crate::loose::*;

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
    of(&matter(1e8), &pieces)
}

#[test]
fn momenta_are_kept_and_energy_does_not_grow_in_collisions() {
    for kind in 0..3 {
        for friction in [0.0, 30.0] {
            for seed in 1..4 {
                let mut deck = swarm(seed, kind);
                deck.contact.friction = Some(friction);
                let mut simulation = simulation(&deck);
                start(&mut simulation, Damping::None);
                let (first, sizes) = momenta(&mut simulation);
                let energy = simulation.energy();
                let held = |e: ddem_core::Energy| e.kinetic + e.strain_bodies + e.strain_joints;
                let before = held(energy);
                let time_step = simulation.time_step();
                let count = (1.0 / time_step) as usize;
                let (mut most, mut balance, mut patches, mut deep) = (0.0_f64, 0.0_f64, 0, 0.0_f64);
                for at in 0..count {
                    steps(&mut simulation, 1);
                    let energy = simulation.energy();
                    most = most.max(held(energy) / before - 1.0);
                    balance = balance.max(energy.balance.abs() / before);
                    if at % 50 == 0 {
                        patches = patches.max(contacts(&simulation)[0]);
                        deep = deep.max(deepest(&all_corners(&simulation), 0).0);
                    }
                }
                let (last, _) = momenta(&mut simulation);
                let change = [0, 1].map(|k| (last[k] - first[k]).norm() / sizes[k]);
                println!(
                    "kind {kind} friction {friction} seed {seed}: {count} steps, momenta {:.1e} {:.1e}, energy +{most:.1e}, left {:.2}, balance {balance:.1e}, {patches} contacts, {deep:.3} deep",
                    change[0],
                    change[1],
                    held(simulation.energy()) / before
                );
                assert!(change[0] < 1e-13 && change[1] < 1e-13, "{change:?}");
            }
        }
    }
}

/// A box of five held walls of thickness 0.5 around `[0, width]² × [0, height]`.
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

/// n³ slightly turned cubes of edge 1 above the floor of a box.
fn filled_box(n: u32, divisions: u32, young: f64) -> Deck {
    let mut deck = matter(young);
    let pitch = 1.45;
    let width = f64::from(n) * pitch + 0.1;
    walls(&mut deck, width, f64::from(n) * pitch + 1.0);
    let mut random = Random::new(u64::from(n));
    for i in 0..n * n * n {
        let at = [i % n, i / n % n, i / (n * n)].map(|c| pitch * (f64::from(c) + 0.5) + 0.05);
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

/// What a box that is filled comes to.
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

/// Lets the cubes fall for some time; everything is looked at every `every` steps.
fn fall(deck: &Deck, width: f64, damping: Damping, time: f64, every: usize) -> Filled {
    let mut simulation = simulation(deck);
    start(&mut simulation, damping);
    let count = (time / simulation.time_step()) as usize;
    let held = |e: ddem_core::Energy| e.kinetic + e.strain_bodies + e.strain_joints - e.external;
    let first = held(simulation.energy());
    let mut found = Filled { steps: count, ..Filled::default() };
    let (mut lowest, mut fell) = (first, 0.0_f64);
    for at in 0..count {
        let clock = std::time::Instant::now();
        steps(&mut simulation, 1);
        found.seconds += clock.elapsed().as_secs_f64();
        if at % every == 0 || at + 1 == count {
            let energy = simulation.energy();
            fell = fell.max(energy.external.abs());
            found.grown = found.grown.max(held(energy) - lowest);
            lowest = lowest.min(held(energy));
            found.deep_at_rest = deepest(&all_corners(&simulation), 5).0;
            found.deepest = found.deepest.max(found.deep_at_rest);
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
    found.contacts = contacts(&simulation)[0];
    found
}

#[test]
fn cubes_fill_a_box() {
    for divisions in [0, 1] {
        let n = 3;
        let mut deck = filled_box(n, divisions, if divisions == 0 { 5e8 } else { 1e8 });
        deck.contact.restitution = Some(0.2);
        let width = f64::from(n) * 1.45 + 0.1;
        let found = fall(&deck, width, Damping::Local(0.1), 2.5, 20);
        println!("divisions {divisions}: {found:?}");
        assert_eq!(found.outside, 0);
        assert!(found.deep_at_rest < 0.01, "{found:?}");
        assert!(found.grown < 1e-3, "{found:?}");
    }
}

#[test]
#[ignore = "minutes: 1000 cubes"]
fn a_thousand_cubes_fill_a_box() {
    for (divisions, time) in [(0, 4.0), (1, 1.5)] {
        let n = 10;
        let mut deck = filled_box(n, divisions, if divisions == 0 { 1e9 } else { 1e8 });
        deck.contact.restitution = Some(0.2);
        let width = f64::from(n) * 1.45 + 0.1;
        let found = fall(&deck, width, Damping::Local(0.2), time, 100);
        println!(
            "divisions {divisions}: {:.2} ms a step, {found:?}",
            1e3 * found.seconds / found.steps as f64
        );
        assert_eq!(found.outside, 0);
    }
}

/// How a throw ended.
#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    Back,
    TooFast,
    Through,
    Diverged,
}

/// A small block thrown at the middle of a thin plate, at a part of the way that is allowed in a step.
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
    let deck = of(&matter(1e8), &[plate, small]);
    let mut probe = simulation(&deck);
    start(&mut probe, Damping::None);
    let speed = part_of_limit * 0.25 * thin / probe.time_step();
    let thrown = Piece { velocity: -normal * speed, ..small };
    let mut simulation = simulation(&of(&matter(1e8), &[plate, thrown]));
    start(&mut simulation, Damping::None);
    let count = (2.0 / (speed * simulation.time_step())) as usize + 100;
    let mut deep = 0.0_f64;
    for _ in 0..count {
        match simulation.step() {
            Ok(()) => {}
            Err(RunError::TooFast { block, step, .. }) => {
                assert!(block == 1 || kinds != [0, 0], "block {block}");
                assert_eq!(step, simulation.steps());
                return (End::TooFast, deep);
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
fn nothing_passes_through_a_thin_plate() {
    let mut random = Random::new(4);
    for kinds in [[0, 0], [2, 0], [0, 2], [2, 2]] {
        for held in [true, false] {
            for part_of_limit in [0.02, 0.1, 0.3, 0.6, 0.95, 1.2] {
                let ends: Vec<(End, f64)> =
                    (0..6).map(|_| at_plate(&mut random, part_of_limit, kinds, held)).collect();
                let count = |end: End| ends.iter().filter(|e| e.0 == end).count();
                let deep = ends.iter().map(|e| e.1).fold(0.0, f64::max);
                println!(
                    "plate {} block {} held {held} {part_of_limit}: back {} too fast {} diverged {} THROUGH {}, {deep:.3} deep",
                    kinds[0],
                    kinds[1],
                    count(End::Back),
                    count(End::TooFast),
                    count(End::Diverged),
                    count(End::Through)
                );
            }
        }
    }
}

/// Two blocks thrown at each other, in any position: they meet at corners, edges and faces.
#[test]
fn nothing_passes_through_in_throws_of_two() {
    let mut random = Random::new(8);
    for kinds in [[0, 0], [0, 2], [1, 2]] {
        let (mut deepest, mut worst_energy, mut balance, mut met) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
        for throw in 0..if kinds == [0, 0] { 200 } else { 60 } {
            let along = random.vector().normalize();
            let aside = random.vector() * 0.3;
            let piece = |random: &mut Random, side: f64, divisions: u32| Piece {
                centre: along * (1.3 * side) + aside * side,
                edges: Vec3::repeat(1.0) + random.vector() * 0.3,
                turn: any_turn(random),
                divisions,
                velocity: along * (-2.0 * side),
                ..Piece::default()
            };
            let pieces = [piece(&mut random, -1.0, kinds[0]), piece(&mut random, 1.0, kinds[1])];
            let mut simulation = simulation(&of(&matter(1e8), &pieces));
            start(&mut simulation, Damping::None);
            let held = |e: ddem_core::Energy| e.kinetic + e.strain_bodies + e.strain_joints;
            let first = held(simulation.energy());
            let (momenta_first, sizes) = momenta(&mut simulation);
            let count = (1.5 / simulation.time_step()) as usize;
            let mut touched = false;
            for at in 0..count {
                steps(&mut simulation, 1);
                if at % 4 == 0 {
                    let energy = simulation.energy();
                    worst_energy = worst_energy.max(held(energy) / first - 1.0);
                    balance = balance.max(energy.balance.abs() / first);
                    let all = all_corners(&simulation);
                    let deep = overlap(&all[0], &all[1]);
                    touched |= deep > 0.0;
                    if deep > deepest {
                        deepest = deep;
                        println!("throw {throw} of {kinds:?}: {deep:.3} deep at step {at}");
                    }
                }
            }
            met += usize::from(touched);
            let (last, _) = momenta(&mut simulation);
            let change = [0, 1].map(|k| (last[k] - momenta_first[k]).norm() / sizes[k]);
            assert!(change[0] < 1e-13 && change[1] < 1e-12, "throw {throw}: {change:?}");
            // They rebound, or turn past each other: not on the line through each other.
            let all = all_corners(&simulation);
            let apart = middle(&all[1]) - middle(&all[0]);
            let through = touched
                && apart.dot(&along) < 0.0
                && overlap(&all[0], &all[1]) < 0.0
                && (apart - along * along.dot(&apart)).norm() < 0.5;
            assert!(!through, "throw {throw} of {kinds:?} went through");
        }
        println!(
            "{kinds:?}: {met} met, {deepest:.3} deep, energy +{worst_energy:.1e}, balance {balance:.1e}"
        );
    }
}

#[test]
#[ignore = "to look at"]
fn scratch_energy() {
    let mut random = Random::new(8);
    let mut found = 0;
    for throw in 0..100 {
        let along = random.vector().normalize();
        let aside = random.vector() * 0.3;
        let piece = |random: &mut Random, side: f64| Piece {
            centre: along * (1.1 * side) + aside * side,
            edges: Vec3::repeat(1.0) + random.vector() * 0.3,
            turn: any_turn(random),
            velocity: along * (-2.0 * side),
            ..Piece::default()
        };
        let pieces = [piece(&mut random, -1.0), piece(&mut random, 1.0)];
        let mut deck = of(&matter(1e8), &pieces);
        deck.contact.friction = Some(0.0);
        let mut simulation = simulation(&deck);
        let dt: f64 = std::env::var("DT").map_or(1.0, |x| x.parse().unwrap());
        simulation.start(Damping::None, TimeStep::Auto, None).unwrap();
        let auto = simulation.time_step();
        simulation.start(Damping::None, TimeStep::Seconds(auto * dt), None).unwrap();
        let held = |e: ddem_core::Energy| e.kinetic + e.strain_bodies + e.strain_joints;
        let first = held(simulation.energy());
        let count = (1.5 / simulation.time_step()) as usize;
        let mut old = (first, 0.0, simulation.energy().balance, 0.0);
        let mut log = Vec::new();
        for at in 0..count {
            steps(&mut simulation, 1);
            let e = simulation.energy();
            let now = (held(e), e.friction, e.balance, e.strain_joints);
            if (now.1 - old.1).abs() > 0.002 * first || (now.2 - old.2).abs() > 0.002 * first {
                let saved = simulation.save();
                let a = |name: &str| saved.arrays.get(name).cloned().unwrap_or_default();
                let (p, q) = (a("contact_patches"), a("contact_points"));
                let points: Vec<String> = q
                    .chunks(21)
                    .map(|q| {
                        format!(
                            "[A {:.3} gap {:.4} off {:.4} tn {:.2e}]",
                            q[10], q[15], q[13], q[17]
                        )
                    })
                    .collect();
                log.push(format!(
                    "   step {at}: held {:.4} friction {:+.4} balance {:+.4} spring {:.4} ref {} n {:.2} {:.2} {:.2} limit {:.4} {}",
                    now.0 / first, (now.1 - old.1) / first, (now.2 - old.2) / first, now.3 / first,
                    p.get(2).copied().unwrap_or(-1.0), p.get(3).copied().unwrap_or(0.0), p.get(4).copied().unwrap_or(0.0), p.get(5).copied().unwrap_or(0.0), p.get(18).copied().unwrap_or(0.0),
                    points.join(" ")
                ));
            }
            old = now;
        }
        let e = simulation.energy();
        println!(
            "throw {throw}: left {:.4} friction {:+.4} balance {:+.4}",
            held(e) / first,
            e.friction / first,
            e.balance / first
        );
        if held(e) / first > 1.02 && found < 4 {
            found += 1;
            log.iter().take(25).for_each(|line| println!("{line}"));
        }
    }
}
