//! Tests of the warnings of a run, from numbers that a run may give.

use ddem_core::{Energy, Profile, Safety, SafetySearch, SafetyTrial, Verdict};
use ddem_deck::{Deck, Stage, StageKind};

use super::safety::warnings;
use super::warnings::energy_imbalance;

const CUBE: &str = "
    [materials.rock]
    density = 2400
    young = 18e9
    poisson = 0.25
    [[blocks]]
    size = [1, 1, 1]
    material = 'rock'
    ";

fn deck() -> Deck {
    ddem_deck::parse_alone(CUBE, "cube.toml").unwrap().0
}

#[test]
fn energy_loss_warns() {
    let energy = |balance: f64, contact: f64| Energy {
        balance,
        contact,
        largest: 100.0,
        ..Energy::default()
    };
    let stage = Stage { name: "fall".into(), kind: StageKind::Dynamic, ..Stage::default() };
    let warning = |energy: Energy| energy_imbalance(&energy, 0.0, &stage, &deck());
    assert_eq!(warning(energy(0.9, 0.0)), None);
    let found = [energy(2.0, 0.0), energy(-2.0, 3.0), energy(-2.0, 0.0)].map(warning);
    let found: Vec<String> = found.into_iter().flatten().map(|w| w.to_string()).collect();
    insta::assert_snapshot!(found.join("\n"));
}

/// Warnings about results of searches in the present state of a simulation.
fn of_searches(simulation: &mut ddem_core::Simulation, found: Vec<Safety>) -> String {
    let mut messages = |found: &Safety| warnings(found, &SafetySearch::default(), simulation);
    let all: Vec<String> = found.iter().flat_map(&mut messages).map(|w| w.to_string()).collect();
    all.join("\n")
}

#[test]
fn doubtful_factors_of_safety_warn() {
    let trial = |factor: f64, verdict: Verdict| SafetyTrial { factor, verdict, steps: 40 };
    let safety = |bracket: [Option<f64>; 2], trials: Vec<SafetyTrial>| Safety {
        factor: None,
        bracket,
        trials,
        failing: None,
        profile: Profile::default(),
    };
    let (rests, open) = (Verdict::AtRest, Verdict::Undecided);
    let mut simulation = ddem_core::Simulation::new(deck().build().unwrap());
    let found = vec![
        safety(
            [Some(1.0), Some(2.0)],
            vec![trial(1.0, rests), trial(2.0, open), trial(3.0, rests)],
        ),
        safety([None, None], vec![trial(0.5, open)]),
        safety([None, Some(0.5)], vec![]),
        safety([Some(4.0), None], vec![]),
    ];
    let undecided = of_searches(&mut simulation, found);
    // Blocks with a joint that never fails, before anything has moved.
    let jointed = CUBE.to_owned()
        + "count = [1, 1, 2]\njoint = 'seam'\n[model]\ngravity = [0, 0, -10]\n[[fix]]\nwhere = { z = 0.0 }\n\
           axes = 'xyz'\n[joints.seam]\nnormal_stiffness = 1e10\nshear_stiffness = 1e10\n";
    let held = jointed.replace("z = 0.0", "z = [0, 1]");
    let holds = [jointed, held].map(|text| {
        let (deck, _) = ddem_deck::parse_alone(&text, "blocks.toml").unwrap();
        let mut simulation = ddem_core::Simulation::new(deck.build().unwrap());
        of_searches(&mut simulation, vec![safety([Some(4.0), None], vec![])])
    });
    insta::assert_snapshot!([undecided, holds.join("\n")].join("\n"));
}
