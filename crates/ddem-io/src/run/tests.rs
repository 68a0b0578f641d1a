//! Tests of the warnings of a run, from numbers that a run may give.

use ddem_core::{Energy, Safety, SafetySearch, SafetyTrial, Verdict};
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
    assert_eq!(
        warning(energy(2.0, 0.0)).map(|warning| warning.to_string()).as_deref(),
        Some(
            "stage: energy imbalance: 2.0 % of the largest energy is gained (`balance` in energy.csv); check \
             whether a shorter `time_step` changes the result [energy-imbalance]"
        )
    );
    let lost = warning(energy(-2.0, 3.0)).map(|warning| warning.message).unwrap_or_default();
    assert!(lost.contains("5.0 % of the largest energy is lost in contacts"), "{lost}");
}

#[test]
fn doubtful_factors_of_safety_warn() {
    let trial = |factor: f64, verdict: Verdict| SafetyTrial { factor, verdict, steps: 40 };
    let mut simulation = ddem_core::Simulation::new(deck().build().unwrap());
    let mut messages = |bracket: [Option<f64>; 2], trials: Vec<SafetyTrial>| {
        let found = Safety { factor: None, bracket, trials, failing: None };
        let warnings = warnings(&found, &SafetySearch::default(), &mut simulation);
        warnings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let (rests, open) = (Verdict::AtRest, Verdict::Undecided);
    assert_eq!(
        messages(
            [Some(1.0), Some(2.0)],
            vec![trial(1.0, rests), trial(2.0, open), trial(3.0, rests)]
        ),
        [
            "max_steps: the trial with strengths / 2.0000 was undecided after 40 steps and counts as \
             unstable: the factor of safety may be larger; raise `max_steps` [undecided-trial]",
            "bracket: strengths / 3.0000 came to rest, but strengths / 2.0000 did not: the factor of \
             safety may be as large as 3.0000; search again with a `bracket` above 2.0000 [nonmonotonic-safety]",
        ]
    );
    assert_eq!(
        messages([None, None], vec![trial(0.5, open)]),
        [
            "max_steps: there is no factor of safety: the trial with strengths / 0.5000 was undecided \
          after 40 steps; raise `max_steps` [undecided-trial]"
        ]
    );
    assert_eq!(
        messages([None, Some(0.5)], vec![]),
        ["bracket: the blocks fail with the smallest factor, 0.5; lower the first number of \
          `bracket` [factor-below-bracket]"]
    );
    assert_eq!(
        messages([Some(4.0), None], vec![]),
        [
            "bracket: the blocks hold with the largest factor, 4; the model has no `gravity`; raise the \
          second number of `bracket` [factor-above-bracket]"
        ]
    );
}
