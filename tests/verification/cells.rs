//! Cells cut from a region: ties, hexahedra of any shape, and joints between matching faces.

use nalgebra::Vector3;

use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{check, of};
use super::shared::{Frames, edited, example, run, simulation};

const PRESSURE: f64 = 1e6;

/// Largest deviation of the stresses of all elements from some stress `[Pa]`.
fn deviation(frames: &Frames, exact: [f64; 6]) -> f64 {
    // The last of the frames, which have equal numbers of elements.
    let stresses = frames.all("CellData", "stress");
    let first = stresses.len() - stresses.len() / frames.times().len();
    let stresses: Vec<[f64; 6]> = stresses[first..].as_chunks().0.to_vec();
    assert!(!stresses.is_empty());
    let far = |stress: &[f64; 6]| {
        stress.iter().zip(exact).map(|(found, exact)| (found - exact).abs()).fold(0.0, f64::max)
    };
    stresses.iter().map(far).fold(0.0, f64::max)
}

#[test]
fn uniform_stress_passes_joints_and_ties_of_cells() {
    let case = of("cells_pressed");
    for divisions in [2, 4] {
        let text = edited(&example(case.deck), "divisions = 2", &format!("divisions = {divisions}"));
        for (what, text) in [
            ("spring joints", text.clone()),
            ("tied", edited(&text, "joint = \"seam\"", "join = true")),
        ] {
            let run = run(&text);
            let is = |quantity: &str, exact: f64, computed: f64, tolerance| {
                let quantity = format!("{quantity}, {what}, {divisions} divisions");
                check(case, &quantity, exact, computed, tolerance);
            };
            let frames = Frames::open(run.path("blocks.vtkhdf"));
            let stress = deviation(&frames, [0.0, 0.0, -PRESSURE, 0.0, 0.0, 0.0]);
            is("stress of any element, deviation [Pa]", 0.0, stress, Of(PRESSURE, 1e-8));
            is("reaction of the base [N]", 0.0, run.last("base.z"), Of(6e6, 1e-8));
            if what == "tied" {
                for (axis, exact) in [("x", 5e-5), ("y", 7.5e-5), ("z", -4e-4)] {
                    let found = run.last(&format!("corner.{axis}"));
                    is(&format!("u_{axis} of the corner [m]"), exact, found, Relative(1e-8));
                }
                let strain = *run.energy.column("strain_bodies").last().expect("a row");
                is("strain energy [J]", 1200.0, strain, Relative(1e-9));
            }
        }
    }
}

/// Forces of a linear field of displacements: zero inside, and those of a uniform stress outside.
#[test]
fn linear_field_is_exact_in_tied_cells() {
    let case = of("cells_pressed");
    let text = edited(&example(case.deck), "joint = \"seam\"", "join = true");
    for divisions in [2, 4] {
        let text = edited(&text, "divisions = 2", &format!("divisions = {divisions}"));
        let text = edited(&text, "pressure = 1e6", "pressure = 0.0");
        let mut simulation = simulation(&text);
        let nodes: Vec<Vector3<f64>> =
            (0..simulation.model().n_nodes()).map(|n| simulation.model().point(n).into()).collect();
        let gradient = nalgebra::Matrix3::new(3e-5, -2e-5, 1e-5, 4e-5, 1e-5, -3e-5, 2e-5, 5e-5, -4e-5);
        let field: Vec<[f64; 3]> = nodes.iter().map(|x| (gradient * x).into()).collect();
        simulation.set_displacements(&field);
        let forces = simulation.internal_forces();
        let inner = |x: &Vector3<f64>| {
            (0..3).all(|d| x[d] > 1e-9 && x[d] < [2.0, 3.0, 4.0][d] - 1e-9)
        };
        let size = |force: &[f64; 3]| Vector3::from(*force).norm();
        let most = forces.iter().map(size).fold(0.0, f64::max);
        let inside = nodes.iter().zip(&forces).filter(|(x, _)| inner(x));
        let left = inside.map(|(_, force)| size(force)).fold(0.0, f64::max);
        let what = format!("force inside / largest force, {divisions} divisions");
        check(case, &what, 0.0, left / most, Absolute(1e-12));
        let strain = (gradient + gradient.transpose()) / 2.0;
        let (lambda, shear) = (4e9, 4e9);
        let exact = nalgebra::Matrix3::identity() * (lambda * strain.trace()) + strain * (2.0 * shear);
        let exact = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].map(|at| exact[at]);
        let far = |stress: &[f64; 6]| {
            stress.iter().zip(exact).map(|(found, exact)| (found - exact).abs()).fold(0.0, f64::max)
        };
        let far = simulation.stresses().iter().map(far).fold(0.0, f64::max);
        let size = exact.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let what = format!("stress of a linear field, deviation [Pa], {divisions} divisions");
        check(case, &what, 0.0, far, Of(size, 1e-11));
    }
}
