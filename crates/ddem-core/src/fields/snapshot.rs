//! Fields at one time.

use std::ops::Range;

use super::{Field, On};
use crate::model::Model;
use crate::simulation::Simulation;

/// Fields of a simulation at the present time, by ranges of their values: nobody needs to hold a
/// whole one. What a field takes from all blocks is found once.
#[derive(Debug)]
pub struct Snapshot<'a> {
    pub(super) simulation: &'a mut Simulation,
    fragments: Option<Vec<usize>>,
    moving: Option<Vec<bool>>,
}

impl Simulation {
    /// Fields at the present time. Nothing moves.
    ///
    /// ```
    /// # use ddem_core::{FIELDS, Simulation};
    /// # fn values(simulation: &mut Simulation) {
    /// let mut snapshot = simulation.snapshot();
    /// for field in &FIELDS {
    ///     let n = snapshot.len(field.on);
    ///     let mut first = vec![0.0; n.min(100) * field.components];
    ///     snapshot.fill(field, 0..n.min(100), &mut first);
    /// }
    /// # }
    /// ```
    pub fn snapshot(&mut self) -> Snapshot<'_> {
        Snapshot { simulation: self, fragments: None, moving: None }
    }
}

impl Snapshot<'_> {
    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.simulation.model
    }

    /// Number of the values of a field.
    #[must_use]
    pub fn len(&self, on: On) -> usize {
        let model = &self.simulation.model;
        match on {
            On::Node => model.n_nodes(),
            On::Element => model.n_elements(),
            On::Pair => model.n_pairs(),
        }
    }

    /// Writes a range of the values of a field, one after another.
    ///
    /// # Panics
    ///
    /// If there are no such values, or there is not room for exactly them.
    pub fn fill(&mut self, field: &Field, range: Range<usize>, out: &mut [f64]) {
        let (n, room) = (self.len(field.on), out.len());
        assert!(range.end <= n, "`{}` has no values {range:?}: it has {n}", field.name);
        let wanted = range.len() * field.components;
        assert_eq!(room, wanted, "room for the values {range:?} of `{}`", field.name);
        (field.fill)(self, range, out);
    }

    /// All values of a field, one after another.
    pub fn values(&mut self, field: &Field) -> Vec<f64> {
        let n = self.len(field.on);
        let mut values = vec![0.0; n * field.components];
        self.fill(field, 0..n, &mut values);
        values
    }

    /// The simulation, and the number of the fragment of each block.
    pub(super) fn fragments(&mut self) -> (&Simulation, &[usize]) {
        let Self { simulation, fragments, .. } = self;
        let numbers = fragments.get_or_insert_with(|| simulation.block_fragments());
        (simulation, numbers)
    }

    /// The simulation, and which blocks move in the failing trial of a factor of safety.
    pub(super) fn moving(&mut self) -> (&Simulation, &[bool]) {
        let Self { simulation, moving, .. } = self;
        let moving = moving.get_or_insert_with(|| {
            let mut moves = vec![false; simulation.model.n_blocks()];
            if simulation.failing {
                simulation.moving_blocks().iter().for_each(|moving| moves[moving.block] = true);
            }
            moves
        });
        (simulation, moving)
    }
}
