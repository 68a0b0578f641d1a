//! V16, V17: in-situ stress, and displacements when blocks are removed from stressed rock.

use std::f64::consts::PI;

use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{at_most, check, of};
use super::shared::{example, run};

#[test]
fn overburden_stays() {
    let case = of("v16_overburden");
    let run = run(&example(case.deck));
    let unbalanced = run.summary.stages[0].unbalanced;
    check(case, "unbalanced force ratio at the start", 0.0, unbalanced, Of(1.0, 1e-10));
    check(case, "steps to equilibrium", 0.0, run.steps() as f64, Absolute(0.0));
    // Settlement under 50 m of rock without the in-situ stress.
    let settled = 2500.0 * 9.81 * 50.0 * 4.0 / 21.6e9;
    check(case, "way of the top, in motion [m]", 0.0, run.last("top.z"), Of(settled, 1e-11));
    let weight = 3.0 * 2.0 * 2500.0 * 9.81 * 54.0;
    check(case, "reaction of the foot [N]", weight, run.last("foot.z"), Relative(1e-9));
    // Depth of the centre of the lowest element, one of two between the base and the first joint.
    let depth = 54.0 - 0.99 / 4.0;
    check(case, "stress zz [Pa]", -2500.0 * 9.81 * depth, run.last("stress.zz"), Relative(1e-9));
}

#[test]
fn excavated_face_rises_exactly() {
    let case = of("v16_face");
    let run = run(&example(case.deck));
    let stiff = 18e9 * (1.0 - 0.25) / ((1.0 + 0.25) * (1.0 - 2.0 * 0.25));
    let rise = 8e6 * 1.99 / stiff;
    check(case, "rise of the face [m]", rise, run.last("face.z"), Relative(1e-6));
    check(case, "stress xx [Pa]", -3e6 + 8e6 / 3.0, run.last("stress.xx"), Relative(1e-5));
    check(case, "stress zz [Pa]", 0.0, run.last("stress.zz"), Of(8e6, 1e-6));
}

/// Downward displacement of the rock above the crown due to the excavation, at a distance from the
/// centre (Kirsch 1898).
fn kirsch(distance: f64) -> f64 {
    let (along, across, shear) = (10e6, 4e6, 8e9);
    // Squared radius of a circle with the area of the staircase.
    let square = 4.0 * 0.8125 / PI;
    let spread = 4.0 * (1.0 - 0.25) - square / (distance * distance);
    -square / (2.0 * shear * distance) * (0.5 * (along + across) + 0.5 * (along - across) * spread)
}

#[test]
fn round_tunnel_closes_as_kirsch() {
    let distances = [2.0, 3.0, 4.0];
    let errors = |deck: &str, allowed: f64| {
        let case = of(deck);
        let run = run(&example(deck));
        distances.map(|distance| {
            let what = format!("u_z at {distance} m above the centre [m]");
            let (exact, found) = (kirsch(distance), run.last(&format!("roof{distance}.z")));
            check(case, &what, exact, found, Relative(allowed));
            (found / exact - 1.0).abs()
        })
    };
    let coarse = errors("v17_tunnel_4", 0.06);
    for deck in ["v17_tunnel_8", "v17_tunnel_refined"] {
        let fine = errors(deck, 0.04);
        for (distance, (fine, coarse)) in distances.iter().zip(fine.into_iter().zip(coarse)) {
            let what = format!("error at {distance} m / that with blocks of 1/4 m");
            at_most(of(deck), &what, 0.7, fine / coarse);
        }
    }
}
