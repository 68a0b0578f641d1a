//! Peak velocities and peak stresses of a run.

use ddem_core::{Field, Simd, Simulation};
use ddem_deck::{Damping, Deck, Extent, History, Initial, Load, Sphere, TimeStep, Where};

use crate::damage::withstands_damage;
use crate::decks::*;

/// Laterally confined bar along x with a pressure pulse at x = 0.
fn bar(pressure: f64, joint: f64) -> Deck {
    let mut deck = deck([20, 1, 1], [10.0, 0.5, 0.5], 4, joint);
    if let (Some(rock), Some(section)) =
        (deck.materials.get("rock").copied(), deck.joints.get_mut("seam"))
    {
        // Joints of the rock's material, so that no wave is reflected at them.
        deck.materials.insert("clay".into(), rock);
        section.material = Some("rock".into());
    }
    deck.model.peaks = true;
    deck.fix.push(fix(Where::default(), "yz"));
    // sin² pulse of 1.6 ms: a wave 4.8 m long.
    let part = |k: u32| f64::from(k) / 64.0;
    let row = |k| [1.6e-3 * part(k), (std::f64::consts::PI * part(k)).sin().powi(2)];
    let history = History::Table((0..=64).map(row).collect());
    deck.load.push(Load {
        r#where: plane(0, 0.0),
        pressure: Some(pressure),
        history: Some(history),
        ..Load::default()
    });
    deck
}

fn run(simulation: &mut Simulation, seconds: f64) {
    let started = simulation.start(Damping::None, TimeStep::Auto, Some(seconds));
    let steps = started.unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..steps {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

fn field(simulation: &mut Simulation, name: &str) -> Vec<f64> {
    let field = ddem_core::fields(simulation.model()).find(|field: &&Field| field.name == name);
    field
        .map(|field| simulation.snapshot().values(field))
        .unwrap_or_else(|| panic!("no field {name}"))
}

#[test]
fn peaks_of_plane_wave_equal_its_amplitude() {
    let mut simulation = simulation(&bar(1e6, 0.01));
    // λ + 2G of the rock, and the speed of its compression waves.
    let modulus: f64 = 18e9 * 0.75 / (1.25 * 0.5);
    let c = (modulus / 2400.0).sqrt();
    // The front of the wave is at 10 m, its end at 5.2 m; nothing has been reflected yet.
    run(&mut simulation, 10.0 / c);
    let expected = 1e6 / (2400.0 * c);
    let speeds = field(&mut simulation, "peak_velocity");
    let compression = field(&mut simulation, "peak_compression");
    let tension = field(&mut simulation, "peak_tension");
    let model = simulation.model();
    let in_window = |node: usize| (1.0..5.0).contains(&model.point(node)[0]);
    let off = |found: f64, exact: f64| (found / exact - 1.0).abs();
    let nodes = speeds.iter().enumerate().filter(|&(node, _)| in_window(node));
    let velocity = nodes.map(|(_, speed)| off(*speed, expected)).fold(0.0, f64::max);
    let hexes = (0..model.n_blocks()).flat_map(|block| model.hexes(block)).enumerate();
    let elements = hexes.filter(|(_, hex)| in_window(hex[0] as usize)).map(|(element, _)| element);
    let (mut count, mut pressed, mut pulled) = (0, 0.0_f64, 0.0_f64);
    for element in elements {
        count += 1;
        pressed = pressed.max(off(compression[element], 1e6));
        pulled = pulled.max(tension[element] / 1e6);
    }
    println!(
        "peak velocity off by {velocity:.1e}, compression {pressed:.1e}, tension {pulled:.1e}"
    );
    assert!(count > 400 && velocity < 0.01 && pressed < 0.01 && pulled < 0.02);
}

#[test]
fn thrown_block_peaks_at_start_and_resting_block_has_none() {
    let mut deck = deck([2, 1, 1], [2.0, 1.0, 1.0], 2, 0.02);
    deck.model.peaks = true;
    let velocity = Some([3.0, 0.0, -4.0]);
    deck.initial.push(Initial { velocity, ..Initial::default() });
    let mut thrown = simulation(&deck);
    assert!(field(&mut thrown, "peak_velocity").iter().all(|&v| v == 5.0));
    run(&mut thrown, 1e-3);
    assert!(field(&mut thrown, "peak_velocity").iter().all(|v| (v - 5.0).abs() < 1e-9));
    assert!(field(&mut thrown, "peak_tension").iter().all(|s| s.abs() < 1.0));
}

/// Intermediate states of a relaxation are no peaks; its equilibrium is.
#[test]
fn relaxation_records_peaks_at_equilibrium_only() {
    let mut deck = bar(0.0, 0.01);
    deck.load[0] =
        Load { r#where: plane(0, 10.0), traction: Some([2e5, 0.0, 0.0]), ..Load::default() };
    deck.fix.push(fix(plane(0, 0.0), "x"));
    let mut simulation = simulation(&deck);
    simulation.relax(1e-9, 100_000).unwrap_or_else(|error| panic!("{error}"));
    assert!(field(&mut simulation, "peak_velocity").iter().all(|&v| v == 0.0));
    assert!(field(&mut simulation, "peak_tension").iter().all(|s| (s / 2e5 - 1.0).abs() < 1e-4));
    assert!(field(&mut simulation, "peak_compression").iter().all(|&s| s < 1e2));
}

#[test]
fn peaks_off_allocate_nothing() {
    let mut deck = bar(1e6, 0.01);
    deck.model.peaks = false;
    let free = simulation(&deck);
    assert!(ddem_core::fields(free.model()).all(|field| !field.name.starts_with("peak")));
    assert!(free.peak_velocities().is_empty() && free.peak_stresses().is_empty());
    deck.model.peaks = true;
    // One speed per node and two stresses per element.
    let (n, elements) = (free.model().n_nodes(), free.model().n_elements());
    let bytes = |simulation: &Simulation| simulation.save().bytes().len();
    assert!(bytes(&simulation(&deck)) >= bytes(&free) + 8 * n + 16 * elements);
}

fn peaks(simulation: &Simulation) -> Vec<u64> {
    let stresses = simulation.peak_stresses().into_flattened();
    simulation.peak_velocities().into_iter().chain(stresses).map(f64::to_bits).collect()
}

#[test]
fn peak_bits_are_independent_of_resume_and_threads() {
    let mut deck = bar(1e6, 0.01);
    let region = Where {
        x: Some(Extent::Range([1.0, 2.0])),
        sphere: Some(Sphere { centre: [1.5, 0.2, 0.2], radius: 0.6 }),
        ..Where::default()
    };
    deck.initial.push(Initial {
        r#where: region,
        velocity: Some([0.3, 0.0, 0.0]),
        ..Initial::default()
    });
    let whole = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.unwrap_or_else(|error| panic!("{error}"));
        pool.install(|| {
            let mut simulation = simulation(&deck);
            run(&mut simulation, 2e-3);
            peaks(&simulation)
        })
    };
    let expected = whole(1);
    assert!(expected == whole(3), "threads");
    let mut rebuilt = simulation(&deck);
    let started = rebuilt.start(Damping::None, TimeStep::Auto, Some(2e-3));
    for step in 0..started.unwrap_or_else(|error| panic!("{error}")) {
        rebuilt.step().unwrap_or_else(|error| panic!("{error}"));
        if step % 7 == 0 {
            let saved = rebuilt.save();
            rebuilt = Simulation::restore(model(&deck), Simd::default(), &saved)
                .unwrap_or_else(|error| panic!("{error}"));
            assert!(rebuilt.save() == saved);
        }
    }
    assert!(expected == peaks(&rebuilt), "after restarts");
    withstands_damage(&deck, &rebuilt.save(), 200);
}

/// A rotated and stretched block: peaks are the principal values of its stresses.
#[test]
fn peak_stresses_are_principal_values() {
    let mut deck = with_axes(deck([1, 1, 1], [1.0; 3], 2, 0.01), OBLIQUE);
    deck.model.peaks = true;
    let mut simulation = simulation(&deck);
    let (mut random, points) = (Random::new(3), points(simulation.model()));
    let turn = random.rotation(0.8);
    let moved = points.iter().map(|x| (turn * x - x + random.vector() * 1e-4).into());
    let moved: Vec<[f64; 3]> = moved.collect();
    simulation.set_displacements(&moved);
    let step = TimeStep::Seconds(1e-6);
    simulation.start(Damping::None, step, None).unwrap_or_else(|error| panic!("{error}"));
    let mut expected = vec![[0.0_f64; 2]; simulation.model().n_elements()];
    // Peaks are sampled after a quarter of the time that a wave takes to cross half a metre: 41
    // steps of a microsecond. The reference is taken at the same step.
    for at in 1..=41 {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
        if simulation.peak_stresses().iter().any(|peak| *peak != [0.0; 2]) {
            assert!(at > 20, "looked after {at} steps");
            for (most, [xx, yy, zz, xy, yz, zx]) in expected.iter_mut().zip(simulation.stresses()) {
                let s = nalgebra::Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
                let values = s.symmetric_eigenvalues();
                *most = [values.max().max(0.0), (-values.min()).max(0.0)];
            }
            break;
        }
    }
    assert!(expected.iter().all(|peak| peak[0].max(peak[1]) > 1e4));
    for (found, expected) in simulation.peak_stresses().iter().zip(&expected) {
        let off = |k: usize| (found[k] - expected[k]).abs() / expected[0].max(expected[1]);
        assert!(off(0).max(off(1)) < 1e-9, "{found:?}, not {expected:?}");
    }
}
