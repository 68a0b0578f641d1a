//! Fragments: blocks that unbroken joints connect.

use ddem_core::{FIELDS, Fragment, Simulation};
use ddem_deck::{Assign, Body, Damping, Deck, Extent, Joint, TimeStep, Where};

use crate::decks::*;

fn weak(joint: Joint) -> Joint {
    Joint { cohesion: Some(1e5), friction: Some(30.0), tension: Some(4e4), ..joint }
}

/// 27 blocks; the joint below the upper 18 blocks is changed by `with`.
fn layered(body: Body, with: impl Fn(Joint) -> Joint) -> Deck {
    let mut deck = deck([3, 3, 3], [3.0; 3], 2, 0.02);
    deck.blocks[0].body = body;
    deck.joints.insert("weak".into(), with(deck.joints["seam"].clone()));
    deck.assign.push(Assign {
        r#where: Where { z: Some(Extent::Plane(1.0)), ..Where::default() },
        joint: Some("weak".into()),
        ..Assign::default()
    });
    deck
}

fn model_sums(simulation: &Simulation) -> [f64; 2] {
    let model = simulation.model();
    [model.volumes()[0], (0..model.n_nodes()).map(|node| model.mass(node)).sum()]
}

fn check_sums(simulation: &Simulation, fragments: &[Fragment]) {
    let [volume, mass] = model_sums(simulation);
    let sum = |of: &dyn Fn(&Fragment) -> f64| fragments.iter().map(of).sum::<f64>();
    assert!((sum(&|f| f.volume) / volume - 1.0).abs() < 1e-13);
    assert!((sum(&|f| f.mass) / mass - 1.0).abs() < 1e-12);
}

#[test]
fn cube_pulled_apart_has_two_fragments() {
    for body in [Body::Deformable, Body::Rigid] {
        let mut simulation = simulation(&layered(body, weak));
        assert_eq!(simulation.fragments().len(), 1);
        assert_eq!(simulation.block_fragments(), vec![0; 27]);
        // 1 m/s upwards in the upper blocks, 2 m/s downwards in the lower ones.
        let model = simulation.model();
        let up = |node| if model.point(node)[2] > 1.0 { 1.0 } else { -2.0 };
        let velocities: Vec<_> = (0..model.n_nodes()).map(|n| [0.0, 0.0, up(n)]).collect();
        simulation.set_velocities(&velocities);
        let step = TimeStep::Seconds(2e-6);
        let started = simulation.start(Damping::None, step, None);
        started.unwrap_or_else(|error| panic!("{error}"));
        for _ in 0..200 {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        let fragments = simulation.fragments();
        assert_eq!(fragments.len(), 2);
        check_sums(&simulation, &fragments);
        assert_eq!(fragments[0].blocks, (9..27).collect::<Vec<_>>());
        assert_eq!(fragments[1].blocks, (0..9).collect::<Vec<_>>());
        // Outer blocks lose half of the 20 mm gap on one side, inner ones on both.
        let layer = 2.96 * 2.96;
        let volumes = [layer * (0.98 + 0.99), layer * 0.99];
        for (fragment, (volume, speed)) in
            fragments.iter().zip(volumes.into_iter().zip([1.0, -2.0]))
        {
            assert!((fragment.volume / volume - 1.0).abs() < 1e-12, "{}", fragment.volume);
            assert!((fragment.size() / volume.cbrt() - 1.0).abs() < 1e-12);
            // The joint changes the velocities little before it fails: it carries a strain of
            // 1.4e-5.
            assert!((fragment.velocity[2] / speed - 1.0).abs() < 0.03, "{:?}", fragment.velocity);
            assert!((fragment.centroid[0] - 1.5).abs() < 1e-6);
        }
        let passing = fragments.iter().map(|f| f.passing).collect::<Vec<_>>();
        let mass = fragments[0].mass + fragments[1].mass;
        assert_eq!(passing, [1.0, fragments[1].mass / mass]);
        let field = FIELDS.iter().find(|field| field.name == "fragment");
        let field = field.map(|field| simulation.snapshot().values(field)).unwrap_or_default();
        let per_block = simulation.model().n_elements() / 27;
        assert_eq!(field[..9 * per_block], vec![1.0; 9 * per_block]);
        assert_eq!(field[9 * per_block..], vec![0.0; 18 * per_block]);
    }
}

/// A joint with friction only, smooth or rough, connects nothing, although none of its pairs has
/// failed.
#[test]
fn only_unfailed_joints_with_strength_connect_fragments() {
    type Change = fn(Joint) -> Joint;
    let friction: Change = |joint| Joint { friction: Some(30.0), ..joint };
    let rough: Change = |joint| {
        let joint = Joint { jrc: Some(8.0), jcs: Some(50e6), ..joint };
        Joint { residual_friction: Some(25.0), ..joint }
    };
    let cohesion: Change = |joint| Joint { cohesion: Some(1.0), ..joint };
    let springs: Change = |joint| Joint {
        material: None,
        normal_stiffness: Some(2e11),
        shear_stiffness: Some(6e10),
        ..joint
    };
    for (change, expected) in [(friction, 2), (rough, 2), (cohesion, 1), (springs, 1)] {
        let mut simulation = simulation(&layered(Body::Deformable, change));
        let fragments = simulation.fragments();
        check_sums(&simulation, &fragments);
        assert_eq!(fragments.len(), expected);
    }
}

/// Volumes that differ only by rounding are equal, and their fragments have the same passing
/// fraction.
#[test]
fn equal_fragments_are_numbered_by_lowest_block() {
    let mut deck = deck([7, 3, 1], [0.7, 0.9, 0.1], 1, 0.0);
    let friction = Joint { friction: Some(30.0), ..deck.joints["seam"].clone() };
    let springs = Joint {
        material: None,
        normal_stiffness: Some(1e10),
        shear_stiffness: Some(1e10),
        ..friction
    };
    deck.joints.insert("seam".into(), springs);
    let mut simulation = simulation(&deck);
    let fragments = simulation.fragments();
    assert_eq!(fragments.len(), 21);
    for (number, fragment) in fragments.iter().enumerate() {
        assert_eq!((fragment.blocks.as_slice(), fragment.passing), ([number].as_slice(), 1.0));
    }
}
