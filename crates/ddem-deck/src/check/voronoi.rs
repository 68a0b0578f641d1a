//! Checks of the seeds of Voronoi cells.

use std::collections::HashMap;

use super::rock::one_of;
use super::{ErrorCode, Faults, Rule};
use crate::schema::VoronoiCut;
use ddem_cut::MOST_CELLS;

pub(super) fn check(at: &str, of: &VoronoiCut, faults: &mut Faults) {
    let keys = [("number", of.number.is_some()), ("points", of.points.is_some())];
    let help = "seeds are at random places, as in `number = 300`, or given";
    if !one_of(at, &keys, help, faults) {
        return;
    }
    faults.optional(format!("{at}.least"), of.least, Rule::ZeroOrMore);
    let n = of.number.map_or(of.points.iter().flatten().count(), |number| number as usize);
    let key = keys[usize::from(of.number.is_none())].0;
    if n < 2 {
        let message = "one seed divides nothing";
        faults.add_help(ErrorCode::OutOfRange, format!("{at}.{key}"), message, "give 2 or more");
    }
    if n > MOST_CELLS {
        let message = format!("there would be {n} cells; at most {MOST_CELLS} are possible");
        faults.add_help(ErrorCode::TooLarge, format!("{at}.{key}"), message, "give fewer seeds");
    }
    let Some(points) = &of.points else { return };
    if of.least.is_some() {
        let message = "`least` is a distance between random seeds, and `points` are given";
        let help = "leave one of them out";
        faults.add_help(ErrorCode::IneffectiveKey, format!("{at}.least"), message, help);
    }
    let mut known = HashMap::new();
    for (number, point) in points.iter().enumerate() {
        let place = format!("{at}.points[{number}]");
        if !faults.finite(&place, point) {
            return;
        }
        // Adding zero turns −0 into 0.
        if let Some(other) = known.insert(point.map(|part| (part + 0.0).to_bits()), number) {
            let message = format!("the seed is at the place of `points[{other}]`");
            let help = "each seed has a place of its own";
            faults.add_help(ErrorCode::InvalidGeometry, place, message, help);
            return;
        }
    }
}
