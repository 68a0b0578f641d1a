//! §5: failing joints in whole models.

use ddem_core::{Energy, FIELDS, FieldLocation, Simd, Simulation};
use ddem_deck::{Assign, Damping, Deck, Extent, Fix, Joint, Load, TimeStep, Where};

use crate::decks::*;
use crate::unbonded_blocks::momenta;

/// Thick clay joint (0), or springs with (1) or without (2) thickness.
fn section(kind: usize) -> Joint {
    match kind {
        0 => Joint { thickness: 0.02, material: Some("clay".into()), ..Joint::default() },
        _ => Joint {
            thickness: if kind == 1 { 0.02 } else { 0.0 },
            normal_stiffness: Some(2e11),
            shear_stiffness: Some(6e10),
            ..Joint::default()
        },
    }
}

fn with_seam(mut deck: Deck, joint: Joint) -> Deck {
    deck.joints.insert("seam".into(), joint);
    deck
}

fn weak(joint: Joint) -> Joint {
    Joint {
        cohesion: Some(1e5),
        friction: Some(30.0),
        tension: Some(4e4),
        residual_friction: Some(20.0),
        dilation: Some(5.0),
        ..joint
    }
}

fn pair_field(simulation: &mut Simulation, name: &str) -> Vec<f64> {
    let field = FIELDS.iter().find(|field| field.on == FieldLocation::Pair && field.name == name);
    field
        .map(|field| simulation.snapshot().values(field))
        .unwrap_or_else(|| panic!("no field {name}"))
}

fn start(simulation: &mut Simulation, damping: Damping) {
    simulation.start(damping, TimeStep::Auto, None).unwrap_or_else(|error| panic!("{error}"));
}

fn steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Eight blocks that rotate and are pushed through each other, so that every pair fails and slides.
fn torn(joint: Joint) -> Simulation {
    let mut simulation = simulation(&with_seam(deck([2, 2, 2], [2.0; 3], 2, 0.02), joint));
    let (n, mut random) = (simulation.model().n_nodes(), Random::new(7));
    let pushes: Vec<Vec3> = (0..8).map(|_| random.vector() * 0.06).collect();
    let velocities: Vec<[f64; 3]> = (0..n)
        .map(|node| {
            let x = Vec3::from(simulation.model().point(node)) - Vec3::repeat(1.0);
            let push = pushes[simulation.model().block_of(node)];
            ((Vec3::new(0.7, -0.4, 1.1).cross(&x) - x * 0.5) * 0.1 + push).into()
        })
        .collect();
    simulation.set_velocities(&velocities);
    // Short steps: at the longest one, a thin joint opens and closes within one or two steps.
    let step = TimeStep::Seconds(5e-6);
    simulation.start(Damping::None, step, None).unwrap_or_else(|error| panic!("{error}"));
    simulation
}

#[test]
fn momentum_is_conserved_during_failure_and_sliding() {
    for kind in 0..3 {
        let mut simulation = torn(weak(section(kind)));
        let (first, sizes) = momenta(&mut simulation);
        let before = simulation.energy().balance;
        steps(&mut simulation, 15_000);
        let (last, _) = momenta(&mut simulation);
        let change = [0, 1].map(|k| (last[k] - first[k]).norm() / sizes[k]);
        let failed: u64 = simulation.failed_pairs().iter().sum();
        let slip = pair_field(&mut simulation, "slip");
        let most = slip.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        let energy = simulation.energy();
        println!(
            "{kind}: {change:?} failed {failed} of {} slip {most} {energy:?}",
            simulation.model().n_pairs()
        );
        assert!(failed as usize > simulation.model().n_pairs() * 9 / 10, "{failed}");
        assert!(most > 1e-3, "{most}");
        assert!(change[0] < 1e-13 && change[1] < 1e-13, "joint {kind}: {change:?}");
        let exchanged = energy.friction + energy.fracture;
        let balance = energy.balance - before;
        assert!(balance.abs() < 0.01 * exchanged, "{balance} {energy:?}");
    }
}

/// The traction of a pair that stays bonded equals the traction of the same joint without failure.
#[test]
fn bonded_pair_has_no_traction_jump() {
    for kind in 0..3 {
        let mut tough = simulation(&with_seam(deck([2, 2, 2], [2.0; 3], 3, 0.02), section(kind)));
        let mut brittle =
            simulation(&with_seam(deck([2, 2, 2], [2.0; 3], 3, 0.02), weak(section(kind))));
        let mut random = Random::new(3);
        let n = tough.model().n_nodes();
        let u: Vec<[f64; 3]> = (0..n).map(|_| (random.vector() * 3e-7).into()).collect();
        for simulation in [&mut tough, &mut brittle] {
            simulation.set_displacements(&u);
            start(simulation, Damping::None);
        }
        let (expected, found) = (tough.tractions(), brittle.tractions());
        let state = pair_field(&mut brittle, "state");
        let failed = state.iter().filter(|state| **state != 0.0).count();
        assert!(failed > 0 && failed < state.len() / 2, "{failed} of {}", state.len());
        let scale = largest(&expected);
        let mut most: f64 = 0.0;
        for ((state, a), b) in state.iter().zip(&expected).zip(&found) {
            if *state == 0.0 {
                most = most.max((Vec3::from(*a) - Vec3::from(*b)).norm() / scale);
            }
        }
        assert!(most < 1e-12, "joint {kind}: {most}");
    }
}

/// Column of two blocks, pulled apart or sheared by its driven top.
fn driven(joint: Joint, velocity: [f64; 3], load: f64) -> Simulation {
    let mut deck = with_seam(deck([1, 1, 2], [1.0, 1.0, 2.0], 2, 0.02), joint);
    deck.fix.push(fix(plane(2, 0.0), "xyz"));
    deck.fix.push(Fix {
        velocity: Some(velocity),
        ..fix(plane(2, 2.0), if load == 0.0 { "xyz" } else { "xy" })
    });
    if load != 0.0 {
        deck.load.push(Load { r#where: plane(2, 2.0), pressure: Some(load), ..Load::default() });
    }
    simulation(&deck)
}

#[test]
fn unreached_strength_changes_no_bit() {
    for kind in 0..3 {
        let strong = Joint {
            cohesion: Some(1e15),
            friction: Some(30.0),
            tension: Some(1e15),
            ..section(kind)
        };
        let results = [section(kind), strong].map(|joint| {
            let mut simulation = driven(joint, [0.3, 0.1, 0.2], 0.0);
            start(&mut simulation, Damping::Ratio(0.02));
            steps(&mut simulation, 300);
            (bits(&simulation.displacements()), bits(&simulation.tractions()))
        });
        assert!(results[0] == results[1], "joint {kind}");
    }
}

#[test]
fn failure_bits_are_independent_of_threads_and_simd() {
    let run = |simd: Simd, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap_or_else(|error| panic!("{error}")).install(|| {
            let mut deck = with_seam(deck([3, 3, 3], [3.0; 3], 4, 0.02), weak(section(0)));
            deck.model.gravity = [3.0, 0.5, -9.81];
            deck.fix.push(fix(plane(2, 0.0), "xyz"));
            let mut simulation = Simulation::with_simd(model(&deck), simd);
            start(&mut simulation, Damping::None);
            steps(&mut simulation, 700);
            let energy = simulation.energy();
            let numbers = [energy.friction, energy.fracture, energy.balance].map(f64::to_bits);
            let slips: Vec<u64> =
                pair_field(&mut simulation, "slip").into_iter().map(f64::to_bits).collect();
            (simulation.failed_pairs(), bits(&simulation.displacements()), slips, numbers)
        })
    };
    let first = run(Simd::available()[0].1, 1);
    assert!(first.0.iter().sum::<u64>() > 100, "{:?}", first.0);
    for (name, simd) in Simd::available() {
        for threads in [2, 3] {
            assert!(run(simd, threads) == first, "{name}, {threads} threads");
        }
    }
}

/// Oblique axes, where the gap is not along the normal, and blocks that do not fill their packs.
#[test]
fn momentum_is_conserved_in_oblique_lattices() {
    for kind in 0..3 {
        let deck = with_seam(deck([3, 2, 1], [3.0, 2.0, 1.0], 3, 0.02), weak(section(kind)));
        let mut simulation = simulation(&with_axes(deck, OBLIQUE));
        let (n, mut random) = (simulation.model().n_nodes(), Random::new(11));
        let pushes: Vec<Vec3> = (0..6).map(|_| random.vector() * 0.1).collect();
        let push = |node| pushes[simulation.model().block_of(node)].into();
        let velocities: Vec<[f64; 3]> = (0..n).map(push).collect();
        simulation.set_velocities(&velocities);
        start(&mut simulation, Damping::None);
        let (first, sizes) = momenta(&mut simulation);
        steps(&mut simulation, 500);
        let (last, _) = momenta(&mut simulation);
        let change = [0, 1].map(|k| (last[k] - first[k]).norm() / sizes[k]);
        assert!(simulation.failed_pairs().iter().sum::<u64>() > 50, "joint {kind}");
        assert!(change[0] < 1e-13 && change[1] < 1e-13, "joint {kind}: {change:?}");
    }
}

/// Joints of several kinds in one pack: each fails at its own strength or never.
#[test]
fn joints_of_one_pack_fail_at_their_own_strengths() {
    let mut deck = deck([4, 1, 2], [4.0, 1.0, 2.0], 2, 0.02);
    let loose = Joint { thickness: 0.02, ..section(1) };
    deck.joints.insert("loose".into(), loose);
    let names = ["never", "weak", "springs", "strong"];
    for (name, joint) in [
        ("never", section(0)),
        ("weak", weak(section(0))),
        ("springs", weak(section(1))),
        ("strong", Joint { tension: Some(1e12), cohesion: Some(1e12), ..section(0) }),
    ] {
        deck.joints.insert(name.into(), joint);
    }
    // Columns that do not affect each other, pulled at both ends.
    for (column, name) in names.into_iter().enumerate() {
        let x = Some(Extent::Range([column as f64, column as f64 + 1.0]));
        let region = Where { x, z: Some(Extent::Plane(1.0)), ..Where::default() };
        deck.assign.push(Assign { r#where: region, joint: Some(name.into()), ..Assign::default() });
    }
    for column in 1..4 {
        let x = Some(Extent::Plane(f64::from(column)));
        let region = Where { x, ..Where::default() };
        let joint = Some("loose".into());
        deck.assign.push(Assign { r#where: region, joint, ..Assign::default() });
    }
    deck.fix.push(fix(plane(2, 0.0), "xyz"));
    deck.fix.push(Fix { velocity: Some([0.0, 0.0, 1e-3]), ..fix(plane(2, 2.0), "xyz") });
    let mut simulation = simulation(&deck);
    start(&mut simulation, Damping::Ratio(0.01));
    steps(&mut simulation, 3000);
    let state = pair_field(&mut simulation, "state");
    let traction = simulation.tractions();
    let model = simulation.model();
    let joints: Vec<&str> = deck.joints.keys().map(String::as_str).collect();
    let mut seen = 0;
    for face in model.faces() {
        let name = joints[face.joint as usize];
        let pairs = face.first_pair as usize..face.first_pair as usize + 9;
        let failed = state[pairs.clone()].iter().filter(|state| **state != 0.0).count();
        let pull = traction[pairs].iter().fold(f64::INFINITY, |least, t| least.min(t[2]));
        match name {
            "weak" | "springs" => {
                assert!(failed == 9 && pull.abs() < 1.0, "{name}: {failed} {pull}")
            }
            "never" | "strong" => assert!(failed == 0 && pull > 4e4, "{name}: {failed} {pull}"),
            _ => continue,
        }
        seen += 1;
    }
    assert_eq!(seen, 4);
}

/// Strengths have no effect on a relaxation until a pair fails.
#[test]
fn unreached_strength_changes_no_bit_of_a_relaxation() {
    for kind in 0..3 {
        let strong = Joint { cohesion: Some(1e15), tension: Some(1e15), ..section(kind) };
        let results = [section(kind), strong].map(|joint| {
            let mut deck = with_seam(deck([2, 2, 2], [2.0; 3], 2, 0.02), joint);
            deck.model.gravity = [1.0, 0.5, -9.81];
            deck.fix.push(fix(plane(2, 0.0), "xyz"));
            let mut simulation = simulation(&deck);
            let steps = simulation.relax(1e-6, 5000).unwrap_or_else(|error| panic!("{error}"));
            (steps, bits(&simulation.displacements()))
        });
        assert!(results[0] == results[1], "joint {kind}");
    }
}

/// Pairs shown as failed stay failed, even if the stage ends there.
#[test]
fn pair_failed_at_stage_end_stays_failed() {
    let mut simulation = driven(weak(section(0)), [0.0, 0.0, 0.01], 0.0);
    start(&mut simulation, Damping::None);
    while pair_field(&mut simulation, "state").iter().all(|state| *state == 0.0) {
        steps(&mut simulation, 1);
    }
    let shown = pair_field(&mut simulation, "state");
    let failed = simulation.failed_pairs();
    simulation.synchronise();
    assert_eq!(simulation.failed_pairs(), failed);
    simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(pair_field(&mut simulation, "state"), shown);
}

/// A joint that breaks all at once: the energy columns add up.
#[test]
fn energies_balance_when_joint_breaks_at_once() {
    for kind in 0..3 {
        let mut simulation = driven(weak(section(kind)), [0.0, 0.0, 2e-3], 0.0);
        start(&mut simulation, Damping::None);
        let sum = |e: &Energy| {
            let held = e.kinetic + e.strain_bodies + e.strain_joints;
            held + e.friction + e.fracture + e.damping - e.external_work
        };
        // The first step, which sets the top in motion at once, is excluded.
        steps(&mut simulation, 1);
        let first = sum(&simulation.energy());
        let (mut worst, mut exchange) = (0.0_f64, 0.0_f64);
        for _ in 0..400 {
            steps(&mut simulation, 5);
            let energy = simulation.energy();
            worst = worst.max((sum(&energy) - first).abs());
            exchange = exchange.max(energy.external_work.abs());
        }
        assert_eq!(simulation.failed_pairs(), [0, 9], "joint {kind}");
        assert!(worst < 0.01 * exchange, "joint {kind}: {worst} of {exchange}");
    }
}

/// An automatic step that becomes shorter after the end of the started duration.
#[test]
fn step_shortens_after_end_of_duration() {
    let mut simulation = driven(weak(section(1)), [0.0, 0.0, 1e-3], 0.0);
    let part = 3.0 * {
        start(&mut simulation, Damping::None);
        simulation.time_step()
    };
    let begun = simulation.start(Damping::None, TimeStep::Auto, Some(part));
    let whole = begun.unwrap_or_else(|error| panic!("{error}"));
    steps(&mut simulation, whole as usize);
    assert_eq!(simulation.failed_pairs(), [0; 2]);
    let mut time = simulation.time();
    while simulation.failed_pairs() == [0; 2] {
        steps(&mut simulation, 1);
        assert!(simulation.time() > time && simulation.time_step() > 0.0);
        time = simulation.time();
    }
    steps(&mut simulation, 100);
    assert!(simulation.time() > time && simulation.energy().kinetic.is_finite());
}

/// The sum of whole safe steps, as duration, exceeds the product by rounding.
#[test]
fn duration_of_whole_steps_keeps_the_step() {
    for n in 590..610 {
        let mut simulation = driven(weak(section(1)), [0.0, 0.0, 1.0], 0.0);
        let safe = simulation.broken_step(Damping::None).unwrap_or_else(|error| panic!("{error}"));
        simulation.set_velocities(&vec![[0.0, 0.0, 1e-6]; simulation.model().n_nodes()]);
        let duration = (0..n).map(|_| safe).sum();
        let begun = simulation.start(Damping::None, TimeStep::Auto, Some(duration));
        assert_eq!(begun.ok(), Some(n));
        let step = simulation.time_step();
        steps(&mut simulation, n as usize);
        assert!(simulation.failed_pairs() != [0; 2] && simulation.steps_left() == Some(0), "{n}");
        assert_eq!(simulation.time_step(), step);
    }
}

/// Setting velocities first brings the old ones to the present time, and pairs fail there.
#[test]
fn step_shortens_when_set_velocities_fail_pairs() {
    let mut simulation = driven(weak(section(1)), [0.0, 0.0, 1e-3], 0.0);
    start(&mut simulation, Damping::None);
    let first = simulation.time_step();
    while {
        simulation.energy();
        simulation.failed_pairs() == [0; 2]
    } {
        steps(&mut simulation, 1);
    }
    assert_eq!(simulation.time_step(), first);
    let velocities = simulation.velocities();
    simulation.set_velocities(&velocities);
    steps(&mut simulation, 1);
    let safe = simulation.broken_step(Damping::None).unwrap_or_else(|error| panic!("{error}"));
    assert!(simulation.time_step() <= safe && safe < first);
}

/// Blocks in motion at the start of a stage can shock the joints. A later change of the step would
/// be too inaccurate, so the stage begins with the safe step.
#[test]
fn stage_starting_in_motion_uses_safe_step() {
    for joint in [section(1), weak(section(1))] {
        let mut simulation = driven(joint, [0.0; 3], 0.0);
        start(&mut simulation, Damping::None);
        let at_rest = simulation.time_step();
        simulation.set_velocities(&vec![[1e-3, 0.0, 0.0]; simulation.model().n_nodes()]);
        start(&mut simulation, Damping::None);
        let safe = simulation.broken_step(Damping::None).unwrap_or_else(|error| panic!("{error}"));
        let moving = if simulation.model().can_fail() { safe } else { at_rest };
        assert_eq!(simulation.time_step(), moving);
        assert!(safe < at_rest);
    }
}

/// Energies, tractions and slips describe a step to come; reading them takes no step.
#[test]
fn evaluating_failing_joints_changes_no_bit() {
    let run = |looks: bool| {
        let mut simulation = driven(weak(section(0)), [0.02, 0.0, 0.0], 2e5);
        start(&mut simulation, Damping::Ratio(0.01));
        for _ in 0..600 {
            steps(&mut simulation, 1);
            if looks {
                simulation.energy();
                simulation.tractions();
                pair_field(&mut simulation, "slip");
            }
        }
        let slips = pair_field(&mut simulation, "slip").into_iter().map(f64::to_bits);
        (simulation.failed_pairs(), bits(&simulation.displacements()), slips.collect::<Vec<_>>())
    };
    let plain = run(false);
    assert!(plain.0.iter().sum::<u64>() > 3, "{:?}", plain.0);
    assert!(run(true) == plain);
}

/// Dilation opens the joint against the pressure; its work is booked when it is done.
#[test]
fn energies_balance_during_dilation() {
    for kind in 0..3 {
        let mut simulation = driven(weak(section(kind)), [0.02, 0.0, 0.0], 2e5);
        // A constant step: joint failure would change it, and with it the measure of the energy.
        let safe = simulation.safe_step().unwrap_or_else(|error| panic!("{error}"));
        let begun = simulation.start(Damping::Ratio(0.01), TimeStep::Seconds(safe), None);
        begun.unwrap_or_else(|error| panic!("{error}"));
        steps(&mut simulation, 2000);
        let energy = simulation.energy();
        assert!(simulation.failed_pairs().iter().sum::<u64>() > 3, "joint {kind}");
        let opened = pair_field(&mut simulation, "opening").into_iter().fold(0.0, f64::max);
        assert!(opened > 1e-6, "joint {kind}: {opened}");
        assert!(energy.balance.abs() < 2e-3 * energy.friction, "joint {kind}: {energy:?}");
    }
}
