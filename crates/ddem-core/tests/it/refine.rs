//! Split blocks, sets that touch, and nonconforming joints.

use ddem_core::{Fault, Relaxed, Simulation};
use ddem_deck::{
    Assign, BlockSet, Charge, Damping, Deck, Extent, Initial, Joint, JointChoice, Kinematics, Load,
    Material, Refine, TimeStep, Where,
};

use crate::decks::*;

pub(crate) fn range(axis: usize, from: f64, to: f64) -> Where {
    let mut ranges = [None; 3];
    ranges[axis] = Some(Extent::Range([from, to]));
    let [x, y, z] = ranges;
    Where { x, y, z, ..Where::default() }
}

pub(crate) fn refine(region: Where, factor: u32) -> Refine {
    Refine { r#where: region, factor }
}

/// 2 × 2 × 3 blocks of 1 m whose joints are as stiff as rock over a tenth of a metre. The lower two
/// layers are split in two, the lowest again in three.
pub(crate) fn layers(thickness: f64) -> Deck {
    let mut deck = deck([2, 2, 3], [2.0, 2.0, 3.0], 2, thickness);
    let springs = Joint {
        thickness,
        normal_stiffness: Some(2e11),
        shear_stiffness: Some(8e10),
        ..Joint::default()
    };
    deck.joints = [("seam".to_owned(), springs)].into();
    deck.refine = vec![refine(range(2, 0.0, 2.0), 2), refine(range(2, 0.0, 1.0), 3)];
    deck
}

fn relaxed(deck: &Deck) -> Simulation {
    let mut simulation = simulation(deck);
    simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..20_000 {
        let step = simulation.relax_step(1e-9).unwrap_or_else(|error| panic!("{error}"));
        if step == Relaxed::Done {
            return simulation;
        }
    }
    panic!("not in equilibrium: {:e}", simulation.unbalanced());
}

/// A uniform stress crosses joints between coarse and fine blocks exactly, apart from the single
/// precision of the points on faces.
#[test]
fn uniform_stress_crosses_split_blocks() {
    for kinematics in [Kinematics::Small, Kinematics::Corotational] {
        let mut deck = layers(0.0);
        deck.model.kinematics = kinematics;
        deck.fix = (0..3).map(|axis| fix(plane(axis, 0.0), ["x", "y", "z"][axis])).collect();
        let traction = Some([0.0, 0.0, -1e6]);
        deck.load.push(Load { r#where: plane(2, 3.0), traction, ..Load::default() });
        deck.stage = vec![relax_stage("load")];
        let mut simulation = relaxed(&deck);
        assert_eq!(simulation.model().n_blocks(), 4 + 32 + 864);
        for stress in simulation.stresses() {
            for (c, s) in stress.into_iter().enumerate() {
                let exact = if c == 2 { -1e6 } else { 0.0 };
                // Corotational blocks do not rotate, but shorten by 1e-4.
                assert!((s - exact).abs() < 2e-6 * 1e6 + 1e-4 * f64::abs(exact), "{stress:?}");
            }
        }
        let pairs: Vec<_> = simulation.model().pairs().collect();
        for (pair, traction) in pairs.iter().zip(simulation.tractions()) {
            let across = pair.normal[2].abs() * -1e6;
            let normal: f64 = (0..3).map(|c| traction[c] * pair.normal[c]).sum();
            assert!((normal - across).abs() < 2e-3 * 1e6, "{pair:?} {traction:?}");
        }
    }
}

/// Two sets with different divisions and positions are joined where they touch.
#[test]
fn touching_sets_with_different_divisions_are_joined() {
    let mut deck = layers(0.0);
    deck.refine.clear();
    deck.blocks[0].count = Some([2, 2, 1]);
    deck.blocks[0].size = Some([2.0, 2.0, 1.0]);
    deck.blocks.push(BlockSet {
        origin: [0.0, 0.0, 1.0],
        count: Some([3, 5, 1]),
        divisions: 3,
        ..deck.blocks[0].clone()
    });
    deck.fix = (0..3).map(|axis| fix(plane(axis, 0.0), ["x", "y", "z"][axis])).collect();
    let traction = Some([0.0, 0.0, 1e6]);
    deck.load.push(Load { r#where: plane(2, 2.0), traction, ..Load::default() });
    deck.stage = vec![relax_stage("load")];
    let simulation = relaxed(&deck);
    for stress in simulation.stresses() {
        for (c, s) in stress.into_iter().enumerate() {
            let exact = if c == 2 { 1e6 } else { 0.0 };
            assert!((s - exact).abs() < 1e-5 * 1e6, "{stress:?}");
        }
    }
    // A set without a joint can only be in contact.
    deck.model.contact = Some(false);
    deck.blocks[1].joint = None;
    deck.blocks[1].count = None;
    let loose = deck.build().err().map(|error| error.faults).unwrap_or_default();
    assert!(loose.iter().any(|fault| fault.message.contains("rigid body")), "{loose:?}");
    // An assigned joint connects the set.
    deck.assign.push(Assign {
        r#where: plane(2, 1.0),
        joint: Some("seam".into()),
        ..Assign::default()
    });
    assert!(deck.build().is_ok());
}

fn thrown(thickness: f64) -> Simulation {
    let mut deck = layers(thickness);
    deck.model.kinematics = Kinematics::Corotational;
    deck.initial.push(Initial {
        velocity: Some([3.0, -2.0, 1.0]),
        spin: Some([4.0, 5.0, -6.0]),
        centre: Some([1.0, 1.0, 1.5]),
        ..Initial::default()
    });
    let mut simulation = simulation(&deck);
    let started = simulation.start(Damping::None, TimeStep::Auto, None);
    started.unwrap_or_else(|error| panic!("{error}"));
    simulation
}

/// Free flight with rotation keeps momentum and angular momentum to rounding, and energy to the
/// order of the time step.
#[test]
fn free_flight_conserves_momentum_to_rounding() {
    for thickness in [0.0, 0.01] {
        let mut simulation = thrown(thickness);
        let (before, spin) = (simulation.momentum(), simulation.angular_momentum());
        let energy = simulation.energy();
        let whole = energy.kinetic;
        for _ in 0..300 {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        let (after, turned) = (simulation.momentum(), simulation.angular_momentum());
        let size = |v: [f64; 3]| Vec3::from(v).norm();
        assert!((Vec3::from(after) - Vec3::from(before)).norm() < 1e-12 * size(before));
        // Positions and velocities are half a step apart.
        let off = (Vec3::from(turned) - Vec3::from(spin)).norm() / size(spin);
        assert!(off < 1e-10, "{thickness} {off:e}");
        let energy = simulation.energy();
        assert!(energy.balance.abs() < 1e-4 * whole, "{energy:?}");
    }
}

/// Rigid motions of any size cause no force.
#[test]
fn rigid_motions_give_no_force() {
    let mut simulation = thrown(0.01);
    let turn = nalgebra::Rotation3::from_euler_angles(0.7, -1.1, 0.4);
    let n = simulation.model().n_nodes();
    let moved: Vec<[f64; 3]> = (0..n)
        .map(|node| {
            let x = Vec3::from(simulation.model().point(node));
            (turn * x - x + Vec3::new(5.0, 0.0, -2.0)).into()
        })
        .collect();
    simulation.set_displacements(&moved);
    let worst = simulation.tractions().iter().flatten().fold(0.0, |most: f64, t| most.max(t.abs()));
    // Rounding of displacements times the stiffness of the springs.
    assert!(worst < 1e-13 * 2e11 * 10.0, "{worst:e}");
}

#[test]
fn invalid_refinements_are_refused() {
    let message = |change: &dyn Fn(&mut Deck)| -> String {
        let mut deck = layers(0.05);
        change(&mut deck);
        let faults = deck.build().err().map(|error| error.faults).unwrap_or_default();
        let help = |fault: &Fault| fault.help.clone().unwrap_or_default();
        let line = |fault: &Fault| format!("{}: {}, {}\n", fault.place, fault.message, help(fault));
        faults.iter().map(line).collect()
    };
    let nowhere = message(&|deck| deck.refine[0].r#where = range(2, 7.0, 9.0));
    assert!(nowhere.starts_with("refine[0].where: selects nothing"), "{nowhere}");
    assert!(nowhere.contains("centroid: that of the nearest is at [0.5, 0.5, 2.5]"), "{nowhere}");
    let one = message(&|deck| deck.refine[0].factor = 1);
    assert!(one.starts_with("refine[0].factor: 1 parts leave blocks as they are"), "{one}");
    let fine = message(&|deck| deck.refine[1].factor = 7);
    assert!(fine.starts_with("refine[1].factor: 7 parts leave blocks of 7.143e-2 m"), "{fine}");
    let many = message(&|deck| deck.refine[1].factor = 10_000);
    assert!(many.contains("more than 4.29e9"), "{many}");
    let bare = message(&|deck| {
        deck.blocks[0].count = Some([1; 3]);
        deck.blocks[0].joint = None::<JointChoice>;
        deck.refine.truncate(1);
    });
    assert!(bare.contains("blocks need a joint between"), "{bare}");
}

/// Layers of nonconforming joints have mass: with one density the model has the mass of its volume.
#[test]
fn nonconforming_joint_layers_have_mass() {
    for factor in [2, 3] {
        let mut deck = deck([2, 3, 2], [2.0, 3.0, 2.0], 2, 0.06);
        let density = deck.materials["rock"].density;
        deck.materials.insert("clay".into(), Material { density, ..deck.materials["clay"] });
        deck.refine = vec![refine(range(1, 1.0, 2.0), factor)];
        let model = model(&deck);
        let mass: f64 = (0..model.n_nodes()).map(|node| model.mass(node)).sum();
        assert!((mass / (density * 12.0) - 1.0).abs() < 1e-12, "{mass}");
    }
}

/// A warning counts the joints on which the gas does not act.
#[test]
fn charge_warns_of_joints_without_gas() {
    let mut deck = deck([2, 3, 2], [2.0, 3.0, 2.0], 2, 0.02);
    deck.refine = vec![refine(range(1, 1.0, 2.0), 2)];
    let warned = |deck: &mut Deck, from: f64| {
        let region = range(1, from, 2.5);
        deck.charge = vec![Charge { r#where: region, pressure: Some(1e6), ..Charge::default() }];
        let warnings = crate::decks::warnings(deck);
        warnings.iter().any(|text| text.contains("the gas does not push 16 joints between faces"))
    };
    assert!(warned(&mut deck, 1.2));
    deck.refine = vec![refine(range(1, 1.0, 3.0), 2)];
    assert!(!warned(&mut deck, 1.2));
}

/// The joint between two sets is that of the later set, not one assigned on a plane inside it.
#[test]
fn assignment_inside_set_leaves_interface_joint() {
    let mut deck = layers(0.0);
    deck.refine.clear();
    deck.blocks[0].count = Some([1, 1, 1]);
    deck.blocks[0].size = Some([2.0, 2.0, 1.0]);
    deck.blocks.push(BlockSet {
        origin: [0.0, 0.0, 1.0],
        count: Some([2, 2, 2]),
        size: Some([2.0; 3]),
        ..deck.blocks[0].clone()
    });
    let weak = Joint { tension: Some(1.0), ..deck.joints["seam"].clone() };
    deck.joints.insert("weak".into(), weak);
    let assign =
        |z: f64| Assign { r#where: plane(2, z), joint: Some("weak".into()), ..Assign::default() };
    let numbers = |deck: &Deck| {
        let model = model(deck);
        let level = |z: f64| {
            let at = |pair: &ddem_core::PairAtRest| {
                (pair.point[2] - z).abs() < 1e-9 && pair.normal[2].abs() > 0.5
            };
            let mut joints: Vec<u16> = model.pairs().filter(at).map(|pair| pair.joint).collect();
            joints.dedup();
            joints
        };
        [level(1.0), level(2.0)]
    };
    let (section, weak) = (0, 1);
    deck.assign = vec![assign(2.0)];
    assert_eq!(numbers(&deck), [[section], [weak]]);
    deck.assign = vec![assign(1.0)];
    assert_eq!(numbers(&deck), [[weak], [section]]);
}

/// Sets that touch leave no room for a layer, and a face that another block covers in part carries
/// no load.
#[test]
fn touching_sets_have_no_layer_and_load_whole_faces_only() {
    let mut deck = deck([2, 2, 1], [4.0, 4.0, 1.0], 2, 0.05);
    deck.blocks.push(BlockSet {
        origin: [0.5, 0.5, 1.0],
        count: Some([1, 1, 1]),
        size: Some([1.0; 3]),
        ..deck.blocks[0].clone()
    });
    let density = deck.materials["rock"].density;
    deck.materials.insert("clay".into(), Material { density, ..deck.materials["clay"] });
    deck.load.push(Load { r#where: plane(2, 1.0), pressure: Some(1e5), ..Load::default() });
    let model = model(&deck);
    let mass: f64 = (0..model.n_nodes()).map(|node| model.mass(node)).sum();
    assert!((mass / (density * 17.0) - 1.0).abs() < 1e-12, "{mass}");
    let warnings = crate::decks::warnings(&deck);
    let left_out = "load[0].where: 1 face is left out, because other blocks cover it in part";
    assert!(warnings.iter().any(|w| w.starts_with(left_out)), "{warnings:?}");
}
