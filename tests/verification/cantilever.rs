//! Bending with one element per block, with and without incompatible modes.

use super::record::Tolerance::Relative;
use super::record::{at_most, between, check, of};
use super::shared::{edited, example, run};

/// Timoshenko: P L³/(3 E I) + P L/(κ G A), κ = 5/6.
const EXACT: f64 = -(1e5 * 512.0 / (3.0 * 18e9 / 12.0) + 1e5 * 8.0 / (5.0 / 6.0 * 7.2e9));

#[test]
fn standard_elements_lock_in_bending() {
    let case = of("cantilever_standard");
    let run = run(&example(case.deck));
    let part = run.last("tip.z") / EXACT;
    between(case, "u_z of the tip / Timoshenko", part, [0.6, 0.7]);
    check(case, "force of the wall, z [N]", 1e5, run.last("wall.z"), Relative(1e-6));
}

#[test]
fn incompatible_elements_bend_exactly() {
    let case = of("cantilever_incompatible");
    let run = run(&example(case.deck));
    check(case, "u_z of the tip [m]", EXACT, run.last("tip.z"), Relative(0.02));
    check(case, "force of the wall, z [N]", 1e5, run.last("wall.z"), Relative(1e-6));
}

/// A deck without settings has the element that bends, and its joints may be as thin as desired.
#[test]
fn default_element_bends_exactly() {
    let case = of("cantilever_default");
    let deck = example(case.deck);
    let steps = |text: &str, name: &str| {
        let run = run(text);
        check(
            case,
            &format!("u_z of the tip, {name} [m]"),
            EXACT,
            run.last("tip.z"),
            Relative(0.02),
        );
        check(
            case,
            &format!("force of the wall, z, {name} [N]"),
            1e5,
            run.last("wall.z"),
            Relative(1e-4),
        );
        run.summary.stages[0].steps as f64
    };
    let thick = steps(&deck, "joints of 1 mm");
    let thin =
        steps(&edited(&deck, "thickness = 0.001 ", "thickness = 1e-5 "), "joints of 0.01 mm");
    at_most(case, "steps, joints of 0.01 mm", 1.5 * thick, thin);
}
