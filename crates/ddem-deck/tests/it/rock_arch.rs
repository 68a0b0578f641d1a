//! Heyman's arch: the least thickness of a semicircular arch of stones.

use std::path::Path;

use ddem_core::{RunError, Simulation};
use ddem_deck::{Body, BuiltDeck, read, read_files};

/// Least thickness over the radius of the middle line: 0.1075 by Heyman (The Stone Skeleton, 1966), for any
/// number of stones. For the 20 straight stones of the example, whose hinges are at joints 9 deg apart, a
/// line of thrust fits from 0.1073 on.
const HEYMAN: f64 = 0.1075;

/// True if the example arch comes to rest with a thickness, given as a part of the least one; false if its
/// stones move against each other without end.
fn stands(part: f64, body: Body) -> bool {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let (mut deck, _) = read(&folder.join("arch.toml")).unwrap();
    read_files(&mut deck, &folder).unwrap();
    // The intrados has a radius of 1 m: t = ratio (1 + t/2).
    let ratio = part * HEYMAN;
    let thickness = ratio / (1.0 - ratio / 2.0);
    deck.region[0].body = body;
    let prism = deck.region[0].prism.as_mut().unwrap();
    let before = prism.outline.iter().map(|corner| corner[0]).fold(0.0, f64::max);
    for corner in &mut prism.outline {
        let scale = (1.0 + thickness) / before;
        corner[0] *= scale;
        // The feet of the abutments keep their level.
        corner[1] *= if corner[1] > 0.0 { scale } else { 1.0 };
    }
    let mut simulation = Simulation::new(BuiltDeck::new(&deck).unwrap().model());
    match simulation.relax(1e-5, 100_000) {
        Ok(_) => true,
        Err(RunError::NoEquilibrium { .. }) => false,
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn arch_stands_above_the_least_thickness_and_falls_below() {
    for body in [Body::Deformable, Body::Rigid] {
        assert!(stands(1.02, body));
        assert!(!stands(0.98, body));
    }
}
