//! Sets of blocks that touch, those that joints join, and those that a joint nearly joins.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::{Abutment, Geometry};
use crate::deck::Deck;

/// Two sets of blocks that touch, and what is between them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Names of the two sets, in the order of the deck.
    pub sets: [String; 2],
    /// Name of the joint that joins them; `None` where their blocks meet as contacts.
    pub joint: Option<String>,
    /// Number of faces: of pairs of a block of the one set and one of the other.
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
                "sets `{a}` and `{b}` touch {over} without a joint: their blocks meet as contacts"
            ),
        }
    }
}

fn over(faces: usize) -> String {
    format!("over {faces} face{}", if faces == 1 { "" } else { "s" })
}

/// Part of the shortest edge of two blocks up to which a gap between them may be a mistake.
const NARROW: f64 = 0.02;

/// Two sets, the earlier one first.
type Sets = [usize; 2];

impl Geometry {
    fn sets(&self, blocks: [u32; 2]) -> Sets {
        let mut sets = blocks.map(|block| self.set(block as usize));
        sets.sort_unstable();
        sets
    }

    /// Sets that touch: those that joints join, and where contacts are found those that they do not.
    pub(crate) fn interfaces(&self, deck: &Deck) -> Vec<Interface> {
        let mut faces: BTreeMap<(Sets, Option<u16>), usize> = BTreeMap::new();
        let joined = self.abutments.iter().map(|a| (self.sets(a.blocks), Some(a.joint)));
        let contacts = if deck.finds_contacts() { self.unjoined() } else { Vec::new() };
        let contacts = contacts.into_iter().map(|blocks| (self.sets(blocks), None));
        for place in joined.filter(|([a, b], _)| a != b).chain(contacts) {
            *faces.entry(place).or_default() += 1;
        }
        let named = |((sets, joint), faces): ((Sets, Option<u16>), usize)| Interface {
            sets: sets.map(|set| deck.set_name(set)),
            joint: joint.map(|joint| name(deck, joint)),
            faces,
        };
        faces.into_iter().map(named).collect()
    }

    /// Warnings about sets that nearly touch and are not joined.
    pub(crate) fn ajar(&self, deck: &Deck) -> Vec<String> {
        let mut said = self.unfilled_gaps(deck);
        said.extend(self.narrow_gaps(deck));
        said
    }

    /// Those of sets that are nearer to each other than their joint is thick.
    fn unfilled_gaps(&self, deck: &Deck) -> Vec<String> {
        let mut places: BTreeMap<(Sets, u16), Vec<&Abutment>> = BTreeMap::new();
        for abutment in &self.apart {
            places.entry((self.sets(abutment.blocks), abutment.joint)).or_default().push(abutment);
        }
        let said = places.into_iter().map(|((sets, joint), faces)| {
            let [a, b] = sets.map(|set| deck.set_name(set));
            let thickness = deck.joints.values().nth(joint.into()).map_or(0.0, |j| j.thickness);
            let gap = faces.iter().map(|a| a.gap).fold(f64::INFINITY, f64::min);
            let apart = if gap < 0.0 {
                format!("they overlap by {:.3e} m", -gap)
            } else {
                format!("there is a gap of {gap:.3e} m")
            };
            format!(
                "sets `{a}` and `{b}` are not joined {}: {apart}, and joint `{}` is {thickness:.3e} m thick. \
                 Joints join sets that touch, or whose gap is as wide as the joint is thick",
                over(faces.len()),
                name(deck, joint)
            )
        });
        said.collect()
    }

    /// Those of sets that are farther apart, and touch nowhere.
    fn narrow_gaps(&self, deck: &Deck) -> Vec<String> {
        if deck.blocks.len() < 2 {
            return Vec::new();
        }
        let all = self.abutments.iter().chain(&self.apart).map(|abutment| abutment.blocks);
        let known: BTreeSet<Sets> =
            all.chain(self.unjoined()).map(|blocks| self.sets(blocks)).collect();
        let mut gaps: BTreeMap<Sets, (f64, usize)> = BTreeMap::new();
        for (blocks, gap) in self.across_gaps(NARROW) {
            let sets = self.sets(blocks);
            if !known.contains(&sets) {
                let (least, faces) = gaps.entry(sets).or_insert((gap, 0));
                (*least, *faces) = (least.min(gap), *faces + 1);
            }
        }
        let said = gaps.into_iter().map(|(sets, (gap, faces))| {
            let [a, b] = sets.map(|set| deck.set_name(set));
            format!(
                "sets `{a}` and `{b}` do not touch: there is a gap of {gap:.3e} m {}. Close it if they are \
                 meant to touch or to be joined",
                over(faces)
            )
        });
        said.collect()
    }
}

fn name(deck: &Deck, joint: u16) -> String {
    deck.joints.keys().nth(joint.into()).cloned().unwrap_or_default()
}
