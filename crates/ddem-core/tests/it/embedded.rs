//! Queries of Rust programs, and the errors for wrong numbers or names.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use ddem_core::{Function, Model, RunError, Simulation};
use ddem_deck::*;

use crate::decks::*;

/// Two blocks on top of each other with two elements along each edge: 54 nodes.
pub(crate) fn pile() -> Deck {
    let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 2, 0.01);
    deck.model.gravity = [0.0, 0.0, -10.0];
    deck.blocks[0].name = Some("pile".into());
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck
}

/// Message of a panic.
pub(crate) fn panic_message<T>(does: impl FnOnce() -> T) -> String {
    let panic = catch_unwind(AssertUnwindSafe(does)).err().expect("a panic");
    let text = panic.downcast_ref::<String>().cloned();
    text.unwrap_or_else(|| (*panic.downcast_ref::<&str>().expect("words")).to_owned())
}

/// Message of an error about values that a program gave.
fn refusal<T>(done: Result<T, RunError>) -> String {
    let Err(error @ RunError::Values { .. }) = done else { panic!("not refused as values") };
    error.to_string()
}

#[test]
fn reaction_ignores_order_and_repetition_of_nodes() {
    let mut simulation = Simulation::new(model(&pile()));
    simulation.relax(1e-9, 20_000).unwrap_or_else(|error| panic!("{error}"));
    let nodes = plane(2, 0.0).nodes(simulation.model()).expect("a floor");
    let model = simulation.model();
    let weight: f64 = (0..model.n_nodes()).map(|node| 10.0 * model.mass(node)).sum();
    let sum = simulation.reaction(&nodes);
    assert!((sum[2] - weight).abs() < 1e-6 * weight, "{sum:?}, not {weight}");

    let back: Vec<u32> = nodes.iter().rev().copied().collect();
    let doubled: Vec<u32> = back.iter().chain(&nodes).copied().collect();
    assert_eq!(simulation.reaction(&back), sum);
    assert_eq!(simulation.reaction(&doubled), sum);
    let parts = nodes.iter().map(|&node| simulation.reaction(&[node])[2]).sum::<f64>();
    assert!((parts - sum[2]).abs() < 1e-9 * weight);
    assert_eq!(simulation.reaction(&[]), [0.0; 3]);
}

#[test]
fn unknown_set_in_node_selection_is_refused() {
    let model = model(&pile());
    let set = |name: &str| Where { set: Some(name.into()), ..Where::default() };
    let refused = |region: &Where| region.nodes(&model).expect_err("a fault").to_string();
    assert_eq!(
        refused(&set("pyle")),
        "where.set: there is no set named `pyle` (did you mean `pile`? sets of this model: `pile`) \
         [unknown-name]"
    );
    let unread = FileOf { path: "ore.stl".into(), ..FileOf::default() };
    let inside = Where { inside: Some(unread), ..Where::default() };
    assert!(refused(&inside).contains("the file `ore.stl` has not been read"));
    let away = Where { x: Some(Extent::Plane(f64::NAN)), ..Where::default() };
    assert!(refused(&away).starts_with("where.x: `x` is NaN"), "{}", refused(&away));
    // An empty selection is no error.
    assert!(plane(2, 7.0).nodes(&model).expect("none").is_empty());
    assert_eq!(set("pile").nodes(&model).expect("all").len(), 54);
}

#[test]
fn topography_must_cover_selected_nodes() {
    let model = model(&pile());
    let above = |to: f64, x: Option<Extent>| {
        let heights = Heights { x: vec![0.0, to], y: vec![0.0, 1.0], z: vec![1.2; 4], rim: 0.0 };
        let topography = FileOf {
            path: "ground.csv".into(),
            content: Some(std::sync::Arc::new(heights.into())),
        };
        (Where { x, above: Some(Sheet::Topography { topography }), ..Where::default() })
            .nodes(&model)
    };
    // Two of three levels of the upper block are above 1.2 m.
    assert_eq!(above(1.0, None).expect("covered").len(), 18);
    let fault = above(0.6, None).expect_err("not covered");
    assert_eq!(fault.place, "where.above.topography");
    assert!(fault.message.contains("does not cover the model"), "{fault}");
    assert_eq!(above(0.6, Some(Extent::Range([0.0, 0.5]))).expect("covered").len(), 12);
}

#[test]
fn node_and_block_numbers_out_of_range_panic() {
    let model = model(&pile());
    let no_node = "there is no node 9999: the model has 54 nodes, from 0";
    let no_block = "there is no block 2: the model has 2 blocks, from 0";
    assert_eq!(panic_message(|| model.point(9999)), no_node);
    assert_eq!(panic_message(|| model.block_of(9999)), no_node);
    assert_eq!(panic_message(|| model.mass(9999)), no_node);
    assert_eq!(panic_message(|| model.stiffness_diagonal(9999)), no_node);
    assert_eq!(panic_message(|| model.elements_at(&[0, 9999])), no_node);
    assert_eq!(panic_message(|| model.hexes(2).count()), no_block);
    assert_eq!(panic_message(|| model.is_rigid(2)), no_block);
    assert_eq!(panic_message(|| model.is_removed(2)), no_block);
    assert_eq!(panic_message(|| model.removed_in(2)), no_block);
    assert_eq!(panic_message(|| model.material(2)), no_block);
    assert_eq!(panic_message(|| model.volume(2)), no_block);
    assert!(
        panic_message(|| model.nearest_node([f64::NAN; 3]))
            .starts_with("no node is nearest to [NaN")
    );
    assert!(
        panic_message(|| model.element_at([0.0, f64::INFINITY, 0.0]))
            .starts_with("no element is at")
    );

    let mut simulation = Simulation::new(model);
    assert_eq!(panic_message(|| simulation.displacement(9999)), no_node);
    assert_eq!(panic_message(|| simulation.velocity(9999)), no_node);
    assert_eq!(panic_message(|| simulation.reaction(&[9999, 0])), no_node);
    assert_eq!(panic_message(|| simulation.stress(2, [0; 3])), no_block);
    for at in [[2, 0, 0], [0, 2, 0], [0, 0, 2]] {
        let words = format!("block 0 has no element at {at:?}: it has 2 along each edge, from 0");
        assert_eq!(panic_message(|| simulation.stress(0, at)), words);
    }
    assert_eq!(
        panic_message(|| simulation.enter(99)),
        "there is no stage 99: the model has 1, from 0"
    );
}

/// A refused call changes nothing.
#[test]
fn forces_and_fields_of_wrong_length_are_refused() {
    let mut simulation = Simulation::new(model(&pile()));
    let before = simulation.save();
    let none = [0.0; 3];
    assert!(
        panic_message(|| simulation.apply_force(&[9999], &[none]))
            .starts_with("there is no node 9999")
    );
    let words = panic_message(|| simulation.apply_force(&[0, 1, 2], &[none]));
    assert_eq!(
        words,
        "the numbers of forces (1) and of nodes (3) differ: give one force for each node"
    );
    let words = panic_message(|| simulation.set_displacements(&[none; 3]));
    assert_eq!(
        words,
        "the numbers of displacements (3) and of nodes of the model (54) differ: give one for each node"
    );
    let words = panic_message(|| simulation.set_velocities(&[none; 55]));
    assert_eq!(
        words,
        "the numbers of velocities (55) and of nodes of the model (54) differ: give one for each node"
    );
    assert_eq!(simulation.save(), before);
    simulation.step().unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn values_outside_deck_rules_are_refused() {
    let mut simulation = Simulation::new(model(&pile()));
    let before = simulation.save();
    let mut start = |damping, step, duration| refusal(simulation.start(damping, step, duration));
    for step in [f64::NAN, -1e-6, 0.0, f64::INFINITY] {
        let words = start(Damping::None, TimeStep::Seconds(step), None);
        assert!(words.starts_with("time_step: `time_step` is "), "{words}");
    }
    for duration in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
        let words = start(Damping::None, TimeStep::Auto, Some(duration));
        assert!(words.starts_with("duration: `duration` is "), "{words}");
    }
    for damping in [Damping::Ratio(-1.0), Damping::Ratio(f64::NAN), Damping::Local(1.0)] {
        let words = start(damping, TimeStep::Auto, None);
        assert!(words.starts_with("damping."), "{words}");
    }
    for tolerance in [f64::NAN, 0.0, -1.0, 1.0] {
        for refused in [
            simulation.relax(tolerance, 10).map(|_| ()),
            simulation.relax_step(tolerance).map(|_| ()),
        ] {
            assert!(refusal(refused).starts_with("tolerance: `tolerance` is "));
        }
    }
    assert_eq!(simulation.save(), before);
}

#[test]
fn invalid_safety_searches_are_refused() {
    let mut deck = pile();
    let section = deck.joints.get_mut("seam").expect("a joint");
    (section.friction, section.cohesion) = (Some(30.0), Some(1e5));
    let simulation = Simulation::new(model(&deck));
    let nan = f64::NAN;
    for (key, search) in [
        ("tolerance", SafetySearch { tolerance: nan, ..SafetySearch::default() }),
        ("limit", SafetySearch { limit: nan, ..SafetySearch::default() }),
        ("resolution", SafetySearch { resolution: nan, ..SafetySearch::default() }),
        ("bracket", SafetySearch { bracket: [nan, 2.0], ..SafetySearch::default() }),
        ("max_steps", SafetySearch { max_steps: 0, ..SafetySearch::default() }),
        ("joints", SafetySearch { joints: Some(Vec::new()), ..SafetySearch::default() }),
    ] {
        let words = refusal(simulation.factor_of_safety(&search, &|_| {}));
        assert!(words.starts_with(key), "{words}");
    }
}

#[test]
fn safety_search_after_divergence_is_refused() {
    let mut deck = pile();
    let section = deck.joints.get_mut("seam").expect("a joint");
    (section.friction, section.cohesion) = (Some(30.0), Some(1e5));
    let mut simulation = Simulation::new(model(&deck));
    simulation.apply_force(&[53], &[[1e308; 3]]);
    let error = loop {
        if let Err(error) = simulation.step() {
            break error;
        }
    };
    assert!(matches!(error, RunError::Diverged { .. }), "{error}");
    let error =
        simulation.factor_of_safety(&SafetySearch::default(), &|_| {}).expect_err("no state");
    assert!(matches!(error, RunError::Diverged { .. }), "{error}");
}

#[test]
fn collapse_without_motion_names_no_block() {
    let words = Simulation::new(model(&pile())).no_equilibrium().to_string();
    assert_eq!(words, "there is no equilibrium: no block has moved so far [no-equilibrium]");
}

/// The same rule applies to a boundary without a wave.
#[test]
fn history_of_support_without_velocity_is_refused() {
    let mut deck = pile();
    let driven = Some([0.0, 0.0, -0.01]);
    deck.fix.push(Fix { velocity: driven, ..fix(plane(2, 2.0), "z") });
    let mut model: Model = model(&deck);
    let function: Arc<Function> = Arc::new(|_| Ok(1.0));
    let fault = model.set_fix_history(0, function.clone()).expect_err("a fault");
    assert_eq!(
        (fault.place.as_str(), fault.message.as_str()),
        ("fix[0].history", "`history` needs `velocity`")
    );
    assert!(model.set_fix_history(1, function.clone()).is_ok());
    assert!(model.set_fix_history(2, function).is_err());
    assert_eq!(model.computed(), ["fix[1].history"]);
}
