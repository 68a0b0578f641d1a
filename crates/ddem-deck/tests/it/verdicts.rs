//! Verdicts that rounding hides, and the fastest block.

use std::ops::ControlFlow;

use ddem_core::{FastestBlock, RunError, Safety, SafetySearch, Simulation};

use crate::rock_decks;

/// Block on a slope with the factor of safety tan 35° / tan 30°.
const BLOCK: &str = include_str!("../../../../examples/block.toml");

fn block(changes: &[(&str, &str)]) -> Simulation {
    let text = changes.iter().fold(BLOCK.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    Simulation::new(rock_decks::built(&text).model())
}

/// With 1e13 Pa/m the rounding of a displacement of 3 µm, 3e-22 m, causes 3e-9 Pa; the weight causes 22 kPa.
#[test]
fn rounding_of_a_stiff_contact_ends_trials_at_rest() {
    let mut stiff = block(&[("normal_stiffness = 1e10", "normal_stiffness = 1e13")]);
    let search = SafetySearch { tolerance: 1e-14, ..SafetySearch::default() };
    let found = stiff.factor_of_safety(&search, &|_| {}).expect("a search");
    let exact = 35_f64.to_radians().tan() / 30_f64.to_radians().tan();
    assert!((found.factor.expect("a factor") / exact - 1.0).abs() < 2e-3);
    let error = stiff.relax(1e-14, 20_000).expect_err("rounding");
    assert!(matches!(error, RunError::UnreachableTolerance { joint: None, .. }), "{error}");
}

/// The search of cells in contact ends with the same bits if its trials are known: its rungs run again, and
/// the failing trial from a restored state.
#[test]
fn known_trials_of_cells_give_the_same_bits() {
    let text = include_str!("../../../../examples/verification/cells_wedge.toml");
    let mut wedge = Simulation::new(rock_decks::built(text).model());
    wedge.relax(1e-6, 20_000).expect("an equilibrium");
    let search = SafetySearch { bracket: [1.3, 2.0], resolution: 0.03, ..SafetySearch::default() };
    let whole = wedge.factor_of_safety(&search, &|_| {}).expect("a search");
    let failing = |safety: &Safety| safety.failing.as_ref().expect("a failing trial").save();
    for known in [0, 2, whole.trials.len()] {
        let known = &whole.trials[..known];
        let rest = wedge.continue_search(&search, known, &|_| ControlFlow::Continue(()));
        let rest = rest.expect("a search");
        assert_eq!((&rest.trials, failing(&rest)), (&whole.trials, failing(&whole)));
    }
}

#[test]
fn fastest_block_has_the_fastest_node() {
    let still = block(&[]);
    assert_eq!(still.fastest_block(), None);
    let thrown = "[[initial]]\nwhere = { set = 'block' }\nvelocity = [0, 0, 3]\n[[stage]]\nname = \"weight\"";
    let simulation = block(&[("[[stage]]\nname = \"weight\"", thrown)]);
    let expected = FastestBlock { block: 3, set: "block".to_owned(), speed: 3.0 };
    assert_eq!(simulation.fastest_block(), Some(expected));
}
