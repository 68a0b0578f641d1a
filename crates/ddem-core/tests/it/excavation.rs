//! Blocks that are removed at the start of a stage.

use std::sync::Arc;

use ddem_core::law::MohrCoulomb;
use ddem_core::{Simd, Simulation};
use ddem_deck::*;

use crate::decks::*;

const STRESS: [f64; 6] = [-3e6, -3e6, -8e6, 0.0, 0.0, 0.0];

/// Column of four blocks under stress, supported on all sides; the upper two are removed.
fn column(release: Option<f64>, kind: StageKind) -> Deck {
    let mut deck = deck([1, 1, 4], [1.0, 1.0, 4.0], 2, 0.02);
    if let Some(section) = deck.joints.get_mut("seam") {
        section.material = Some("rock".into());
    }
    deck.initial.push(Initial { stress: Some(STRESS), ..Initial::default() });
    for (axis, name) in [(0, "x"), (1, "y")] {
        deck.fix.push(fix(plane(axis, 0.0), name));
        deck.fix.push(fix(plane(axis, 1.0), name));
    }
    deck.fix.push(fix(plane(2, 0.0), "z"));
    deck.fix.push(fix(plane(2, 4.0), "z"));
    let duration = (kind == StageKind::Dynamic).then_some(0.05);
    deck.stage = vec![relax_stage("before"), Stage { kind, duration, ..relax_stage("dig") }];
    let upper = Where { z: Some(Extent::Range([2.0, 4.0])), ..Where::default() };
    let from = Some("dig".to_owned());
    deck.remove.push(Remove { r#where: upper, from, release, ..Remove::default() });
    deck
}

fn relax(simulation: &mut Simulation, increments: u32) {
    simulation.start_relaxation(increments).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..20_000 {
        let relaxed = simulation.relax_step(1e-9).unwrap_or_else(|error| panic!("{error}"));
        if relaxed == ddem_core::Relaxed::Done {
            return simulation.finish_relaxation();
        }
    }
    panic!("no equilibrium");
}

fn excavated(release: Option<f64>, increments: u32) -> Simulation {
    let mut simulation = simulation(&column(release, StageKind::Relax));
    relax(&mut simulation, 1);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    relax(&mut simulation, increments);
    simulation
}

/// The face moves by σ⁰ H/(λ + 2G), at once or in increments; no stress along z remains.
#[test]
fn excavated_face_moves_by_elastic_unloading() {
    let stiff = 18e9 * (1.0 - 0.25) / ((1.0 + 0.25) * (1.0 - 0.5));
    // The face of the second block is half a joint below the plane.
    let exact = 8e6 * (2.0 - 0.01) / stiff;
    for (release, increments) in [(None, 1), (Some(1.0), 1), (Some(1.0), 5)] {
        let mut simulation = excavated(release, increments);
        let model = simulation.model();
        let top = model.nearest_node([0.5, 0.5, 1.98]);
        let found = simulation.displacement(top)[2];
        assert!((found / exact - 1.0).abs() < 1e-6, "{release:?}: {found} {exact}");
        let stress = simulation.stress(0, [0; 3]);
        assert!(stress[2].abs() < 1e-5 * 8e6, "{stress:?}");
        let drop = 8e6 / 3.0;
        assert!((stress[0] - (-3e6 + drop)).abs() < 1e-5 * 8e6, "{stress:?}");
        let energy = simulation.energy();
        let size = energy.strain_bodies.abs() + energy.external_work.abs();
        assert!(energy.balance.abs() < 1e-9 * size, "{energy:?}");
        assert!(simulation.model().is_removed(3) && !simulation.model().is_removed(1));
        assert_eq!(simulation.stress(3, [0; 3]), [0.0; 6]);
    }
}

/// Nothing moves before the release begins to fade.
#[test]
fn forces_continue_until_release_fades() {
    let mut simulation = simulation(&column(Some(1e9), StageKind::Dynamic));
    relax(&mut simulation, 1);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    simulation.forces();
    assert!(simulation.unbalanced() < 1e-12, "{}", simulation.unbalanced());
    for _ in 0..50 {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    assert!(largest(&simulation.displacements()) < 1e-12);
}

/// Release while blocks move: a resume in the middle gives the same bits, and energies balance.
#[test]
fn dynamic_release_resumes_with_same_bits_and_balances() {
    let mut deck = column(Some(0.002), StageKind::Dynamic);
    deck.model.kinematics = Kinematics::Small;
    let run = |from: Option<Simulation>, steps: usize| {
        let mut simulation = from.unwrap_or_else(|| {
            let mut simulation = simulation(&deck);
            simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
            let begun = simulation.start(Damping::None, TimeStep::Auto, Some(0.05));
            begun.unwrap_or_else(|error| panic!("{error}"));
            simulation
        });
        for _ in 0..steps {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        simulation
    };
    let mut whole = run(None, 300);
    let half = run(None, 120);
    let again = Simulation::restore(model(&deck), Simd::default(), &half.save());
    let mut again = run(Some(again.unwrap_or_else(|error| panic!("{error}"))), 180);
    assert_eq!(bits(&whole.displacements()), bits(&again.displacements()));
    assert_eq!(
        whole.energy().values().map(f64::to_bits),
        again.energy().values().map(f64::to_bits)
    );
    let energy = whole.energy();
    assert!(energy.kinetic > 0.01, "{energy:?}");
    let size = energy.strain_bodies.abs() + energy.external_work.abs();
    assert!(energy.balance.abs() < 1e-10 * size, "{energy:?}");
}

/// Blocks fall when the blocks below are removed. This includes failed joints and contacts.
#[test]
fn blocks_fall_after_blocks_below_are_removed() {
    for body in [Body::Deformable, Body::Rigid] {
        let mut deck = deck([1, 1, 3], [1.0, 1.0, 3.0], 1, 0.02);
        deck.blocks[0].body = body;
        deck.joints.insert(
            "seam".into(),
            Joint {
                normal_stiffness: Some(1e9),
                shear_stiffness: Some(1e9),
                friction: Some(30.0),
                ..Joint::default()
            },
        );
        deck.model.gravity = [0.0, 0.0, -10.0];
        deck.fix.push(fix(plane(2, 0.0), "xyz"));
        let dig = Stage { kind: StageKind::Dynamic, duration: Some(0.3), ..relax_stage("dig") };
        deck.stage = vec![relax_stage("before"), dig];
        let middle = Where { z: Some(Extent::Range([1.0, 2.0])), ..Where::default() };
        let from = Some("dig".to_owned());
        deck.remove.push(Remove { r#where: middle, from, ..Remove::default() });
        let mut simulation = simulation(&deck);
        relax(&mut simulation, 1);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        let steps = simulation.start(Damping::None, TimeStep::Auto, Some(0.3));
        let steps = steps.unwrap_or_else(|error| panic!("{error}"));
        for _ in 0..steps {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        let top = simulation.model().nearest_node([0.0, 0.0, 3.0]);
        let fallen = simulation.displacement(top)[2];
        assert!((fallen / (-0.5 * 10.0 * 0.09) - 1.0).abs() < 0.01, "{body:?}: {fallen}");
    }
}

/// Blocks whose joints can fail only by a law of the program make contact, also after an
/// excavation.
#[test]
fn blocks_with_program_law_make_contact() {
    let mut deck = deck([1, 1, 3], [1.0, 1.0, 3.0], 1, 0.02);
    deck.blocks[0].body = Body::Rigid;
    deck.model.gravity = [0.0, 0.0, -10.0];
    deck.fix.push(fix(plane(2, 0.0), "xyz"));
    let dynamic =
        |name: &str| Stage { kind: StageKind::Dynamic, duration: Some(0.6), ..relax_stage(name) };
    deck.stage = vec![dynamic("before"), dynamic("dig")];
    let middle = Where { z: Some(Extent::Range([1.0, 2.0])), ..Where::default() };
    let from = Some("dig".to_owned());
    deck.remove.push(Remove { r#where: middle, from, ..Remove::default() });
    let mut model = model(&deck);
    assert!(!model.can_meet());
    let law = MohrCoulomb { tan_friction: 0.5, ..MohrCoulomb::default() };
    model.set_law("seam", Arc::new(law)).unwrap_or_else(|fault| panic!("{fault}"));
    let mut simulation = Simulation::new(model);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    assert!(simulation.model().can_meet());
    let steps = simulation.start(Damping::None, TimeStep::Auto, Some(0.6));
    for _ in 0..steps.unwrap_or_else(|error| panic!("{error}")) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    // Without the gap of 1.02 m the block would fall 1.8 m in 0.6 s.
    let top = simulation.model().nearest_node([0.0, 0.0, 3.0]);
    let fallen = simulation.displacement(top)[2];
    assert!((-1.05..-0.5).contains(&fallen), "{fallen}");
}

/// Nonconforming joints are removed with their blocks. Forces continue at first, energies balance,
/// a resume gives the same bits, and fragments consist of the remaining blocks.
#[test]
fn nonconforming_joints_are_removed_with_their_blocks() {
    let springs =
        Joint { normal_stiffness: Some(8e10), shear_stiffness: Some(3e10), ..Joint::default() };
    let prepared = |release: f64| {
        let mut deck = column(Some(release), StageKind::Dynamic);
        deck.model.kinematics = Kinematics::Small;
        deck.joints.insert("seam".into(), springs.clone());
        let region = Where { z: Some(Extent::Range([1.0, 3.0])), ..Where::default() };
        deck.refine.push(Refine { r#where: region, factor: 2 });
        deck
    };
    let begun = |deck: &Deck| {
        let mut simulation = simulation(deck);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        let begun = simulation.start(Damping::None, TimeStep::Auto, Some(0.05));
        begun.unwrap_or_else(|error| panic!("{error}"));
        simulation
    };
    let go = |simulation: &mut Simulation, steps: usize| {
        for _ in 0..steps {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
    };
    // Points are located on faces in single precision.
    let mut held = begun(&prepared(1e9));
    held.forces();
    assert!(held.unbalanced() < 1e-6, "{:e}", held.unbalanced());
    let deck = prepared(0.002);
    let mut whole = begun(&deck);
    go(&mut whole, 200);
    let mut half = begun(&deck);
    go(&mut half, 90);
    let again = Simulation::restore(model(&deck), Simd::default(), &half.save());
    let mut again = again.unwrap_or_else(|error| panic!("{error}"));
    go(&mut again, 110);
    assert_eq!(bits(&whole.displacements()), bits(&again.displacements()));
    assert_eq!(bits(&whole.tractions()), bits(&again.tractions()));
    let energy = whole.energy();
    let size = energy.strain_bodies.abs() + energy.external_work.abs();
    assert!(energy.kinetic > 0.01 && energy.balance.abs() < 1e-6 * size, "{energy:?}");
    // One block, and the eight parts of the next.
    let left: Vec<usize> = whole.fragments().into_iter().flat_map(|f| f.blocks).collect();
    let there = (0..whole.model().n_blocks()).filter(|&block| !whole.model().is_removed(block));
    assert_eq!(left.len(), 9);
    assert_eq!(left, there.collect::<Vec<_>>());
    let tractions = whole.tractions();
    assert!(tractions.as_flattened().iter().all(|t| t.is_finite()), "{tractions:?}");
}

#[test]
fn invalid_excavations_are_refused() {
    let faults = |change: &dyn Fn(&mut Deck)| {
        let mut deck = column(None, StageKind::Relax);
        change(&mut deck);
        let error = deck.build().err().unwrap_or_else(|| panic!("nothing is wrong"));
        error.to_string()
    };
    let until = faults(&|deck| deck.remove[0].until = Some("dig".into()));
    assert!(until.contains("do not return"), "{until}");
    let first = faults(&|deck| deck.remove[0].from = Some("before".into()));
    assert!(first.contains("`before` is the first stage"), "{first}");
    let nothing = faults(&|deck| deck.remove[0].r#where = plane(0, 55.0));
    assert!(nothing.contains("remove[0].where") && nothing.contains("no block"), "{nothing}");
    let all = faults(&|deck| deck.remove[0].r#where = Where::default());
    assert!(all.contains("all blocks are removed"), "{all}");
    let never = faults(&|deck| (deck.remove[0].from, deck.remove[0].release) = (None, Some(1.0)));
    assert!(never.contains("`release` needs `from`"), "{never}");
    let charged = |until: Option<String>| {
        let mut deck = column(None, StageKind::Dynamic);
        let region = plane(2, 2.0);
        deck.charge.push(Charge {
            r#where: region,
            pressure: Some(1e5),
            until,
            ..Charge::default()
        });
        deck.build().err().map(|error| error.to_string()).unwrap_or_default()
    };
    let pushed = charged(None);
    assert!(
        pushed.contains("charge[0]") && pushed.contains("stage `dig` removes blocks"),
        "{pushed}"
    );
    assert_eq!(charged(Some("dig".into())), "");
}

/// Boundary forces end on removed blocks; the rest of the boundary continues.
#[test]
fn boundary_forces_end_on_removed_blocks() {
    let boundary = |axis: usize, at: f64, kind: BoundaryKind| Boundary {
        r#where: plane(axis, at),
        kind,
        velocity: None,
        history: None,
        from: Some("dig".into()),
        until: None,
    };
    for (kind, damping) in [
        (BoundaryKind::Viscous, Damping::Local(0.3)),
        (BoundaryKind::Viscous, Damping::None),
        (BoundaryKind::FreeField, Damping::None),
    ] {
        let mut deck = column(None, StageKind::Dynamic);
        deck.fix.iter_mut().for_each(|fix| fix.until = Some("dig".into()));
        deck.boundary.push(boundary(2, 0.0, BoundaryKind::Viscous));
        deck.boundary.extend([0.0, 1.0].map(|at| boundary(0, at, kind)));
        let mut simulation = simulation(&deck);
        relax(&mut simulation, 1);
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        simulation.start(damping, TimeStep::Auto, None).unwrap_or_else(|error| panic!("{error}"));
        for _ in 0..100 {
            simulation.step().unwrap_or_else(|error| panic!("{kind:?}, {damping:?}: {error}"));
        }
        let top = simulation.model().nearest_node([0.5, 0.5, 1.98]);
        let rises = simulation.displacement(top)[2];
        assert!(rises > 1e-5 && rises < 1e-2, "{kind:?}, {damping:?}: {rises}");
        assert!(simulation.unbalanced().is_finite());
    }
}

/// Each stage with an excavation stores the block data once more, but not the nodal data.
#[test]
fn excavation_memory_grows_with_block_data_only() {
    let mut deck = column(None, StageKind::Relax);
    deck.stage.push(relax_stage("again"));
    deck.stage.push(relax_stage("third"));
    let [removed] = &std::mem::take(&mut deck.remove)[..] else { panic!("one entry") };
    let bytes = |digs: &[[f64; 2]]| {
        let mut deck = deck.clone();
        for (z, stage) in digs.iter().zip(&deck.stage[1..]) {
            let region = Where { z: Some(Extent::Range(*z)), ..Where::default() };
            let from = Some(stage.name.clone());
            deck.remove.push(Remove { r#where: region, from, ..removed.clone() });
        }
        let mut simulation = simulation(&deck);
        let before = simulation.bytes();
        simulation.enter(digs.len()).unwrap_or_else(|error| panic!("{error}"));
        assert!(simulation.bytes() <= before, "{}", simulation.bytes());
        before
    };
    let all = [[3.0, 4.0], [2.0, 3.0], [1.0, 2.0]];
    let [none, one, two, three] = [0, 1, 2, 3].map(|n| bytes(&all[..n]));
    // More than 16 bytes per block and 12 bytes per cell, and the cuts along three edges.
    let more = one - none;
    assert!(more >= 4 * 28, "{more}");
    // One displacement for each of the 27 nodes of a block would exceed the total.
    assert!(more < 4 * 27 * 24, "{more}");
    assert_eq!([two - one, three - two], [more; 2]);
}

/// An in-situ stress balances all loads at once; a first release still fades by increments.
#[test]
fn release_in_first_relaxation_fades_by_increments() {
    let stiff = 18e9 * (1.0 - 0.25) / ((1.0 + 0.25) * (1.0 - 0.5));
    let exact = 8e6 * (2.0 - 0.01) / stiff;
    let mut simulation = simulation(&column(Some(1.0), StageKind::Relax));
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    simulation.start_relaxation(4).unwrap_or_else(|error| panic!("{error}"));
    let top = simulation.model().nearest_node([0.5, 0.5, 1.98]);
    let mut found = Vec::new();
    while found.len() < 4 {
        let relaxed = simulation.relax_step(1e-9).unwrap_or_else(|error| panic!("{error}"));
        if relaxed != ddem_core::Relaxed::Moving {
            found.push(simulation.displacement(top)[2] / exact);
        }
    }
    for (found, part) in found.iter().zip([0.25, 0.5, 0.75, 1.0]) {
        assert!((found / part - 1.0).abs() < 1e-6, "{found} {part}");
    }
}

/// A relaxation completes a release.
#[test]
fn relaxation_completes_a_release() {
    let stiff = 18e9 * (1.0 - 0.25) / ((1.0 + 0.25) * (1.0 - 0.5));
    let exact = 8e6 * (2.0 - 0.01) / stiff;
    let mut deck = column(Some(1e9), StageKind::Dynamic);
    deck.stage.push(relax_stage("after"));
    let mut simulation = simulation(&deck);
    relax(&mut simulation, 1);
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    simulation.step().unwrap_or_else(|error| panic!("{error}"));
    let top = simulation.model().nearest_node([0.5, 0.5, 1.98]);
    assert!(simulation.displacement(top)[2].abs() < 1e-6 * exact);
    assert!(simulation.enter(0).is_err());
    simulation.enter(2).unwrap_or_else(|error| panic!("{error}"));
    relax(&mut simulation, 1);
    let found = simulation.displacement(top)[2];
    assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
}

/// Data that do not change between stages are stored once.
#[test]
fn hundred_excavations_take_little_memory() {
    let bytes = |stages: usize| {
        let mut deck = deck([10, 10, 10], [10.0; 3], 1, 0.01);
        let name = |stage: usize| format!("dig {stage}");
        let dynamic = |stage: usize| Stage {
            name: name(stage),
            kind: StageKind::Dynamic,
            duration: Some(1.0),
            ..Stage::default()
        };
        deck.stage = (0..=stages).map(dynamic).collect();
        let block = |stage: usize| {
            let at = [stage % 10, stage / 10].map(|k| k as f64);
            let [x, y] = at.map(|at| Some(Extent::Range([at + 0.2, at + 0.8])));
            Where { x, y, z: Some(Extent::Range([9.2, 9.8])), ..Where::default() }
        };
        let remove = |stage: usize| Remove {
            r#where: block(stage),
            from: Some(name(stage + 1)),
            ..Remove::default()
        };
        deck.remove = (0..stages).map(remove).collect();
        Simulation::new(model(&deck)).bytes()
    };
    let (plain, excavated) = (bytes(0), bytes(100));
    // Four bytes per block and stage record the remaining blocks.
    assert!(10 * excavated < 13 * plain, "{excavated} B for {plain} B");
}
