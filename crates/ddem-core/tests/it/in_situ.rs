//! In-situ stress: it stays in place, follows from an energy, and is output, saved and lost at
//! failure like any other stress.

use ddem_core::{Simd, Simulation};
use ddem_deck::*;
use nalgebra::{Matrix3, Rotation3};

use crate::decks::*;

pub(crate) const STRESS: [f64; 6] = [-6e6, -4e6, -9e6, 1e6, -0.5e6, 0.7e6];

fn matrix([xx, yy, zz, xy, yz, zx]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
}

pub(crate) fn in_place(stress: [f64; 6], gradient: Option<Gradient>) -> Initial {
    Initial { stress: Some(stress), gradient, ..Initial::default() }
}

/// Gradients that differ in every direction.
fn slopes() -> Gradient {
    let slope = |k: f64| [0, 1, 2, 3, 4, 5].map(|i| 1e6 * (k + 1.7 * f64::from(i)).sin());
    Gradient { x: Some(slope(0.3)), y: Some(slope(1.1)), z: Some(slope(2.9)) }
}

/// Joints of any kind: layers, springs with a gap, springs without.
pub(crate) fn joint(kind: usize) -> Joint {
    let stiff =
        Joint { normal_stiffness: Some(8e10), shear_stiffness: Some(3e10), ..Joint::default() };
    match kind {
        0 => Joint { thickness: 0.02, material: Some("clay".into()), ..Joint::default() },
        1 => Joint { thickness: 0.02, ..stiff },
        _ => stiff,
    }
}

/// Blocks under a stress, with tractions on all outer faces that balance it.
pub(crate) fn loaded(kind: usize, axes: [[f64; 3]; 3], stress: [f64; 6]) -> Deck {
    let mut deck = with_axes(deck([3, 2, 2], [3.0, 2.0, 2.0], 2, 0.02), axes);
    deck.joints.insert("seam".into(), joint(kind));
    deck.initial.push(in_place(stress, None));
    if axes == BOX {
        for (axis, far) in [(0, 3.0), (1, 2.0), (2, 2.0)] {
            for (at, sign) in [(0.0, -1.0), (far, 1.0)] {
                let normal = Vec3::ith(axis, sign);
                let traction = Some((matrix(stress) * normal).into());
                deck.load.push(Load { r#where: plane(axis, at), traction, ..Load::default() });
            }
        }
    }
    deck
}

fn steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// A uniform stress under balancing tractions: no force, no motion, and output equals input.
#[test]
fn balanced_stress_stays() {
    for (kind, kinematics) in
        (0..3).flat_map(|kind| [Kinematics::Small, Kinematics::Corotational].map(|k| (kind, k)))
    {
        // Empty gaps carry neither the loads on them nor the couple of the shear across them.
        let stress = if kind == 1 { [-6e6, -4e6, -9e6, 0.0, 0.0, 0.0] } else { STRESS };
        let mut deck = loaded(kind, BOX, stress);
        if kind == 1 {
            for load in std::mem::take(&mut deck.load) {
                let axis = [load.r#where.x, load.r#where.y].iter().position(Option::is_some);
                deck.fix.push(fix(load.r#where, ["x", "y", "z"][axis.unwrap_or(2)]));
            }
        }
        deck.model.kinematics = kinematics;
        let mut simulation = simulation(&deck);
        simulation.forces();
        assert!(simulation.unbalanced() < 1e-14, "{kind}: {}", simulation.unbalanced());
        let before = simulation.energy();
        assert!(before.strain_bodies > 0.0 && before.balance == 0.0, "{before:?}");
        steps(&mut simulation, 200);
        // Less than 1e-12 of the shortening that the stress would cause.
        let moved = largest(&simulation.displacements());
        assert!(moved < 1e-12 * 9e6 / 18e9 * 2.0, "{kind} {kinematics:?}: {moved}");
        for found in simulation.stresses() {
            let off = (matrix(found) - matrix(stress)).norm();
            assert!(off < 1e-9 * 9e6, "{kind}: {found:?}");
        }
        let faces = simulation.model().faces().to_vec();
        let tractions = simulation.tractions();
        for face in faces {
            let normal = Vec3::from(face.normal(simulation.model().geometry()));
            let pairs = face.pairs(simulation.model().geometry()).count();
            for traction in &tractions[face.first_pair as usize..][..pairs] {
                let off = Vec3::from(*traction) - matrix(stress) * normal;
                assert!(off.norm() < 1e-9 * 9e6, "{kind}: {traction:?}");
            }
        }
    }
}

/// Rigid blocks carry a stress in the springs between them.
#[test]
fn rigid_blocks_carry_stress_in_their_joints() {
    let mut deck = loaded(2, BOX, STRESS);
    deck.blocks[0].body = Body::Rigid;
    let mut simulation = simulation(&deck);
    simulation.forces();
    assert!(simulation.unbalanced() < 1e-14, "{}", simulation.unbalanced());
    steps(&mut simulation, 200);
    let moved = largest(&simulation.displacements());
    assert!(moved < 1e-12 * 9e6 / 8e10, "{moved}");
    let geometry = simulation.model().geometry();
    let normals = simulation
        .model()
        .faces()
        .iter()
        .flat_map(|face| vec![Vec3::from(face.normal(geometry)); face.pairs(geometry).count()]);
    let normals: Vec<Vec3> = normals.collect();
    let tractions = simulation.tractions();
    assert_eq!(tractions.len(), normals.len());
    for (traction, normal) in tractions.iter().zip(normals) {
        let off = Vec3::from(*traction) - matrix(STRESS) * normal;
        assert!(off.norm() < 1e-9 * 9e6, "{traction:?}");
    }
}

/// The same for refined blocks and sets with different divisions, joined by springs without
/// thickness. Points are located on faces in single precision, so the tolerances are larger.
#[test]
fn uniform_stress_crosses_nonconforming_faces() {
    for kinematics in [Kinematics::Small, Kinematics::Corotational] {
        let mut deck = loaded(2, BOX, STRESS);
        deck.blocks[0].count = Some([2, 2, 2]);
        deck.blocks[0].size = Some([2.0, 2.0, 2.0]);
        deck.blocks.push(BlockSet {
            origin: [2.0, 0.0, 0.0],
            size: Some([1.0, 2.0, 2.0]),
            count: Some([1, 3, 1]),
            divisions: 3,
            ..deck.blocks[0].clone()
        });
        let corner = Some(Extent::Range([0.0, 1.0]));
        let region = Where { x: corner, z: corner, ..Where::default() };
        deck.refine.push(Refine { r#where: region, factor: 2 });
        deck.model.kinematics = kinematics;
        let mut simulation = simulation(&deck);
        assert!(simulation.model().n_pairs() > 400);
        simulation.forces();
        let unbalanced = simulation.unbalanced();
        assert!(unbalanced < 1e-6, "{kinematics:?}: {unbalanced:e}");
        steps(&mut simulation, 100);
        for found in simulation.stresses() {
            let off = (matrix(found) - matrix(STRESS)).norm();
            assert!(off < 1e-5 * 9e6, "{found:?}");
        }
        let normals: Vec<_> = simulation.model().pairs().map(|pair| pair.normal).collect();
        for (normal, traction) in normals.iter().zip(simulation.tractions()) {
            let off = Vec3::from(traction) - matrix(STRESS) * Vec3::from(*normal);
            assert!(off.norm() < 1e-4 * 9e6, "{normal:?} {traction:?}");
        }
    }
}

/// Overburden on a level joint whose upper face is finer; the layer of the joint has weight as
/// well. Blocks side by side would have strips between them, so each side has a single block.
#[test]
fn overburden_crosses_nonconforming_faces() {
    let weight = 2400.0 * 9.81;
    let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 2, 0.02);
    if let Some(clay) = deck.materials.get_mut("clay") {
        clay.density = 2400.0;
    }
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.blocks.push(BlockSet {
        origin: [0.0, 0.0, 2.02],
        size: Some([1.0, 1.0, 1.0]),
        count: Some([1, 1, 1]),
        divisions: 3,
        ..deck.blocks[0].clone()
    });
    let slope = [0.6 * weight, 0.6 * weight, weight, 0.0, 0.0, 0.0];
    let gradient = Gradient { z: Some(slope), ..Gradient::default() };
    deck.initial.push(in_place(slope.map(|s| -3.02 * s), Some(gradient)));
    for (axis, far, name) in [(0, 1.0, "x"), (1, 1.0, "y")] {
        deck.fix.push(fix(plane(axis, 0.0), name));
        deck.fix.push(fix(plane(axis, far), name));
    }
    deck.fix.push(fix(plane(2, 0.0), "z"));
    let mut simulation = simulation(&deck);
    assert!(simulation.model().n_pairs() > 9);
    simulation.forces();
    assert!(simulation.unbalanced() < 1e-7, "{:e}", simulation.unbalanced());
}

/// `½ σ:C⁻¹:σ` of the blocks; joints have their own energy.
#[test]
fn energy_follows_from_initial_stress() {
    let mut simulation = simulation(&loaded(0, BOX, STRESS));
    let (young, poisson) = (18e9, 0.25);
    let s = matrix(STRESS);
    let density =
        ((1.0 + poisson) * s.norm_squared() - poisson * s.trace() * s.trace()) / (2.0 * young);
    let volume = simulation.model().volumes()[0];
    let found = simulation.energy().strain_bodies;
    assert!((found / (density * volume) - 1.0).abs() < 1e-12, "{found}");
}

/// Forces are the derivative of the energy also for randomly turned, bent and separated blocks.
#[test]
fn forces_are_the_derivative_of_the_energy() {
    for (kind, axes) in (0..3).flat_map(|kind| [BOX, OBLIQUE].map(|axes| (kind, axes))) {
        let mut deck = loaded(kind, axes, STRESS);
        deck.load.clear();
        deck.initial = vec![in_place(STRESS, Some(slopes()))];
        let mut simulation = simulation(&deck);
        let (mut random, points) = (Random::new(3), points(simulation.model()));
        let turn = random.rotation(0.4);
        let bend = |x: &Vec3, u: Vec3| (turn * x - x + u * 1e-5).into();
        let u: Vec<[f64; 3]> = points.iter().map(|x| bend(x, random.vector())).collect();
        let way: Vec<Vec3> = points.iter().map(|_| random.vector() * 1e-6).collect();
        let mut strain = |part: f64| {
            let moved = u.iter().zip(&way).map(|(u, w)| (Vec3::from(*u) + w * part).into());
            simulation.set_displacements(&moved.collect::<Vec<_>>());
            let energy = simulation.energy();
            energy.strain_bodies + energy.strain_joints
        };
        let slope = (strain(1.0) - strain(-1.0)) / 2.0;
        simulation.set_displacements(&u);
        let forces = simulation.internal_forces();
        let work: f64 = forces.iter().zip(&way).map(|(f, w)| Vec3::from(*f).dot(w)).sum();
        let sizes: f64 =
            forces.iter().zip(&way).map(|(f, w)| Vec3::from(*f).norm() * w.norm()).sum();
        assert!((slope - work).abs() < 1e-6 * sizes, "{kind}: {slope} {work} {sizes}");
        let [force, moment] = sums(&points, &u, &forces, Vec3::zeros());
        assert!(force < 1e-12 && moment < 1e-11, "{kind}: {force} {moment}");
    }
}

/// The stress of a block turns with the block.
#[test]
fn initial_stress_rotates_with_blocks() {
    let mut simulation = simulation(&loaded(0, OBLIQUE, STRESS));
    let (mut random, points) = (Random::new(5), points(simulation.model()));
    let turn: Rotation3<f64> = random.rotation(1.2);
    let before = simulation.energy();
    let u: Vec<[f64; 3]> = points.iter().map(|x| (turn * x - x).into()).collect();
    simulation.set_displacements(&u);
    let expected = turn * matrix(STRESS) * turn.inverse();
    for stress in simulation.stresses() {
        assert!((matrix(stress) - expected).norm() < 1e-6 * 9e6, "{stress:?}");
    }
    let after = simulation.energy();
    assert!((after.strain_bodies / before.strain_bodies - 1.0).abs() < 1e-9);
    assert!((after.strain_joints / before.strain_joints - 1.0).abs() < 1e-9);
}

/// Overburden under gravity with fixed sides and K0 = 0.6 stays in place in stages of both kinds.
/// The joints have the density of the rock, or neither weight nor thickness.
#[test]
fn overburden_stays() {
    let weight = 2400.0 * 9.81;
    for kind in [0, 2] {
        let mut deck = deck([3, 2, 4], [3.0, 2.0, 4.0], 2, 0.02);
        deck.joints.insert("seam".into(), joint(kind));
        if let Some(clay) = deck.materials.get_mut("clay") {
            clay.density = 2400.0;
        }
        deck.model.gravity = [0.0, 0.0, -9.81];
        let slope = [0.6 * weight, 0.6 * weight, weight, 0.0, 0.0, 0.0];
        let z = Some(slope);
        // Stress under 4 m of rock above the model.
        let surface = slope.map(|s| -8.0 * s);
        deck.initial.push(in_place(surface, Some(Gradient { z, ..Gradient::default() })));
        deck.load.push(Load {
            r#where: plane(2, 4.0),
            pressure: Some(4.0 * weight),
            ..Load::default()
        });
        for (axis, far, name) in [(0, 3.0, "x"), (1, 2.0, "y")] {
            deck.fix.push(fix(plane(axis, 0.0), name));
            deck.fix.push(fix(plane(axis, far), name));
        }
        deck.fix.push(fix(plane(2, 0.0), "z"));
        let mut simulation = simulation(&deck);
        simulation.forces();
        assert!(simulation.unbalanced() < 1e-13, "{kind}: {}", simulation.unbalanced());
        steps(&mut simulation, 100);
        assert!(largest(&simulation.displacements()) < 1e-15, "{kind}");
        let took = simulation.relax(1e-10, 100).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(took, 0, "{kind}");
        let (at, stress) = (1.25, simulation.stress(0, [0, 0, 1]));
        assert!((stress[0] / (0.6 * weight * (at - 8.0)) - 1.0).abs() < 0.1, "{stress:?}");
    }
}

/// Joints that are too weak fail under the in-situ stress, and all energies balance during failure.
#[test]
fn energies_balance_when_joints_fail_under_initial_stress() {
    for kind in 0..3 {
        let mut deck = loaded(kind, BOX, [-1e6, -1e6, -4e6, 0.0, 1.2e6, 0.0]);
        let section = deck.joints.get_mut("seam").unwrap_or_else(|| panic!("a seam"));
        (section.cohesion, section.friction) = (Some(0.1e6), Some(10.0));
        section.tension = Some(1e6);
        deck.model.kinematics = Kinematics::Small;
        let mut simulation = simulation(&deck);
        let first = simulation.energy();
        let start = first.strain_bodies + first.strain_joints;
        let step = 0.1 * simulation.safe_step().unwrap_or_else(|error| panic!("{error}"));
        let time_step = TimeStep::Seconds(step);
        let begun = simulation.start(Damping::None, time_step, None);
        begun.unwrap_or_else(|error| panic!("{error}"));
        steps(&mut simulation, 400);
        let energy = simulation.energy();
        assert!(simulation.failed_pairs()[0] > 10, "{kind}: {:?}", simulation.failed_pairs());
        assert!(energy.balance.abs() < 2e-3 * start, "{kind}: {energy:?} of {start}");
    }
}

/// A resumed run gives the same bits.
#[test]
fn initial_stress_resumes_with_same_bits() {
    let mut deck = loaded(2, BOX, STRESS);
    deck.initial[0].gradient = Some(slopes());
    let mut whole = simulation(&deck);
    steps(&mut whole, 20);
    let mut part = simulation(&deck);
    steps(&mut part, 8);
    let saved = part.save();
    let again = Simulation::restore(model(&deck), Simd::default(), &saved);
    let mut again = again.unwrap_or_else(|error| panic!("{error}"));
    steps(&mut again, 12);
    assert_eq!(bits(&whole.displacements()), bits(&again.displacements()));
    assert_eq!(bits(&whole.tractions()), bits(&again.tractions()));
    assert_eq!(
        whole.energy().values().map(f64::to_bits),
        again.energy().values().map(f64::to_bits)
    );
}

#[test]
fn invalid_initial_stress_is_refused() {
    let faults = |change: &dyn Fn(&mut Deck)| {
        let mut deck = loaded(0, BOX, STRESS);
        change(&mut deck);
        let error = deck.build().err().unwrap_or_else(|| panic!("nothing is wrong"));
        error.to_string()
    };
    let nowhere = faults(&|deck| deck.initial[0].r#where = plane(0, 77.0));
    assert!(nowhere.contains("initial[0].where") && nowhere.contains("no block"), "{nowhere}");
    let alone = faults(&|deck| {
        deck.initial[0] = Initial { gradient: Some(slopes()), ..Initial::default() };
    });
    assert!(alone.contains("`gradient` needs `stress`"), "{alone}");
    let infinite = faults(&|deck| deck.initial[0].stress = Some([f64::NAN; 6]));
    assert!(infinite.contains("initial[0].stress"), "{infinite}");
}

/// A warning names each face without support and the missing force; a model in equilibrium has no
/// warning.
#[test]
fn unbalanced_faces_warn() {
    let mut deck = loaded(0, BOX, [-6e6, -4e6, -9e6, 0.0, 0.0, 0.0]);
    let unbalanced = |deck: &Deck| {
        let warnings = crate::decks::warnings(deck).into_iter();
        warnings.filter(|warning| warning.contains("[unbalanced-stress]")).collect::<Vec<_>>()
    };
    assert_eq!(unbalanced(&deck), Vec::<String>::new());
    // Removes the pressure on x = 3, an area of 4 m2.
    deck.load.remove(1);
    let warnings = unbalanced(&deck);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let message = ["x = 3.000000 m, looking along +x", "-2.4000e7", "100.00 %"];
    assert!(message.iter().all(|words| warnings[0].contains(words)), "{}", warnings[0]);
    let lines = "\n  [[fix]]\n  where = { x = 3.0 }\n  axes = \"x\"\n";
    assert!(warnings[0].contains(lines), "{}", warnings[0]);
    // At the top under gravity the advice is a load, not a support.
    let mut below = deck.clone();
    below.model.gravity = [-9.81, 0.0, 0.0];
    let lines = "\n  [[load]]\n  where = { x = 3.0 }\n  traction = [-6000000.0, 0.0, 0.0]\n";
    assert!(unbalanced(&below)[0].contains(lines), "{:?}", unbalanced(&below));
    // Pressure on one half and tension on the other cancel, so no single load can carry them.
    let mut bent = deck.clone();
    bent.initial[0].stress = Some([-1e6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let slope = Some([1e6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    bent.initial[0].gradient = Some(Gradient { y: slope, ..Gradient::default() });
    let lines = "\n  [[fix]]\n  where = { x = 3.0 }\n  axes = \"x\"\n";
    let of_x = |deck: &Deck| unbalanced(deck).into_iter().find(|text| text.contains("along +x"));
    assert!(of_x(&bent).is_some_and(|text| text.contains(lines)), "{:?}", unbalanced(&bent));
    bent.model.gravity = [-9.81, 0.0, 0.0];
    let message = of_x(&bent).unwrap_or_default();
    assert!(message.contains("hold them") && !message.contains("[[load]]\n"), "{message}");
    deck.fix.push(fix(plane(0, 3.0), "x"));
    assert_eq!(unbalanced(&deck), Vec::<String>::new());
}
