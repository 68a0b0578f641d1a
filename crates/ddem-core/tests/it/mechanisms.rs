//! A relax stage refuses supports that leave a rigid motion, and names the motion.

use ddem_deck::{BlockSet, Deck, Extent, Remove, StageKind, Where};

use crate::decks::*;

/// Error in stage `static` of a beam of 4 m × 1 m × 2 m, if there is one.
fn fault(change: impl FnOnce(&mut Deck)) -> Option<String> {
    let mut deck = deck([2, 1, 1], [4.0, 1.0, 2.0], 2, 0.02);
    deck.stage.push(relax_stage("static"));
    change(&mut deck);
    let error = deck.build().err()?;
    assert_eq!(error.faults.len(), 1, "{error}");
    assert_eq!(error.faults[0].place, "stage[0]");
    assert!(error.faults[0].message.contains("`static`"), "{error}");
    Some(error.faults[0].message.clone())
}

fn motions(message: &str) -> Vec<&str> {
    message.split_once("rigid body: ").map_or("", |(_, names)| names).split(", ").collect()
}

fn line(x: f64, z: f64) -> Where {
    Where { x: Some(Extent::Plane(x)), ..plane(2, z) }
}

#[test]
fn unsupported_model_has_six_rigid_motions() {
    let message = fault(|_| {}).expect("nothing is held");
    for motion in ["translation along", "rotation about"] {
        for axis in ["x", "y", "z"] {
            assert!(message.contains(&format!("{motion} {axis}")), "{message}");
        }
    }
    assert!(message.contains("let the model move"), "{message}");
}

#[test]
fn hinge_line_leaves_one_rotation() {
    let message = fault(|deck| deck.fix.push(fix(line(0.0, 0.0), "xyz"))).expect("a hinge");
    assert!(message.ends_with("rotation about y through (0.0000, 0.5000, 0.0000)"), "{message}");
    assert!(!message.contains("translation"), "{message}");
    // Supports on an edge far from the origin: the axis of rotation passes through it.
    let message = fault(|deck| {
        deck.blocks[0].origin = [100.0, 20.0, -3.0];
        deck.fix.push(fix(line(104.0, -1.0), "xyz"));
    });
    let message = message.expect("a hinge");
    assert!(
        message.ends_with("rotation about y through (104.0000, 20.5000, -1.0000)"),
        "{message}"
    );
}

#[test]
fn smooth_plane_leaves_two_translations_and_rotation() {
    let message = fault(|deck| deck.fix.push(fix(plane(2, 0.0), "z"))).expect("a plane");
    let names = motions(&message);
    assert_eq!(names[..2], ["translation along x", "translation along y"], "{message}");
    assert!(names[2].starts_with("rotation about z"), "{message}");
    assert!(!message.contains("along z") && !message.contains("about x"), "{message}");
}

#[test]
fn two_smooth_planes_leave_one_translation() {
    let message = fault(|deck| {
        deck.fix.push(fix(plane(2, 0.0), "z"));
        deck.fix.push(fix(plane(1, 0.0), "y"));
    });
    assert_eq!(motions(&message.expect("free along x")), ["translation along x"]);
}

#[test]
fn unsupported_set_is_named() {
    let two = |deck: &mut Deck| {
        deck.blocks[0].name = Some("held".into());
        let free = BlockSet {
            name: Some("loose".into()),
            origin: [10.0, 0.0, 0.0],
            ..deck.blocks[0].clone()
        };
        deck.blocks.push(free);
        deck.fix.push(fix(plane(0, 0.0), "xyz"));
    };
    let message = fault(two).expect("one set is free");
    assert!(message.contains("block 2 of the set `loose`"), "{message}");
    assert!(message.contains("translation along z"), "{message}");
}

#[test]
fn disconnected_part_is_named() {
    let message = fault(|deck| {
        deck.blocks[0].size = Some([6.0, 1.0, 2.0]);
        deck.blocks[0].count = Some([3, 1, 1]);
        let middle = Where { x: Some(Extent::Range([2.5, 3.5])), ..Where::default() };
        deck.remove.push(Remove { r#where: middle, ..Remove::default() });
        deck.fix.push(fix(plane(0, 0.0), "xyz"));
    });
    let message = message.expect("the far block is free");
    assert!(message.contains("block 1 of the set `blocks[0]`"), "{message}");
}

#[test]
fn sufficient_supports_and_dynamic_stages_pass() {
    assert_eq!(fault(|deck| deck.fix.push(fix(plane(0, 0.0), "xyz"))), None);
    // Six restraints, just enough.
    assert_eq!(
        fault(|deck| {
            deck.fix.push(fix(line(0.0, 0.0), "xz"));
            deck.fix.push(fix(line(4.0, 0.0), "z"));
            let corner = Where { y: Some(Extent::Plane(0.0)), ..line(0.0, 0.0) };
            deck.fix.push(fix(corner, "y"));
        }),
        None
    );
    let dynamic = |deck: &mut Deck| {
        deck.stage[0].kind = StageKind::Dynamic;
        deck.stage[0].duration = Some(1.0);
    };
    assert_eq!(fault(dynamic), None);
}

/// A rotation about an axis that is not parallel to x, y or z is given in numbers.
#[test]
fn oblique_hinge_axis_is_given_in_numbers() {
    let message = fault(|deck| {
        let corner =
            |x, y, z| Where { x: Some(Extent::Plane(x)), y: Some(Extent::Plane(y)), ..plane(2, z) };
        deck.fix.push(fix(corner(0.0, 0.0, 0.0), "xyz"));
        deck.fix.push(fix(corner(4.0, 1.0, 2.0), "xyz"));
    });
    let message = message.expect("a diagonal hinge");
    let axis = "rotation about (0.873, 0.218, 0.436) through (2.0000, 0.5000, 1.0000)";
    assert!(message.ends_with(axis), "{message}");
}
