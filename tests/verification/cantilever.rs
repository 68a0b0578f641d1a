//! Bending with one element a block, with and without incompatible modes.

use super::record::Tolerance::{Between, Relative};
use super::record::{check, of};
use super::shared::{example, run};

/// Timoshenko: P L³/(3 E I) + P L/(κ G A), κ = 5/6.
const EXACT: f64 = -(1e5 * 512.0 / (3.0 * 18e9 / 12.0) + 1e5 * 8.0 / (5.0 / 6.0 * 7.2e9));

#[test]
fn standard_elements_lock() {
    let case = of("cantilever_standard");
    let run = run(&example(case.deck));
    let part = run.last("tip.z") / EXACT;
    check(case, "u_z of the tip / Timoshenko", 1.0, part, Between(0.6, 0.7));
    check(case, "force of the wall, z [N]", 1e5, run.last("wall.z"), Relative(1e-6));
}

#[test]
fn incompatible_elements_bend() {
    let case = of("cantilever_incompatible");
    let run = run(&example(case.deck));
    check(case, "u_z of the tip [m]", EXACT, run.last("tip.z"), Relative(0.02));
    check(case, "force of the wall, z [N]", 1e5, run.last("wall.z"), Relative(1e-6));
}
