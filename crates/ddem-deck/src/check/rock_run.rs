//! Entries that do not act on regions yet, by name.

use super::{ErrorCode, Faults};
use crate::schema::Deck;

/// Faults of a deck with regions that a run does not support yet.
pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    if deck.region.is_empty() {
        return;
    }
    let mut refuse = |place: String, message: &str, help: &str| {
        faults.add_help(ErrorCode::NotSupported, place, message, help);
    };
    for (i, entry) in deck.refine.iter().enumerate() {
        let set = entry.r#where.set.as_deref();
        if !deck.blocks.iter().any(|blocks| set.is_some() && blocks.name.as_deref() == set) {
            let message = "cells of regions cannot be refined yet";
            let help =
                "more `divisions` of the region; `set` in `where` names a set of blocks to refine";
            refuse(format!("refine[{i}]"), message, help);
        }
    }
    let sections = [
        ("charge", !deck.charge.is_empty(), "charges do not act on regions yet"),
        ("boundary", !deck.boundary.is_empty(), "boundaries do not act on regions yet"),
    ];
    for (section, given, message) in sections {
        if given {
            refuse(format!("{section}[0]"), message, "leave it out, or model sets of blocks alone");
        }
    }
    for (i, _) in deck.load.iter().enumerate().filter(|(_, load)| load.line.is_some()) {
        let message = "line loads do not act on regions yet";
        let help = "give a `force` on the nodes of the line, or a `traction` on a face";
        refuse(format!("load[{i}].line"), message, help);
    }
}
