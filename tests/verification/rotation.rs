//! V10: free flight of rotating blocks.

use ddem_core::Simulation;
use ddem_deck::TimeStep;
use nalgebra::Vector3;

use super::record::Tolerance::Of;
use super::record::{at_most, check, consistent, of};
use super::shared::{deck, example, run, simulation};

/// Momentum, angular momentum about the origin, and kinetic + strain energy at the present time.
pub(crate) fn invariants(simulation: &mut Simulation) -> (Vector3<f64>, Vector3<f64>, f64) {
    let (mut momentum, mut angular) = (Vector3::zeros(), Vector3::zeros());
    let velocities = simulation.velocities();
    for (node, v) in velocities.into_iter().enumerate() {
        let u = Vector3::from(simulation.displacement(node));
        let x = Vector3::from(simulation.model().point(node)) + u;
        let p = Vector3::from(v) * simulation.model().mass(node);
        momentum += p;
        angular += x.cross(&p);
    }
    let energy = simulation.energy();
    (momentum, angular, energy.kinetic + energy.strain_bodies + energy.strain_joints)
}

/// Runs the deck and returns the largest changes of momentum, angular momentum and energy, each as
/// a part of its size, and the change of the mean energy from the first tenth to the last.
pub(crate) fn changes(text: &str) -> [f64; 4] {
    let stage = deck(text).stage[0].clone();
    let mut simulation = simulation(text);
    let damping = stage.damping.unwrap_or_default();
    let steps = simulation.start(damping, TimeStep::Auto, stage.duration).expect("a stable step");
    let (p0, l0, e0) = invariants(&mut simulation);
    let mut most = [0.0_f64; 3];
    let mut energies = Vec::new();
    for step in 1..=steps {
        simulation.step().expect("finite numbers");
        if step % (steps / 200).max(1) == 0 {
            let (p, l, e) = invariants(&mut simulation);
            let now =
                [(p - p0).norm() / p0.norm(), (l - l0).norm() / l0.norm(), (e / e0 - 1.0).abs()];
            most = std::array::from_fn(|i| most[i].max(now[i]));
            energies.push(e / e0);
        }
    }
    let tenth = energies.len() / 10;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let drift = mean(&energies[energies.len() - tenth..]) - mean(&energies[..tenth]);
    [most[0], most[1], most[2], drift]
}

fn flight(name: &str) {
    let case = of(name);
    let text = example(name);
    let [momentum, angular, energy, drift] = changes(&text);
    consistent(case, "momentum: largest relative change", 0.0, momentum, Of(1.0, 1e-12));
    consistent(case, "angular momentum: largest relative change", 0.0, angular, Of(1.0, 1e-11));
    consistent(
        case,
        "kinetic + strain energy: largest relative change",
        0.0,
        energy,
        Of(1.0, 2e-6),
    );
    consistent(case, "the same, last tenth of the run − first", 0.0, drift, Of(1.0, 2e-7));
    let run = run(&text);
    for (axis, exact) in [("x", 3.75), ("y", -2.5), ("z", 1.25)] {
        let what = format!("way of the centre, {axis} [m]");
        check(case, &what, exact, run.last(&format!("centre.{axis}")), Of(4.7, 1e-9));
    }
    if text.contains("quantity = \"stress\"") {
        let components = ["xx", "yy", "zz", "xy", "yz", "zx"];
        let stresses = components.map(|c| run.probes.column(&format!("stress.{c}")));
        let largest = stresses.iter().flatten().fold(0.0, |most: f64, s| most.max(s.abs()));
        at_most(case, "largest stress [Pa]", 1e6, largest);
    }
}

#[test]
fn tumbling_block_keeps_invariants() {
    flight("v10_spin");
}

#[test]
fn tumbling_rigid_block_keeps_invariants() {
    flight("v10_spin_rigid");
}

#[test]
fn tumbling_jointed_blocks_keep_invariants() {
    flight("v10_spin_blocks");
}
