//! A region cut by joined planes against an independent finite element model of the same nodes.

use ddem_core::Simulation;
use nalgebra::Vector3;

use super::fem::{Formulation, Mesh, OracleMaterial, System};
use super::{error, random};

const ROCK: OracleMaterial = OracleMaterial { density: 2600.0, young: 10e9, poisson: 0.25 };
const GRAVITY: [f64; 3] = [0.3, -0.2, -9.81];

/// A box of rock cut by 20 joined planes, held at its base.
fn region() -> Simulation {
    let mut text = "
[model]
kinematics = \"small\"
element = \"standard\"
gravity = [0.3, -0.2, -9.81]

[materials.rock]
density = 2600.0
young = 10e9
poisson = 0.25

[[region]]
box = { from = [0, 0, 0], to = [2, 3, 4] }
material = \"rock\"
divisions = 2

[[fix]]
where = { z = 0.0 }
axes = \"xyz\"
"
    .to_owned();
    for at in random(100).as_chunks::<5>().0 {
        let [dip, direction, x, y, z] = at.map(|part| 0.5 * (1.0 + part));
        text += &format!(
            "[[cut]]\nplane = {{ dip = {}, dip_direction = {}, through = [{}, {}, {}] }}\njoin = true\n",
            90.0 * dip,
            360.0 * direction,
            2.0 * x,
            3.0 * y,
            4.0 * z
        );
    }
    let deck = ddem_deck::parse(&text, "cells.toml").unwrap_or_else(|error| panic!("{error}")).0;
    Simulation::new(deck.build().unwrap_or_else(|error| panic!("{error}")))
}

/// Mesh of the elements of a model in which nodes at one place are one, and the node of each of its
/// nodes.
fn merged(simulation: &Simulation) -> (Mesh, Vec<usize>) {
    const NEAR: f64 = 1e-9;
    let model = simulation.model();
    let places: Vec<Vector3<f64>> =
        (0..model.n_nodes()).map(|node| model.point(node).into()).collect();
    let mut by_x: Vec<usize> = (0..places.len()).collect();
    by_x.sort_by(|&a, &b| places[a].x.total_cmp(&places[b].x));
    let mut number = vec![usize::MAX; places.len()];
    let mut nodes = Vec::new();
    for (i, &first) in by_x.iter().enumerate() {
        if number[first] != usize::MAX {
            continue;
        }
        let beside = by_x[i..].iter().take_while(|&&node| places[node].x - places[first].x < NEAR);
        for &node in beside.filter(|&&node| (places[node] - places[first]).norm() < NEAR) {
            number[node] = nodes.len();
        }
        nodes.push(places[first]);
    }
    let hexes: Vec<_> = (0..model.n_blocks())
        .flat_map(|block| model.hexes(block))
        .map(|hex| hex.map(|node| number[node as usize]))
        .collect();
    (Mesh::of_hexahedra(nodes, hexes, ROCK), number)
}

#[test]
fn region_of_joined_planes_equals_one_mesh() {
    let mut simulation = region();
    let (mesh, number) = merged(&simulation);
    let system = System::assemble(&mesh, Formulation::MeanStrain);
    let of_copies = |values: &[f64]| -> Vec<f64> {
        number.iter().flat_map(|node| &values[3 * node..3 * node + 3]).copied().collect()
    };
    println!("{} nodes, {} with copies", mesh.nodes.len(), number.len());

    let u: Vec<f64> = random(mesh.dofs()).into_iter().map(|x| 1e-3 * x).collect();
    simulation.set_displacements(of_copies(&u).as_chunks().0);
    let found = simulation.internal_forces().into_flattened();
    let off = error(&found, &of_copies(&system.stiffness.multiply(&u)));
    println!("forces off by {off:.1e}");
    assert!(off <= 1e-10, "{off:e}");

    let mut held = vec![None; mesh.dofs()];
    for node in mesh.select(|at| at.z < 1e-9) {
        held[3 * node..3 * node + 3].fill(Some(0.0));
    }
    let weight: Vec<f64> = system.mass.iter().flat_map(|mass| GRAVITY.map(|g| mass * g)).collect();
    let exact = system.solve(&weight, &held);
    simulation.set_displacements(&vec![[0.0; 3]; number.len()]);
    let steps = simulation.relax(1e-12, 100_000).unwrap_or_else(|error| panic!("{error}"));
    let off = error(&simulation.displacements().into_flattened(), &of_copies(&exact.displacement));
    println!("{steps} steps, displacements off by {off:.1e}");
    assert!(off <= 1e-10, "{off:e}");
}
