//! Sets of blocks that touch or nearly touch: the joints between them, and the messages about gaps.

use ddem_deck::*;

use crate::decks::*;
use crate::refine::range;

/// Bed of 2 × 2 blocks, and a block across all four above a gap; both sets have a joint of 1 cm.
fn block_over_bed(gap: f64) -> Deck {
    let mut deck = deck([2, 2, 1], [2.0, 2.0, 1.0], 1, 0.01);
    deck.blocks[0].name = Some("bed".into());
    deck.blocks.push(BlockSet {
        name: Some("block".into()),
        origin: [0.5, 0.5, 1.0 + gap],
        size: Some([1.0; 3]),
        count: None,
        ..deck.blocks[0].clone()
    });
    deck
}

fn messages(deck: &Deck) -> Vec<String> {
    built(deck).interfaces().iter().map(ToString::to_string).collect()
}

#[test]
fn sets_join_where_they_touch_or_joint_fills_gap() {
    // A ten thousandth of the shortest edge counts as rounding.
    for gap in [0.0, 0.8e-4, -0.8e-4, 0.01, 0.01 + 0.8e-4, 0.01 - 0.8e-4] {
        let deck = block_over_bed(gap);
        let joined = "sets `bed` and `block` are joined by joint `seam` over 4 faces";
        assert_eq!(messages(&deck), [joined], "{gap}");
        assert_eq!(warnings(&deck), [""; 0], "{gap}");
    }
}

#[test]
fn gap_other_than_thickness_is_not_joined() {
    for gap in [0.005, 0.0002, 0.0098, 0.015, 0.03] {
        let deck = block_over_bed(gap);
        let model = model(&deck);
        let warnings = warnings(&deck);
        assert_eq!((model.n_joints(), messages(&deck)), (4, Vec::new()), "{gap}");
        if gap > 0.02 {
            assert_eq!(warnings, [""; 0]);
            continue;
        }
        if gap > 0.01 {
            let expected = "blocks[1]: sets `bed` and `block` do not touch: there is a gap of 1.500e-2 m over 4 \
                            faces; close the gap if they are meant to touch or to be joined [gap-between-sets]";
            assert_eq!(warnings, [expected]);
            continue;
        }
        let expected = format!(
            "blocks[1]: sets `bed` and `block` are not joined over 4 faces: there is a gap of {gap:.3e} m, but \
             joint `seam` is 1.000e-2 m thick; joints join sets that touch, or whose gap is as wide as the joint is \
             thick [joint-does-not-fill]"
        );
        assert_eq!(warnings, [expected]);
    }
}

/// The gap leaves a block without support: the error of the relaxation names the gap.
#[test]
fn unfilled_gap_is_named_by_relaxation_error() {
    for (gap, start) in [
        (0.005, "sets `bed` and `block` are not joined over 4 faces"),
        (0.015, "sets `bed` and `block` do not touch: there is a gap of 1.500e-2 m over 4 faces"),
    ] {
        assert_error_names_gap(gap, start);
    }
}

fn assert_error_names_gap(gap: f64, start: &str) {
    let mut deck = block_over_bed(gap);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck.stage = vec![relax_stage("load")];
    let faults = deck.build().err().map_or(Vec::new(), |error| error.faults);
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].message.contains("move as a rigid body"), "{faults:?}");
    let help = faults[0].help.as_deref().unwrap_or_default();
    assert!(help.starts_with(start), "{help}");
    assert!(
        help.contains("prevent this motion with `[[fix]]`, or make the stage dynamic"),
        "{help}"
    );
}

/// The joint of the later set, or the joint assigned there. Its thickness decides which gap it
/// fills.
#[test]
fn joint_of_later_set_or_assignment_applies_between_sets() {
    let mut deck = block_over_bed(0.03);
    let wide = Joint { thickness: 0.03, ..deck.joints["seam"].clone() };
    deck.joints.insert("wide".into(), wide);
    assert_eq!(messages(&deck), [""; 0]);
    let assigned =
        Assign { r#where: plane(2, 1.0), joint: Some("wide".into()), ..Assign::default() };
    let mut by_place = deck.clone();
    by_place.assign.push(assigned);
    let joined = "sets `bed` and `block` are joined by joint `wide` over 4 faces";
    assert_eq!(messages(&by_place), [joined]);
    deck.blocks[1].joint = Some(JointChoice::All("wide".into()));
    assert_eq!(messages(&deck), [joined]);
    deck.blocks.swap(0, 1);
    assert_eq!(messages(&deck), [""; 0]);
}

#[test]
fn sets_without_joint_make_contact() {
    let mut deck = block_over_bed(0.0);
    deck.blocks[1].joint = None;
    let touching = "sets `bed` and `block` touch over 4 faces without a joint: their blocks interact by contact";
    assert_eq!(messages(&deck), [touching]);
    deck.blocks[1].origin = [0.0, 0.0, 1.0];
    assert_eq!(messages(&deck), [touching.replace("4 faces", "1 face")]);
    deck.model.contact = Some(false);
    assert_eq!(messages(&deck), [""; 0]);
}

/// A set in place of removed blocks touches the blocks around it across half a joint.
#[test]
fn set_replacing_removed_blocks_touches_neighbours() {
    let mut deck = deck([3, 3, 1], [3.0, 3.0, 1.0], 1, 0.01);
    deck.blocks[0].name = Some("frame".into());
    let y = Some(Extent::Range([1.0, 2.0]));
    let middle = Where { y, set: Some("frame".into()), ..range(0, 1.0, 2.0) };
    deck.remove.push(Remove { r#where: middle, ..Remove::default() });
    deck.blocks.push(BlockSet {
        name: Some("plug".into()),
        origin: [1.0, 1.0, 0.0],
        size: Some([1.0; 3]),
        count: None,
        ..deck.blocks[0].clone()
    });
    let _model = model(&deck);
    let joined = "sets `frame` and `plug` are joined by joint `seam` over 4 faces";
    assert_eq!(messages(&deck), [joined]);
    assert_eq!(warnings(&deck), [""; 0]);
}
