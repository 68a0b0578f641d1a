//! V1: a cube under pressure.

use nalgebra::Vector3;

use super::ROCK;
use super::fem::{Formulation, OracleLattice, System};
use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{check, of};
use super::shared::{Frames, edited, example, run};

const PRESSURE: f64 = 50e3;
const YOUNG: f64 = 18e9;
const SIDE: f64 = 4.0;

#[test]
fn cube_on_smooth_base_is_exact_for_any_thickness() {
    let case = of("v01_poisson");
    for thickness in ["0.01", "0.001", "0.1"] {
        let old = "thickness = 0.01 ";
        let text = edited(&example(case.deck), old, &format!("thickness = {thickness} "));
        let run = run(&text);
        let settled = -PRESSURE / YOUNG * SIDE;
        let widened = -0.25 * settled;
        let is = |what: &str, exact: f64, computed: f64, tolerance| {
            check(case, &format!("{what}, t = {thickness} m"), exact, computed, tolerance);
        };
        let small = Relative(1e-6);
        is("settlement u_z of the top [m]", settled, run.last("top.z"), small);
        is("strain ε_z", settled / SIDE, run.last("corner.z") / SIDE, small);
        is("strain ε_x", widened / SIDE, run.last("corner.x") / SIDE, small);
        is("u_x of the side x = 4 [m]", widened, run.last("side_x.x"), small);
        is("u_y of the side y = 4 [m]", widened, run.last("side_y.y"), small);
        is("stress zz [Pa]", -PRESSURE, run.last("stress.zz"), small);
        let others = ["xx", "yy", "xy", "yz", "zx"];
        let largest = others.map(|c| run.last(&format!("stress.{c}")).abs());
        let largest = largest.into_iter().fold(0.0, f64::max);
        is("other stresses [Pa]", 0.0, largest, Of(PRESSURE, 1e-6));
        is("reaction of the base [N]", 800e3, run.last("base.z"), small);
    }
}

#[test]
fn cube_on_base_of_paper_equals_finite_elements() {
    let case = of("v01_paper_base");
    let run = run(&example(case.deck));
    check(case, "reaction of the base, z [N]", 800e3, run.last("base.z"), Relative(1e-6));
    for axis in ["base.x", "base.y"] {
        check(case, &format!("{axis} [N]"), 0.0, run.last(axis), Of(800e3, 1e-6));
    }
    let [left, right] = ["left.x", "right.x"].map(|column| run.last(column));
    let largest = run.last("top.z").abs();
    check(case, "u_x left + right [m]", 0.0, left + right, Of(largest, 1e-6));
    let mesh = OracleLattice::boxed([SIDE; 3], [4; 3], 4, 0.01, ROCK).mesh();
    let mut held = vec![None; mesh.dofs()];
    for node in mesh.select(|at| at.z < 1e-9) {
        held[3 * node..3 * node + 3].fill(Some(0.0));
    }
    let mut load = vec![0.0; mesh.dofs()];
    for (node, share) in mesh.outer_face(2, true) {
        load[3 * node + 2] = -800e3 * share;
    }
    let exact = System::assemble(&mesh, Formulation::Standard).solve(&load, &held).displacement;
    let at = |x: f64| 3 * mesh.nearest(Vector3::new(x, 1.5, 1.5));
    check(case, "u_x of the side x = 4 [m]", exact[at(SIDE)], right, Relative(1e-6));
    let frames = Frames::open(run.path("blocks.vtkhdf"));
    let found = frames.last_vectors("displacement").into_flattened();
    let points = frames.points();
    assert_eq!(points.len(), mesh.nodes.len());
    for (point, node) in points.iter().zip(&mesh.nodes) {
        assert!((Vector3::from(*point) - node).norm() < 1e-9, "nodes are numbered otherwise");
    }
    let most = exact.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    let error = found.iter().zip(&exact).fold(0.0, |e: f64, (a, b)| e.max((a - b).abs()));
    let what = "8000 nodes: largest difference from FEM / largest displacement";
    check(case, what, 0.0, error / most, Absolute(1e-6));
}

#[test]
fn rigid_cube_does_not_bulge() {
    let case = of("v01_rigid");
    let run = run(&example(case.deck));
    // λ + 2G of the rock is 21.6 GPa.
    let settled = -3.0 * PRESSURE * 0.01 / 21.6e9;
    check(case, "settlement u_z of the top [m]", settled, run.last("top.z"), Relative(1e-6));
    check(case, "reaction of the base [N]", 800e3, run.last("base.z"), Relative(1e-6));
    for axis in ["side_x.x", "side_y.y", "corner.x", "corner.y"] {
        let sideways = run.last(axis);
        check(case, &format!("{axis} [m]"), 0.0, sideways, Absolute(-0.01 * settled));
    }
}
