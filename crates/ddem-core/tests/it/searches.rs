//! Searches for the factor of safety by programs: with their laws and histories, stopped and continued.

use std::ops::ControlFlow::{Break, Continue};
use std::sync::{Arc, Mutex};

use ddem_core::{Function, RunError, Safety, SearchNews, Simulation};
use ddem_deck::*;

use crate::decks::*;
use crate::programs::DryFriction;

/// Deck of a slab on a fixed one.
fn slabs() -> Deck {
    let mut deck = deck([1, 1, 2], [2.0, 2.0, 1.0], 1, 0.01);
    let held = Where { z: Some(Extent::Range([0.0, 0.499])), ..Where::default() };
    deck.fix = vec![fix(held, "xyz")];
    deck
}

/// Slabs in equilibrium; their joint has friction of 35°.
fn relaxed(deck: &Deck, function: Option<Arc<Function>>) -> Simulation {
    let mut model = model(deck);
    let set = model.set_law("seam", Arc::new(DryFriction(35_f64.to_radians().tan())));
    set.unwrap_or_else(|fault| panic!("{fault}"));
    if let Some(function) = function {
        model.set_load_history(0, function).unwrap_or_else(|fault| panic!("{fault}"));
    }
    let mut simulation = Simulation::new(model);
    simulation.relax(1e-6, 20_000).unwrap_or_else(|error| panic!("{error}"));
    simulation
}

fn safety(deck: &Deck, function: Option<Arc<Function>>) -> f64 {
    let found = relaxed(deck, function).factor_of_safety(&SafetySearch::default(), &|_| {});
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    found.factor.unwrap_or_else(|| panic!("not in the bracket: {:?}", found.trials))
}

#[test]
fn factor_of_safety_uses_program_laws_and_histories() {
    let mut deck = slabs();
    let (sine, cosine) = 25_f64.to_radians().sin_cos();
    deck.model.gravity = [9.81 * sine, 0.0, -9.81 * cosine];
    let exact = 35_f64.to_radians().tan() / 25_f64.to_radians().tan();
    let found = safety(&deck, None);
    assert!((found / exact - 1.0).abs() < 5e-3, "{found}, not {exact}");

    let pushed = |traction: f64, function: Option<Arc<Function>>| {
        let mut deck = deck.clone();
        deck.model.gravity = [0.0, 0.0, -9.81];
        let traction = Some([traction, 0.0, 0.0]);
        deck.load = vec![Load { r#where: plane(2, 1.0), traction, ..Load::default() }];
        safety(&deck, function)
    };
    let half: Arc<Function> = Arc::new(|_| Ok(0.5));
    assert_eq!(pushed(8e3, Some(half)).to_bits(), pushed(4e3, None).to_bits());
}

/// A search that was stopped after any number of trials ends with the bits of one that was not, also in the final state
/// of its failing trial.
#[test]
fn stopped_search_continues_with_its_trials() {
    let mut deck = slabs();
    let (sine, cosine) = 25_f64.to_radians().sin_cos();
    deck.model.gravity = [9.81 * sine, 0.0, -9.81 * cosine];
    let simulation = relaxed(&deck, None);
    // The exact factor is 1.50.
    for (bracket, trials) in [([0.5, 4.0], 10), ([1.02, 2.0], 9), ([0.5, 1.2], 5), ([1.6, 2.0], 1)]
    {
        continues(
            &simulation,
            &SafetySearch { bracket, resolution: 0.2, ..SafetySearch::default() },
            trials,
        );
    }
    let stopped = simulation.continue_search(&SafetySearch::default(), &[], &|_| Break(()));
    assert!(matches!(stopped, Err(RunError::Stopped)));
}

fn continues(simulation: &Simulation, search: &SafetySearch, trials: usize) {
    let told = Mutex::new(Vec::new());
    let whole = simulation.continue_search(search, &[], &|news| {
        if let SearchNews::Trial(trial) = news {
            told.lock().unwrap().push(*trial);
        }
        Continue(())
    });
    let (whole, told) = (whole.unwrap(), told.into_inner().unwrap());
    assert_eq!(told.len(), trials, "{told:?}");
    let failing = |safety: &Safety| safety.failing.as_ref().map(|failing| failing.save());
    for known in 0..=told.len() {
        let again = Mutex::new(0);
        let rest = simulation.continue_search(search, &told[..known], &|news| {
            *again.lock().unwrap() += usize::from(matches!(news, SearchNews::Trial(_)));
            Continue(())
        });
        let rest = rest.unwrap();
        assert_eq!(again.into_inner().unwrap(), told.len() - known);
        assert_eq!((rest.factor, rest.bracket), (whole.factor, whole.bracket));
        assert_eq!((&rest.trials, failing(&rest)), (&whole.trials, failing(&whole)));
    }
}
