//! V15: errors decrease with the square of the element size and of the time step.

use super::record::Tolerance::Relative;
use super::record::{between, check, of};
use super::shared::{edited, example, run};

/// Exact u_z at the centre of a sagging square shaft `[m]`, from its series.
const SAG: f64 = -0.0736713533 * 2400.0 * 10.0 / 7.2e9;

#[test]
fn error_decreases_with_square_of_element_size() {
    // The values of bilinear elements to nine digits.
    let decks = ["v15_convergence_n2", "v15_convergence_n4", "v15_convergence_n8"];
    let bilinear = [-3.125e-7, -2.5892857e-7, -2.4866100e-7];
    let found = decks.map(|deck| run(&example(deck)).last("centre.z"));
    for i in 0..3 {
        let what = "u_z at the centre, bilinear elements [m]";
        check(of(decks[i]), what, bilinear[i], found[i], Relative(1e-6));
    }
    let order = |i: usize| ((found[i] - SAG) / (found[i + 1] - SAG)).log2();
    between(of(decks[1]), "order in h, n = 2 to 4", order(0), [1.9, 2.5]);
    between(of(decks[2]), "order in h, n = 4 to 8", order(1), [1.9, 2.2]);
}

#[test]
fn error_decreases_with_square_of_element_size_of_cells() {
    let case = of("cells_sag");
    let text = example(case.deck);
    let divisions = [2, 4, 8, 16];
    let error = divisions.map(|n| {
        let text = edited(&text, "divisions = 2", &format!("divisions = {n}"));
        run(&text).last("centre.z") - SAG
    });
    let order = |i: usize| (error[i] / error[i + 1]).log2();
    for (i, within) in [[1.75, 2.25], [1.9, 2.2], [1.9, 2.1]].into_iter().enumerate() {
        let what = format!("order in h, n = {} to {}", divisions[i], divisions[i + 1]);
        between(case, &what, order(i), within);
    }
}

#[test]
fn error_decreases_with_square_of_time_step() {
    let decks = ["v15_time_1", "v15_time_2", "v15_time_4", "v15_time_reference"];
    let ends = decks.map(|deck| run(&example(deck)).last("end.x"));
    let error = |i: usize| ends[i] - ends[3];
    for (i, deck) in decks[..2].iter().enumerate() {
        let what = "error of u_x over that of half the time step";
        between(of(deck), what, error(i) / error(i + 1), [3.5, 4.5]);
    }
    let order = (error(0) / error(2)).log2() / 2.0;
    between(of(decks[2]), "order in Δt over two halvings", order, [1.9, 2.1]);
    let case = of(decks[3]);
    between(case, "error of v15_time_4 / u_x", error(2) / ends[3], [-1e-2, 1e-2]);
}
