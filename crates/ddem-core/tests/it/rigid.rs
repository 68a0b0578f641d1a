//! §8: rigid blocks.

use ddem_core::{Model, Simulation};
use ddem_deck::Deck;
use ddem_deck::{BlockSet, Body, Joint, JointChoice, Material};
use nalgebra::{Rotation3, Vector3};

/// Deck of two rigid blocks joined by springs.
fn pair() -> Deck {
    let mut deck = Deck::default();
    deck.materials.insert("rock".into(), Material { density: 2400.0, young: 18e9, poisson: 0.25 });
    let springs = Joint {
        thickness: 0.05,
        normal_stiffness: Some(2e9),
        shear_stiffness: Some(1e9),
        ..Joint::default()
    };
    deck.joints.insert("seam".into(), springs);
    deck.blocks.push(BlockSet {
        size: Some([2.0, 1.5, 1.0]),
        count: Some([2, 1, 1]),
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        body: Body::Rigid,
        ..BlockSet::default()
    });
    deck
}

/// Displacements that give the two blocks their shifts and rotations.
fn displacements(model: &Model, motions: &[(Vector3<f64>, Vector3<f64>)]) -> Vec<[f64; 3]> {
    let place = |node: usize| {
        let block = model.block_of(node);
        let nodes = 8 * block..8 * block + 8;
        let centre: Vector3<f64> =
            nodes.map(|n| Vector3::from(model.point(n))).sum::<Vector3<f64>>() / 8.0;
        let (shift, turn) = motions[block];
        let arm = Vector3::from(model.point(node)) - centre;
        (shift + Rotation3::new(turn) * arm - arm).into()
    };
    (0..model.n_nodes()).map(place).collect()
}

/// Forces are the gradient of the energy for any motion of two blocks.
#[test]
fn forces_follow_from_the_energy() {
    let mut simulation = Simulation::new(pair().build().unwrap());
    let mut motions = [
        (Vector3::new(0.3, -0.2, 0.1), Vector3::new(0.4, -0.3, 0.8)),
        (Vector3::new(0.35, -0.1, 0.15), Vector3::new(0.4, -0.3, 1.0)),
    ];
    let at = displacements(simulation.model(), &motions);
    simulation.set_displacements(&at);
    let forces = simulation.internal_forces();
    let h = 1e-6;
    for (block, k) in (0..2).flat_map(|block| (0..6).map(move |k| (block, k))) {
        let mut energy = [0.0; 2];
        let mut moved = Vec::new();
        for (e, sign) in energy.iter_mut().zip([-1.0, 1.0]) {
            let (shift, turn) = motions[block];
            if k < 3 {
                motions[block].0[k] += sign * h;
            } else {
                let more = Rotation3::new(Vector3::ith(k - 3, sign * h));
                motions[block].1 = (more * Rotation3::new(turn)).scaled_axis();
            }
            let u = displacements(simulation.model(), &motions);
            motions[block] = (shift, turn);
            simulation.set_displacements(&u);
            *e = simulation.energy().strain_joints;
            moved.push(u);
        }
        let slope = (energy[1] - energy[0]) / (2.0 * h);
        let work: f64 = (0..16)
            .map(|n| (0..3).map(|c| forces[n][c] * (moved[1][n][c] - moved[0][n][c])).sum::<f64>())
            .sum::<f64>()
            / (2.0 * h);
        assert!((slope - work).abs() < 2.0, "{block} {k}: {slope} {work}");
    }
}

/// Rounding at the corners of a rotated block causes no strain.
#[test]
fn rigid_blocks_have_no_stress() {
    let mut simulation = Simulation::new(pair().build().unwrap());
    let model = simulation.model();
    let motion = (Vector3::new(1e3, -2e3, 5.0), Vector3::new(1.0, 0.5, -0.7));
    let u = displacements(model, &vec![motion; model.n_blocks()]);
    simulation.set_displacements(&u);
    assert!(simulation.stresses().iter().all(|stress| *stress == [0.0; 6]));
}
