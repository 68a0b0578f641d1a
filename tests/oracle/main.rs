//! The program against an independent finite element model (`tests/fem`), number by number.

#![allow(clippy::print_stdout, reason = "errors that were found, shown by --nocapture")]

mod cavity;
mod cells;
#[path = "../fem/mod.rs"]
mod fem;
mod sample;

use ddem_core::Simulation;
use ddem_deck::{Damping, Kinematics, TimeStep};
use fem::{LatticePart, Mesh, System, Transient};
use sample::{Sample, samples};

/// Simulation, independent mesh and independent matrices of a sample.
fn both(sample: &Sample, kinematics: Kinematics) -> (Simulation, Mesh, System) {
    let mut deck = sample.deck();
    deck.model.kinematics = kinematics;
    let model = deck.build().unwrap_or_else(|error| panic!("{}: {error}", sample.name));
    let mesh = sample.lattice().mesh();
    assert_eq!(model.n_nodes(), mesh.nodes.len(), "{}", sample.name);
    for (node, at) in mesh.nodes.iter().enumerate() {
        let far = (nalgebra::Vector3::from(model.point(node)) - at).norm();
        assert!(far < 1e-12 * 10.0, "{}: node {node} is {far:e} m away", sample.name);
    }
    let system = System::assemble(&mesh, sample.formulation());
    (Simulation::new(model), mesh, system)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Largest difference over the largest exact value.
fn error(found: &[f64], exact: &[f64]) -> f64 {
    assert_eq!(found.len(), exact.len());
    let off: Vec<f64> = found.iter().zip(exact).map(|(a, b)| a - b).collect();
    assert!(off.iter().all(|x| x.is_finite()));
    largest(&off) / largest(exact)
}

/// Numbers in (−1, 1), always the same ones.
fn random(count: usize) -> Vec<f64> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut draw = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| draw()).collect()
}

#[test]
fn forces_equal_stiffness_times_displacement() {
    // The corotational model is linear except for the rotation of the blocks, here about 1e-9. R is
    // known to rounding, compared with strains of the order of 1e-7.
    let cases = [(Kinematics::Small, 1e-3, 1e-12), (Kinematics::Corotational, 1e-8, 1e-8)];
    for sample in samples() {
        for (kinematics, size, tolerance) in cases {
            let (mut simulation, mesh, system) = both(&sample, kinematics);
            let u: Vec<f64> = random(mesh.dofs()).into_iter().map(|x| size * x).collect();
            simulation.set_displacements(u.as_chunks().0);
            let found = simulation.internal_forces().into_flattened();
            let off = error(&found, &system.stiffness.multiply(&u));
            println!("{}, {kinematics:?}: forces off by {off:.1e}", sample.name);
            assert!(off <= tolerance, "{}, {kinematics:?}: {off:e}", sample.name);
        }
    }
}

#[test]
fn masses_and_diagonals_equal_assembled_matrices() {
    for sample in samples() {
        let (simulation, mesh, system) = both(&sample, Kinematics::Small);
        let model = simulation.model();
        let nodes = 0..mesh.nodes.len();
        let masses: Vec<f64> = nodes.clone().map(|node| model.mass(node)).collect();
        let relative = |found: &[f64], exact: &[f64]| {
            found.iter().zip(exact).fold(0.0, |e: f64, (a, b)| e.max((a / b - 1.0).abs()))
        };
        let mass = relative(&masses, &system.mass);
        let diagonal: Vec<f64> = nodes.flat_map(|node| model.stiffness_diagonal(node)).collect();
        let stiffness = relative(&diagonal, &system.stiffness.diagonal());
        println!("{}: masses {mass:.1e}, diagonal {stiffness:.1e}", sample.name);
        assert!(mass <= 1e-12, "{}: masses off by {mass:e}", sample.name);
        assert!(stiffness <= 1e-12, "{}: diagonal off by {stiffness:e}", sample.name);
    }
}

#[test]
fn critical_step_follows_from_largest_eigenvalue() {
    for sample in samples() {
        let (mut simulation, mesh, system) = both(&sample, Kinematics::Small);
        let exact = 2.0 / system.largest_eigenvalue(&vec![false; mesh.dofs()]).sqrt();
        let off = (simulation.critical_step().expect("a step") / exact - 1.0).abs();
        println!("{}: critical step {exact:.4e} s off by {off:.1e}", sample.name);
        assert!(off <= 1e-6, "{}: {off:e}", sample.name);
    }
}

#[test]
fn relaxation_converges_to_direct_solution() {
    for sample in samples().iter().filter(|sample| sample.cells() > 1) {
        let mut sample = sample.clone();
        sample.loaded = true;
        let (mut simulation, mesh, system) = both(&sample, Kinematics::Small);
        let (load, held) = sample.load_and_supports(&mesh, &system);
        let exact = system.solve(&load, &held);
        let steps = simulation.relax(1e-10, 100_000);
        let steps = steps.unwrap_or_else(|error| panic!("{}: {error}", sample.name));
        let off = error(&simulation.displacements().into_flattened(), &exact.displacement);
        println!("{}: {steps} steps, displacements off by {off:.1e}", sample.name);
        assert!(off <= 1e-6, "{}: {off:e}", sample.name);
    }
}

#[test]
fn damped_motion_equals_scheme_with_assembled_matrix() {
    for sample in samples() {
        let stiffness = Damping::Stiffness(2e-5);
        for damping in [Damping::Ratio(0.03), Damping::Mass(200.0), stiffness, Damping::None] {
            let mut sample = sample.clone();
            sample.loaded = true;
            let (mut simulation, mesh, system) = both(&sample, Kinematics::Small);
            let (load, held) = sample.load_and_supports(&mesh, &system);
            let fixed: Vec<bool> = held.iter().map(Option::is_some).collect();
            let critical = simulation.critical_step().expect("a step");
            let step = 0.6 * damping.stable_step(critical);
            let coefficients = match damping {
                Damping::Ratio(ratio) => system.damping(ratio),
                Damping::Mass(alpha) => system.dof_masses().iter().map(|m| alpha * m).collect(),
                _ => vec![0.0; mesh.dofs()],
            };
            let mut motion = Transient::new(&system, load, coefficients, fixed, step);
            if let Damping::Stiffness(beta) = damping {
                let mut bodies = mesh.clone();
                bodies.elements.retain(|element| element.kind == LatticePart::Body);
                let mut stiffness = System::assemble(&bodies, sample.formulation()).stiffness;
                stiffness.values.iter_mut().for_each(|value| *value *= beta);
                motion.viscous = Some(stiffness);
            }
            simulation.start(damping, TimeStep::Seconds(step), None).expect("a stable step");
            for _ in 0..400 {
                simulation.step().expect("finite numbers");
            }
            motion.run(400);
            let off = error(&simulation.displacements().into_flattened(), &motion.displacement);
            println!("{}, {damping:?}: displacements off by {off:.1e}", sample.name);
            assert!(off <= 1e-10, "{}, {damping:?}: {off:e}", sample.name);
        }
    }
}
