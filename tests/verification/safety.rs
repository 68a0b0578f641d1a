//! Factors of safety by strength reduction.

use ddem_core::{Simulation, Verdict};
use ddem_deck::Deck;
use ddem_deck::{Body, SafetySearch};

use super::limit::{STRENGTHS, in_contact, layered, plane, wedges, with_body};
use super::record::{Case, bracket, of};
use super::shared::{deck, edited, example, root};

/// Factor by which strengths are divided beforehand, relative to the factor at the limit.
const PART: f64 = 0.7;

/// Finds the factor of safety of a deck whose strengths carry 1/`PART` times the load.
fn find((case, what): (Case, &str), deck: &Deck) {
    let model = deck.build().unwrap_or_else(|error| panic!("{what}: {error}"));
    let mut simulation = Simulation::new(model);
    simulation.relax(1e-6, 20_000).unwrap_or_else(|error| panic!("{what}: {error}"));
    let search = SafetySearch::default();
    let found = simulation.factor_of_safety(&search, &|_| {});
    let found = found.unwrap_or_else(|error| panic!("{what}: {error}"));
    let [stands, fails] = found.bracket.map(|end| end.expect("both have been found"));
    assert!(fails - stands <= search.resolution, "{what}: from {stands} to {fails}");
    bracket(case, &format!("factor of safety, {what}"), 1.0 / PART, [stands, fails]);
}

#[test]
fn block_on_plane_has_exact_factor() {
    let case = of("limit_plane");
    for (strengths, what) in STRENGTHS {
        for body in [Body::Rigid, Body::Deformable] {
            let what = format!("{what}, {body:?}").to_lowercase();
            find((case, &what), &with_body(plane(strengths, PART), &["block"], body));
        }
        find((case, &format!("{what}, layer")), &layered(plane(strengths, PART), 18e9));
    }
    for body in [Body::Rigid, Body::Deformable] {
        let deck = with_body(plane([0.0, 35.0], PART), &["block"], body);
        let what = format!("contact, {body:?}").to_lowercase();
        find((case, &what), &in_contact(deck, "plane"));
    }
}

#[test]
fn two_blocks_have_exact_factor() {
    let case = of("limit_wedges");
    find((case, "joints, rigid"), &wedges(PART, false));
    let deck = with_body(wedges(PART, true), &["active", "passive"], Body::Deformable);
    find((case, "contacts, deformable"), &deck);
}

#[test]
fn leaning_column_has_exact_factor() {
    let case = of("limit_topple");
    for (body, divisions) in [(Body::Rigid, 1), (Body::Deformable, 1), (Body::Deformable, 2)] {
        let mut deck = with_body(deck(&example(case.deck)), &["column", "block"], body);
        deck.blocks.iter_mut().for_each(|set| set.divisions = divisions);
        let what = format!("{body:?}, divisions {divisions}").to_lowercase();
        find((case, &what), &deck);
    }
}

/// Rigid blocks that rattle on their joints must come to rest or fall. The trial had taken 200 000
/// steps and ended undecided.
#[test]
fn rigid_block_slope_is_decided() {
    let text = std::fs::read_to_string(root("examples/slope-safety.toml")).expect("the deck");
    let deck = deck(&edited(&text, "divisions = 1", "body = \"rigid\""));
    let mut simulation = Simulation::new(deck.build().expect("a model"));
    simulation.relax(1e-5, 20_000).expect("it stands");
    let search =
        SafetySearch { bracket: [1.0, 1.1197], resolution: 0.2, ..SafetySearch::default() };
    let found = simulation.factor_of_safety(&search, &|_| {}).expect("four trials");
    let verdicts: Vec<_> = found.trials.iter().map(|trial| trial.verdict).collect();
    assert_eq!(verdicts[0], Verdict::AtRest);
    assert_eq!(verdicts.last(), Some(&Verdict::Fails));
    assert!(!verdicts.contains(&Verdict::Undecided), "{verdicts:?}");
    assert!(found.trials.iter().all(|trial| trial.steps < 30_000), "{:?}", found.trials);
}
