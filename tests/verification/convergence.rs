//! V15: errors fall with the square of the size of the elements and of the time step.

use super::record::Tolerance::{BlendedLaw, Relative};
use super::record::{check, of};
use super::shared::{example, run};

#[test]
fn in_space() {
    // A sagging square shaft, its series and the bilinear values to nine digits.
    let exact = -0.0736713533 * 2400.0 * 10.0 / 7.2e9;
    let decks = ["v15_convergence_n2", "v15_convergence_n4", "v15_convergence_n8"];
    let bilinear = [-3.125e-7, -2.5892857e-7, -2.4866100e-7];
    let found = decks.map(|deck| run(&example(deck)).last("centre.z"));
    for i in 0..3 {
        let what = "u_z at the centre, bilinear elements [m]";
        check(of(decks[i]), what, bilinear[i], found[i], Relative(1e-6));
    }
    let order = |i: usize| ((found[i] - exact) / (found[i + 1] - exact)).log2();
    check(of(decks[1]), "order in h, n = 2 to 4", 2.0, order(0), BlendedLaw(1.9, 2.5));
    check(of(decks[2]), "order in h, n = 4 to 8", 2.0, order(1), BlendedLaw(1.9, 2.2));
}

#[test]
fn in_time() {
    let decks = ["v15_time_1", "v15_time_2", "v15_time_4", "v15_time_reference"];
    let ends = decks.map(|deck| run(&example(deck)).last("end.x"));
    let error = |i: usize| ends[i] - ends[3];
    for (i, deck) in decks[..2].iter().enumerate() {
        let what = "error of u_x over that of half the time step";
        check(of(deck), what, 4.0, error(i) / error(i + 1), BlendedLaw(3.5, 4.5));
    }
    let order = (error(0) / error(2)).log2() / 2.0;
    check(of(decks[2]), "order in Δt over two halvings", 2.0, order, BlendedLaw(1.9, 2.1));
    let case = of(decks[3]);
    check(case, "error of v15_time_4 / u_x", 0.0, error(2) / ends[3], BlendedLaw(-1e-2, 1e-2));
}
