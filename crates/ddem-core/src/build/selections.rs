//! Nodes and blocks that parts of space select.

use std::cmp::Reverse;

use crate::deck::Where;
use crate::error::Fault;
use crate::geometry::{Geometry, Selection, Vec3, uncovered};
use crate::model::Model;

impl Model {
    /// Nodes that a `where` selects, in order; empty where it selects none.
    ///
    /// # Errors
    ///
    /// What the check of a deck finds in it: a `set` that the deck does not have, a file that has not been read,
    /// numbers that cannot be, a topography that does not cover what is selected. Its place begins with `where`.
    pub fn nodes_in(&self, region: &Where) -> Result<Vec<u32>, Fault> {
        let mut faults = region.check(&self.problem.deck);
        if faults.is_empty() {
            let at = ("where", region);
            faults =
                uncovered(at, &self.problem.deck, &self.geometry.frame, &self.geometry.lattices);
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
        crate::geometry::no_node(place, &self.region(region), &self.geometry)
    }

    /// The node nearest to a reference position; on a tie that of a block that is not taken out, or later,
    /// and of these the lower number.
    ///
    /// # Panics
    ///
    /// If a coordinate is not a finite number.
    #[must_use]
    pub fn nearest_node(&self, at: [f64; 3]) -> usize {
        assert!(at.iter().all(|x| x.is_finite()), "no node is nearest to {at:?}: it is no place");
        let at = Vec3::from(at);
        let tie = 1e-12 * (self.geometry.frame.bounds[1] - self.geometry.frame.bounds[0]).norm();
        let distance = |node: usize| (Vec3::from(self.point(node)) - at).norm();
        let nearest = (0..self.n_nodes()).map(distance).fold(f64::INFINITY, f64::min);
        let near = (0..self.n_nodes()).filter(|&node| distance(node) <= nearest + tie);
        let best = near.min_by_key(|&node| (Reverse(self.stays(self.block_of(node))), node));
        best.unwrap_or(0)
    }

    /// Blocks that each curved or slanted `where` of the deck has selected: first those that are split
    /// and that never were there, then those that are dug, then those that get a material or a stress.
    #[must_use]
    pub fn selections(&self) -> Vec<Selection> {
        let of = |place: String, what: String, geometry: &Geometry, region| {
            let (region, frame) = (self.region(region), &geometry.frame);
            Selection::new((place, what), &region, frame, &geometry.lattices)
        };
        let assigned = self.problem.deck.assign.iter().enumerate().filter_map(|(index, entry)| {
            let what = format!("material `{}`", entry.material.as_ref()?);
            let geometry = self.stages.from(&self.problem.deck, entry.from.as_ref());
            of(format!("assign[{index}]"), what, geometry, &entry.region)
        });
        let stressed = self.problem.deck.initial.iter().enumerate().filter_map(|(index, entry)| {
            entry.stress?;
            let what = format!("initial stress {index}");
            of(format!("initial[{index}]"), what, self.stages.at(0), &entry.region)
        });
        let dug = self.geometry.taken.iter().chain(&self.stages.taken).cloned();
        dug.chain(assigned).chain(stressed).collect()
    }
}
