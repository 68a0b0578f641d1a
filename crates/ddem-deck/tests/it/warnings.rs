//! Data of charges, and warnings about decks.

use ddem_deck::*;

use crate::decks::*;
use crate::hollows::*;

fn within(from: [f64; 3], to: [f64; 3]) -> Where {
    let [x, y, z] = [0, 1, 2].map(|k| Some(Extent::Range([from[k], to[k]])));
    Where { x, y, z, ..Where::default() }
}

fn tnt(region: Where, mass: f64) -> Charge {
    let explosive = Some(Explosive::Named("tnt".into()));
    Charge { region, mass: Some(mass), explosive, ..Charge::default() }
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
fn charges_have_walls_volumes_and_pressures() {
    let mut deck = boxes(&[[1.0; 3], [2.0, 1.0, 1.0]]);
    deck.charge = vec![
        tnt(within([0.9; 3], [3.1, 2.1, 2.1]), 500.0),
        gas(within([0.9; 3], [3.1, 2.1, 2.1]), 3e6),
    ];
    let model_of = |deck: &Deck| {
        let model = model(deck);
        let said = crate::decks::warnings(deck);
        assert!(said.iter().all(|said| said.contains("[shared-cavity]")), "{said:?}");
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
fn a_charge_is_warned_of_whose_hole_was_forgotten() {
    let mut deck = boxes(&[]);
    let line = Cylinder { from: [1.5, 1.5, 0.0], to: [1.5, 1.5, 4.0], radius: 0.2 };
    let hole = Where { cylinder: Some(line), ..Where::default() };
    deck.charge = vec![tnt(hole.clone(), 1.0)];
    let said = one_of(&deck, "[missing-remove]");
    assert!(said.contains("the charge acts on 3 joints"), "{said}");
    assert!(said.contains("a block at [1.5, 1.5, 0.5]"), "{said}");
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
fn a_charge_that_hardly_pushes_is_warned_of() {
    let mut deck = boxes(&[[1.0; 3]]);
    let region = ball([1.5; 3], 0.7);
    // In a cubic metre 10.5016e9 (m/1630)^2.727 is 0.1 MPa at 23.5 kg.
    deck.charge = vec![tnt(region.clone(), 23.0)];
    let said = one_of(&deck, "[weak-charge]");
    assert!(said.starts_with("charge[0].mass: 23 kg of explosive begin with 9.4"), "{said}");
    deck.charge = vec![tnt(region.clone(), 24.0)];
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    deck.charge = vec![gas(region, 1e4)];
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
}

#[test]
fn a_blast_in_statics_is_warned_of() {
    let mut deck = boxes(&[[1.0; 3]]);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck.stage = vec![relax_stage("weight"), dynamic("blast", 0.1), relax_stage("rest")];
    let region = ball([1.5; 3], 0.7);
    let said = |charge: &Charge| {
        let deck = Deck { charge: vec![charge.clone()], ..deck.clone() };
        crate::decks::warnings(&deck).join("\n")
    };
    let charge = tnt(region.clone(), 500.0);
    let warned = said(&charge);
    assert!(warned.contains("in relax stage `weight`; `from`"), "{warned}");
    let strong = gas(region.clone(), 2e8);
    assert!(said(&strong).contains("the charge exerts 2.000e8 Pa"), "{}", said(&strong));
    let from = Some("blast".to_owned());
    assert_eq!(said(&Charge { from, ..charge.clone() }), "");
    assert_eq!(said(&Charge { delay: Some(0.05), ..charge.clone() }), "");
    // The charge has detonated before that stage.
    let again = vec![dynamic("blast", 0.1), relax_stage("rest"), dynamic("more", 0.1)];
    let later = Deck { charge: vec![charge.clone()], stage: again, ..deck.clone() };
    assert_eq!(crate::decks::warnings(&later), [""; 0]);
    let pulse = History::Triangle(Triangle { rise: 1e-4, fall: Some(1e-4), duration: None });
    assert_eq!(said(&given(region.clone(), 2e8, pulse)), "");
    // Stored gas.
    assert_eq!(said(&gas(region, 1e7)), "");
    // No motion follows, so an equilibrium is intended.
    let still = Deck { charge: vec![charge], stage: vec![relax_stage("weight")], ..deck.clone() };
    assert_eq!(crate::decks::warnings(&still), [""; 0]);
}

#[test]
fn stemming_of_another_set_is_warned_of() {
    let mut deck = boxes(&[[1.0, 1.0, 1.0], [1.0, 1.0, 2.0]]);
    deck.charge = vec![gas(within([0.9; 3], [2.1, 2.1, 3.1]), 1e6)];
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    deck.blocks[0].name = Some("rock".into());
    deck.remove.iter_mut().for_each(|remove| remove.region.set = Some("rock".into()));
    deck.blocks.push(BlockSet {
        name: Some("stemming".into()),
        origin: [1.0, 1.0, 2.0],
        size: Some([1.0; 3]),
        count: Some([1; 3]),
        joint: None,
        ..deck.blocks[0].clone()
    });
    let said = one_of(&deck, "[blocks-in-cavity]");
    assert!(said.starts_with("charge[0].where: 1 blocks of set `stemming`"), "{said}");
    assert!(said.contains("at [1.5, 1.5, 2.5]"), "{said}");
    // Many small blocks, oblique to the cavity, are counted one by one.
    deck.blocks[1] = BlockSet {
        origin: [1.45, 1.15, 2.2],
        size: Some([0.6; 3]),
        count: Some([3; 3]),
        axes: [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]],
        joint: deck.blocks[0].joint.clone(),
        ..deck.blocks[1].clone()
    };
    let said = one_of(&deck, "[blocks-in-cavity]");
    assert!(said.starts_with("charge[0].where: 27 blocks of set `stemming`"), "{said}");
    let set = Some("stemming".to_owned());
    deck.remove.push(Remove {
        region: Where { set, ..ball([1.47, 1.29, 2.3], 0.02) },
        ..Remove::default()
    });
    let said = one_of(&deck, "[blocks-in-cavity]");
    assert!(said.starts_with("charge[0].where: 26 blocks of set `stemming`"), "{said}");
}

/// The warning names the end of a cavity: no block, blocks of another set or of another size, and
/// the place.
#[test]
fn it_is_said_where_a_cavity_ends_and_at_what() {
    let mut deck = boxes(&[[1.0, 1.0, 3.0]]);
    deck.charge = vec![gas(within([0.9, 0.9, 2.9], [2.1, 2.1, 4.1]), 1e6)];
    let said = one_of(&deck, "charge[0]");
    assert!(said.contains("open to the outside at [1.5, 1.5, 4]"), "{said}");
    let mut lid = deck.clone();
    lid.blocks.push(BlockSet {
        name: Some("lid".into()),
        origin: [0.0, 0.0, 4.0],
        size: Some([4.0, 4.0, 1.0]),
        count: Some([2, 2, 1]),
        ..deck.blocks[0].clone()
    });
    let said = one_of(&lid, "charge[0]");
    assert!(said.contains("borders on blocks of set `lid` at [1.5, 1.5, 4]"), "{said}");
    assert!(!said.contains("open"), "{said}");
    // A gap like that of a joint, and a larger one.
    for (seam, closed) in [(4e-3, true), (0.04, true), (0.2, false)] {
        lid.blocks[1].origin[2] = 4.0 + seam;
        let said = one_of(&lid, "charge[0]");
        assert_eq!(
            said.contains("borders on blocks of set `lid` at [1.5, 1.5, 4]"),
            closed,
            "{said}"
        );
        assert_eq!(said.contains("open to the outside"), !closed, "{said}");
    }
    // Finer blocks below the cavity, and then a hole among them.
    let mut split = boxes(&[[1.0; 3]]);
    split.refine = vec![Refine { region: within([0.0; 3], [4.0, 4.0, 1.0]), factor: 2 }];
    split.charge = vec![gas(within([0.9; 3], [2.1; 3]), 1e6)];
    let said = one_of(&split, "charge[0]");
    assert!(said.contains("splits in another way, at [1.5, 1.5, 1]"), "{said}");
    split
        .remove
        .push(Remove { region: within([1.0, 1.0, 0.5], [2.0, 2.0, 1.0]), ..Remove::default() });
    let said = one_of(&split, "charge[0]");
    assert!(said.contains("continues at [1.5, 1.5, 1] among blocks"), "{said}");
}

/// The displacement of a single wall is measured from its own start; the mean over all walls would
/// be its own displacement.
#[test]
fn gas_behind_a_single_wall_gets_out() {
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
fn a_release_that_has_no_end_or_no_effect_is_warned_of() {
    let mut deck = deck([1, 1, 4], [1.0, 1.0, 4.0], 1, 0.02);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    let (region, from) = (within([0.0, 0.0, 2.0], [1.0, 1.0, 4.0]), Some("dig".to_owned()));
    let mut said = |release: f64, stages: Vec<Stage>| {
        let release = Some(release);
        deck.remove =
            vec![Remove { region: region.clone(), from: from.clone(), release, until: None }];
        deck.stage = vec![relax_stage("weight")];
        deck.stage.extend(stages);
        crate::decks::warnings(&deck).join("\n")
    };
    let slow = || vec![dynamic("dig", 0.3), dynamic("on", 0.2)];
    assert_eq!(said(0.5, slow()), "");
    assert_eq!(
        said(2.0, slow()),
        "remove[0].release: `release` takes 2 s, but the dynamic stages from `dig` on take 0.5 s: 75 % of the \
         forces are never released [unfinished-release]"
    );
    let ended = [slow(), vec![relax_stage("rest")]].concat();
    assert!(said(1.0, ended).contains("50 % of the forces vanish at once in relax stage `rest`"));
    let still = |increments: Option<u32>| Stage { increments, ..relax_stage("dig") };
    assert!(said(1.0, vec![still(None)]).contains("relax stage `dig` has one increment"));
    assert_eq!(said(1.0, vec![still(Some(5))]), "");
    assert_eq!(said(0.0, vec![still(None)]), "");
}

#[test]
fn where_nothing_is_selected_the_nearest_is_said() {
    let plain = boxes(&[[3.0; 3]]);
    let beyond = within([3.6, 3.6, 3.6], [9.0; 3]);
    let mut deck = plain.clone();
    deck.stage = vec![relax_stage("weight"), relax_stage("dig")];
    let from = Some("dig".to_owned());
    deck.remove.push(Remove { region: beyond.clone(), from, ..Remove::default() });
    let said = faults(&deck);
    assert!(said.contains("remove[1].where") && said.contains("no block there"), "{said}");
    // The block at [3.5, 3.5, 3.5] has been removed, so the nearest is one of those beside it.
    assert!(said.contains("that of the nearest is at [3.5, 3.5, 2.5]"), "{said}");
    let beyond = within([3.6, 3.6, 2.1], [9.0, 9.0, 2.45]);
    let assign = |joint: bool, material: bool| {
        let name = |wanted: bool, name: &str| wanted.then(|| name.to_owned());
        let (joint, material) = (name(joint, "seam"), name(material, "clay"));
        let entry = Assign { region: beyond.clone(), joint, material, ..Assign::default() };
        faults(&Deck { assign: vec![entry], ..plain.clone() })
    };
    let said = assign(false, true);
    assert!(
        said.contains("no block there") && said.contains("nearest is at [3.5, 3.5, 2.5]"),
        "{said}"
    );
    let said = assign(true, false);
    assert!(
        said.contains("no joint there") && said.contains("joints count by their centre"),
        "{said}"
    );
    assert!(said.contains("that of the nearest is at [3.5, 3.5, 2]"), "{said}");
    assert!(assign(true, true).contains("no joint and no block there"));
}

#[test]
fn a_probe_where_nothing_is_is_warned_of() {
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
             away [far-probe]"
        ]
    );
}

#[test]
fn two_charges_in_one_cavity_are_not_one() {
    let mut deck = boxes(&[[1.0; 3], [3.0; 3]]);
    let hole = |at: f64| ball([at + 0.5; 3], 0.7);
    deck.charge = vec![tnt(hole(1.0), 500.0), tnt(hole(3.0), 500.0)];
    let alone = crate::decks::warnings(&deck);
    assert!(!alone.iter().any(|said| said.contains("[shared-cavity]")), "{alone:?}");
    deck.charge.push(Charge { delay: Some(1e-3), ..tnt(hole(1.0), 500.0) });
    assert!(one_of(&deck, "[shared-cavity]").contains("charges 0 and 2"));
    deck.charge[2].until = Some("later".into());
    deck.stage = vec![dynamic("blast", 0.01), dynamic("later", 0.01)];
    assert!(!crate::decks::warnings(&deck).iter().any(|said| said.contains("[shared-cavity]")));
}

#[test]
fn a_hole_among_blocks_that_are_split_otherwise_is_named() {
    let mut deck = boxes(&[]);
    deck.refine.push(Refine { region: within([1.0; 3], [2.0; 3]), factor: 2 });
    let region = within([1.0; 3], [2.0; 3]);
    deck.remove.push(Remove { region: region.clone(), ..Remove::default() });
    deck.charge.push(tnt(region, 100.0));
    let said = faults(&deck);
    assert!(said.contains("there is a cavity") && said.contains("a block more"), "{said}");
    deck.refine[0].factor = 100;
    deck.joints.insert("seam".into(), Joint { thickness: 0.02, ..deck.joints["seam"].clone() });
    let said = faults(&deck);
    assert!(said.contains("refine[0].factor"), "{said}");
}

#[test]
fn a_set_that_is_taken_out_as_a_whole_is_named() {
    let mut deck = boxes(&[]);
    let lining =
        BlockSet { name: Some("lining".into()), origin: [9.0; 3], ..deck.blocks[0].clone() };
    deck.blocks.push(lining);
    assert!(!crate::decks::warnings(&deck).iter().any(|said| said.contains("[empty-set]")));
    deck.remove.push(Remove { region: within([8.0; 3], [20.0; 3]), ..Remove::default() });
    assert!(one_of(&deck, "[empty-set]").contains("all blocks of set `lining`"));
}

/// A support normal to a non-reflecting side is reported. A base with an incoming wave may have
/// such a support.
#[test]
fn boundaries_that_are_held_across_are_named() {
    let mut deck = boxes(&[]);
    let side = Boundary {
        region: plane(0, 0.0),
        kind: BoundaryKind::Viscous,
        velocity: None,
        history: None,
        from: None,
        until: None,
    };
    let held = |deck: &Deck| {
        crate::decks::warnings(deck).iter().any(|said| said.contains("[reflecting-boundary]"))
    };
    deck.boundary.push(side.clone());
    deck.fix.push(fix(plane(0, 0.0), "y"));
    deck.stage = vec![dynamic("go", 0.01)];
    assert!(!held(&deck));
    deck.fix[0].axes = "x".into();
    assert!(one_of(&deck, "[reflecting-boundary]").contains("fix 0 holds the nodes along x"));
    deck.boundary[0].velocity = Some([0.0, 0.1, 0.0]);
    assert!(!held(&deck));
    deck.boundary[0].velocity = None;
    deck.stage.push(dynamic("later", 0.01));
    (deck.fix[0].until, deck.boundary[0].from) = (Some("later".into()), Some("later".into()));
    assert!(!held(&deck));
}
