//! Keys that are part of the deck but that this version cannot compute: said, never ignored.

use super::Faults;
use crate::deck::Deck;

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    let mut not_yet = |place: String, what: &str, help: &str| {
        faults.add_help(place, format!("this version does not have {what}"), help);
    };
    let leave_out = "leave this out";

    let assign = deck.assign.iter().map(|entry| (&entry.from, &entry.until));
    let remove = deck.remove.iter().map(|entry| (&entry.from, &entry.until));
    let timed = assign.enumerate().map(|entry| ("assign", entry));
    for (table, (i, (from, until))) in
        timed.chain(remove.enumerate().map(|entry| ("remove", entry)))
    {
        for (key, _) in [("from", from), ("until", until)].iter().filter(|(_, n)| n.is_some()) {
            let what = format!("`{table}` with `{key}`: blocks and joints stay as they start");
            not_yet(format!("{table}[{i}].{key}"), &what, leave_out);
        }
    }
}
