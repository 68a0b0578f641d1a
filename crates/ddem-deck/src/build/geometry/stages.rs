//! Removal of blocks, and assignment of joints and materials, at the start of stages.

use std::sync::Arc;

use super::empty_selection::{no_block, nothing};
use super::{Names, Selection, Selector, assign, refined};
use crate::build::rock::AssignedRock;
use crate::schema::{Deck, Where};
use ddem_core::problem::{Geometry, Sets, Stages};
use ddem_core::{ErrorCode, Fault};

/// Geometries of the stages, and the blocks that curved and slanted shapes remove.
pub(in crate::build) fn stages(
    (deck, all): (&Deck, &Names),
    start: Arc<Geometry>,
    sets: &Sets,
    rock: Option<&AssignedRock<'_>>,
) -> Result<(Stages, Vec<Selection>), Vec<Fault>> {
    let selector = |selector: &Where| Selector::new(selector, sets);
    let (mut geometries, mut faults) = (vec![(0, start.clone())], Vec::new());
    let mut selections = Vec::new();
    for (stage, entry) in deck.stage.iter().enumerate() {
        let mut now: Option<Geometry> = None;
        for (index, remove) in deck.remove.iter().enumerate() {
            if remove.from.as_ref() != Some(&entry.name) {
                continue;
            }
            let last = geometries.last().map(|(_, geometry)| geometry.as_ref());
            let before = now.as_ref().or(last).unwrap_or(&start);
            let selector = selector(&remove.r#where);
            let blocks = selector.blocks(before);
            if blocks.is_empty() {
                let fault = nothing(format!("remove[{index}].where"), "no block");
                faults.push(no_block(fault, &selector, &before.lattices));
                continue;
            }
            let what = (format!("remove[{index}]"), format!("excavate `{}`", entry.name));
            if deck.region.is_empty() {
                selections.extend(Selection::new(what, &selector, sets, &before.lattices));
            }
            let mut after = before.clone();
            after.remove(&blocks);
            if stage == 0 {
                after.clear_removed();
            }
            if (0..after.blocks.len()).all(|block| after.is_removed(block)) {
                let message = "all blocks are removed";
                faults.push(Fault::new(ErrorCode::EmptyModel, format!("remove[{index}]"), message));
            }
            now = Some(after);
        }
        let excavated = now.map(Arc::new);
        let last = geometries.last().map_or(&start, |(_, geometry)| geometry);
        let last = excavated.as_ref().unwrap_or(last).clone();
        let assigned = assign::changes(deck, stage).then(|| Geometry::clone(&last));
        geometries.extend(excavated.map(|geometry| (stage, geometry)));
        if let Some(mut after) = assigned {
            let wrong = match rock {
                Some(rock) => rock.reassign(&mut after, stage),
                None => {
                    let lattices = refined(deck, all)?.lattices;
                    assign::reassign(&mut after, lattices, (deck, all, sets), stage)
                }
            };
            // A fault that appears at one stage may appear again at a later one; it is reported
            // once.
            let known = |fault: &Fault| faults.iter().any(|other| other.place == fault.place);
            let wrong: Vec<Fault> = wrong.into_iter().filter(|fault| !known(fault)).collect();
            faults.extend(wrong);
            geometries.push((stage, Arc::new(after)));
        }
    }
    let assigns = (0..deck.stage.len()).filter(|&stage| assign::changes(deck, stage)).collect();
    let excavated = deck.remove.iter().any(|remove| remove.from.is_some());
    if faults.is_empty() {
        Ok((Stages { geometries, assigns, excavated }, selections))
    } else {
        Err(faults)
    }
}
