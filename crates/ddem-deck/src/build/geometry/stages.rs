//! Removal of blocks, and assignment of joints and materials, at the start of stages.

use std::sync::Arc;

use super::empty_selection::{no_block, nothing};
use super::{Selection, Selector, assign, refined};
use crate::build::rock::AssignedRock;
use crate::schema::Deck;
use ddem_core::problem::{Geometry, Sets, Stages};
use ddem_core::{ErrorCode, Fault};

/// Removals of blocks at the starts of stages, and what is found about them.
struct Removals<'a> {
    deck: &'a Deck,
    sets: &'a Sets,
    /// Blocks that curved and slanted shapes remove.
    selections: Vec<Selection>,
    faults: Vec<Fault>,
}

/// Geometries of the stages, and the blocks that curved and slanted shapes remove.
pub(super) fn stages(
    start: Arc<Geometry>,
    rock: &AssignedRock<'_>,
) -> Result<(Stages, Vec<Selection>), Vec<Fault>> {
    let AssignedRock { deck, names, sets, .. } = *rock;
    let mut removals = Removals { deck, sets, selections: Vec::new(), faults: Vec::new() };
    let mut geometries = vec![(0, start.clone())];
    for stage in 0..deck.stage.len() {
        let last = geometries.last().map_or(&start, |(_, geometry)| geometry).clone();
        let excavated = removals.at(stage, &last).map(Arc::new);
        let last = excavated.as_ref().unwrap_or(&last).clone();
        let assigned = assign::changes(deck, stage).then(|| Geometry::clone(&last));
        geometries.extend(excavated.map(|geometry| (stage, geometry)));
        if let Some(mut after) = assigned {
            // A fault that appears at one stage may appear again at a later one; it is reported
            // once.
            let lattices = refined(deck, names, sets.list[..deck.region.len()].to_vec())?.lattices;
            for fault in assign::reassign(&mut after, lattices, rock, stage) {
                if removals.faults.iter().all(|other| other.place != fault.place) {
                    removals.faults.push(fault);
                }
            }
            geometries.push((stage, Arc::new(after)));
        }
    }
    let assigns = (0..deck.stage.len()).filter(|&stage| assign::changes(deck, stage)).collect();
    let excavated = deck.remove.iter().any(|remove| remove.from.is_some());
    if removals.faults.is_empty() {
        Ok((Stages { geometries, assigns, excavated }, removals.selections))
    } else {
        Err(removals.faults)
    }
}

impl Removals<'_> {
    /// Geometry after the removals at the start of a stage; `None` if there are none.
    fn at(&mut self, stage: usize, last: &Geometry) -> Option<Geometry> {
        let name = &self.deck.stage[stage].name;
        let mut now: Option<Geometry> = None;
        for (index, remove) in self.deck.remove.iter().enumerate() {
            if remove.from.as_ref() != Some(name) {
                continue;
            }
            let before = now.as_ref().unwrap_or(last);
            let selector = Selector::new(&remove.r#where, self.sets);
            let blocks = selector.blocks(before);
            if blocks.is_empty() {
                let fault = nothing(format!("remove[{index}].where"), "no block");
                self.faults.push(no_block(fault, &selector, &before.lattices));
                continue;
            }
            let what = (format!("remove[{index}]"), format!("excavate `{name}`"));
            if self.deck.region.is_empty() {
                let selection = Selection::new(what, &selector, self.sets, &before.lattices);
                self.selections.extend(selection);
            }
            let mut after = before.clone();
            after.remove(&blocks);
            if stage == 0 {
                after.clear_removed();
            }
            if (0..after.blocks.len()).all(|block| after.is_removed(block)) {
                let message = "all blocks are removed";
                let place = format!("remove[{index}]");
                self.faults.push(Fault::new(ErrorCode::EmptyModel, place, message));
            }
            now = Some(after);
        }
        now
    }
}
