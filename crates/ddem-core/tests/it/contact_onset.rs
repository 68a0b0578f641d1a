//! Blocks that make contact: in initial positions, in relaxations, at edges, and when supports
//! start or end.

use std::sync::Arc;

use ddem_core::law::JointLaw;
use ddem_core::{Relaxed, RunError, Simulation};
use ddem_deck::{
    BlockSet, Body, Damping, Deck, Edges, Extent, Fix, Joint, JointChoice, Load, Material, Remove,
    StageKind, TimeStep, Where,
};
use nalgebra::Rotation3;

use crate::decks::*;
use crate::unbonded_blocks::*;

fn start(simulation: &mut Simulation) {
    let start = simulation.start(Damping::None, TimeStep::Auto, None);
    start.unwrap_or_else(|error| panic!("{error}"));
}

fn steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Two cubes of edge 1 with the same rotation, the upper one `gap` above the lower one.
fn stacked(gap: f64, divisions: u32, held: bool) -> [Piece; 2] {
    let turn = Rotation3::from_euler_angles(0.3, -0.2, 0.5);
    let below = Piece { turn, divisions, held, ..Piece::default() };
    let above = Piece { centre: turn * Vec3::new(0.2, 0.1, 1.0 + gap), held: false, ..below };
    [below, above]
}

/// An overlap by rounding is no penetration, and the blocks do not spring apart.
#[test]
fn overlap_by_rounding_moves_no_block() {
    for divisions in [0, 1, 2] {
        let mut simulation =
            simulation(&of(&mass_properties(1e9), &stacked(-5e-5, divisions, false)));
        start(&mut simulation);
        steps(&mut simulation, 300);
        assert_eq!(contacts(&mut simulation)[0], 1);
        let moved = largest(&simulation.displacements());
        assert!(moved < 1e-13, "{divisions}: {moved}");
        let energy = simulation.energy();
        assert!(energy.values().iter().all(|e| e.abs() < 1e-15), "{energy:?}");
    }
}

/// A gap by rounding is no gap: a relaxation closes it, and the lower block carries the upper one.
#[test]
fn relaxation_closes_gap_of_rounding() {
    for (gap, divisions) in [(5e-5, 0), (5e-5, 2), (-5e-5, 0), (-5e-5, 2)] {
        let mut deck = of(&mass_properties(1e9), &stacked(gap, divisions, true));
        deck.contact.friction = Some(60.0);
        deck.model.gravity = [0.0, 0.0, -9.81];
        deck.stage.push(relax_stage("rest"));
        let mut simulation = simulation(&deck);
        simulation.relax(1e-8, 20_000).unwrap_or_else(|error| panic!("{gap}: {error}"));
        let below: Vec<u32> = simulation.model().hexes(0).flatten().collect();
        let nodes: Vec<u32> =
            (0..simulation.model().n_nodes() as u32).filter(|node| below.contains(node)).collect();
        let weight = 2.0 * 2400.0 * 9.81;
        let borne = simulation.reaction(&nodes)[2];
        assert!((borne / weight - 1.0).abs() < 1e-6, "{gap} {divisions}: {borne} {weight}");
    }
}

/// A relaxation stops with an error if two blocks penetrate too deeply, as a dynamic stage does.
#[test]
fn relaxation_names_penetrating_blocks() {
    for divisions in [0, 2] {
        let mut deck = of(&mass_properties(1e9), &stacked(0.0, divisions, true));
        deck.contact.friction = Some(60.0);
        deck.model.gravity = [0.0, 0.0, -9.81];
        // Equilibrium would need a penetration of 0.4 of an edge.
        deck.contact.normal_stiffness = Some(2400.0 * 9.81 / 0.4);
        deck.contact.shear_stiffness = Some(2400.0 * 9.81 / 0.4);
        let mut simulation = simulation(&deck);
        let error = simulation.relax(1e-8, 20_000).err();
        let Some(RunError::DeepPenetration { blocks: [0, 1], depth, relaxes: true, .. }) = &error
        else {
            panic!("{divisions}: {error:?}");
        };
        assert!(*depth > 0.25 && *depth < 0.5, "{depth}");
        let message = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(
            message.starts_with("block 0 (set `piece 0`) and block 1 (set `piece 1`) penetrate"),
            "{message}"
        );
    }
}

/// The error names the support that pushes one block into another.
#[test]
fn support_that_causes_penetration_is_named() {
    let mut deck = of(&mass_properties(1e6), &stacked(0.0, 0, true));
    let region = Where { set: Some("piece 1".into()), ..Where::default() };
    let velocity = Some([0.0, 0.0, -20.0]);
    deck.fix.push(Fix { r#where: region, axes: "xyz".into(), velocity, ..Fix::default() });
    let mut simulation = simulation(&deck);
    start(&mut simulation);
    let error = (0..100_000).find_map(|_| simulation.step().err());
    let Some(RunError::DeepPenetration { driven: Some((1, 1)), relaxes: false, .. }) = &error
    else {
        panic!("{error:?}");
    };
    let message = error.map(|error| error.to_string()).unwrap_or_default();
    assert!(message.contains("the support fix[1] drives block 1"), "{message}");
}

/// Frame of fixed blocks; one more block hangs from it by a weak joint, 15 mm above the block
/// below.
fn frame(body: Body, divisions: u32) -> Deck {
    let mut deck = mass_properties(1e9);
    let weak = Joint {
        normal_stiffness: Some(2e8),
        shear_stiffness: Some(1e8),
        cohesion: Some(1.0),
        friction: Some(10.0),
        tension: Some(1.0),
        ..Joint::default()
    };
    let firm = Joint { cohesion: None, friction: None, tension: None, ..weak.clone() };
    deck.joints = [("weak".to_owned(), weak), ("firm".to_owned(), firm)].into();
    let by = |name: &str| Some(name.to_owned());
    deck.blocks.push(BlockSet {
        edges: Some(Edges {
            x: Some(vec![0.0, 1.0, 2.0, 3.0]),
            y: Some(vec![0.0, 1.0]),
            z: Some(vec![0.0, 1.0, 1.015, 2.015, 3.015]),
        }),
        divisions,
        body,
        material: "stuff".into(),
        joint: Some(JointChoice::ByNormal { x: by("firm"), y: None, z: by("weak") }),
        ..BlockSet::default()
    });
    let part = |x: [f64; 2], z: [f64; 2]| Where {
        x: Some(Extent::Range(x)),
        z: Some(Extent::Range(z)),
        ..Where::default()
    };
    for region in [part([1.0, 3.0], [1.0, 1.015]), part([1.0, 2.0], [1.015, 2.015])] {
        deck.remove.push(Remove { r#where: region, ..Remove::default() });
    }
    for region in [
        part([0.0, 1.999], [0.0, 3.015]),
        part([0.0, 3.0], [0.0, 0.999]),
        part([0.0, 3.0], [2.016, 3.015]),
    ] {
        deck.fix.push(fix(region, "xyz"));
    }
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck
}

/// In one jointed set a joint breaks and its block falls onto another. The masses of the relaxation
/// are stable for the new contact.
#[test]
fn block_broken_off_in_relaxation_rests_on_another() {
    for (body, divisions) in [(Body::Rigid, 1), (Body::Deformable, 1), (Body::Deformable, 2)] {
        let mut simulation = simulation(&frame(body, divisions));
        let steps = simulation.relax(1e-6, 100_000);
        let fallen = (0..simulation.model().n_blocks()).min_by(|&a, &b| {
            let z = |block| middle(&corners(&simulation, block)) - Vec3::new(2.5, 0.5, 1.5);
            z(a).norm().total_cmp(&z(b).norm())
        });
        let at = middle(&corners(&simulation, fallen.unwrap_or_default()));
        println!("{body:?} {divisions}: {steps:?}, {}", at.transpose());
        assert!(steps.is_ok(), "{body:?} {divisions}: {steps:?}");
        assert!((at - Vec3::new(2.5, 0.5, 1.5)).norm() < 1e-3, "{at}");
        assert!(simulation.failed_pairs().iter().sum::<u64>() > 0);
    }
}

/// Contact at an edge does not depend on the order of its two faces.
#[test]
fn edge_contact_is_independent_of_face_order() {
    let rebound = |swapped: [bool; 2]| {
        let mut pieces = [0, 1].map(|side| {
            let sign = if side == 0 { 1.0 } else { -1.0 };
            // The long edge lies along x or y; a corner edge points up or down.
            let along = Rotation3::from_euler_angles(0.0, std::f64::consts::FRAC_PI_2, 0.0);
            let across = Rotation3::from_euler_angles(-std::f64::consts::FRAC_PI_2, 0.0, 0.0);
            let long = if side == 0 { along } else { across };
            let axis = if side == 0 { Vec3::x_axis() } else { Vec3::y_axis() };
            let edges = Vec3::new(0.4, 1.0, 2.0);
            let tilt = Rotation3::from_axis_angle(&axis, std::f64::consts::FRAC_PI_4);
            let turn = tilt * long;
            // Highest corner edge of the lower block, lowest of the upper one.
            let arm = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
                .map(|(i, k)| turn * Vec3::new(0.5 * i * edges.x, 0.5 * k * edges.y, 0.0))
                .into_iter()
                .max_by(|a, b| (sign * a.z).total_cmp(&(sign * b.z)))
                .unwrap_or_default();
            let top = Vec3::new(0.0, 0.0, -0.005 * sign);
            let velocity = Vec3::new(0.0, 0.0, sign);
            Piece { centre: top - arm, edges, turn, velocity, ..Piece::default() }
        });
        for (piece, swap) in pieces.iter_mut().zip(swapped) {
            if swap {
                let quarter =
                    Rotation3::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
                piece.turn *= quarter;
                piece.edges = Vec3::new(piece.edges.y, piece.edges.x, piece.edges.z);
            }
        }
        let mut simulation = simulation(&of(&mass_properties(1e8), &pieces));
        let dt = 2e-5;
        simulation
            .start(Damping::None, TimeStep::Seconds(dt), None)
            .unwrap_or_else(|e| panic!("{e}"));
        steps(&mut simulation, 1500);
        let middle = |block| {
            let all = corners(&simulation, block);
            middle(&all)
        };
        [middle(0), middle(1)]
    };
    let first = rebound([false, false]);
    for swapped in [[true, false], [false, true], [true, true]] {
        let other = rebound(swapped);
        let off = (0..2).map(|k| (first[k] - other[k]).norm()).fold(0.0, f64::max);
        assert!(off < 1e-10, "{swapped:?}: {off}");
    }
    // The blocks have met: without contact the lower one would be above the other.
    assert!(first[0].z < first[1].z);
}

/// A contact made before a support ends gets the same dashpot as a contact made without the
/// support.
#[test]
fn contact_dashpots_follow_changes_of_support() {
    let mut thrown = stacked(0.005, 0, false);
    thrown[1].velocity = thrown[1].turn * Vec3::new(0.0, 0.0, -1.0);
    let rebound = |held: bool| {
        let mut deck = of(&mass_properties(1e8), &thrown);
        deck.contact.damping = Some(0.3);
        deck.contact.friction = Some(0.0);
        deck.stage = vec![relax_stage("a"), relax_stage("b")];
        let region = Where { set: Some("piece 0".into()), ..Where::default() };
        let until = Some("b".into());
        deck.fix.push(Fix { r#where: region, axes: "xyz".into(), until, ..Fix::default() });
        if !held {
            deck.fix.clear();
        }
        deck.stage.iter_mut().for_each(|stage| {
            stage.kind = ddem_deck::StageKind::Dynamic;
            stage.duration = Some(1.0);
        });
        let mut simulation = simulation(&deck);
        start(&mut simulation);
        steps(&mut simulation, 2);
        assert_eq!(contacts(&mut simulation)[0], 1);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        start(&mut simulation);
        steps(&mut simulation, 2000);
        simulation.velocities()
    };
    let (held, free) = (rebound(true), rebound(false));
    let off = held.iter().zip(&free).map(|(a, b)| (Vec3::from(*a) - Vec3::from(*b)).norm());
    let off = off.fold(0.0, f64::max);
    assert!(off < 1e-9, "{off}");
    assert!(free[0][2].abs() > 0.1, "they have met");
}

#[derive(Debug)]
struct Dry;

impl JointLaw for Dry {
    fn tension(&self) -> f64 {
        10.0
    }

    fn peak(&self, normal: f64) -> f64 {
        (10.0 - normal).max(0.0)
    }

    fn residual(&self, normal: f64) -> f64 {
        -normal
    }
}

/// A law of the program enables contacts, as strengths in the deck do.
#[test]
fn program_law_enables_contacts() {
    let mut deck = deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.01);
    deck.fix.push(fix(plane(0, 0.0), "xyz"));
    deck.fix.push(Fix { velocity: Some([1.0, 0.0, 0.0]), ..fix(plane(0, 2.0), "xyz") });
    for (given, released) in [(None, 1), (Some(false), 0)] {
        deck.model.contact = given;
        let mut model = model(&deck);
        model.set_law("seam", Arc::new(Dry)).unwrap_or_else(|fault| panic!("{fault}"));
        let mut simulation = Simulation::new(model);
        start(&mut simulation);
        while simulation.time() < 0.05 {
            steps(&mut simulation, 1);
        }
        assert!(simulation.failed_pairs().iter().sum::<u64>() > 0);
        assert_eq!(contacts(&mut simulation)[1], released);
    }
}

/// The masses of the relaxation include the coupling by the joint of nodes that faced each other.
/// After sliding, a contact acts on other nodes.
#[test]
fn relaxation_is_stable_after_sliding() {
    for thickness in [1e-2, 1e-3] {
        let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 2, thickness);
        let clay = Material { density: 2000.0, young: 1e7, poisson: 0.3 };
        deck.materials.insert("clay".into(), clay);
        for section in deck.joints.values_mut() {
            section.material = Some("clay".into());
            (section.cohesion, section.friction) = (Some(0.0), Some(5.0));
        }
        deck.model.gravity = [0.0, 0.0, -9.81];
        deck.fix.push(fix(plane(2, 0.0), "xyz"));
        deck.stage = vec![relax_stage("slide"), relax_stage("rest")];
        deck.stage[0].kind = StageKind::Dynamic;
        deck.stage[0].duration = Some(1.0);
        let top = Where { z: Some(Extent::Range([1.0, 2.0])), ..Where::default() };
        let push = Some([2400.0 * 9.81, 0.0, 0.0]);
        let until = Some("rest".into());
        deck.load.push(Load { r#where: top, force: push, until, ..Load::default() });
        let mut simulation = simulation(&deck);
        let started = simulation.start(Damping::Local(0.3), TimeStep::Auto, None);
        started.unwrap_or_else(|error| panic!("{error}"));
        let last = simulation.model().n_nodes() - 1;
        while simulation.displacement(last)[0] < 0.3 {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
        let done = (0..5_000).any(|_| {
            let step = simulation.relax_step(1e-6);
            step.unwrap_or_else(|error| panic!("{error}")) == Relaxed::Done
        });
        assert!(done, "{thickness}: {:e}", simulation.unbalanced());
    }
}
