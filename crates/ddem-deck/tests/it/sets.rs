//! Several sets of blocks: allowed overlaps, messages about touching sets, and rigid sets.

use ddem_core::Fault;
use ddem_deck::*;

use crate::decks::*;

/// Three blocks in a row, and two blocks above them that begin at `origin`.
fn row_and_top(origin: [f64; 3], thickness: f64) -> Deck {
    let mut deck = deck([3, 1, 1], [3.0, 1.0, 1.0], 1, thickness);
    deck.blocks[0].name = Some("row".into());
    deck.blocks.push(BlockSet {
        name: Some("top".into()),
        origin,
        size: Some([1.0, 1.0, 2.0]),
        count: Some([1, 1, 2]),
        ..deck.blocks[0].clone()
    });
    deck
}

fn faults(deck: &Deck) -> Vec<Fault> {
    deck.build().err().map_or(Vec::new(), |error| error.faults)
}

#[test]
fn overlapping_blocks_are_named() {
    let faults = faults(&row_and_top([1.5, 0.0, 0.9], 0.01));
    assert_eq!(faults.len(), 1);
    assert_eq!(faults[0].place, "blocks[1].origin");
    assert_eq!(
        faults[0].message,
        "block [0, 0, 0] of `top` and block [1, 0, 0] of `row` overlap by 1.000e-1 m"
    );
    let help = faults[0].help.as_deref().unwrap_or_default();
    assert!(help.contains("they may touch, or overlap by 1.000e-2 m"), "{help}");

    // The deepest overlap is reported, for other numbers of blocks too.
    let mut deck = row_and_top([2.2, 0.25, -1.5], 0.01);
    deck.blocks[1].size = Some([1.0, 0.5, 2.0]);
    let found = self::faults(&deck);
    assert_eq!(
        found[0].message,
        "block [0, 0, 1] of `top` and block [2, 0, 0] of `row` overlap by 5.000e-1 m"
    );
}

/// Blocks may overlap by the thickness of their joints: where three sets meet, planes with and
/// without a joint cannot all match.
#[test]
fn overlap_within_joint_thickness_is_allowed() {
    let found =
        |depth: f64, thickness: f64| faults(&row_and_top([1.5, 0.0, 1.0 - depth], thickness)).len();
    assert_eq!(found(0.0, 0.01), 0);
    assert_eq!(found(0.01, 0.01), 0);
    assert_eq!(found(0.0101, 0.01), 1);
    // Without thickness only rounding is allowed; the same holds for blocks without joints.
    for (z, wrong) in [(0.99991, 0), (0.99989, 1)] {
        let mut flat = row_and_top([1.5, 0.0, z], 0.0);
        let stiff = Some(1e9);
        let spring = Joint { normal_stiffness: stiff, shear_stiffness: stiff, ..Joint::default() };
        flat.joints.insert("seam".into(), spring);
        assert_eq!(faults(&flat).len(), wrong);
    }
    let mut single = row_and_top([1.5, 0.0, 0.995], 0.01);
    assert_eq!(faults(&single).len(), 0);
    single.blocks[0].count = Some([1, 1, 1]);
    assert_eq!(faults(&single).len(), 0);
    single.blocks[1].count = Some([1, 1, 1]);
    assert_eq!(faults(&single).len(), 1);
}

#[test]
fn set_may_fill_removed_blocks_of_another() {
    let mut deck = deck([3, 3, 3], [3.0, 3.0, 3.0], 1, 0.01);
    deck.blocks.push(BlockSet {
        origin: [1.0; 3],
        size: Some([1.0; 3]),
        count: None,
        ..deck.blocks[0].clone()
    });
    assert_eq!(
        faults(&deck)[0].message,
        "block [0, 0, 0] of `blocks[1]` and block [1, 1, 1] of `blocks[0]` overlap by 1.000e0 m"
    );
    let sphere = Some(Sphere { centre: [1.5; 3], radius: 0.1 });
    let region = Where { sphere, ..Where::default() };
    deck.remove.push(Remove { r#where: region, ..Remove::default() });
    // `remove` applies to all sets; the set that fills the hole must be excluded.
    deck.remove[0].r#where.set = Some("around".into());
    deck.blocks[0].name = Some("around".into());
    assert_eq!(faults(&deck), []);
}

/// The neighbour search finds the same overlaps of oblique and rotated sets as a search over all
/// blocks.
#[test]
fn overlaps_equal_brute_force_search() {
    let mut random = Random::new(7);
    let (mut overlapping, mut apart) = (0, 0);
    for _ in 0..60 {
        let axes = [random.rotation(0.5), random.rotation(0.5)]
            .map(|turn| OBLIQUE.map(|axis| (turn * Vec3::from(axis)).into()));
        let mut whole = with_axes(deck([3, 2, 2], [3.0, 2.0, 2.0], 1, 0.001), axes[0]);
        whole.blocks.push(BlockSet {
            origin: (random.vector() * 3.5).into(),
            axes: axes[1],
            ..whole.blocks[0].clone()
        });
        // Each block of the first set becomes a separate set.
        let units = axes[0].map(|axis| Vec3::from(axis).normalize());
        let cells = (0..12).map(|i| [i % 3, i / 3 % 2, i / 6]);
        let mut blocks = vec![whole.blocks[1].clone()];
        blocks.extend(cells.map(|cell| BlockSet {
            origin: (0..3).map(|d| units[d] * f64::from(cell[d])).sum::<Vec3>().into(),
            size: Some([1.0; 3]),
            count: Some([1; 3]),
            ..whole.blocks[0].clone()
        }));
        let single = Deck { blocks, ..whole.clone() };
        let depth = |deck: &Deck| {
            let number = |fault: &Fault| {
                let after = fault.message.split("overlap by ").nth(1);
                after.and_then(|text| text.trim_end_matches(" m").parse::<f64>().ok())
            };
            faults(deck).iter().filter_map(number).fold(0.0, f64::max)
        };
        let (expected, found) = (depth(&single), depth(&whole));
        // The tolerance between two sets exceeds that between a set and a single block.
        if expected > 0.002 {
            assert_eq!(found, expected);
            overlapping += 1;
        } else {
            assert_eq!(found, 0.0);
            apart += 1;
        }
    }
    assert!(overlapping > 10 && apart > 5, "{overlapping} {apart}");
}

/// Many sets and large sets are checked quickly.
#[test]
fn large_and_many_sets_are_checked_quickly() {
    let mut deck = deck([60, 60, 30], [60.0, 60.0, 30.0], 1, 0.01);
    deck.blocks.push(BlockSet { origin: [0.5, 0.5, 30.0], ..deck.blocks[0].clone() });
    assert_eq!(faults(&deck), []);
    let brick =
        BlockSet { size: Some([1.0; 3]), count: None, joint: None, ..deck.blocks[0].clone() };
    let at = |i: u32| [i % 13, i / 13 % 13, i / 169].map(|c| f64::from(c) + 0.001);
    deck.blocks = (0..2000).map(|i| BlockSet { origin: at(i), ..brick.clone() }).collect();
    assert_eq!(faults(&deck), []);
    // Only some of very many errors are reported.
    deck.blocks.iter_mut().for_each(|set| set.origin = [0.0; 3]);
    assert_eq!(faults(&deck).len(), 50);
}

#[test]
fn touching_sets_without_contacts_warn() {
    let mut deck = row_and_top([1.5, 0.0, 1.0], 0.01);
    // With a joint on both sides the sets are joined.
    deck.model.contact = Some(false);
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    deck.model.contact = None;
    (deck.blocks[1].count, deck.blocks[1].joint) = (None, None);
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    deck.model.contact = Some(true);
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
    deck.model.contact = Some(false);
    let warnings = crate::decks::warnings(&deck);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].ends_with("[sets-not-in-contact]"));
    deck.blocks[1].origin[2] = 1.1;
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
}

#[test]
fn default_friction_beside_a_joint_with_another_warns() {
    let mut deck = row_and_top([0.0, 0.0, 1.0], 0.0);
    let springs = Joint {
        normal_stiffness: Some(1e10),
        shear_stiffness: Some(1e10),
        friction: Some(35.0),
        ..Joint::default()
    };
    deck.joints.insert("seam".into(), springs);
    (deck.blocks[1].count, deck.blocks[1].joint) = (None, None);
    let of = |deck: &Deck| crate::decks::warnings(deck).join("\n");
    let text = of(&deck);
    let angles = "the default friction angle of 30 degrees, not the 35 degrees of joint `seam`";
    assert!(text.starts_with("contact.friction: sets `row` and `top` touch over"), "{text}");
    assert!(text.contains(angles) && text.ends_with("[default-friction]"), "{text}");
    // The angle after failure counts.
    let mut weak = deck.clone();
    weak.joints.get_mut("seam").unwrap().residual_friction = Some(20.0);
    assert!(of(&weak).contains("not the 20 degrees of joint `seam`"));
    let silent: [&dyn Fn(&mut Deck); 4] = [
        &|deck| deck.contact.friction = Some(25.0),
        &|deck| deck.joints.get_mut("seam").unwrap().friction = Some(30.0),
        &|deck| deck.joints.get_mut("seam").unwrap().friction = None,
        &|deck| deck.blocks[1].joint = deck.blocks[0].joint.clone(),
    ];
    for change in silent {
        let mut deck = deck.clone();
        change(&mut deck);
        assert_eq!(of(&deck), "");
    }
    // A block that is joined to the same face gives the face the friction of their joint.
    deck.blocks[1].size = Some([0.5, 1.0, 1.0]);
    let beside = BlockSet {
        name: Some("beside".into()),
        origin: [0.5, 0.0, 1.0],
        joint: deck.blocks[0].joint.clone(),
        ..deck.blocks[1].clone()
    };
    deck.blocks.push(beside);
    let text = of(&deck);
    assert!(!text.contains("`row` and `top`") && text.contains("`beside` and `top`"), "{text}");
}

#[test]
fn contact_keys_without_search_warn() {
    let mut deck = deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.01);
    deck.contact.friction = Some(20.0);
    let start = |deck: &Deck| {
        let warnings = crate::decks::warnings(deck);
        warnings.iter().map(|text| text.chars().take(60).collect()).collect::<Vec<String>>()
    };
    assert_eq!(start(&deck), ["contact: `[contact]` has no effect: no contacts are searched"]);
    deck.model.contact = Some(false);
    assert_eq!(start(&deck), ["contact: `[contact]` has no effect: `contact = false` in `[m"]);
    deck.model.contact = Some(true);
    assert_eq!(start(&deck), [""; 0]);
    deck.model.contact = None;
    if let Some(seam) = deck.joints.get_mut("seam") {
        seam.cohesion = Some(1e6);
    }
    assert_eq!(start(&deck), [""; 0]);
}

/// Contacts of a given stiffness between cubes of rock under their weight.
#[test]
fn contacts_much_stiffer_or_softer_than_blocks_warn() {
    let message = |change: &dyn Fn(&mut Deck)| {
        let mut deck = row_and_top([1.5, 0.0, 1.0], 0.01);
        deck.model.gravity = [0.0, 0.0, -9.81];
        deck.fix = vec![fix(plane(2, 0.0), "xyz")];
        change(&mut deck);
        crate::decks::warnings(&deck)
    };
    assert_eq!(message(&|_| ()), [""; 0]);
    for (normal, shear) in [(1e10, 1e10), (1e12, 1e12), (1e9, 1e8)] {
        let given = |deck: &mut Deck| {
            (deck.contact.normal_stiffness, deck.contact.shear_stiffness) =
                (Some(normal), Some(shear));
        };
        assert_eq!(message(&given), [""; 0], "{normal} {shear}");
    }
    for body in [Body::Rigid, Body::Deformable] {
        let warnings = message(&|deck| {
            deck.blocks.iter_mut().for_each(|set| set.body = body);
            deck.contact.normal_stiffness = Some(1e18);
        });
        println!("{warnings:#?}");
        assert_eq!(warnings.len(), 1);
        let start = "contact.normal_stiffness: 1e18 Pa/m is ";
        assert!(warnings[0].starts_with(start), "{}", warnings[0]);
        assert!(warnings[0].contains("it limits the time step to "), "{}", warnings[0]);
    }
    let across = message(&|deck| deck.contact.shear_stiffness = Some(1e16));
    assert_eq!(across.len(), 1);
    assert!(across[0].starts_with("contact.shear_stiffness: 1e16 Pa/m is "), "{across:?}");
    let soft = message(&|deck| deck.contact.normal_stiffness = Some(3e6));
    println!("{soft:#?}");
    assert_eq!(soft.len(), 1);
    assert!(soft[0].contains("blocks in contact sink into each other"), "{soft:?}");
    let sinks = message(&|deck| deck.contact.normal_stiffness = Some(1e5));
    assert_eq!(
        sinks,
        [
            "contact.normal_stiffness: under its own weight a block of 2400 kg/m³ sinks 23.5 % of its edge into \
             the one below: contacts have 1.00e5 Pa/m; check the units of `young` (Pa), `density` (kg/m³) and \
             lengths (m), or increase `normal_stiffness` [soft-contact]"
        ]
    );
    // Without contacts the only warning is that there are none.
    let none = message(&|deck| {
        deck.model.contact = Some(false);
        deck.contact.normal_stiffness = Some(1e18);
    });
    assert!(none.iter().all(|text| !text.contains("time step")), "{none:?}");
}

#[test]
fn rigid_sets_have_rigid_blocks() {
    let mut deck = row_and_top([1.5, 0.0, 1.0], 0.01);
    deck.blocks[1].body = Body::Rigid;
    let model = model(&deck);
    let rigid: Vec<bool> = (0..model.n_blocks()).map(|block| model.is_rigid(block)).collect();
    assert_eq!(rigid, [false, false, false, true, true]);
}
