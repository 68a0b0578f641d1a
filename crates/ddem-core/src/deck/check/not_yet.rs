//! Keys that are part of the deck but that this version cannot compute: said, never ignored.

use super::Faults;
use crate::deck::Deck;

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    let mut not_yet = |place: String, what: &str, help: &str| {
        faults.add_help(place, format!("this version does not have {what}"), help);
    };
    let leave_out = "leave this out";

    for (i, assign) in deck.assign.iter().enumerate() {
        for (key, name) in [("from", &assign.from), ("until", &assign.until)] {
            if name.is_some() {
                let what =
                    format!("`assign` with `{key}`: materials and joints stay as they start");
                not_yet(format!("assign[{i}].{key}"), &what, leave_out);
            }
        }
    }
}
