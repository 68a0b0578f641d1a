//! Blocks that curved and slanted shapes have selected.

use super::Model;
use crate::geometry::{Geometry, Selection};

impl Model {
    /// Blocks that each curved or slanted `where` of the deck has selected: first those that are split
    /// and that never were there, then those that are dug, then those that get a material or a stress.
    #[must_use]
    pub fn selections(&self) -> Vec<Selection> {
        let of = |place: String, what: String, geometry: &Geometry, region| {
            let (region, frame) = (self.region(region), &geometry.frame);
            Selection::new((place, what), &region, frame, &geometry.lattices)
        };
        let assigned = self.deck.assign.iter().enumerate().filter_map(|(index, entry)| {
            let what = format!("material `{}`", entry.material.as_ref()?);
            let geometry = self.stages.from(&self.deck, entry.from.as_ref());
            of(format!("assign[{index}]"), what, geometry, &entry.region)
        });
        let stressed = self.deck.initial.iter().enumerate().filter_map(|(index, entry)| {
            entry.stress?;
            let what = format!("initial stress {index}");
            of(format!("initial[{index}]"), what, self.stages.at(0), &entry.region)
        });
        let dug = self.geometry.taken.iter().chain(&self.stages.taken).cloned();
        dug.chain(assigned).chain(stressed).collect()
    }
}
