//! Sets of blocks that touch, that a joint joins, or that a joint nearly joins.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::touching::TouchingFaces;
use crate::lint::{Code, Diagnostic};
use crate::schema::Deck;
use ddem_core::counted;
use ddem_core::problem::{Geometry, NonconformingJoint};

/// Two sets of blocks that touch, with the joint between them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Names of the two sets, in the order of the deck.
    pub sets: [String; 2],
    /// Name of the joint that joins them; `None` if their blocks interact by contact.
    pub joint: Option<String>,
    /// Number of pairs of touching faces, one of each set.
    pub faces: usize,
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sets: [a, b], joint, faces } = self;
        let over = over(*faces);
        match joint {
            Some(joint) => write!(f, "sets `{a}` and `{b}` are joined by joint `{joint}` {over}"),
            None => write!(
                f,
                "sets `{a}` and `{b}` touch {over} without a joint: their blocks interact by contact"
            ),
        }
    }
}

fn over(faces: usize) -> String {
    format!("over {}", counted(faces, "face"))
}

/// Largest gap that may be a mistake, as a fraction of the shortest edge of the two blocks.
const NARROW: f64 = 0.02;

/// Numbers of two sets, the earlier one first.
type SetPair = [usize; 2];

fn sets(geometry: &Geometry, blocks: [u32; 2]) -> SetPair {
    let mut sets = blocks.map(|block| geometry.set(block as usize));
    sets.sort_unstable();
    sets
}

/// Sets that touch: those that joints join and, if contacts are found, those without a joint.
pub(in crate::build) fn interfaces(geometry: &Geometry, deck: &Deck) -> Vec<Interface> {
    let mut faces: BTreeMap<(SetPair, Option<u16>), usize> = BTreeMap::new();
    let joined = geometry.joined().map(|a| (sets(geometry, a.blocks), Some(a.joint)));
    let contacts =
        if deck.finds_contacts() { TouchingFaces(geometry).unjoined() } else { Vec::new() };
    let contacts = contacts.into_iter().map(|blocks| (sets(geometry, blocks), None));
    for pair in joined.filter(|([a, b], _)| a != b).chain(contacts) {
        *faces.entry(pair).or_default() += 1;
    }
    let named = |((sets, joint), faces): ((SetPair, Option<u16>), usize)| Interface {
        sets: sets.map(|set| deck.set_name(set)),
        joint: joint.map(|joint| name(deck, joint)),
        faces,
    };
    faces.into_iter().map(named).collect()
}

/// Warnings about sets that nearly touch and are not joined.
pub(in crate::build) fn gaps(deck: &Deck, geometry: &Geometry) -> Vec<Diagnostic> {
    let mut warnings = unfilled_gaps(deck, geometry);
    warnings.extend(narrow_gaps(deck, geometry));
    warnings
}

fn of_set((deck, set): (&Deck, usize), code: Code, message: String, help: &str) -> Diagnostic {
    Diagnostic::warning(code, deck.set_place(set), message, help)
}

/// Warnings about sets whose gap is narrower than the thickness of their joint.
fn unfilled_gaps(deck: &Deck, geometry: &Geometry) -> Vec<Diagnostic> {
    let mut pairs: BTreeMap<(SetPair, u16), Vec<&NonconformingJoint>> = BTreeMap::new();
    for joint in &*geometry.unjoined_faces {
        pairs.entry((sets(geometry, joint.blocks), joint.joint)).or_default().push(joint);
    }
    let warnings = pairs.into_iter().map(|((sets, joint), faces)| {
        let [a, b] = sets.map(|set| deck.set_name(set));
        let thickness = deck.joints.values().nth(joint.into()).map_or(0.0, |j| j.thickness);
        let gap = faces.iter().map(|a| a.gap).fold(f64::INFINITY, f64::min);
        let apart = if gap < 0.0 {
            format!("they overlap by {:.3e} m", -gap)
        } else {
            format!("there is a gap of {gap:.3e} m")
        };
        let message = format!(
            "sets `{a}` and `{b}` are not joined {}: {apart}, but joint `{}` is {thickness:.3e} m thick",
            over(faces.len()),
            name(deck, joint)
        );
        let help = "joints join sets that touch, or whose gap is as wide as the joint is thick";
        of_set((deck, sets[1]), Code::JointDoesNotFill, message, help)
    });
    warnings.collect()
}

/// Warnings about sets that neither touch nor have a joint, but have a narrow gap.
fn narrow_gaps(deck: &Deck, geometry: &Geometry) -> Vec<Diagnostic> {
    if deck.set_names().len() < 2 {
        return Vec::new();
    }
    let all =
        geometry.joined().chain(&*geometry.unjoined_faces).map(|joint_pair| joint_pair.blocks);
    let known: BTreeSet<SetPair> = all
        .chain(TouchingFaces(geometry).unjoined())
        .map(|blocks| sets(geometry, blocks))
        .collect();
    let mut gaps: BTreeMap<SetPair, (f64, usize)> = BTreeMap::new();
    for (blocks, gap) in TouchingFaces(geometry).across_gaps(NARROW) {
        let sets = sets(geometry, blocks);
        if !known.contains(&sets) {
            let (least, faces) = gaps.entry(sets).or_insert((gap, 0));
            (*least, *faces) = (least.min(gap), *faces + 1);
        }
    }
    let warnings = gaps.into_iter().map(|(sets, (gap, faces))| {
        let [a, b] = sets.map(|set| deck.set_name(set));
        let message = format!(
            "sets `{a}` and `{b}` do not touch: there is a gap of {gap:.3e} m {}",
            over(faces)
        );
        let help = "close the gap if they are meant to touch or to be joined";
        of_set((deck, sets[1]), Code::GapBetweenSets, message, help)
    });
    warnings.collect()
}

fn name(deck: &Deck, joint: u16) -> String {
    deck.joints.keys().nth(joint.into()).cloned().unwrap_or_default()
}
