//! Supports of an in-situ stress: loads, rigid beds and other sets; and the gradient that carries
//! the weight.

use ddem_deck::*;
use nalgebra::Rotation3;

use crate::decks::*;
use crate::in_situ::{STRESS, in_place, joint, loaded};

/// Loads that carry an in-situ stress act at once, also when the relaxation applies loads in
/// increments.
#[test]
fn balancing_loads_act_at_once_despite_increments() {
    let mut deck = loaded(0, BOX, STRESS);
    deck.fix = vec![fix(plane(0, 0.0), "xyz")];
    deck.stage = vec![relax_stage("rock")];
    let mut simulation = simulation(&deck);
    simulation.start_relaxation(4).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..1000 {
        let relaxed = simulation.relax_step(1e-6).unwrap_or_else(|error| panic!("{error}"));
        let moved = largest(&simulation.displacements());
        assert!(moved < 1e-12, "{moved:e}");
        if relaxed == ddem_core::Relaxed::Done {
            return;
        }
    }
    panic!("no equilibrium");
}

/// Stressed rock on a rigid bed: the joint between them carries all of the stress. A free surface
/// where the gradient leaves only rounding error is not reported.
#[test]
fn rigid_bed_carries_initial_stress() {
    let mut deck = deck([2, 2, 3], [2.0, 2.0, 0.9], 2, 0.0);
    deck.joints.insert("seam".into(), joint(2));
    let density = 2400.0;
    deck.materials.insert("rock".into(), Material { density, ..deck.materials["rock"] });
    let bed = BlockSet {
        name: Some("bed".into()),
        origin: [0.0, 0.0, -1.0],
        size: Some([2.0, 2.0, 1.0]),
        count: Some([1, 1, 1]),
        divisions: 1,
        body: Body::Rigid,
        ..deck.blocks[0].clone()
    };
    deck.blocks.push(bed);
    let weight = density * 9.81;
    deck.model.gravity = [0.0, 0.0, -9.81];
    let slope = [0.0, 0.0, weight, 0.0, 0.0, 0.0];
    let rock = Where { z: Some(Extent::Range([0.0, 0.9])), ..Where::default() };
    let stress = [0.0, 0.0, -weight * 0.9, 0.0, 0.0, 0.0];
    let gradient = Some(Gradient { z: Some(slope), ..Gradient::default() });
    deck.initial = vec![Initial { r#where: rock, ..in_place(stress, gradient) }];
    let region = Where { set: Some("bed".into()), ..Where::default() };
    deck.fix = vec![fix(region, "xyz")];
    let warnings = crate::decks::warnings(&deck);
    assert!(!warnings.iter().any(|w| w.contains("carried")), "{warnings:?}");
    let simulation = simulation(&deck);
    let unbalanced = simulation.unbalanced();
    assert!(unbalanced < 1e-5, "{unbalanced:e}");
}

/// Four jointed sets around an edge: sets on the diagonal touch at an edge only, which is no error.
#[test]
fn sets_around_an_edge_carry_initial_stress() {
    let mut deck = deck([1, 1, 1], [1.0; 3], 2, 0.0);
    deck.joints.insert("seam".into(), joint(2));
    for (x, y) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let origin = [x, y, 0.0];
        deck.blocks.push(BlockSet { origin, ..deck.blocks[0].clone() });
    }
    deck.initial = vec![in_place([-1e6, -1e6, 0.0, 0.0, 0.0, 0.0], None)];
    for (axis, at) in [(0, 0.0), (0, 2.0), (1, 0.0), (1, 2.0)] {
        deck.fix.push(fix(plane(axis, at), ["x", "y"][axis]));
    }
    let simulation = simulation(&deck);
    assert!(simulation.unbalanced() < 1e-6, "{:e}", simulation.unbalanced());
    // A set without a joint carries nothing.
    deck.blocks[3].joint = None;
    deck.model.contact = Some(true);
    let faults = deck.build().err().map(|error| error.faults).unwrap_or_default();
    assert!(
        faults.iter().any(|fault| fault.message.contains("touch without a joint")),
        "{faults:?}"
    );
}

/// A stress that does not carry the weight is reported, with the gradient that would.
#[test]
fn stress_without_weight_gradient_warns() {
    let mut deck = loaded(2, BOX, [0.0; 6]);
    deck.load.clear();
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck.model.gravity = [0.0, 0.0, -10.0];
    let slope =
        |zz: f64| Some(Gradient { z: Some([0.0, 0.0, zz, 0.0, 0.0, 0.0]), ..Gradient::default() });
    let message = |gradient: Option<Gradient>| {
        let mut deck = deck.clone();
        deck.initial = vec![in_place([0.0, 0.0, -4.8e4, 0.0, 0.0, 0.0], gradient)];
        let warnings = crate::decks::warnings(&deck);
        warnings.into_iter().find(|text| text.contains("[unbalanced-weight]"))
    };
    assert_eq!(message(slope(2.4e4)), None);
    for gradient in [None, slope(2.5e4), slope(-2.4e4)] {
        let text = message(gradient).unwrap_or_default();
        assert!(text.contains("of 12 blocks") && text.contains("2.4000e4"), "{text}");
        let line = "put `gradient = { z = [0.0, 0.0, 24000.0, 0.0, 0.0, 0.0] }` into";
        assert!(text.contains(line), "{text}");
    }
}

/// A uniform stress across the face between two sets, one turned about the common normal. No node
/// of the upper set is loaded, and no node of the lower set whose surroundings are covered.
#[test]
fn uniform_stress_crosses_rotated_nonconforming_faces() {
    for degrees in [15.0_f64, 30.0, 45.0, 77.0] {
        let turn = Rotation3::from_axis_angle(&Vec3::z_axis(), degrees.to_radians());
        let stress = [0.0, 0.0, -9e6, 0.0, 0.0, 0.0];
        let mut deck = deck([1, 1, 1], [4.0, 4.0, 1.0], 16, 0.0);
        deck.joints.insert("seam".into(), joint(2));
        let corner = Vec3::new(2.0, 2.0, 1.0) - turn * Vec3::new(0.75, 0.75, 0.0);
        deck.blocks.push(BlockSet {
            origin: corner.into(),
            size: Some([1.5, 1.5, 1.0]),
            divisions: 3,
            axes: [0, 1, 2].map(|d| (turn * Vec3::ith(d, 1.0)).into()),
            ..deck.blocks[0].clone()
        });
        deck.initial.push(in_place(stress, None));
        deck.load.push(Load { r#where: plane(2, 2.0), pressure: Some(9e6), ..Load::default() });
        let mut simulation = simulation(&deck);
        let forces = simulation.forces();
        let (lower, mut seen) = (17_usize.pow(3), 0);
        for (node, (x, force)) in points(simulation.model()).iter().zip(&forces).enumerate() {
            // Lower nodes count if the four elements around them lie inside the circle that the
            // upper face covers at any rotation.
            let around = (x.x - 2.0).hypot(x.y - 2.0) + 0.25_f64.hypot(0.25);
            if node >= lower || (x.z == 1.0 && around < 0.75) {
                let size = Vec3::from(*force).norm();
                assert!(size < 1e-6 * 9e6 * 0.0625, "{degrees}: {x:?} {force:?}");
                seen += 1;
            }
        }
        assert_eq!(seen, 64 + 9, "{degrees}");
    }
}
