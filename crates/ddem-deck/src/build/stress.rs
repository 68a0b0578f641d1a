//! Conversion of `stress` in `[[initial]]` to stresses of blocks.

use std::collections::BTreeSet;

use ddem_core::problem::Stress;
use ddem_core::{ErrorCode, Fault, Problem};

use super::geometry::touching::TouchingFaces;
use super::geometry::{Selector, nothing};
use crate::schema::Deck;

/// Faults of stressed sets that touch without a joint. Contacts begin without force, so they cannot
/// carry an in-situ stress.
pub(super) fn unjoined(deck: &Deck, problem: &Problem) -> Vec<Fault> {
    let (geometry, stresses) = (&**problem.stages.at(0), &problem.stresses);
    if stresses.iter().all(Option::is_none) || !deck.finds_contacts() {
        return Vec::new();
    }
    let index = deck.initial.iter().position(|entry| entry.stress.is_some()).unwrap_or_default();
    let stressed = |blocks: &[u32; 2]| blocks.iter().any(|&b| stresses[b as usize].is_some());
    let sets = |blocks: [u32; 2]| blocks.map(|block| geometry.set(block as usize));
    let alone: BTreeSet<[usize; 2]> = TouchingFaces(geometry)
        .unjoined()
        .into_iter()
        .filter(stressed)
        .map(sets)
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    let fault = |[a, b]: [usize; 2]| {
        let message = format!(
            "sets `{}` and `{}` touch without a joint: contacts begin without force, so they carry \
             no in-situ stress",
            deck.set_name(a),
            deck.set_name(b)
        );
        let help = "give both a `joint`, or apply the stress by loads in a relax stage";
        Fault::new(ErrorCode::NotSupported, format!("initial[{index}].stress"), message).help(help)
    };
    alone.into_iter().map(fault).collect()
}

/// In-situ stress of each block to which the deck gives one.
pub(super) fn stresses(deck: &Deck, problem: &Problem) -> Result<Vec<Option<Stress>>, Vec<Fault>> {
    let geometry = &**problem.stages.at(0);
    if deck.initial.iter().all(|entry| entry.stress.is_none()) {
        return Ok(Vec::new());
    }
    let mut stresses = vec![None; geometry.blocks.len()];
    let mut faults = Vec::new();
    for (index, entry) in deck.initial.iter().enumerate() {
        let Some(origin) = entry.stress else { continue };
        let slope = entry.gradient.unwrap_or_default();
        let gradient = [slope.x, slope.y, slope.z].map(Option::unwrap_or_default);
        let blocks = Selector::new(&entry.r#where, &problem.sets).blocks(geometry);
        let place = format!("initial[{index}].where");
        if blocks.is_empty() {
            faults.push(nothing(place, "no block"));
        }
        for block in blocks {
            stresses[block] = Some(Stress { origin, gradient });
        }
    }
    if faults.is_empty() { Ok(stresses) } else { Err(faults) }
}
