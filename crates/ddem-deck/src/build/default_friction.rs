//! Warnings about sets that touch without a joint and slide with the default friction, although one
//! of them names a joint.

use std::collections::BTreeMap;

use ddem_core::counted;
use ddem_core::problem::{BlockFace, FRICTION, Geometry, shown};

use super::geometry::touching::TouchingFaces;
use crate::lint::{Code, Diagnostic};
use crate::schema::{Deck, Joint};

/// A joint that a set names, with the other set.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Unused {
    own: usize,
    other: usize,
    joint: u16,
}

/// Warnings about the default friction between sets at the start.
pub(super) fn warnings(deck: &Deck, geometry: &Geometry) -> Vec<Diagnostic> {
    if !deck.finds_contacts() || deck.contact.friction.is_some() {
        return Vec::new();
    }
    let mut unused: BTreeMap<Unused, usize> = BTreeMap::new();
    for faces in TouchingFaces(geometry).unjoined_faces() {
        let with_friction = |face: &BlockFace| {
            joint_beside(geometry, face).is_some_and(|number| friction(deck, number).is_some())
        };
        if faces.iter().any(with_friction) {
            continue;
        }
        let sets = faces.map(|face| geometry.set(face.block));
        for (side, face) in faces.iter().enumerate() {
            let named = geometry.joint_at(face.block, face.face);
            let other_angle =
                |&joint: &u16| friction(deck, joint).is_some_and(|angle| angle != FRICTION);
            if let Some(joint) = named.filter(other_angle) {
                let place = Unused { own: sets[side], other: sets[1 - side], joint };
                *unused.entry(place).or_default() += 1;
            }
        }
    }
    unused.into_iter().map(|(unused, faces)| warning(deck, &unused, faces)).collect()
}

/// Number of the joint that connects a face to another block; contacts of the face have its
/// friction.
fn joint_beside(geometry: &Geometry, face: &BlockFace) -> Option<u16> {
    let nonconforming = geometry.nonconforming(face.block, face.face.number());
    let beyond = || geometry.beyond(face.block, face.face);
    nonconforming
        .map(|joint| joint.joint)
        .or_else(|| beyond().and_then(|_| geometry.joint_at(face.block, face.face)))
}

/// Friction angle of a joint after failure; `None` if it never fails `[degrees]`.
fn friction(deck: &Deck, number: u16) -> Option<f64> {
    let joint = nth(deck, number).map(|(_, joint)| joint).filter(|joint| joint.can_fail())?;
    Some(joint.residual_friction.or(joint.friction).unwrap_or_default())
}

fn nth(deck: &Deck, number: u16) -> Option<(&str, &Joint)> {
    deck.joints.iter().nth(number.into()).map(|(name, joint)| (name.as_str(), joint))
}

fn warning(deck: &Deck, unused: &Unused, faces: usize) -> Diagnostic {
    let [own, other] = [unused.own, unused.other].map(|set| deck.set_name(set));
    let name = nth(deck, unused.joint).map_or("", |(name, _)| name);
    let angle = shown(friction(deck, unused.joint).unwrap_or_default());
    let faces = counted(faces, "face");
    let message = format!(
        "sets `{own}` and `{other}` touch over {faces} without a joint between them: their contacts have the \
         default friction angle of {} degrees, not the {angle} degrees of joint `{name}`, which set `{own}` names",
        shown(FRICTION)
    );
    let help = format!(
        "`friction = {angle}` in `[contact]` gives it to all contacts; `joint = \"{name}\"` in set `{other}`, too, \
         joins the two sets"
    );
    Diagnostic::warning(Code::DefaultFriction, "contact.friction", message, help)
}
