//! Nodes and blocks that a `where` selects.

use ddem_core::problem::Geometry;
use ddem_core::{Fault, Model};

use super::BuiltDeck;
use super::geometry::{Selection, Selector, no_node, uncovered};
use crate::schema::Where;

impl Where {
    /// Numbers of the nodes that the `where` selects in a model, in order. Only blocks that exist in
    /// the present stage count.
    ///
    /// # Errors
    ///
    /// The fault of a `set` that the model does not have, of a file that has not been read, of an
    /// invalid number, or of a topography that does not cover the selection. The place of the fault
    /// begins with `where`.
    pub fn nodes(&self, model: &Model) -> Result<Vec<u32>, Fault> {
        let sets = &model.problem().sets;
        let mut faults = self.check(&sets.list);
        if faults.is_empty() {
            faults = uncovered(("where", self), sets, &model.geometry().lattices);
        }
        match faults.into_iter().next() {
            Some(fault) => Err(fault),
            None => Ok(Selector::new(self, sets).nodes(model.geometry())),
        }
    }

    /// Fault of a `where` at a place in the deck that selects no node of a model.
    #[must_use]
    pub fn no_node(&self, model: &Model, place: String) -> Fault {
        no_node(place, &Selector::new(self, &model.problem().sets), model.geometry())
    }
}

impl BuiltDeck {
    /// Blocks that each curved or slanted `where` of the deck has selected: first split blocks and
    /// blocks removed from the start, then excavated blocks, then blocks with an assigned material
    /// or an in-situ stress.
    #[must_use]
    pub fn selections(&self) -> Vec<Selection> {
        let of = |place: String, what: String, geometry: &Geometry, selector| {
            let selector = self.selector(selector);
            Selection::new((place, what), &selector, &self.problem.sets, &geometry.lattices)
        };
        let assigned = self.deck.assign.iter().enumerate().filter_map(|(index, entry)| {
            let what = format!("material `{}`", entry.material.as_ref()?);
            let geometry = self.at_stage(entry.from.as_ref());
            of(format!("assign[{index}]"), what, geometry, &entry.r#where)
        });
        let stressed = self.deck.initial.iter().enumerate().filter_map(|(index, entry)| {
            entry.stress?;
            let what = format!("in-situ stress {index}");
            of(format!("initial[{index}]"), what, self.at_stage(None), &entry.r#where)
        });
        self.selections.iter().cloned().chain(assigned).chain(stressed).collect()
    }
}
