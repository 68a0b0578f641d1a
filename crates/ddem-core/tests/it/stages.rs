//! Stages that programs enter, and supports that end where blocks are removed.

use ddem_core::{Model, Relaxed, RunError, Simd, Simulation};
use ddem_deck::*;

use crate::damage::withstands_damage;
use crate::decks::*;

const STRESS: [f64; 6] = [-3e6, -3e6, -8e6, 0.0, 0.0, 0.0];

fn layer(from: f64, to: f64) -> Where {
    Where { z: Some(Extent::Range([from, to])), ..Where::default() }
}

fn dynamic(name: &str) -> Stage {
    Stage { kind: StageKind::Dynamic, duration: Some(0.05), ..relax_stage(name) }
}

fn remove(region: Where, from: &str, release: Option<f64>) -> Remove {
    Remove { r#where: region, from: Some(from.into()), release, ..Remove::default() }
}

/// Column of four blocks under stress with these stages, fixed all around.
fn column(stages: Vec<Stage>) -> Deck {
    let mut deck = deck([1, 1, 4], [1.0, 1.0, 4.0], 2, 0.02);
    if let Some(section) = deck.joints.get_mut("seam") {
        section.material = Some("rock".into());
    }
    deck.initial.push(Initial { stress: Some(STRESS), ..Initial::default() });
    deck.fix = vec![fix(plane(2, 0.0), "xyz"), fix(plane(2, 4.0), "z")];
    deck.fix.extend([0.0, 1.0].map(|at| fix(plane(0, at), "xyz")));
    deck.fix.extend([0.0, 1.0].map(|at| fix(plane(1, at), "y")));
    deck.stage = stages;
    deck
}

fn relax(simulation: &mut Simulation) {
    simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..20_000 {
        let relaxed = simulation.relax_step(1e-10).unwrap_or_else(|error| panic!("{error}"));
        if relaxed == Relaxed::Done {
            return simulation.finish_relaxation();
        }
    }
    panic!("no equilibrium");
}

fn step(simulation: &mut Simulation, steps: usize) {
    for _ in 0..steps {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

fn begin(simulation: &mut Simulation, time_step: TimeStep, duration: Option<f64>) {
    let begun = simulation.start(Damping::None, time_step, duration);
    begun.unwrap_or_else(|error| panic!("{error}"));
}

/// State after the upper half has been removed; boundaries replace the supports of the sides at
/// that stage.
fn handed_over(release: Option<f64>) -> Simulation {
    let mut deck = column(vec![relax_stage("before"), relax_stage("dig")]);
    for at in [0.0, 1.0] {
        deck.boundary.push(Boundary {
            r#where: plane(0, at),
            kind: BoundaryKind::Viscous,
            velocity: None,
            history: None,
            from: Some("dig".into()),
            until: None,
        });
    }
    deck.fix[2].until = Some("dig".into());
    deck.fix[3].until = Some("dig".into());
    deck.remove.push(remove(layer(2.0, 4.0), "dig", release));
    let mut simulation = simulation(&deck);
    relax(&mut simulation);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    simulation
}

/// Share of a node in a length of 1 m with two elements.
fn share(x: f64) -> f64 {
    if x == 0.5 { 0.5 } else { 0.25 }
}

/// Forces of a support continue when a boundary replaces it, but forces of blocks removed in the
/// same stage do not. At the rim σ⁰ n of the joint above and of half of its sides is missing.
#[test]
fn excavation_reduces_locked_reactions() {
    let mut simulation = handed_over(None);
    let forces = simulation.forces();
    for (node, found) in forces.into_iter().enumerate().take(27 * 2) {
        let [x, y, z] = simulation.model().point(node);
        let mut exact = [0.0; 3];
        if (z - 1.99).abs() < 1e-9 {
            exact[2] = 8e6 * share(x) * share(y);
            exact[0] = match x {
                0.5 => 0.0,
                x => 3e6 * 0.01 * share(y) * if x < 0.5 { 1.0 } else { -1.0 },
            };
        }
        for c in 0..3 {
            assert!((found[c] - exact[c]).abs() < 1.0, "({x}, {y}, {z}): {found:?} {exact:?}");
        }
    }
}

/// With a release nothing moves at first, at the sides and inside; the end state is the same.
#[test]
fn release_beside_boundary_ends_in_same_state() {
    let mut released = handed_over(Some(1.0));
    assert!(largest(&released.forces()[..54]) < 1.0, "{:?}", &released.forces()[..54]);
    let mut at_once = handed_over(None);
    relax(&mut released);
    relax(&mut at_once);
    let (a, b) = (released.displacements(), at_once.displacements());
    let size = largest(&b);
    assert!(size > 1e-4, "{size}");
    for (a, b) in a.as_flattened().iter().zip(b.as_flattened()) {
        assert!((a - b).abs() < 1e-6 * size, "{a} {b}");
    }
}

/// Column whose upper half is removed in a dynamic stage, between stages without an excavation.
fn excavated(release: Option<f64>) -> Deck {
    let stages = vec![relax_stage("before"), dynamic("dig"), relax_stage("rest"), dynamic("on")];
    let mut deck = column(stages);
    deck.fix[2..4].iter_mut().for_each(|fix| fix.axes = "x".into());
    deck.remove.push(remove(layer(2.0, 4.0), "dig", release));
    deck
}

/// Stages are entered forwards only: an earlier one is refused and changes nothing. A saved state
/// goes back.
#[test]
fn stages_are_entered_forwards_only() {
    let deck = excavated(Some(0.001));
    let mut simulation = simulation(&deck);
    relax(&mut simulation);
    let before = simulation.save();
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    begin(&mut simulation, TimeStep::Auto, None);
    step(&mut simulation, 30);
    let error = simulation.enter(0);
    assert!(matches!(error, Err(RunError::EarlierStage { stage: 0, present: 1 })), "{error:?}");
    assert_eq!(simulation.stage(), 1);
    assert!(simulation.model().is_removed(3) && !simulation.model().is_removed(1));
    let saved = simulation.save();
    let again = Simulation::restore(model(&deck), Simd::default(), &saved);
    let mut again = again.unwrap_or_else(|error| panic!("{error}"));
    assert!(again.model().is_removed(3) && !again.model().is_removed(1));
    for simulation in [&mut simulation, &mut again] {
        step(simulation, 30);
        simulation.enter(3).unwrap_or_else(|error| panic!("{error}"));
        step(simulation, 30);
    }
    assert!(largest(&simulation.displacements()) > 1e-5);
    assert_eq!(bits(&simulation.displacements()), bits(&again.displacements()));
    assert_eq!(bits(&simulation.forces()), bits(&again.forces()));
    let energies = [&mut simulation, &mut again].map(|s| s.energy().values().map(f64::to_bits));
    assert_eq!(energies[0], energies[1]);
    let back = Simulation::restore(model(&deck), Simd::default(), &before);
    let back = back.unwrap_or_else(|error| panic!("{error}"));
    assert!(back.stage() == 0 && !back.model().is_removed(3));
    withstands_damage(&deck, &again.save(), 300);
}

/// A release continues when a dynamic stage is entered, until a relaxation completes it.
#[test]
fn release_continues_in_next_dynamic_stage() {
    let mut simulation = simulation(&excavated(Some(0.002)));
    relax(&mut simulation);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    begin(&mut simulation, TimeStep::Auto, None);
    while simulation.time() < 0.001 {
        step(&mut simulation, 1);
    }
    simulation.synchronise();
    let forces = simulation.forces();
    let left = 8e6 * (1.0 - simulation.time() / 0.002) / 4.0;
    // The remaining stress is not small.
    assert!(left > 0.9e6, "{left}");
    for stage in [1, 1] {
        simulation.enter(stage).unwrap_or_else(|error| panic!("{error}"));
        assert!(bits(&simulation.forces()) == bits(&forces), "{stage}");
    }
    simulation.enter(2).unwrap_or_else(|error| panic!("{error}"));
    relax(&mut simulation);
    assert!(simulation.enter(1).is_err());
    for stage in [2, 3] {
        simulation.enter(stage).unwrap_or_else(|error| panic!("{error}"));
        simulation.forces();
        assert!(simulation.unbalanced() < 1e-8, "{stage}: {}", simulation.unbalanced());
    }
}

/// Two excavations entered at once: each fades its own forces, or does not fade them.
#[test]
fn skipped_stages_release_their_own_forces() {
    let mut deck = column(vec![relax_stage("before"), dynamic("top"), dynamic("bottom")]);
    deck.fix[2..4].iter_mut().for_each(|fix| fix.axes = "x".into());
    deck.remove =
        vec![remove(layer(3.0, 4.0), "top", None), remove(layer(0.0, 1.0), "bottom", Some(1.0))];
    let mut both = simulation(&deck);
    relax(&mut both);
    let mut one_by_one = Simulation::restore(model(&deck), Simd::default(), &both.save());
    let one_by_one = one_by_one.as_mut().unwrap_or_else(|error| panic!("{error}"));
    both.enter(2).unwrap_or_else(|error| panic!("{error}"));
    one_by_one.enter(1).unwrap_or_else(|error| panic!("{error}"));
    one_by_one.enter(2).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(bits(&both.forces()), bits(&one_by_one.forces()));
    let again = Simulation::restore(model(&deck), Simd::default(), &both.save());
    let mut again = again.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(bits(&both.forces()), bits(&again.forces()));
    let forces = both.forces();
    for (node, found) in forces.into_iter().enumerate().take(27 * 3).skip(27) {
        let [x, y, z] = both.model().point(node);
        let exact = if (z - 2.99).abs() < 1e-9 { 8e6 * share(x) * share(y) } else { 0.0 };
        assert!((found[2] - exact).abs() < 1.0, "({x}, {y}, {z}): {found:?}");
    }
}

/// A given time step and duration stay in force.
#[test]
fn excavation_keeps_time_step_and_duration() {
    let mut simulation = simulation(&excavated(None));
    begin(&mut simulation, TimeStep::Seconds(1e-6), Some(5e-5));
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(simulation.time_step(), 1e-6);
    step(&mut simulation, 10);
    assert_eq!((simulation.time_step(), simulation.steps_left()), (1e-6, Some(40)));
    assert!((simulation.time() / 1e-5 - 1.0).abs() < 1e-12);
}

/// The remaining model can be too stiff for the step: heavy joints had made the step long.
#[test]
fn unstable_step_after_excavation_is_refused_or_shortened() {
    let mut deck = deck([1, 1, 3], [1.0, 1.0, 3.0], 1, 0.02);
    let soft = Material { density: 2400.0, young: 18e4, poisson: 0.25 };
    deck.materials.insert("soft".into(), soft);
    deck.materials.insert("clay".into(), Material { density: 1e6, young: 3e3, poisson: 0.3 });
    for z in [[0.0, 1.0], [2.0, 3.0]] {
        let (region, material) = (layer(z[0], z[1]), Some("soft".to_owned()));
        deck.assign.push(Assign { r#where: region.clone(), material, ..Assign::default() });
        deck.remove.push(remove(region, "dig", None));
    }
    deck.stage = vec![dynamic("before"), dynamic("dig")];
    let critical = simulation(&deck).critical_step().unwrap_or(f64::NAN);
    let dig = |time_step: TimeStep| {
        let mut simulation = simulation(&deck);
        begin(&mut simulation, time_step, None);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        simulation
    };
    let mut given = dig(TimeStep::Seconds(critical));
    for _ in 0..2 {
        let Err(RunError::UnstableTimeStep { time_step, critical: now }) = given.step() else {
            panic!("a step of {critical} s is taken")
        };
        assert!(time_step == critical && now < 0.5 * critical, "{time_step} {now}");
    }
    let mut automatic = dig(TimeStep::Auto);
    step(&mut automatic, 1);
    let now = automatic.critical_step().unwrap_or(f64::NAN);
    assert!((automatic.time_step() / (0.9 * now) - 1.0).abs() < 1e-12);
}

/// A part of a model has no larger eigenvalue than the model. That of the part converges to rounding,
/// and the large model adds a margin to its own.
#[test]
fn critical_step_of_large_model_is_safe_and_close() {
    let critical = |count: [u32; 3]| {
        let deck = deck(count, count.map(f64::from), 1, 0.02);
        let mut simulation = simulation(&deck);
        let nodes = simulation.model().n_nodes();
        (nodes, simulation.critical_step().unwrap_or_else(|error| panic!("{error}")))
    };
    let ((part, longer), (large, shorter)) = (critical([12; 3]), critical([20, 20, 16]));
    assert!(part < 50_000 && large >= 50_000, "{part} {large}");
    println!("{part} nodes: {longer:e} s, {large} nodes: {shorter:e} s");
    assert!(shorter <= longer && shorter > 0.995 * longer, "{shorter:e} {longer:e}");
}

/// Nodes of removed blocks stay at rest for any values that are set.
#[test]
fn removed_blocks_stay_at_rest_when_fields_are_set() {
    let (mut a, mut b) = (simulation(&excavated(None)), simulation(&excavated(None)));
    let n = a.model().n_nodes();
    let mut random = Random::new(3);
    let field: Vec<[f64; 3]> = (0..n).map(|_| (random.vector() * 1e-4).into()).collect();
    let mut cut = field.clone();
    cut[n / 2..].fill([0.0; 3]);
    for (simulation, field) in [(&mut a, &field), (&mut b, &cut)] {
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        simulation.set_displacements(field);
        simulation.set_velocities(field);
    }
    assert_eq!(bits(&a.displacements()), bits(&cut));
    assert_eq!(bits(&a.velocities()), bits(&cut));
    let energies = [&mut a, &mut b].map(|s| s.energy().values().map(f64::to_bits));
    assert_eq!(energies[0], energies[1]);
    a.forces();
    b.forces();
    assert_eq!(a.unbalanced().to_bits(), b.unbalanced().to_bits());
}

/// Velocities that are set after a relaxation are those of the next motion, also if they are set block by
/// block.
#[test]
fn velocities_after_a_relaxation_can_be_read_and_set_in_parts() {
    let mut simulation = simulation(&excavated(None));
    simulation.relax(1e-5, 10_000).unwrap_or_else(|error| panic!("{error}"));
    let n = simulation.model().n_nodes();
    let mut wanted = vec![[0.0; 3]; n];
    for part in [0..n / 2, n / 2..n] {
        let mut velocities = simulation.velocities();
        velocities[part.clone()].fill([1e-3, 0.0, -2e-3]);
        wanted[part].fill([1e-3, 0.0, -2e-3]);
        simulation.set_velocities(&velocities);
        assert_eq!(bits(&simulation.velocities()), bits(&wanted));
    }
    let mass: f64 = (0..n).map(|node| simulation.model().mass(node)).sum();
    let (kinetic, exact) = (simulation.energy().kinetic, 0.5 * mass * 5e-6);
    assert!((kinetic / exact - 1.0).abs() < 1e-12, "{kinetic} {exact}");
}

/// The loads of a release are not loads of the deck.
#[test]
fn release_takes_no_program_history() {
    let mut model: Model = model(&excavated(Some(1.0)));
    let fault = model.set_load_history(0, std::sync::Arc::new(|_| Ok(1.0)));
    let fault = fault.err().unwrap_or_else(|| panic!("set"));
    assert!(fault.to_string().contains("there is no such entry"), "{fault}");
    assert!(model.computed().is_empty());
}

/// The nearest node or element is one that remains, if several are equally near: lower and upper
/// face of a joint without thickness.
#[test]
fn nearest_search_prefers_remaining_blocks() {
    let mut deck = excavated(None);
    let joint =
        Joint { normal_stiffness: Some(1e9), shear_stiffness: Some(1e9), ..Joint::default() };
    deck.joints.insert("seam".into(), joint);
    let at = [0.5, 0.5, 2.0];
    let found = |remove: [(f64, &str); 2]| {
        let mut deck = deck.clone();
        let entry = |(from, stage): (f64, &str)| self::remove(layer(from, from + 1.0), stage, None);
        deck.remove = remove.map(entry).into();
        let model = model(&deck);
        [model.block_of(model.nearest_node(at)), model.element_at(at).0]
    };
    // Of two that are removed the later one, otherwise the lower one.
    assert_eq!(found([(2.0, "dig"), (3.0, "dig")]), [1, 1]);
    assert_eq!(found([(0.0, "dig"), (1.0, "dig")]), [2, 2]);
    assert_eq!(found([(1.0, "dig"), (2.0, "on")]), [2, 2]);
    assert_eq!(found([(2.0, "dig"), (1.0, "on")]), [1, 1]);
    assert_eq!(found([(0.0, "dig"), (3.0, "on")]), [1, 1]);
    let model = model(&excavated(None));
    assert_eq!([0, 1, 2, 3].map(|block| model.removed_in(block)), [None, None, Some(1), Some(1)]);
}
