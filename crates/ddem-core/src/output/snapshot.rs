//! Fields at one time.

use std::ops::Range;
use std::sync::OnceLock;

use super::{Field, FieldLocation};
use crate::model::Model;
use crate::state::State;
use crate::step::Context;
use crate::step::scratch::Scratch;

/// Fields of a simulation at the present time, by ranges of values, so that no caller has to hold a
/// whole field. Quantities that depend on all blocks are computed once.
#[derive(Debug)]
pub struct Snapshot<'a> {
    pub(super) model: &'a Model,
    pub(super) state: &'a State,
    /// Forces, broken joints and contacts of the last measurement.
    pub(super) scratch: &'a Scratch,
    pub(super) context: Context<'a>,
    failing: bool,
    fragments: OnceLock<Vec<usize>>,
    moving: OnceLock<Vec<bool>>,
}

impl<'a> Snapshot<'a> {
    /// Snapshot of a measured state. `failing` marks the failing trial of a factor of safety.
    pub(crate) fn new(
        context: Context<'a>,
        state: &'a State,
        scratch: &'a Scratch,
        failing: bool,
    ) -> Self {
        let (fragments, moving) = (OnceLock::new(), OnceLock::new());
        Self { model: context.model, state, scratch, context, failing, fragments, moving }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// Number of values at a location.
    #[must_use]
    pub fn len(&self, on: FieldLocation) -> usize {
        match on {
            FieldLocation::Node => self.model.n_nodes(),
            FieldLocation::Element => self.model.n_elements(),
            FieldLocation::Pair => self.model.n_pairs(),
        }
    }

    /// Writes a range of the values of a field, one after another.
    ///
    /// # Panics
    ///
    /// If the field has no such values, or `out` does not have exactly their length.
    pub fn fill(&self, field: &Field, range: Range<usize>, out: &mut [f64]) {
        let (n, room) = (self.len(field.on), out.len());
        assert!(range.end <= n, "`{}` has no values {range:?}: it has {n}", field.name);
        let wanted = range.len() * field.components;
        assert!(
            room == wanted,
            "`{}` needs room for {wanted} numbers in {range:?}: there is room for {room}",
            field.name
        );
        (field.fill)(self, range, out);
    }

    /// All values of a field, one after another.
    #[must_use]
    pub fn values(&self, field: &Field) -> Vec<f64> {
        let n = self.len(field.on);
        let mut values = vec![0.0; n * field.components];
        self.fill(field, 0..n, &mut values);
        values
    }

    /// Fragment number of each block.
    pub(super) fn numbers(&self) -> &[usize] {
        self.fragments.get_or_init(|| self.block_fragments())
    }

    /// True for each block that moves in the failing trial of a factor of safety.
    pub(super) fn moving(&self) -> &[bool] {
        self.moving.get_or_init(|| {
            let mut moves = vec![false; self.model.n_blocks()];
            if self.failing {
                let moving = self.state.moving(self.model);
                moving.iter().for_each(|moving| moves[moving.block] = true);
            }
            moves
        })
    }
}
