//! Tests of contacts and rigid blocks.

use super::{check, good, places};
use crate::schema::*;

#[test]
fn invalid_contacts_are_refused() {
    let contact = |change: fn(&mut ContactTable)| places(|deck| change(&mut deck.contact));
    let all = |c: &mut ContactTable| {
        (c.normal_stiffness, c.shear_stiffness) = (Some(1e9), Some(1e8));
        (c.friction, c.damping) = (Some(0.0), Some(1.0));
    };
    assert_eq!(contact(all), [""; 0]);
    assert_eq!(contact(|c| c.normal_stiffness = Some(0.0)), ["contact.normal_stiffness"]);
    assert_eq!(contact(|c| c.shear_stiffness = Some(-1.0)), ["contact.shear_stiffness"]);
    assert_eq!(contact(|c| c.friction = Some(90.0)), ["contact.friction"]);
    assert_eq!(contact(|c| c.friction = Some(-1.0)), ["contact.friction"]);
    assert_eq!(contact(|c| c.damping = Some(1.1)), ["contact.damping"]);
    assert_eq!(contact(|c| c.damping = Some(f64::NAN)), ["contact.damping"]);
    assert_eq!(contact(|c| c.restitution = Some(-0.1)), ["contact.restitution"]);
    let both = |c: &mut ContactTable| (c.damping, c.restitution) = (Some(0.5), Some(0.5));
    assert_eq!(contact(both), ["contact.restitution"]);
}

/// Rebound speed of a unit mass from a unit spring and a dashpot that never pull, in very short
/// steps.
fn rebound(ratio: f64) -> f64 {
    let (mut x, mut v, step) = (0.0, 1.0, 1e-5);
    loop {
        let force: f64 = x + 2.0 * ratio * v;
        if force < 0.0 {
            return -v;
        }
        v -= force * step;
        x += v * step;
    }
}

#[test]
fn restitution_equals_equivalent_damping() {
    let of = |restitution: f64| {
        let table = ContactTable { restitution: Some(restitution), ..ContactTable::default() };
        table.damping_ratio().unwrap_or_else(|| panic!("no ratio"))
    };
    assert_eq!(ContactTable::default().damping_ratio(), None);
    assert_eq!(Deck::default().damping_ratio(), 0.2);
    assert_eq!((of(1.0).to_bits(), of(0.0), of(0.1)), (0, 1.0, 1.0));
    for restitution in [0.14, 0.3, 0.9, 0.999] {
        let back = rebound(of(restitution));
        assert!((back - restitution).abs() < 1e-4, "{restitution} {back}");
    }
    let given = ContactTable { damping: Some(0.2), ..ContactTable::default() };
    assert_eq!(given.damping_ratio(), Some(0.2));
}

#[test]
fn contacts_are_enabled_if_blocks_can_separate() {
    let finds = |change: fn(&mut Deck)| {
        let mut deck = good();
        let weak = Joint { cohesion: Some(1e6), ..deck.joints["seam"].clone() };
        deck.joints.insert("weak".into(), weak);
        change(&mut deck);
        deck.finds_contacts()
    };
    // The weak joint exists, but no block has it.
    assert!(!finds(|_| {}));
    assert!(finds(|deck| deck.blocks[0].joint = Some(JointChoice::All("weak".into()))));
    let by_normal = |deck: &mut Deck| {
        let seam = Some("seam".to_owned());
        let z = Some("weak".to_owned());
        deck.blocks[0].joint = Some(JointChoice::ByNormal { x: seam, y: None, z });
    };
    assert!(finds(by_normal));
    let assigned = |deck: &mut Deck| {
        deck.assign.push(Assign { joint: Some("weak".into()), ..Assign::default() });
    };
    assert!(finds(assigned));
    assert!(finds(|deck| deck.blocks.push(deck.blocks[0].clone())));
    assert!(finds(|deck| deck.model.contact = Some(true)));
    let off = |deck: &mut Deck| {
        deck.blocks.push(deck.blocks[0].clone());
        deck.model.contact = Some(false);
    };
    assert!(!finds(off));
}

#[test]
fn rigid_blocks_have_joints_but_no_stress() {
    let rigid = |change: fn(&mut Deck)| {
        places(|deck| {
            deck.blocks[0].body = Body::Rigid;
            deck.blocks.push(BlockSet {
                name: Some("soft".into()),
                body: Body::Deformable,
                origin: [9.0, 0.0, 0.0],
                ..deck.blocks[0].clone()
            });
            deck.probe[0].quantity = Quantity::Stress;
            change(deck);
        })
    };
    let of = |deck: &mut Deck, set: &str| {
        deck.probe[0].at = None;
        deck.probe[0].r#where = Some(Where { set: Some(set.into()), ..Where::default() });
    };
    // The block at a point is known only once the blocks exist.
    assert_eq!(rigid(|_| {}), [""; 0]);
    assert_eq!(places(|deck| deck.probe[0].quantity = Quantity::Stress), [""; 0]);
    let mut deck = good();
    deck.blocks[0].body = Body::Rigid;
    of(&mut deck, "beam");
    assert_eq!(check(&deck), []);
    deck.probe[0].quantity = Quantity::Stress;
    let faults = check(&deck);
    assert_eq!(faults[0].place, "probe[0].quantity");
    assert_eq!(faults[0].message, "there is no stress to record: the blocks of `beam` are rigid");
    assert_eq!(rigid(|deck| deck.blocks[1].body = Body::Rigid), ["probe[0].quantity"]);
    // A layer without thickness has no stiffness between blocks of any kind.
    let flat = |deck: &mut Deck| {
        deck.probe[0].quantity = Quantity::Velocity;
        deck.joints.values_mut().for_each(|joint| joint.thickness = 0.0);
    };
    assert_eq!(rigid(flat), ["joints.seam.thickness"]);
}
