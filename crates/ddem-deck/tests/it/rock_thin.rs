//! Inertia that thin cells of regions have beside their mass.

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

/// All nodes with one velocity have the kinetic energy ½ M v² of the mass that they move: 21 600 kg of rock, and the
/// inertia that a thin slab adds.
#[test]
fn added_inertia_is_that_of_the_kinetic_energy() {
    let built = rock_decks::built(&falling(1.9));
    let model = built.model();
    let warnings = built.warnings(&model);
    let warning = warnings.iter().find(|warning| warning.code == Code::AddedInertia);
    let warning = warning.unwrap_or_else(|| panic!("{warnings:?}"));
    let n = model.n_nodes();
    let mut simulation = Simulation::new(model);
    simulation.set_velocities(&vec![[2.0, 0.0, 0.0]; n]);
    let share = 2.0 * simulation.energy().kinetic / (2.0_f64.powi(2) * 8.0 * 2700.0) - 1.0;
    assert!(warning.message.contains(&format!(" {:.1} %", 100.0 * share)), "{share}: {warning}");
    insta::assert_snapshot!(warning.to_string());
    let built = rock_decks::built(&falling(1.0));
    let other = |warning: &Diagnostic| warning.code != Code::AddedInertia;
    assert!(built.warnings(&built.model()).iter().all(other));
}
