//! Boundaries and loads act on the blocks that are present in the stage where they start.

use ddem_core::Simulation;
use ddem_deck::*;

use crate::decks::*;

fn dynamic(name: &str) -> Stage {
    Stage { kind: StageKind::Dynamic, duration: Some(0.05), ..relax_stage(name) }
}

fn within(x: [f64; 2], z: [f64; 2]) -> Where {
    Where { x: Some(Extent::Range(x)), z: Some(Extent::Range(z)), ..Where::default() }
}

fn boundary(region: Where, kind: BoundaryKind, from: Option<&str>) -> Boundary {
    let from = from.map(str::to_owned);
    Boundary { r#where: region, kind, velocity: None, history: None, from, until: None }
}

/// Blocks of 1 m³ without supports, some of which are removed in the stage `dig`.
fn excavated(count: [u32; 3], removed: Option<Where>) -> Deck {
    let mut deck = deck(count, count.map(f64::from), 2, 0.02);
    if let Some(section) = deck.joints.get_mut("seam") {
        section.material = Some("rock".into());
    }
    deck.stage = vec![dynamic("before"), dynamic("dig")];
    let from = Some("dig".to_owned());
    deck.remove.extend(removed.map(|region| Remove { r#where: region, from, ..Remove::default() }));
    deck
}

/// A face that an excavation opens resists the velocity v with −ρ c_P v from that stage on: 3 km/s
/// and 2400 kg/m³ on one square metre.
#[test]
fn exposed_face_gets_its_boundary() {
    let mut deck = excavated([1, 1, 4], Some(within([0.0, 1.0], [2.0, 4.0])));
    deck.boundary.push(boundary(plane(2, 1.99), BoundaryKind::Viscous, Some("dig")));
    let mut simulation = simulation(&deck);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    let moving = vec![[0.0, 0.0, 1.0]; simulation.model().n_nodes()];
    simulation.set_velocities(&moving);
    let answer: f64 = simulation.forces().iter().map(|force| force[2]).sum();
    assert!((answer / (-2400.0 * 3000.0) - 1.0).abs() < 1e-12, "{answer}");
    // The face does not exist before, and the old top does not exist any more.
    deck.boundary[0].from = None;
    refused(&deck, &["boundary[0].where", "no outer face"]);
    deck.boundary[0] = boundary(plane(2, 4.0), BoundaryKind::Viscous, Some("dig"));
    refused(&deck, &["boundary[0].where", "no outer face"]);
    deck.boundary[0].from = None;
    model(&deck);
}

/// Warnings refer to that stage: a wall of the hole has no rock behind it, and another entry may
/// fix the nodes of dashpots.
#[test]
fn boundary_warnings_refer_to_its_stage() {
    let mut deck = excavated([3, 1, 3], Some(within([1.0, 2.0], [1.0, 2.0])));
    deck.boundary.push(boundary(Where::default(), BoundaryKind::Viscous, None));
    assert_eq!(crate::decks::warnings(&deck), Vec::<String>::new());
    deck.boundary[0].from = Some("dig".into());
    let warnings = crate::decks::warnings(&deck);
    let walls = "boundary[0].where: it acts on 4 faces in cavities";
    assert!(warnings.len() == 1 && warnings[0].starts_with(walls), "{warnings:?}");
    // Half of the nodes are fixed, but they have been removed.
    let mut deck = excavated([2, 1, 1], Some(within([0.0, 1.0], [0.0, 1.0])));
    deck.boundary.push(boundary(plane(2, 0.0), BoundaryKind::Viscous, Some("dig")));
    deck.fix.push(fix(within([0.0, 0.99], [0.0, 1.0]), "xyz"));
    assert_eq!(crate::decks::warnings(&deck), Vec::<String>::new());
    deck.remove.clear();
    let warnings = crate::decks::warnings(&deck);
    assert!(warnings.len() == 1 && warnings[0].contains("9 of 18 nodes"), "{warnings:?}");
}

/// An earlier boundary includes half of a joint that is removed later. Another boundary may still
/// take the rest of the face.
#[test]
fn part_of_face_beside_hole_has_one_boundary() {
    let mut deck = excavated([2, 1, 1], Some(within([1.0, 2.0], [0.0, 1.0])));
    let part = |from: f64, to: f64| Where { x: Some(Extent::Range([from, to])), ..plane(2, 0.0) };
    deck.boundary.push(boundary(part(0.3, 1.0), BoundaryKind::Viscous, None));
    deck.boundary.push(boundary(part(0.0, 0.3), BoundaryKind::Viscous, Some("dig")));
    model(&deck);
    deck.boundary[1].r#where = part(0.0, 0.4);
    refused(&deck, &["boundary[1].where", "that boundary 0 has"]);
}

/// Base of a free field.
#[derive(Clone, Copy, PartialEq)]
enum Base {
    /// Dashpots with an incoming wave.
    Viscous,
    /// Support with a velocity.
    Driven,
    /// The same, and all nodes driven along y.
    Slab,
}

/// Displacements and velocities of free-field columns after shaking from below.
fn columns(base: Base, from: Option<&str>, damping: Damping, removed: Option<Where>) -> Vec<f64> {
    let mut deck = excavated([2, 1, 4], removed);
    let velocity = Some([1.0, 0.4, 0.5]);
    let driven = |region: Where, axes: &str| Fix {
        velocity: Some(
            [("x", 1.0), ("y", 0.4), ("z", 0.5)].map(
                |(axis, v)| {
                    if axes.contains(axis) { v } else { 0.0 }
                },
            ),
        ),
        from: from.map(str::to_owned),
        ..fix(region, axes)
    };
    match base {
        Base::Viscous => {
            let base = boundary(plane(2, 0.0), BoundaryKind::Viscous, from);
            deck.boundary.push(Boundary { velocity, ..base });
        }
        Base::Driven => deck.fix.push(driven(plane(2, 0.0), "xyz")),
        Base::Slab => {
            deck.fix = vec![driven(plane(2, 0.0), "xz"), driven(Where::default(), "y")];
        }
    }
    deck.boundary.push(boundary(plane(0, 0.0), BoundaryKind::FreeField, Some("dig")));
    let mut simulation: Simulation = simulation(&deck);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    let begun = simulation.start(damping, TimeStep::Seconds(2e-6), None);
    begun.unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..600 {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    assert!(largest(&simulation.displacements()) > 1e-4);
    simulation.column_levels().into_flattened().into_flattened()
}

/// The free field of a side continues beside a hole, and ends where the model ends.
#[test]
fn free_field_columns_continue_beside_holes() {
    let columns = |removed| columns(Base::Viscous, Some("dig"), Damping::None, removed);
    let level = columns(None);
    // Three lines of twelve levels, with one displacement and one velocity each.
    assert_eq!(level.len(), 3 * 12 * 6);
    let hole = columns(Some(within([0.0, 1.0], [2.0, 3.0])));
    assert_eq!(level, hole);
    assert_eq!(columns(Some(within([0.0, 2.0], [2.0, 4.0]))).len(), 3 * 6 * 6);
}

/// Beside a hole, and at its foot, the free field keeps its damping and supports, whichever stage
/// they started in.
#[test]
fn free_field_keeps_damping_and_supports_beside_holes() {
    let (middle, foot) = (within([0.0, 1.0], [1.0, 2.0]), within([0.0, 1.0], [0.0, 1.0]));
    for (base, damping, undamped) in [
        (Base::Viscous, Damping::None, false),
        (Base::Viscous, Damping::Mass(2000.0), true),
        (Base::Viscous, Damping::Ratio(0.1), true),
        (Base::Driven, Damping::Ratio(0.1), true),
        (Base::Slab, Damping::None, false),
    ] {
        for from in [None, Some("dig")] {
            let of = |damping, removed| columns(base, from, damping, removed);
            let level = of(damping, None);
            let size = level.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            let differs = |other: &[f64]| {
                assert_eq!(level.len(), other.len());
                let away = level.iter().zip(other).map(|(a, b)| (a - b).abs());
                away.fold(0.0, f64::max) / size
            };
            for removed in [&middle, &foot] {
                let off = differs(&of(damping, Some(removed.clone())));
                assert!(off < 1e-11, "{damping:?}, {from:?}: {off}");
            }
            // The damping has an effect.
            assert!(!undamped || differs(&of(Damping::None, None)) > 0.01, "{damping:?}");
        }
    }
}

/// A face that a block covers in part is whole after the block is removed.
#[test]
fn loads_find_faces_completed_by_removal() {
    let mut deck = excavated([1, 1, 1], None);
    let small = BlockSet {
        name: Some("small".into()),
        size: Some([0.5; 3]),
        origin: [0.25, 0.25, 1.0],
        ..deck.blocks[0].clone()
    };
    deck.blocks.push(small);
    deck.joints.insert(
        "seam".into(),
        Joint { normal_stiffness: Some(1e9), shear_stiffness: Some(1e9), ..Joint::default() },
    );
    let region = Where { set: Some("small".into()), ..Where::default() };
    deck.remove.push(Remove { r#where: region, from: Some("dig".into()), ..Remove::default() });
    let load = Load { r#where: plane(2, 1.5), pressure: Some(1.0), ..Load::default() };
    let until = Some("dig".to_owned());
    deck.load.push(Load { until, ..load.clone() });
    let message = |deck: &Deck| crate::decks::warnings(deck).join("\n");
    assert_eq!(message(&deck), "");
    deck.load[0] = Load { r#where: Where::default(), ..load };
    assert!(message(&deck).contains("load[0].where: 1 face is left out"), "{}", message(&deck));
    deck.load[0].from = Some("dig".into());
    assert_eq!(message(&deck), "");
}
