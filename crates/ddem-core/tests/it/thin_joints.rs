//! Joints that are very thin or very stiff compared with their blocks. Relaxation finds the same
//! equilibrium in as many steps, down to the rounding of the forces.

use ddem_core::{RunError, Simulation};
use ddem_deck::*;

use crate::decks::*;

const TALL: f64 = 4.0;

/// Cube of 8 × 8 × 8 blocks under its own weight, fixed at the base and, if `sideways`, at its
/// sides.
fn cube(thickness: f64, divisions: u32, sideways: bool) -> Deck {
    let mut deck = deck([8; 3], [TALL; 3], divisions, thickness);
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.joints.insert("seam".into(), layer(thickness));
    deck.fix.push(fix(plane(2, 0.0), if sideways { "z" } else { "xyz" }));
    for (axis, name) in [(0, "x"), (1, "y")].into_iter().filter(|_| sideways) {
        deck.fix.push(fix(plane(axis, 0.0), name));
        deck.fix.push(fix(plane(axis, TALL), name));
    }
    deck
}

fn layer(thickness: f64) -> Joint {
    Joint { thickness, material: Some("rock".into()), ..Joint::default() }
}

/// Settlement of the top with fixed sides, `ρ g H² / 2(λ + 2G)`; layers consist of the same rock.
fn settlement(deck: &Deck) -> f64 {
    let Material { density, young, poisson, .. } = deck.materials["rock"];
    let modulus = young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    density * 9.81 * TALL * TALL / (2.0 * modulus)
}

fn top(simulation: &Simulation) -> f64 {
    let u = simulation.displacements();
    let at_top = points(simulation.model());
    let on = at_top.iter().zip(u).filter(|(x, _)| x.z > TALL - 1e-12);
    let down: Vec<f64> = on.map(|(_, u)| -u[2]).collect();
    down.iter().sum::<f64>() / down.len() as f64
}

/// Exact settlement for any thickness down to a millionth of a millimetre, in as many steps.
#[test]
fn relaxation_is_independent_of_joint_thickness() {
    for (thickness, divisions) in [(1e-3, 1), (1e-5, 1), (1e-7, 1), (1e-9, 1), (1e-7, 2)] {
        for kinematics in [Kinematics::Small, Kinematics::Corotational] {
            let mut deck = cube(thickness, divisions, true);
            deck.model.kinematics = kinematics;
            let exact = settlement(&deck);
            let mut held = simulation(&deck);
            let steps = held.relax(1e-5, 2000).unwrap_or_else(|error| panic!("{error}"));
            let off = top(&held) / exact - 1.0;
            println!("{thickness} {divisions} {kinematics:?}: {steps} steps, {off:e}");
            assert!(off.abs() < 1e-4 && steps < 500, "{thickness} {kinematics:?}: {steps} {off:e}");
            // Free sides bulge; these modes have larger eigenvalues than the opening of joints.
            let mut free = cube(thickness, divisions, false);
            free.model.kinematics = kinematics;
            let steps =
                simulation(&free).relax(1e-5, 2000).unwrap_or_else(|error| panic!("{error}"));
            println!("  free: {steps} steps");
            assert!(steps < 500, "{thickness} {kinematics:?}: {steps}");
        }
    }
}

#[test]
fn tolerance_below_rounding_names_reachable_ratio() {
    let mut simulation = simulation(&cube(1e-7, 1, false));
    let Err(error) = simulation.relax(1e-10, 20_000) else { panic!("it was reached") };
    println!("{error}");
    let RunError::UnreachableTolerance { ratio, ref joint, .. } = error else { panic!("{error}") };
    assert_eq!(joint, &Some(("seam".to_owned(), 1e-7)));
    // The reported ratio can be reached.
    simulation.relax(3.0 * ratio, 1000).unwrap_or_else(|error| panic!("{error}"));
}

/// Energy of a layer of one element when the block above stretches and the one below does not, for
/// any element of the blocks. With u = a x (1 + ζ)/2 in the layer it is G a² A (ℓ²/12)/2t in slip
/// and M a² A t/6 along.
#[test]
fn layer_resists_gradient_of_slip() {
    for element in [ElementKind::Standard, ElementKind::Incompatible] {
        for thickness in [1e-1, 1e-3, 1e-6] {
            let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 1, thickness);
            deck.joints.insert("seam".into(), layer(thickness));
            deck.model.element = element;
            deck.model.kinematics = Kinematics::Small;
            let mut simulation = simulation(&deck);
            let stretch = 1e-4;
            let moved = points(simulation.model()).into_iter();
            let moved =
                moved.map(|x| [if x.z > 1.0 { stretch * (x.x - 0.5) } else { 0.0 }, 0.0, 0.0]);
            let moved: Vec<[f64; 3]> = moved.collect();
            simulation.set_displacements(&moved);
            let Material { young, poisson, .. } = deck.materials["rock"];
            let shear = young / (2.0 * (1.0 + poisson));
            let modulus = 2.0 * shear * (1.0 - poisson) / (1.0 - 2.0 * poisson);
            let slip = shear * stretch * stretch / (24.0 * thickness);
            let along = modulus * stretch * stretch * thickness / 6.0;
            let off = simulation.energy().strain_joints / (slip + along) - 1.0;
            assert!(off.abs() < 1e-9, "{element:?} {thickness}: {off:e}");
        }
    }
}

/// A joint stiffer than its blocks by more than sixteen digits: rounding cancels the stiffness of
/// the blocks, so the masses of a relaxation cannot be computed. This is an error; no node silently
/// stays in place.
#[test]
fn joint_stiffness_beyond_double_precision_is_refused() {
    let pulled = |stiffness: f64| {
        let mut deck = deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.0);
        let springs = Joint {
            normal_stiffness: Some(stiffness),
            shear_stiffness: Some(stiffness),
            ..Joint::default()
        };
        deck.joints = [("seam".to_owned(), springs)].into();
        deck.fix = vec![fix(plane(0, 0.0), "xyz")];
        deck.model.gravity = [9.81, 0.0, 0.0];
        Simulation::new(model(&deck)).start_relaxation(1).map_err(|error| error.to_string())
    };
    assert_eq!(pulled(1e14), Ok(()));
    let message = pulled(1e30);
    assert!(
        message.as_ref().is_err_and(|message| message.contains("no mass for node")),
        "{message:?}"
    );
}
