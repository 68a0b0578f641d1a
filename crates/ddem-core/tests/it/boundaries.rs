//! Non-reflecting boundaries: orientation, energies, stages, saved states and bad input.

use std::collections::BTreeMap;
use std::sync::Arc;

use ddem_core::{Model, Simd, Simulation};
use ddem_deck::*;
use nalgebra::Rotation3;

use crate::damage::withstands_damage;
use crate::decks::*;

fn viscous(region: Where) -> Boundary {
    let kind = BoundaryKind::Viscous;
    Boundary { r#where: region, kind, velocity: None, history: None, from: None, until: None }
}

fn free_field(region: Where) -> Boundary {
    Boundary { kind: BoundaryKind::FreeField, ..viscous(region) }
}

fn start(simulation: &mut Simulation, damping: Damping, step: TimeStep) {
    simulation.start(damping, step, None).unwrap_or_else(|error| panic!("{error}"));
}

fn steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

fn mechanical(simulation: &mut Simulation) -> f64 {
    let energy = simulation.energy();
    energy.kinetic + energy.strain_bodies + energy.strain_joints
}

/// Pile of blocks whose outer faces are all viscous.
fn wrapped(axes: [[f64; 3]; 3]) -> Deck {
    let mut deck = with_axes(deck([3, 2, 2], [3.0, 2.0, 2.0], 2, 0.02), axes);
    deck.model.kinematics = Kinematics::Small;
    deck.boundary = vec![viscous(Where::default())];
    deck
}

fn velocities(count: usize) -> Vec<Vec3> {
    let mut random = Random::new(7);
    (0..count).map(|_| random.vector()).collect()
}

fn rows(values: impl Iterator<Item = Vec3>) -> Vec<[f64; 3]> {
    values.map(Vec3::into).collect()
}

#[test]
fn dashpots_are_independent_of_axes() {
    let turn = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let axes = BOX.map(|axis| (turn * Vec3::from(axis)).into());
    let results =
        [(wrapped(BOX), Rotation3::identity()), (wrapped(axes), turn)].map(|(deck, turn)| {
            let mut simulation = simulation(&deck);
            let v = velocities(simulation.model().n_nodes());
            simulation.set_velocities(&rows(v.into_iter().map(|v| turn * v)));
            start(&mut simulation, Damping::None, TimeStep::Seconds(2e-6));
            steps(&mut simulation, 300);
            let back = |v: [f64; 3]| turn.inverse() * Vec3::from(v);
            simulation.velocities().into_iter().map(back).collect::<Vec<_>>()
        });
    let size = results[0].iter().map(Vec3::norm).fold(0.0, f64::max);
    for (a, b) in results[0].iter().zip(&results[1]) {
        assert!((a - b).norm() < 1e-10 * size, "{a} {b}");
    }
}

/// Dashpots alone bring everything to rest, rigid motions included. Steps may be as long as the
/// critical step of the model without dashpots. The dashpots take all the energy that is lost.
#[test]
fn dashpots_absorb_all_energy_at_any_stable_step() {
    for (axes, split) in [(BOX, false), (OBLIQUE, false), (BOX, true)] {
        let mut wrapped = wrapped(axes);
        if split {
            // Dashpots act on both sides of nonconforming joints.
            let region = Where { x: Some(Extent::Range([0.0, 1.0])), ..Where::default() };
            wrapped.refine = vec![Refine { r#where: region, factor: 2 }];
        }
        let free = Deck { boundary: Vec::new(), ..wrapped.clone() };
        let critical = simulation(&free).critical_step().unwrap_or_else(|error| panic!("{error}"));
        let mut simulation = simulation(&wrapped);
        assert_eq!(simulation.critical_step(), Ok(critical));
        simulation.set_velocities(&rows(velocities(simulation.model().n_nodes()).into_iter()));
        start(&mut simulation, Damping::None, TimeStep::Seconds(0.999 * critical));
        let first = mechanical(&mut simulation);
        let mut last = f64::INFINITY;
        for _ in 0..20 {
            // The steps are half as long where blocks are split.
            steps(&mut simulation, if split { 80 } else { 40 });
            let now = mechanical(&mut simulation);
            assert!(now < last, "{now} after {last} J");
            last = now;
        }
        assert!(last < 1e-3 * first, "{last} of {first} J are left");
        let energy = simulation.energy();
        assert!(energy.balance.abs() < 1e-12 * first, "{energy:?}");
        assert_eq!(energy.external_work, 0.0);
    }
}

/// Rock under its weight on fixed faces that later become boundaries.
fn standing() -> Deck {
    let mut deck = with_axes(deck([3, 2, 3], [3.0, 2.0, 3.0], 2, 0.02), LEANING);
    deck.blocks[0].axes = BOX;
    deck.model.gravity = [0.5, 0.0, -9.81];
    let until = |fix: Fix| Fix { until: Some("shake".into()), ..fix };
    let from = |boundary: Boundary| Boundary { from: Some("shake".into()), ..boundary };
    deck.fix = vec![
        until(fix(plane(2, 0.0), "xyz")),
        until(fix(plane(0, 0.0), "x")),
        until(fix(plane(0, 3.0), "x")),
        fix(plane(1, 0.0), "y"),
    ];
    deck.boundary = vec![
        from(viscous(plane(2, 0.0))),
        from(free_field(plane(0, 0.0))),
        from(viscous(plane(0, 3.0))),
    ];
    let relax = Stage { tolerance: Some(1e-10), ..relax_stage("weight") };
    let kind = StageKind::Dynamic;
    let shake = Stage { kind, duration: Some(0.01), ..relax_stage("shake") };
    deck.stage = vec![relax, shake];
    deck
}

fn relaxed(deck: &Deck) -> Simulation {
    let mut simulation = simulation(deck);
    simulation.relax(1e-10, 50_000).unwrap_or_else(|error| panic!("{error}"));
    simulation
}

#[test]
fn support_reactions_continue_when_boundary_replaces_support() {
    let mut simulation = relaxed(&standing());
    let before = simulation.displacements();
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    start(&mut simulation, Damping::None, TimeStep::Auto);
    steps(&mut simulation, 500);
    let size = largest(&before);
    for (a, b) in simulation.displacements().iter().zip(&before) {
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-8 * size), "{a:?} {b:?}");
    }
    // Without the supports that carried it, the weight moves the model.
    let mut loose = standing();
    loose.stage[0] = Stage { name: "weight".into(), ..loose.stage[1].clone() };
    let mut simulation = crate::decks::simulation(&loose);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    start(&mut simulation, Damping::None, TimeStep::Auto);
    steps(&mut simulation, 500);
    assert!(largest(&simulation.displacements()) > size);
}

#[test]
fn boundary_gives_no_support_in_relaxation() {
    let mut deck = standing();
    deck.stage.push(relax_stage("rest"));
    let Err(error) = deck.build() else { panic!("accepted") };
    let text = error.to_string();
    assert!(text.contains("rigid body") && text.contains("holds nothing at rest"), "{text}");
}

/// Standing rock with a wave from below.
fn shaken() -> Deck {
    let mut deck = standing();
    deck.boundary[0].velocity = Some([0.1, 0.05, 0.02]);
    deck.boundary[0].history = Some(History::Table(vec![[0.0, 0.0], [4e-4, 1.0], [9e-4, -0.3]]));
    deck
}

/// Displacements, velocities and energies as bits.
fn state_bits(simulation: &mut Simulation) -> Vec<u64> {
    let mut state_bits = bits(&simulation.displacements());
    state_bits.extend(bits(&simulation.velocities()));
    state_bits.extend(simulation.energy().values().map(f64::to_bits));
    state_bits
}

#[test]
fn shaken_model_resumes_from_any_step() {
    let deck = shaken();
    let relaxed = relaxed(&deck).save();
    let reloaded = |saved: &ddem_core::Saved| {
        Simulation::restore(model(&deck), Simd::default(), saved)
            .unwrap_or_else(|error| panic!("{error}"))
    };
    for damping in [Damping::None, Damping::Ratio(0.02), Damping::Local(0.3)] {
        let mut whole = reloaded(&relaxed);
        whole.enter(1).unwrap_or_else(|error| panic!("{error}"));
        start(&mut whole, damping, TimeStep::Auto);
        let mut rebuilt = reloaded(&whole.save());
        for at in 0..60 {
            if at == 30 {
                // Includes a stage that begins in the middle of the wave.
                for simulation in [&mut whole, &mut rebuilt] {
                    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
                    start(simulation, damping, TimeStep::Auto);
                }
            }
            steps(&mut whole, 1);
            steps(&mut rebuilt, 1);
            rebuilt = reloaded(&rebuilt.save());
            assert!(rebuilt.save() == whole.save(), "{damping:?}, step {at}");
        }
        assert!(state_bits(&mut whole) == state_bits(&mut rebuilt), "{damping:?}");
        withstands_damage(&deck, &whole.save(), 50);
        let energy = whole.energy();
        // Finite rotations are accurate to the order of the time step.
        assert!(
            energy.balance.abs() < 1e-7 * energy.external_work.abs(),
            "{damping:?}: {energy:?}"
        );
    }
}

#[test]
fn boundary_bits_are_independent_of_threads_and_simd() {
    let mut deck = shaken();
    deck.blocks[0].count = Some([8, 3, 8]);
    deck.blocks[0].divisions = 3;
    let run = |simd: Simd, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap_or_else(|error| panic!("{error}")).install(|| {
            let mut simulation = Simulation::with_simd(model(&deck), simd);
            simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
            start(&mut simulation, Damping::Local(0.3), TimeStep::Auto);
            steps(&mut simulation, 60);
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

/// Largest velocity difference on one level, and largest velocity.
fn unevenness(simulation: &mut Simulation) -> [f64; 2] {
    let velocities = simulation.velocities();
    let mut levels: BTreeMap<u64, usize> = BTreeMap::new();
    let mut most = 0.0_f64;
    for (node, velocity) in velocities.iter().enumerate() {
        let level = simulation.model().point(node)[2].to_bits();
        let first = velocities[*levels.entry(level).or_insert(node)];
        most = most.max((Vec3::from(*velocity) - Vec3::from(first)).norm());
    }
    [most, largest(&velocities)]
}

/// Rock and joints that are uniform along each level move as one column, to rounding, for any wave.
#[test]
fn free_field_model_moves_as_one_column() {
    let name = |name: &str| Some(name.to_owned());
    for (count, level) in [([2, 3, 4], "seam"), ([1, 1, 4], "springs")] {
        let mut deck = deck(count, count.map(f64::from), 2, 0.02);
        deck.model.kinematics = Kinematics::Small;
        let rock = Joint { thickness: 0.02, material: name("rock"), ..Joint::default() };
        deck.joints.insert("rock".into(), rock);
        let springs = Joint {
            thickness: 0.02,
            normal_stiffness: Some(8e10),
            shear_stiffness: Some(3e10),
            ..Joint::default()
        };
        deck.joints.insert("springs".into(), springs);
        let [x, y, z] = [name("rock"), name("rock"), name(level)];
        deck.blocks[0].joint = Some(JointChoice::ByNormal { x, y, z });
        let rows = vec![[0.0, 0.0], [5e-4, 1.0], [2e-3, -0.4], [3e-3, 0.0]];
        let (velocity, history) = (Some([0.1, -0.07, 0.2]), Some(History::Table(rows)));
        let side = |axis: usize, at: f64| free_field(plane(axis, at));
        let [far_x, far_y] = [0, 1].map(|axis| side(axis, f64::from(count[axis])));
        let base = Boundary { velocity, history, ..viscous(plane(2, 0.0)) };
        deck.boundary = vec![base, side(0, 0.0), far_x, side(1, 0.0), far_y];
        // Stiffness damping acts on blocks but not on upright joints, so only the case without them
        // has it.
        let third = if level == "springs" { Damping::Stiffness(2e-5) } else { Damping::None };
        for damping in [Damping::None, Damping::Mass(100.0), third] {
            let mut simulation = simulation(&deck);
            start(&mut simulation, damping, TimeStep::Auto);
            // The wave is still in the model.
            steps(&mut simulation, 40);
            let [most, size] = unevenness(&mut simulation);
            assert!(most < 1e-11 * size, "{level}, {damping:?}: {most} of {size}");
        }
    }
}

#[test]
fn invalid_boundaries_are_refused() {
    let plain = deck([2, 2, 2], [2.0, 2.0, 2.0], 2, 0.02);
    let with = |boundary: Boundary| Deck { boundary: vec![boundary], ..plain.clone() };
    // Inside the model, at a joint, and where there is nothing.
    for at in [0.01 + 0.49, 0.99, 1.0] {
        refused(&with(viscous(plane(0, at))), &["boundary[0].where", "no outer face"]);
    }
    refused(&with(viscous(plane(0, 1.0))), &["without a neighbour"]);
    refused(&with(viscous(plane(0, 7.0))), &["selects nothing"]);
    let mut held = with(viscous(plane(0, 0.0)));
    held.fix = vec![fix(plane(1, 0.0), "xyz"), fix(plane(0, 0.0), "xyz")];
    refused(&held, &["boundary[0]", "by fix[1]", "in all directions", "until"]);
    // No warning for a fixed edge, but one for whole fixed faces.
    held.fix = vec![fix(plane(1, 0.0), "xyz")];
    let message = |deck: &Deck| {
        let warnings = crate::decks::warnings(deck);
        warnings.into_iter().find(|warning| warning.starts_with("boundary[0]"))
    };
    assert_eq!(message(&held), None);
    held.fix = vec![fix(Where { y: Some(Extent::Range([0.0, 0.99])), ..Where::default() }, "xyz")];
    let warning = message(&held).unwrap_or_default();
    assert!(warning.contains("18 of 36 nodes") && warning.contains("fix[0]"), "{warning}");
    let history = Some(History::Ramp(0.1));
    let lone = Boundary { history: history.clone(), ..viscous(plane(0, 0.0)) };
    refused(&with(lone), &["boundary[0].history", "needs `velocity`"]);
    let velocity = Some([1.0, 0.0, 0.0]);
    refused(
        &with(Boundary { velocity, ..free_field(plane(0, 0.0)) }),
        &["boundary[0].velocity", "free-field"],
    );
    refused(&with(free_field(plane(0, 0.0))), &["stands on nothing"]);
    refused(&with(free_field(plane(2, 0.0))), &["looks up or down"]);
    let mut oblique = with(free_field(Where::default()));
    oblique.blocks[0].axes = OBLIQUE;
    refused(&oblique, &["upright"]);
    let mut rigid = with(viscous(plane(0, 0.0)));
    rigid.blocks[0].body = Body::Rigid;
    refused(&rigid, &["rigid blocks"]);
    // Two boundaries on one face are refused unless they act at other times or on other parts of
    // it.
    let half = |from: f64, to: f64| Where { x: Some(Extent::Range([from, to])), ..plane(2, 0.0) };
    let mut two = with(viscous(half(0.0, 0.7)));
    two.boundary.push(viscous(half(0.7, 2.0)));
    model(&two);
    two.boundary[1] = viscous(half(0.6, 2.0));
    refused(&two, &["boundary[1].where", "that boundary 0 has", "(0.495, 0.495, 0)"]);
    two.boundary = vec![viscous(Where::default()), viscous(plane(2, 0.0))];
    refused(&two, &["boundary[1].where", "that boundary 0 has"]);
    let dynamic =
        |name: &str| Stage { kind: StageKind::Dynamic, duration: Some(1e-3), ..relax_stage(name) };
    two.stage = vec![dynamic("a"), dynamic("b")];
    two.boundary[0].until = Some("b".into());
    two.boundary[1].from = Some("b".into());
    model(&two);
    let mut hollow = Deck { boundary: vec![viscous(Where::default())], ..plain.clone() };
    let corner = Sphere { centre: [0.5; 3], radius: 0.1 };
    let region = Where { sphere: Some(corner), ..Where::default() };
    hollow.remove = vec![Remove { r#where: region, ..Remove::default() }];
    let warnings = crate::decks::warnings(&hollow);
    let walls = "boundary[0].where: it acts on 3 faces in cavities";
    assert!(warnings.iter().any(|w| w.starts_with(walls)), "{warnings:?}");
    let lower = Where { z: Some(Extent::Range([0.0, 1.0])), ..Where::default() };
    let mut split = with(free_field(plane(0, 0.0)));
    split.boundary.push(viscous(plane(2, 0.0)));
    split.fix = vec![fix(Where::default(), "y")];
    model(&split);
    split.refine = vec![Refine { r#where: lower, factor: 2 }];
    refused(&split, &["boundary[0].where", "blocks are split"]);
    let endless = Boundary { velocity: Some([f64::NAN; 3]), ..viscous(plane(0, 0.0)) };
    refused(&with(endless), &["boundary[0].velocity", "finite"]);
}

#[test]
fn computed_wave_equals_its_table() {
    let rows = vec![[0.0, 0.0], [4e-4, 1.0], [9e-4, -0.3]];
    let run = |model: Model| {
        let mut simulation = Simulation::new(model);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        start(&mut simulation, Damping::None, TimeStep::Auto);
        steps(&mut simulation, 100);
        bits(&simulation.displacements())
    };
    let mut computed = Deck { ..shaken() };
    computed.boundary[0].history = None;
    let mut computed = model(&computed);
    let table = History::Table(rows);
    let function: Arc<ddem_core::Function> = Arc::new(move |time| Ok(table.factor(time)));
    computed.set_boundary_history(0, function.clone()).unwrap_or_else(|fault| panic!("{fault}"));
    assert!(computed.set_boundary_history(1, function.clone()).is_err());
    assert!(computed.set_boundary_history(9, function).is_err());
    assert!(run(computed) == run(model(&shaken())));
}
