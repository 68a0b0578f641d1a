//! Charges: closed surfaces, momentum, energies, venting, saved states and bad input.

use ddem_core::{ChargeState, Simd, Simulation};
use ddem_deck::*;

use crate::cavities::*;
use crate::damage::withstands_damage;
use crate::decks::*;

fn run(simulation: &mut Simulation, damping: Damping, step: TimeStep, steps: usize) {
    simulation.start(damping, step, None).unwrap_or_else(|error| panic!("{error}"));
    more(simulation, steps);
}

fn more(simulation: &mut Simulation, steps: usize) {
    for _ in 0..steps {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Total momentum and angular momentum, relative to the sums of the sizes of their parts.
fn momentum_error(simulation: &mut Simulation) -> [f64; 2] {
    let model = simulation.model();
    let (x, mass): (Vec<Vec3>, Vec<f64>) =
        (0..model.n_nodes()).map(|i| (Vec3::from(model.point(i)), model.mass(i))).unzip();
    let velocities = simulation.velocities();
    let each = || x.iter().zip(&mass).zip(&velocities);
    let size: f64 = each().map(|((_, m), v)| m * Vec3::from(*v).norm()).sum();
    let turn: f64 = each().map(|((x, m), v)| m * x.cross(&Vec3::from(*v)).norm()).sum();
    let [p, l] = [simulation.momentum(), simulation.angular_momentum()];
    [Vec3::from(p).norm() / size, Vec3::from(l).norm() / turn]
}

const SHAPES: [&[[f64; 3]]; 4] = [
    &[[1.0, 1.0, 1.0]],
    &[[1.0, 1.0, 1.0], [2.0, 1.0, 1.0]],
    // Cells around a corner, and around two corners with a block between two diagonal cells.
    &[[1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]],
    &[[1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [2.0, 2.0, 1.0], [2.0, 2.0, 2.0]],
];

/// A place without a block, because the blocks there were split, is no cavity.
#[test]
fn cavity_among_split_blocks_is_closed() {
    let mut deck = hollow(BOX, &[[1.75, 1.75, 1.75]], 0.1);
    let range = Some(Extent::Range([1.0, 3.0]));
    let region = Where { x: range, y: range, z: range, ..Where::default() };
    deck.refine = vec![Refine { r#where: region, factor: 2 }];
    deck.charge = vec![gas(everywhere(), 2e8)];
    let model = model(&deck);
    assert_eq!(model.n_blocks(), 56 + 63);
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    let mut simulation = Simulation::new(model);
    // Volume of the cell and half of the joints around it, with edges and corners cut off.
    let exact =
        0.6_f64.powi(3) - 12.0 * 0.4 * 0.1_f64.powi(2) / 2.0 - 8.0 * 0.1_f64.powi(3) * 5.0 / 6.0;
    let start = state(&simulation, 0);
    assert!((start.volume - exact).abs() < 1e-12, "{start:?}");
    run(&mut simulation, Damping::None, TimeStep::Auto, 200);
    let [p, l] = momentum_error(&mut simulation);
    assert!(p < 1e-12 && l < 1e-6, "{p} {l}");
}

#[test]
fn gas_in_closed_cavity_keeps_momentum_and_does_expansion_work() {
    for axes in [BOX, OBLIQUE] {
        for (shape, cells) in SHAPES.iter().enumerate() {
            for body in [Body::Deformable, Body::Rigid] {
                let mut deck = hollow(axes, cells, 0.1);
                if body == Body::Rigid {
                    (deck.blocks[0].body, deck.blocks[0].divisions) = (body, 1);
                }
                deck.charge = vec![gas(everywhere(), 2e8)];
                let model = model(&deck);
                assert_eq!(crate::decks::warnings(&deck), [""; 0]);
                let mut simulation = Simulation::new(model);
                let start = state(&simulation, 0);
                assert_eq!(start.pressure, 2e8);
                let critical = simulation.critical_step().unwrap_or_else(|error| panic!("{error}"));
                run(&mut simulation, Damping::None, TimeStep::Seconds(0.05 * critical), 400);
                let now = state(&simulation, 0);
                let case = format!("shape {shape}, {body:?}");
                assert!(now.volume > 1.001 * start.volume, "{case}: {now:?} from {start:?}");
                let [p, l] = momentum_error(&mut simulation);
                assert!(p < 1e-13 && l < 1e-6, "{case}: {p} {l}");
                let part = start.volume / now.volume;
                let exact = 2e8 * start.volume / 2.0 * (1.0 - part * part);
                let energy = simulation.energy();
                let error = energy.external_work / exact - 1.0;
                println!("{case}: work of the gas {:.6e} J, {error:.1e} off", energy.external_work);
                assert!(error.abs() < 1e-3, "{case}: {error}");
                assert!(energy.balance.abs() < 1e-5 * exact, "{case}: {energy:?}");
            }
        }
    }
}

/// Volume of a cube whose edges and corners are cut off.
#[test]
fn cavity_volume_includes_gaps_between_walls() {
    let (t, body) = (0.1_f64, 0.9_f64);
    let exact = (body + 2.0 * t).powi(3) - 6.0 * t * t * body - 8.0 * 5.0 / 6.0 * t.powi(3);
    let mut deck = hollow(BOX, &[[1.0; 3]], t);
    deck.charge = vec![gas(ball([1.5; 3], 0.7), 1e6)];
    let volume = state(&simulation(&deck), 0).volume;
    assert!((volume / exact - 1.0).abs() < 1e-13, "{volume} {exact}");
    // In an oblique cell the volume is the one that its edges span.
    let mut deck = hollow(OBLIQUE, SHAPES[2], 0.1);
    deck.blocks[0].joint = Some(JointChoice::All("springs".into()));
    let stiff = Some(1e10);
    let springs = Joint { normal_stiffness: stiff, shear_stiffness: stiff, ..Joint::default() };
    deck.joints.insert("springs".into(), springs);
    deck.charge = vec![gas(everywhere(), 1e6)];
    let [x, y, z] = OBLIQUE.map(|axis| Vec3::from(axis).normalize());
    let exact = 3.0 * x.dot(&y.cross(&z)).abs();
    let volume = state(&simulation(&deck), 0).volume;
    assert!((volume / exact - 1.0).abs() < 1e-13, "{volume} {exact}");
}

/// `p_d = ρ D²/(2(γ + 1))`, and the lower pressure in a larger hole.
#[test]
fn charge_mass_gives_detonation_pressure() {
    let numbers = Detonation { density: 1000.0, detonation_velocity: 4000.0, gamma: 3.0 };
    let mut deck = hollow(BOX, &[[1.0; 3]], 0.1);
    let charge = |mass: f64| Charge {
        r#where: ball([1.5; 3], 0.7),
        mass: Some(mass),
        explosive: Some(Explosive::Given(numbers)),
        ..Charge::default()
    };
    deck.charge = vec![charge(100.0)];
    let ChargeState { pressure, volume, .. } = state(&simulation(&deck), 0);
    let exact = 2e9 * (0.1 / volume).powi(3);
    assert!((pressure / exact - 1.0).abs() < 1e-12, "{pressure} {exact}");
    deck.charge = vec![charge(5000.0)];
    assert!((state(&simulation(&deck), 0).pressure / 2e9 - 1.0).abs() < 1e-12);
    let warnings = crate::decks::warnings(&deck);
    assert!(warnings.iter().any(|w| w.contains("explosive in a cavity")), "{warnings:?}");
    for (name, pressure) in [("tnt", 1.05e10), ("anfo", 2.3e9), ("emulsion", 4.2e9)] {
        let named = Explosive::Named(name.into()).detonation().map(|d| d.pressure());
        assert!(named.is_some_and(|p| (p / pressure - 1.0).abs() < 0.02), "{name}: {named:?}");
    }
}

/// A large gas mass in a thin joint is stiffer than the rock; automatic steps shorten accordingly.
#[test]
fn steps_are_stable_for_stiff_gas() {
    let mut deck = deck([2, 2, 1], [2.0, 2.0, 1.0], 2, 0.02);
    let bare = simulation(&deck).critical_step().unwrap_or_else(|error| panic!("{error}"));
    let explosive = Some(Explosive::Named("tnt".into()));
    let region = everywhere();
    deck.charge =
        vec![Charge { mass: Some(0.02), explosive, r#where: region, ..Charge::default() }];
    let mut simulation = simulation(&deck);
    let critical = simulation.critical_step().unwrap_or_else(|error| panic!("{error}"));
    assert!(critical < 0.1 * bare, "{critical} {bare}");
    run(&mut simulation, Damping::None, TimeStep::Auto, 500);
    let own = 0.02 / 1630.0;
    let all = 1.05e10 * own / 1.7;
    let energy = simulation.energy();
    assert!(energy.external_work < 2.0 * all && energy.kinetic < 2.0 * all, "{energy:?} of {all}");
}

/// Without a cavity the gas pushes the joints open.
#[test]
fn gas_without_cavity_opens_joints() {
    for (axes, body) in [(BOX, Body::Deformable), (OBLIQUE, Body::Deformable), (BOX, Body::Rigid)] {
        let mut deck = with_axes(deck([2, 2, 1], [2.0, 2.0, 1.0], 2, 0.02), axes);
        deck.blocks[0].body = body;
        deck.charge = vec![Charge {
            mass: Some(2.0),
            explosive: Some(Explosive::Named("emulsion".into())),
            r#where: everywhere(),
            ..Charge::default()
        }];
        let mut simulation = simulation(&deck);
        let start = state(&simulation, 0);
        run(&mut simulation, Damping::None, TimeStep::Seconds(2e-7), 200);
        let now = state(&simulation, 0);
        assert!(now.volume > 1.0001 * start.volume && now.pressure < start.pressure, "{now:?}");
        let [p, l] = momentum_error(&mut simulation);
        assert!(p < 1e-13 && l < 1e-5, "{body:?}: {p} {l}");
        // Explosive in a joint expands from its own volume.
        let own = 2.0 / 1150.0;
        let part = own / (own + now.volume - start.volume);
        let exact = start.pressure * own / 2.0 * (1.0 - part * part);
        let work = simulation.energy().external_work;
        println!("{body:?}: work {work:.6e} J, {:.1e} off", work / exact - 1.0);
        assert!((work / exact - 1.0).abs() < 1e-2, "{work} {exact}");
    }
}

/// A wall block that has moved farther than the width of the cavity lets the gas vent, permanently.
#[test]
fn gas_vents_past_displaced_wall() {
    let mut deck = hollow(BOX, &[[1.0; 3]], 0.1);
    deck.charge = vec![given(ball([1.5; 3], 0.7), 1e6, History::Ramp(0.0))];
    let mut simulation = simulation(&deck);
    let nodes = ball([2.5, 1.5, 1.5], 0.85).nodes(simulation.model()).unwrap();
    let mut moved = simulation.displacements();
    for (far, vented) in [(1.2, false), (1.5, true)] {
        nodes.iter().for_each(|node| moved[*node as usize] = [far, 0.0, 0.0]);
        simulation.set_displacements(&moved);
        assert_eq!(state(&simulation, 0).vented, vented, "{far}");
    }
    run(&mut simulation, Damping::None, TimeStep::Seconds(1e-6), 1);
    simulation.set_displacements(&vec![[0.0; 3]; moved.len()]);
    assert!(state(&simulation, 0).vented);
    let work = simulation.energy().external_work;
    more(&mut simulation, 20);
    assert_eq!(simulation.energy().external_work, work);
}

#[test]
fn delay_counts_from_start_of_stage() {
    let mut deck = hollow(BOX, &[[1.0; 3]], 0.1);
    let stage =
        |name: &str| Stage { kind: StageKind::Dynamic, duration: Some(1e-3), ..relax_stage(name) };
    deck.stage = vec![stage("wait"), stage("blast")];
    let pulse = History::Triangle(Triangle { rise: 1e-4, fall: Some(1e-4), duration: None });
    let charge = given(ball([1.5; 3], 0.7), 1e6, pulse);
    deck.charge = vec![
        Charge { delay: Some(5e-4), from: Some("blast".into()), ..charge.clone() },
        Charge { delay: Some(1e-4), until: Some("blast".into()), ..charge },
    ];
    let mut simulation = simulation(&deck);
    simulation
        .start(Damping::None, TimeStep::Seconds(1e-5), None)
        .unwrap_or_else(|error| panic!("{error}"));
    let mut maxima = Vec::new();
    for step in 0..200 {
        if step == 100 {
            simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
            simulation
                .start(Damping::None, TimeStep::Seconds(1e-5), None)
                .unwrap_or_else(|error| panic!("{error}"));
        }
        let [a, b] = [0, 1].map(|index| state(&simulation, index).pressure / 1e6);
        let time = simulation.time();
        let triangle = |t: f64| (1.0 - (t - 1e-4).abs() / 1e-4).max(0.0);
        let exact = [triangle(time - 1.5e-3), triangle(time - 1e-4)];
        assert!((a - exact[0]).abs() < 1e-9 && (b - exact[1]).abs() < 1e-9, "{time}: {a} {b}");
        maxima.push(a.max(b));
        more(&mut simulation, 1);
    }
    assert!(maxima.iter().filter(|p| **p > 0.5).count() > 10);
}

/// One charge that acts at once, and one with a delay; the gas of one vents during the run.
fn busy() -> Deck {
    let mut deck = hollow(BOX, SHAPES[1], 0.1);
    let history = History::Duvall(Duvall { alpha: 2e3, beta: 2e4 });
    let cavity = ball([2.0, 1.5, 1.5], 1.2);
    deck.charge =
        vec![gas(cavity.clone(), 3e8), Charge { delay: Some(2e-4), ..given(cavity, 1e8, history) }];
    deck
}

fn state_bits(simulation: &mut Simulation) -> Vec<u64> {
    let mut state_bits = bits(&simulation.displacements());
    state_bits.extend(bits(&simulation.velocities()));
    state_bits.extend(simulation.energy().values().map(f64::to_bits));
    state_bits
}

#[test]
fn blast_resumes_from_any_step() {
    let deck = busy();
    let reloaded = |saved: &ddem_core::Saved| {
        Simulation::restore(model(&deck), Simd::default(), saved)
            .unwrap_or_else(|error| panic!("{error}"))
    };
    let mut whole = simulation(&deck);
    whole
        .start(Damping::Local(0.1), TimeStep::Auto, None)
        .unwrap_or_else(|error| panic!("{error}"));
    // The gas of the first charge has vented.
    let mut moved = whole.displacements();
    let nodes = ball([3.5, 1.5, 1.5], 0.85).nodes(whole.model()).unwrap();
    nodes.iter().for_each(|node| moved[*node as usize] = [1.5, 0.0, 0.0]);
    whole.set_displacements(&moved);
    more(&mut whole, 1);
    whole.set_displacements(&vec![[0.0; 3]; moved.len()]);
    assert!(state(&whole, 0).vented && !state(&whole, 1).vented);
    let mut rebuilt = reloaded(&whole.save());
    for at in 0..20 {
        more(&mut whole, 1);
        more(&mut rebuilt, 1);
        rebuilt = reloaded(&rebuilt.save());
        assert!(rebuilt.save() == whole.save(), "step {at}");
    }
    assert!(state_bits(&mut whole) == state_bits(&mut rebuilt));
    withstands_damage(&deck, &whole.save(), 100);
}

#[test]
fn charge_bits_are_independent_of_threads_and_simd() {
    let deck = busy();
    let run = |simd: Simd, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap_or_else(|error| panic!("{error}")).install(|| {
            let mut simulation = Simulation::with_simd(model(&deck), simd);
            run(&mut simulation, Damping::None, TimeStep::Auto, 40);
            state_bits(&mut simulation)
        })
    };
    let first = run(Simd::available()[0].1, 1);
    for (name, simd) in Simd::available() {
        for threads in [1, 3] {
            assert!(run(simd, threads) == first, "{name}, {threads} threads");
        }
    }
}

/// A relaxation reaches equilibrium with a pressure that follows the walls.
#[test]
fn cavity_relaxes_under_gas_pressure() {
    let mut deck = hollow(BOX, &[[1.0; 3]], 0.1);
    deck.fix = [0, 1, 2].map(|axis| fix(plane(axis, 0.0), ["x", "y", "z"][axis])).into();
    deck.charge = vec![gas(ball([1.5; 3], 0.7), 1e8)];
    let mut simulation = simulation(&deck);
    simulation.relax(1e-9, 50_000).unwrap_or_else(|error| panic!("{error}"));
    let grown = state(&simulation, 0).volume;
    let displacements = simulation.displacements();
    run(&mut simulation, Damping::None, TimeStep::Auto, 200);
    let size = largest(&displacements);
    let after = simulation.displacements();
    let apart =
        displacements.iter().zip(&after).map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).norm());
    assert!(apart.fold(0.0, f64::max) < 1e-5 * size);
    assert!(grown > 1.27, "{grown}");
}
