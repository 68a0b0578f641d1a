//! Faults of cuts that make too many cells.

use ddem_core::problem::shown;
use ddem_core::{ErrorCode, Fault};
use ddem_cut::MOST_CELLS;

use super::shapes::spacing;
use crate::schema::Deck;

/// Advice on cuts that make too many cells.
const FEWER: &str =
    "fewer or smaller fractures and wider spacings make fewer cells; fewer `divisions` need less";

/// Fault of cuts that would make more cells than there may be.
pub(super) fn too_many_fault(deck: &Deck, place: String, cells: f64) -> Fault {
    let sets = deck.cut.iter().filter_map(|cut| cut.set.as_ref());
    let least = sets.map(|set| spacing(&set.spacing).mean()).fold(f64::INFINITY, f64::min);
    let message =
        format!("the cuts would make about {cells:.1e} cells; at most {MOST_CELLS} are possible");
    let help = match least.is_finite() {
        true => format!("the smallest `spacing` is {} m on average", shown(least)),
        false => FEWER.to_owned(),
    };
    Fault::new(ErrorCode::TooLarge, place, message).help(help)
}

/// Fault of a cut that has made more cells than fit in the memory.
fn beyond_memory(at: &str, cells: usize, available: u64) -> Fault {
    let message = format!(
        "this cut and those before it make more than {cells} cells, for which {:.1} GB of memory is not enough",
        1e-9 * available as f64
    );
    Fault::new(ErrorCode::OutOfMemory, at, message).help(FEWER)
}

/// Fault of a cut that stopped at a number of cells: there may be no more, or no more fit in the memory.
pub(super) fn stopped(deck: &Deck, at: String, cells: usize, available: u64) -> Fault {
    if cells > MOST_CELLS {
        too_many_fault(deck, at, cells as f64)
    } else {
        beyond_memory(&at, cells, available)
    }
}
