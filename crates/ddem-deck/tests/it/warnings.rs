//! Data of charges, and warnings about decks.

use ddem_deck::*;

use crate::cavities::*;
use crate::decks::*;

fn within(from: [f64; 3], to: [f64; 3]) -> Where {
    let [x, y, z] = [0, 1, 2].map(|k| Some(Extent::Range([from[k], to[k]])));
    Where { x, y, z, ..Where::default() }
}

fn tnt(region: Where, mass: f64) -> Charge {
    let explosive = Some(Explosive::Named("tnt".into()));
    Charge { r#where: region, mass: Some(mass), explosive, ..Charge::default() }
}

fn dynamic(name: &str, duration: f64) -> Stage {
    Stage { kind: StageKind::Dynamic, duration: Some(duration), ..relax_stage(name) }
}

/// Blocks of a metre with joints without thickness, so that cavities are boxes.
fn boxes(cells: &[[f64; 3]]) -> Deck {
    let mut deck = hollow(BOX, cells, 0.0);
    let stiff = Some(1e10);
    let springs = Joint { normal_stiffness: stiff, shear_stiffness: stiff, ..Joint::default() };
    deck.joints.insert("seam".into(), springs);
    deck
}

fn one_of(deck: &Deck, part: &str) -> String {
    let warnings = crate::decks::warnings(deck);
    let found: Vec<_> = warnings.iter().filter(|w| w.contains(part)).collect();
    assert_eq!(found.len(), 1, "{part}: {warnings:?}");
    found[0].clone()
}

fn faults(deck: &Deck) -> String {
    let error = deck.build().err().unwrap_or_else(|| panic!("nothing is wrong"));
    error.faults.iter().map(|f| format!("{f} {}", f.help.as_deref().unwrap_or_default())).collect()
}

/// Values computed by hand: 500 kg of TNT in two cubic metres. The detonation pressure is 1630 ·
/// 6930²/(2 · 3.727) = 10.5016 GPa, and the gas has expanded 2 · 1630/500 = 6.52 times.
#[test]
fn charge_data_match_hand_calculation() {
    let mut deck = boxes(&[[1.0; 3], [2.0, 1.0, 1.0]]);
    deck.charge = vec![
        tnt(within([0.9; 3], [3.1, 2.1, 2.1]), 500.0),
        gas(within([0.9; 3], [3.1, 2.1, 2.1]), 3e6),
    ];
    let model_of = |deck: &Deck| {
        let model = model(deck);
        let message = crate::decks::warnings(deck);
        assert!(message.iter().all(|message| message.contains("[shared-cavity]")), "{message:?}");
        model.charges()
    };
    let [mass, pressure]: [_; 2] =
        model_of(&deck).try_into().unwrap_or_else(|all| panic!("{all:?}"));
    assert_eq!((mass.walls, mass.joints), (10, 0));
    assert!((mass.area - 10.0).abs() < 1e-12 && (mass.volume - 2.0).abs() < 1e-12, "{mass:?}");
    assert_eq!((mass.mass, mass.density), (Some(500.0), Some(1630.0)));
    assert!(mass.filling().is_some_and(|f| (f - 250.0).abs() < 1e-9), "{mass:?}");
    // exp(−2.727 ln 6.52) = 0.0060192
    assert!((mass.pressure / (10.5016e9 * 0.0060192) - 1.0).abs() < 1e-4, "{mass:?}");
    assert_eq!((pressure.pressure, pressure.mass, pressure.filling()), (3e6, None, None));
    // Four joints of a square metre each.
    let mut deck = boxes(&[]);
    deck.charge = vec![tnt(Where { x: Some(Extent::Range([0.9, 2.1])), ..plane(2, 2.0) }, 2.0)];
    let [joints]: [_; 1] = model_of(&deck).try_into().unwrap_or_else(|all| panic!("{all:?}"));
    assert_eq!((joints.walls, joints.joints), (0, 4), "{joints:?}");
    assert!((joints.area - 4.0).abs() < 1e-12 && joints.volume.abs() < 1e-12, "{joints:?}");
    assert!(joints.filling().is_none(), "{joints:?}");
    assert!((joints.pressure / 10.5016e9 - 1.0).abs() < 1e-4, "{joints:?}");
}

#[test]
fn charge_without_cavity_warns() {
    let mut deck = boxes(&[]);
    let line = Cylinder { from: [1.5, 1.5, 0.0], to: [1.5, 1.5, 4.0], radius: 0.2 };
    let hole = Where { cylinder: Some(line), ..Where::default() };
    deck.charge = vec![tnt(hole.clone(), 1.0)];
    let message = one_of(&deck, "[missing-remove]");
    assert!(message.contains("the charge acts on 3 joints"), "{message}");
    assert!(message.contains("a block at [1.5, 1.5, 0.5]"), "{message}");
    let reaches = Cylinder { radius: 0.6, ..line };
    deck.charge = vec![tnt(Where { cylinder: Some(reaches), ..Where::default() }, 1.0)];
    assert!(one_of(&deck, "[missing-remove]").contains("a block at [1.5, 1.5, 0.5]"));
    // No warning if the region contains joints only or is a plane of joints. No warning either if
    // it takes the joints of several blocks: along a line of joints, and all joints in a part of
    // the model.
    let joints = Cylinder { from: [2.0, 1.5, 0.0], to: [2.0, 1.5, 4.0], radius: 0.8 };
    for region in [
        ball([2.0, 1.5, 1.5], 0.4),
        Where { z: Some(Extent::Plane(1.0)), ..hole },
        Where { cylinder: Some(joints), ..Where::default() },
        ball([1.5; 3], 1.6),
    ] {
        deck.charge = vec![tnt(region, 1.0)];
        assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    }
}

#[test]
fn ineffective_charge_warns() {
    let mut deck = boxes(&[[1.0; 3]]);
    let region = ball([1.5; 3], 0.7);
    // In a cubic metre 10.5016e9 (m/1630)^2.727 is 0.1 MPa at 23.5 kg.
    deck.charge = vec![tnt(region.clone(), 23.0)];
    let message = one_of(&deck, "[weak-charge]");
    assert!(message.starts_with("charge[0].mass: 23 kg of explosive begin with 9.4"), "{message}");
    deck.charge = vec![tnt(region.clone(), 24.0)];
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    deck.charge = vec![gas(region, 1e4)];
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
}

#[test]
fn blast_in_relax_stage_warns() {
    let mut deck = boxes(&[[1.0; 3]]);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck.stage = vec![relax_stage("weight"), dynamic("blast", 0.1), relax_stage("rest")];
    let region = ball([1.5; 3], 0.7);
    let message = |charge: &Charge| {
        let deck = Deck { charge: vec![charge.clone()], ..deck.clone() };
        crate::decks::warnings(&deck).join("\n")
    };
    let charge = tnt(region.clone(), 500.0);
    let warned = message(&charge);
    assert!(warned.contains("in relax stage `weight`; `from`"), "{warned}");
    let strong = gas(region.clone(), 2e8);
    assert!(message(&strong).contains("the charge exerts 2.000e8 Pa"), "{}", message(&strong));
    let from = Some("blast".to_owned());
    assert_eq!(message(&Charge { from, ..charge.clone() }), "");
    assert_eq!(message(&Charge { delay: Some(0.05), ..charge.clone() }), "");
    // The charge has detonated before that stage.
    let again = vec![dynamic("blast", 0.1), relax_stage("rest"), dynamic("more", 0.1)];
    let later = Deck { charge: vec![charge.clone()], stage: again, ..deck.clone() };
    assert_eq!(crate::decks::warnings(&later), [""; 0]);
    let pulse = History::Triangle(Triangle { rise: 1e-4, fall: Some(1e-4), duration: None });
    assert_eq!(message(&given(region.clone(), 2e8, pulse)), "");
    // Stored gas.
    assert_eq!(message(&gas(region, 1e7)), "");
    // No motion follows, so an equilibrium is intended.
    let still = Deck { charge: vec![charge], stage: vec![relax_stage("weight")], ..deck.clone() };
    assert_eq!(crate::decks::warnings(&still), [""; 0]);
}

#[test]
fn stemming_of_another_set_warns() {
    let mut deck = boxes(&[[1.0, 1.0, 1.0], [1.0, 1.0, 2.0]]);
    deck.charge = vec![gas(within([0.9; 3], [2.1, 2.1, 3.1]), 1e6)];
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    deck.blocks[0].name = Some("rock".into());
    deck.remove.iter_mut().for_each(|remove| remove.r#where.set = Some("rock".into()));
    deck.blocks.push(BlockSet {
        name: Some("stemming".into()),
        origin: [1.0, 1.0, 2.0],
        size: Some([1.0; 3]),
        count: Some([1; 3]),
        joint: None,
        ..deck.blocks[0].clone()
    });
    let message = one_of(&deck, "[blocks-in-cavity]");
    assert!(message.contains("contains 1 block of set `stemming`"), "{message}");
    assert!(message.contains("at [1.5, 1.5, 2.5]"), "{message}");
    // Many small blocks, oblique to the cavity, are counted one by one.
    deck.blocks[1] = BlockSet {
        origin: [1.45, 1.15, 2.2],
        size: Some([0.6; 3]),
        count: Some([3; 3]),
        axes: [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]],
        joint: deck.blocks[0].joint.clone(),
        ..deck.blocks[1].clone()
    };
    let message = one_of(&deck, "[blocks-in-cavity]");
    assert!(message.contains("contains 27 blocks of set `stemming`"), "{message}");
    let set = Some("stemming".to_owned());
    deck.remove.push(Remove {
        r#where: Where { set, ..ball([1.47, 1.29, 2.3], 0.02) },
        ..Remove::default()
    });
    let message = one_of(&deck, "[blocks-in-cavity]");
    assert!(message.contains("contains 26 blocks of set `stemming`"), "{message}");
}

/// The warning names the end of a cavity: no block, blocks of another set or of another size, and
/// the place.
#[test]
fn cavity_warning_names_where_it_ends() {
    let mut deck = boxes(&[[1.0, 1.0, 3.0]]);
    deck.charge = vec![gas(within([0.9, 0.9, 2.9], [2.1, 2.1, 4.1]), 1e6)];
    let message = one_of(&deck, "charge[0]");
    assert!(message.contains("open to the outside at [1.5, 1.5, 4]"), "{message}");
    let mut lid = deck.clone();
    lid.blocks.push(BlockSet {
        name: Some("lid".into()),
        origin: [0.0, 0.0, 4.0],
        size: Some([4.0, 4.0, 1.0]),
        count: Some([2, 2, 1]),
        ..deck.blocks[0].clone()
    });
    let message = one_of(&lid, "charge[0]");
    assert!(message.contains("borders on blocks of set `lid` at [1.5, 1.5, 4]"), "{message}");
    assert!(!message.contains("open"), "{message}");
    // A gap like that of a joint, and a larger one.
    for (seam, closed) in [(4e-3, true), (0.04, true), (0.2, false)] {
        lid.blocks[1].origin[2] = 4.0 + seam;
        let message = one_of(&lid, "charge[0]");
        assert_eq!(
            message.contains("borders on blocks of set `lid` at [1.5, 1.5, 4]"),
            closed,
            "{message}"
        );
        assert_eq!(message.contains("open to the outside"), !closed, "{message}");
    }
    // Finer blocks below the cavity, and then a hole among them.
    let mut split = boxes(&[[1.0; 3]]);
    split.refine = vec![Refine { r#where: within([0.0; 3], [4.0, 4.0, 1.0]), factor: 2 }];
    split.charge = vec![gas(within([0.9; 3], [2.1; 3]), 1e6)];
    let message = one_of(&split, "charge[0]");
    assert!(message.contains("splits in another way, at [1.5, 1.5, 1]"), "{message}");
    split
        .remove
        .push(Remove { r#where: within([1.0, 1.0, 0.5], [2.0, 2.0, 1.0]), ..Remove::default() });
    let message = one_of(&split, "charge[0]");
    assert!(message.contains("continues at [1.5, 1.5, 1] among blocks"), "{message}");
}

/// The displacement of a single wall is measured from its own start; the mean over all walls would
/// be its own displacement.
#[test]
fn gas_behind_single_wall_vents() {
    let mut deck = boxes(&[[1.0; 3]]);
    deck.charge = vec![given(within([1.9, 1.1, 1.1], [2.1, 1.9, 1.9]), 1e6, History::Ramp(0.0))];
    let mut simulation = simulation(&deck);
    let nodes = ball([2.5, 1.5, 1.5], 0.88).nodes(simulation.model()).unwrap();
    let mut moved = simulation.displacements();
    for (far, vented) in [(0.99, false), (1.01, true)] {
        nodes.iter().for_each(|node| moved[*node as usize] = [far, 0.0, 0.0]);
        simulation.set_displacements(&moved);
        assert_eq!(state(&simulation, 0).vented, vented, "{far}");
    }
}

#[test]
fn release_without_end_or_effect_warns() {
    let mut deck = deck([1, 1, 4], [1.0, 1.0, 4.0], 1, 0.02);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    let (region, from) = (within([0.0, 0.0, 2.0], [1.0, 1.0, 4.0]), Some("dig".to_owned()));
    let mut message = |release: f64, stages: Vec<Stage>| {
        let release = Some(release);
        deck.remove =
            vec![Remove { r#where: region.clone(), from: from.clone(), release, until: None }];
        deck.stage = vec![relax_stage("weight")];
        deck.stage.extend(stages);
        crate::decks::warnings(&deck).join("\n")
    };
    let slow = || vec![dynamic("dig", 0.3), dynamic("on", 0.2)];
    assert_eq!(message(0.5, slow()), "");
    assert_eq!(
        message(2.0, slow()),
        "remove[0].release: `release` takes 2 s, but the dynamic stages from `dig` on take 0.5 s: 75 % of the \
         forces are never released; give a shorter `release`, or the stage a longer `duration` \
         [unfinished-release]"
    );
    let ended = [slow(), vec![relax_stage("rest")]].concat();
    assert!(
        message(1.0, ended).contains("50 % of the forces vanish at once in relax stage `rest`")
    );
    let still = |increments: Option<u32>| Stage { increments, ..relax_stage("dig") };
    assert!(message(1.0, vec![still(None)]).contains("relax stage `dig` has one increment"));
    assert_eq!(message(1.0, vec![still(Some(5))]), "");
    assert_eq!(message(0.0, vec![still(None)]), "");
}

#[test]
fn empty_selection_names_nearest_item() {
    let plain = boxes(&[[3.0; 3]]);
    let beyond = within([3.6, 3.6, 3.6], [9.0; 3]);
    let mut deck = plain.clone();
    deck.stage = vec![relax_stage("weight"), relax_stage("dig")];
    let from = Some("dig".to_owned());
    deck.remove.push(Remove { r#where: beyond.clone(), from, ..Remove::default() });
    let message = faults(&deck);
    assert!(message.contains("remove[1].where") && message.contains("no block there"), "{message}");
    // The block at [3.5, 3.5, 3.5] has been removed, so the nearest is one of those beside it.
    assert!(message.contains("that of the nearest is at [3.5, 3.5, 2.5]"), "{message}");
    let beyond = within([3.6, 3.6, 2.1], [9.0, 9.0, 2.45]);
    let assign = |joint: bool, material: bool| {
        let name = |wanted: bool, name: &str| wanted.then(|| name.to_owned());
        let (joint, material) = (name(joint, "seam"), name(material, "clay"));
        let entry = Assign { r#where: beyond.clone(), joint, material, ..Assign::default() };
        faults(&Deck { assign: vec![entry], ..plain.clone() })
    };
    let message = assign(false, true);
    assert!(
        message.contains("no block there") && message.contains("nearest is at [3.5, 3.5, 2.5]"),
        "{message}"
    );
    let message = assign(true, false);
    assert!(
        message.contains("no joint there") && message.contains("joints count by their centre"),
        "{message}"
    );
    assert!(message.contains("that of the nearest is at [3.5, 3.5, 2]"), "{message}");
    assert!(assign(true, true).contains("no joint and no block there"));
}

#[test]
fn probe_outside_blocks_warns() {
    let mut deck = boxes(&[]);
    let probe = |at: [f64; 3]| Probe { name: "top".into(), at: Some(at), ..Probe::default() };
    deck.probe = vec![probe([4.0, 4.0, 4.9])];
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    // In millimetres, say.
    deck.probe = vec![probe([4.0, 4.0, 14.0])];
    assert_eq!(
        crate::decks::warnings(&deck),
        [
            "probe[0].at: probe `top` has no block at [4, 4, 14]; it records the nearest node, at [4, 4, 4], 10.0000 m \
             away; give a point of a block, in metres [far-probe]"
        ]
    );
}

#[test]
fn two_charges_in_one_cavity_warn() {
    let mut deck = boxes(&[[1.0; 3], [3.0; 3]]);
    let hole = |at: f64| ball([at + 0.5; 3], 0.7);
    deck.charge = vec![tnt(hole(1.0), 500.0), tnt(hole(3.0), 500.0)];
    let alone = crate::decks::warnings(&deck);
    assert!(!alone.iter().any(|message| message.contains("[shared-cavity]")), "{alone:?}");
    deck.charge.push(Charge { delay: Some(1e-3), ..tnt(hole(1.0), 500.0) });
    assert!(one_of(&deck, "[shared-cavity]").contains("charges 0 and 2"));
    deck.charge[2].until = Some("later".into());
    deck.stage = vec![dynamic("blast", 0.01), dynamic("later", 0.01)];
    assert!(
        !crate::decks::warnings(&deck).iter().any(|message| message.contains("[shared-cavity]"))
    );
}

#[test]
fn cavity_among_differently_split_blocks_is_named() {
    let mut deck = boxes(&[]);
    deck.refine.push(Refine { r#where: within([1.0; 3], [2.0; 3]), factor: 2 });
    let region = within([1.0; 3], [2.0; 3]);
    deck.remove.push(Remove { r#where: region.clone(), ..Remove::default() });
    deck.charge.push(tnt(region, 100.0));
    let message = faults(&deck);
    assert!(message.contains("there is a cavity") && message.contains("a block more"), "{message}");
    deck.refine[0].factor = 100;
    deck.joints.insert("seam".into(), Joint { thickness: 0.02, ..deck.joints["seam"].clone() });
    let message = faults(&deck);
    assert!(message.contains("refine[0].factor"), "{message}");
}

#[test]
fn removed_whole_set_warns() {
    let mut deck = boxes(&[]);
    let lining =
        BlockSet { name: Some("lining".into()), origin: [9.0; 3], ..deck.blocks[0].clone() };
    deck.blocks.push(lining);
    assert!(!crate::decks::warnings(&deck).iter().any(|message| message.contains("[empty-set]")));
    deck.remove.push(Remove { r#where: within([8.0; 3], [20.0; 3]), ..Remove::default() });
    assert!(one_of(&deck, "[empty-set]").contains("all blocks of set `lining`"));
}

/// A support normal to a non-reflecting side is reported. A base with an incoming wave may have
/// such a support.
#[test]
fn support_normal_to_boundary_is_named() {
    let mut deck = boxes(&[]);
    let side = Boundary {
        r#where: plane(0, 0.0),
        kind: BoundaryKind::Viscous,
        velocity: None,
        history: None,
        from: None,
        until: None,
    };
    let held = |deck: &Deck| {
        crate::decks::warnings(deck).iter().any(|message| message.contains("[reflecting-boundary]"))
    };
    deck.boundary.push(side.clone());
    deck.fix.push(fix(plane(0, 0.0), "y"));
    deck.stage = vec![dynamic("go", 0.01)];
    assert!(!held(&deck));
    deck.fix[0].axes = "x".into();
    assert!(one_of(&deck, "[reflecting-boundary]").contains("`fix[0]` holds the nodes along x"));
    deck.boundary[0].velocity = Some([0.0, 0.1, 0.0]);
    assert!(!held(&deck));
    deck.boundary[0].velocity = None;
    deck.stage.push(dynamic("later", 0.01));
    (deck.fix[0].until, deck.boundary[0].from) = (Some("later".into()), Some("later".into()));
    assert!(!held(&deck));
}
