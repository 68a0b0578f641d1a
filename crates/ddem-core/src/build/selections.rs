//! Nodes and blocks that parts of space select.

use super::at_stage;
use super::geometry::{Selection, no_node, uncovered};
use crate::deck::Where;
use crate::error::Fault;
use crate::geometry::Geometry;
use crate::model::Model;

impl Model {
    /// Nodes that a `where` selects, in order; empty where it selects none.
    ///
    /// # Errors
    ///
    /// What the check of a deck finds in it: a `set` that the deck does not have, a file that has not been read,
    /// numbers that cannot be, a topography that does not cover what is selected. Its place begins with `where`.
    pub fn nodes_in(&self, region: &Where) -> Result<Vec<u32>, Fault> {
        let mut faults = region.check(self.deck());
        if faults.is_empty() {
            let at = ("where", region);
            faults = uncovered(at, self.deck(), &self.site().frame, &self.geometry.lattices);
        }
        match faults.into_iter().next() {
            Some(fault) => Err(fault),
            None => Ok(self.selected(region)),
        }
    }

    /// Nodes that a `where` without faults selects, in order.
    pub(crate) fn selected(&self, region: &Where) -> Vec<u32> {
        self.region(region).nodes(&self.geometry)
    }

    /// What is wrong with a `where`, at this place in the deck, that selects no node.
    #[must_use]
    pub fn no_node(&self, place: String, region: &Where) -> Fault {
        no_node(place, &self.region(region), &self.geometry)
    }

    /// Blocks that each curved or slanted `where` of the deck has selected: first those that are split
    /// and that never were there, then those that are dug, then those that get a material or a stress.
    #[must_use]
    pub fn selections(&self) -> Vec<Selection> {
        let of = |place: String, what: String, geometry: &Geometry, region| {
            let (site, region) = (self.site(), self.region(region));
            Selection::new((place, what), &region, &site.frame, &geometry.lattices)
        };
        let assigned = self.deck().assign.iter().enumerate().filter_map(|(index, entry)| {
            let what = format!("material `{}`", entry.material.as_ref()?);
            let geometry = at_stage(self.deck(), &self.stages, entry.from.as_ref());
            of(format!("assign[{index}]"), what, geometry, &entry.region)
        });
        let stressed = self.deck().initial.iter().enumerate().filter_map(|(index, entry)| {
            entry.stress?;
            let what = format!("initial stress {index}");
            of(format!("initial[{index}]"), what, self.stages.at(0), &entry.region)
        });
        let dug = self.site().taken.iter().cloned();
        dug.chain(assigned).chain(stressed).collect()
    }
}
