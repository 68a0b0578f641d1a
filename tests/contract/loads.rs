//! Resultants of loads, from the reactions.

use super::decks::MATTER;
use super::shared::{edited, run};

/// Six unit blocks on a fixed base.
const BLOCKS: &str = "
[[blocks]]
name = 'wall'
origin = [1.0, -1.0, 0.5]
size = [3.0, 2.0, 1.0]
count = [3, 2, 1]
divisions = 3
material = 'rock'
joint = 'stiff'
[[fix]]
where = { z = 0.5 }
axes = 'xyz'
[[stage]]
name = 'load'
kind = 'relax'
tolerance = 1e-10
[[probe]]
name = 'base'
where = { z = 0.5 }
quantity = 'reaction'
[[probe]]
name = 'all'
where = { set = 'wall' }
quantity = 'displacement'
";

fn deck(extra: &str) -> String {
    // At such small loads the rounding of rotations would matter.
    format!("[model]\nkinematics = 'small'\n{MATTER}{BLOCKS}{extra}")
}

/// Reaction of the base, with the sign of the load.
fn resultant(text: &str) -> [f64; 3] {
    let run = run(text);
    ["x", "y", "z"].map(|axis| -run.last(&format!("base.{axis}")))
}

#[track_caller]
fn assert_is(what: &str, found: [f64; 3], exact: [f64; 3]) {
    let size = exact.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    for (found, exact) in found.iter().zip(exact) {
        assert!((found - exact).abs() <= 1e-8 * size, "{what}: {found} instead of {exact}");
    }
}

#[track_caller]
fn load(region: &str, what: &str, exact: [f64; 3]) {
    let extra = format!("[[load]]\nwhere = {{ {region} }}\n{what}\n");
    assert_is(&extra, resultant(&deck(&extra)), exact);
}

#[test]
fn tractions_are_integrated_over_selected_faces() {
    let (traction, t) = ("traction = [1e4, -2e4, 3e4]", [1e4, -2e4, 3e4]);
    let times = |area: f64| t.map(|t| t * area);
    load("z = 1.5", traction, times(6.0));
    load("x = 4.0", traction, times(2.0));
    // Ranges within elements, across the gap at y = 0, and up to its middle.
    load("x = 4.0, y = [-0.7, 0.7]", traction, times(1.4));
    load("x = 4.0, y = [-0.7, 0.0]", traction, times(0.7));
    load("x = 1.0, y = [-0.123, 0.004], z = [0.6, 1.41]", traction, times(0.127 * 0.81));
    load("z = 1.5, x = [1.3, 2.0], y = [-5.0, 5.0]", traction, times(0.7 * 2.0));
    load("z = 1.5, set = 'wall'", traction, times(6.0));
}

#[test]
fn pressure_acts_inward_on_every_outer_face() {
    load("z = 1.5", "pressure = 2e4", [0.0, 0.0, -12e4]);
    load("x = 1.0", "pressure = 2e4", [4e4, 0.0, 0.0]);
    load("y = 1.0, x = [1.2, 2.2]", "pressure = 2e4", [0.0, -2e4, 0.0]);
}

#[test]
fn line_load_at_gap_is_shared_not_doubled() {
    let line = "line = [1e3, 2e3, -3e3]";
    let times = |length: f64| [1e3, 2e3, -3e3].map(|t| t * length);
    load("x = 4.0, z = 1.5", line, times(2.0));
    load("x = 2.0, z = 1.5", line, times(2.0));
    load("y = 0.0, z = 1.5", line, times(3.0));
    load("y = 0.0, z = 1.5, x = [1.5, 3.25]", line, times(1.75));
}

#[test]
fn force_is_total_over_selection() {
    let force = "force = [5e3, 6e3, 7e3]";
    for region in ["x = 4.0, y = 1.0, z = 1.5", "x = 3.0", "z = 1.5", "set = 'wall'"] {
        load(region, force, [5e3, 6e3, 7e3]);
    }
}

#[test]
fn gravity_acts_on_blocks_and_joints() {
    let text = edited(&deck(""), "[model]", "[model]\ngravity = [1.0, -2.0, -9.81]");
    // Two joint planes across x of 2 m² and one across y of 3 m², 20 mm thick; they cross.
    let (across_x, across_y) = (2.0 * 0.02 * 2.0, 0.02 * 3.0);
    let both = 2.0 * 0.02 * 0.02;
    let joints = across_x + across_y - both;
    let mass = 2400.0 * (6.0 - joints) + 5000.0 * joints;
    assert_is("gravity", resultant(&text), [mass, -2.0 * mass, -9.81 * mass]);
}

#[test]
fn load_on_plane_in_gap_is_shared_evenly() {
    let extra = "
[[load]]
where = { x = 2.0, y = 1.0, z = 1.5 }
force = [0.0, 0.0, -1e4]
[[probe]]
name = 'left'
at = [1.99, 1.0, 1.5]
quantity = 'displacement'
[[probe]]
name = 'right'
at = [2.01, 1.0, 1.5]
quantity = 'displacement'
";
    // Two blocks, so that the gap is the plane of symmetry.
    let text = edited(&deck(extra), "size = [3.0, 2.0, 1.0]", "size = [2.0, 2.0, 1.0]");
    let run = run(&edited(&text, "count = [3, 2, 1]", "count = [2, 2, 1]"));
    let (left, right) = (run.last("left.z"), run.last("right.z"));
    assert!(left < 0.0 && (left / right - 1.0).abs() < 1e-7, "{left:e} and {right:e}");
}

#[test]
fn removed_block_leaves_free_face() {
    let removed = "[[remove]]\nwhere = { x = [3.0, 4.0], y = [0.0, 1.0] }\n";
    // The face at the cavity is set back by half of the joint and can be loaded.
    let cavity = "[[load]]\nwhere = { x = [2.985, 2.995] }\npressure = 1e5\n";
    let run = run(&deck(&format!("{removed}{cavity}")));
    assert_eq!(run.summary.blocks, 5);
    // The width of the block is that of its cell minus half of the joint along y.
    let exact = -1e5 * 0.99;
    let found = -run.last("base.x");
    assert!((found / exact - 1.0).abs() < 1e-8, "{found} instead of {exact}");
    // The outer face of the removed block carries no load; the joint beside it has been removed
    // too.
    let extra = format!("{removed}[[load]]\nwhere = {{ x = 4.0 }}\npressure = 1e5\n");
    let found = resultant(&deck(&extra));
    assert_is("half of the end is gone", found, [-1e5 * 0.99, 0.0, 0.0]);
}
