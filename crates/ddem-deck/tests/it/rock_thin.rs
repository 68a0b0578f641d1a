//! Inertia that thin cells of regions have beside their mass, and time steps of cells.

use ddem_core::Simulation;
use ddem_deck::lint::{Code, Diagnostic};

use crate::rock_decks;

/// Cube of 2 m that falls, cut at one height.
fn falling(height: f64) -> String {
    format!(
        "
[materials.granite]
density = 2700.0
young = 50e9
poisson = 0.25
[joints.bed]
normal_stiffness = 20e9
shear_stiffness = 8e9
cohesion = 10e6
[[region]]
box = {{ from = [0, 0, 0], to = [2, 2, 2] }}
material = 'granite'
[[cut]]
plane = {{ dip = 0, dip_direction = 0, through = [1, 1, {height}] }}
joint = 'bed'
[[stage]]
name = 'fall'
kind = 'dynamic'
duration = 1e-3
"
    )
}

/// Kinds of blocks that thin cells may be.
const BODIES: [&str; 3] = ["", "body = 'rigid'", "small = { is = 'rigid' }"];

/// A deck with more keys of its region.
fn with(text: &str, keys: &str) -> String {
    text.replace("material = 'granite'\n", &format!("material = 'granite'\n{keys}\n"))
}

/// A slab of less than 0.38 m, a fifth of the width of the rest, has so much inertia that its joint and its
/// contacts allow about the step of a slab of 0.38 m.
#[test]
fn thin_cells_hardly_shorten_the_step() {
    for keys in BODIES {
        let step = |height: f64| {
            let text = with(&falling(height), keys);
            Simulation::new(rock_decks::built(&text).model()).critical_step().unwrap()
        };
        // A fifth of 1.6 m, and slabs that are thinner by far.
        let thick = step(1.6);
        for height in [1.99, 1.999] {
            let thin = step(height);
            assert!(thin > 0.5 * thick, "{keys}: {thin} of {thick}");
        }
    }
}

/// All nodes with one velocity have the kinetic energy ½ M v² of the mass that they move: 21 600 kg of rock, and the
/// inertia that a thin slab adds.
#[test]
fn added_inertia_is_that_of_the_kinetic_energy() {
    let [warning, ..] = BODIES.map(|keys| {
        let built = rock_decks::built(&with(&falling(1.9), keys));
        let model = built.model();
        let mut warnings = built.warnings(&model);
        let at = warnings.iter().position(|warning| warning.code == Code::AddedInertia);
        let warning = warnings.remove(at.unwrap_or_else(|| panic!("{keys}: {warnings:?}")));
        let n = model.n_nodes();
        let mut simulation = Simulation::new(model);
        simulation.set_velocities(&vec![[2.0, 0.0, 0.0]; n]);
        let share = 2.0 * simulation.energy().kinetic / (2.0_f64.powi(2) * 8.0 * 2700.0) - 1.0;
        let found = format!(" {:.1} %", 100.0 * share);
        assert!(warning.message.contains(&found), "{keys}, {share}: {warning}");
        warning
    });
    insta::assert_snapshot!(warning.to_string());
    let built = rock_decks::built(&falling(1.0));
    let other = |warning: &Diagnostic| warning.code != Code::AddedInertia;
    assert!(built.warnings(&built.model()).iter().all(other));
}

/// Rock between three scattered sets has cells of all shapes. Its thin cells add at most 0.5 % to the inertia.
#[test]
fn scattered_sets_add_little_inertia() {
    let set = |dip: u32, direction: u32| {
        format!(
            "[[cut]]
joint = 'bed'
set = {{ dip = {dip}, dip_direction = {direction}, fisher = 50, spacing = {{ mean = 1.0, spread = 0.3 }} }}
"
        )
    };
    let text = falling(1.0).replace("[2, 2, 2]", "[7, 7, 7]");
    let (head, rest) = text.split_once("[[cut]]").unwrap();
    let (_, stages) = rest.split_once("[[stage]]").unwrap();
    let sets = [set(30, 80), set(70, 200), set(80, 320)].concat();
    let model = rock_decks::built(&format!("{head}{sets}[[stage]]{stages}")).model();
    let volume = model.volumes()[0];
    assert!((volume / 343.0 - 1.0).abs() < 1e-12, "{volume}");
    let n = model.n_nodes();
    let mut simulation = Simulation::new(model);
    simulation.set_velocities(&vec![[2.0, 0.0, 0.0]; n]);
    let share = 2.0 * simulation.energy().kinetic / (2.0_f64.powi(2) * volume * 2700.0) - 1.0;
    assert!((1e-6..5e-3).contains(&share), "{share}");
}

/// Critical step of a box of rock with edges of 1 m, `length` metres long, and more of its deck.
fn step_of_box(length: f64, more: &str) -> f64 {
    let text = format!(
        "
[materials.granite]
density = 2600.0
young = 20e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e9
shear_stiffness = 1e9
[[region]]
box = {{ from = [0, 0, 0], to = [{length}, 1, 1] }}
material = 'granite'
small = {{ is = 'removed' }}
{more}
[[stage]]
name = 'rest'
kind = 'dynamic'
duration = 1e-3
"
    );
    let mut simulation = Simulation::new(rock_decks::built(&text).model());
    simulation.critical_step().unwrap_or_else(|error| panic!("{error}"))
}

/// A face of a millimetre makes no elements of a millimetre: all elements of the cell meet in its middle.
#[test]
fn corner_that_is_cut_off_keeps_the_step() {
    let corner = "[[cut]]
plane = { points = [[0.999, 1, 1], [1, 0.999, 1], [1, 1, 0.999]] }
joint = 'seam'";
    let (whole, cut) = (step_of_box(1.0, ""), step_of_box(1.0, corner));
    println!("{cut} s of {whole} s");
    assert!(cut > 0.4 * whole, "{cut} s of {whole} s");
}

/// The largest eigenvalue of elements with common nodes is at most that of the stiffest element.
#[test]
fn ties_cost_no_step() {
    let middle = "[[cut]]
plane = { points = [[1, 0, 0], [1, 1, 0], [1, 0, 1]] }
join = true";
    let (cube, two) = (step_of_box(1.0, ""), step_of_box(2.0, middle));
    println!("{two} s of {cube} s");
    assert!(two >= cube * (1.0 - 1e-6), "{two} s of {cube} s");
}
