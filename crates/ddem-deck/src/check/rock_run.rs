//! Entries that do not act on regions yet, by name.

use super::{ErrorCode, Faults};
use crate::schema::{BoundaryKind, Deck, Where};

/// Faults of a deck with regions that a run does not support yet.
pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    if deck.region.is_empty() {
        return;
    }
    let mut refuse = |place: String, message: &str, help: &str| {
        faults.add_help(ErrorCode::NotSupported, place, message, help);
    };
    let is_of_blocks = |r#where: &Where| {
        let set = r#where.set.as_deref();
        deck.blocks.iter().any(|blocks| set.is_some() && blocks.name.as_deref() == set)
    };
    for (i, entry) in deck.refine.iter().enumerate() {
        if !is_of_blocks(&entry.r#where) {
            let message = "cells of regions cannot be refined yet";
            let help =
                "more `divisions` of the region; `set` in `where` names a set of blocks to refine";
            refuse(format!("refine[{i}]"), message, help);
        }
    }
    for (i, entry) in deck.charge.iter().enumerate() {
        if !is_of_blocks(&entry.r#where) {
            let message = "charges do not act on regions yet";
            let help = "a `[[load]]` with `pressure` and `history` pushes walls of cells; `set` in `where` \
                        names a set of blocks beside the region";
            refuse(format!("charge[{i}]"), message, help);
        }
    }
    for (i, entry) in deck.boundary.iter().enumerate() {
        if entry.kind == BoundaryKind::FreeField && !is_of_blocks(&entry.r#where) {
            let message = "free-field sides do not act on regions yet";
            let help = "kind \"viscous\"; `set` in `where` names a set of blocks beside the region";
            refuse(format!("boundary[{i}]"), message, help);
        }
    }
    for (i, entry) in deck.load.iter().enumerate() {
        if entry.line.is_some() && !is_of_blocks(&entry.r#where) {
            let message = "line loads do not act on regions yet";
            let help = "a `force` on the nodes of the line, or a `traction` on a face; `set` in `where` \
                        names a set of blocks beside the region";
            refuse(format!("load[{i}].line"), message, help);
        }
    }
}
