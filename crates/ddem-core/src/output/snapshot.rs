//! Fields at one time.

use std::ops::Range;
use std::sync::OnceLock;

use super::{Field, FieldLocation};
use crate::model::Model;
use crate::state::State;
use crate::step::Context;
use crate::step::scratch::Scratch;

/// Fields of a simulation at the present time, by ranges of their values: nobody needs to hold a
/// whole one. What a field takes from all blocks is found once.
#[derive(Debug)]
pub struct Snapshot<'a> {
    pub(super) model: &'a Model,
    pub(super) state: &'a State,
    /// Forces, broken joints and contacts as they were last measured.
    pub(super) scratch: &'a Scratch,
    pub(super) context: Context<'a>,
    failing: bool,
    fragments: OnceLock<Vec<usize>>,
    moving: OnceLock<Vec<bool>>,
}

impl<'a> Snapshot<'a> {
    /// Of a state that was measured, and of a trial that is `failing` or not.
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

    /// Number of the values of a field.
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
    /// If there are no such values, or there is not room for exactly them.
    pub fn fill(&self, field: &Field, range: Range<usize>, out: &mut [f64]) {
        let (n, room) = (self.len(field.on), out.len());
        assert!(range.end <= n, "`{}` has no values {range:?}: it has {n}", field.name);
        let wanted = range.len() * field.components;
        assert_eq!(room, wanted, "room for the values {range:?} of `{}`", field.name);
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

    /// Number of the fragment of each block.
    pub(super) fn numbers(&self) -> &[usize] {
        self.fragments.get_or_init(|| self.block_fragments())
    }

    /// Blocks that move in the failing trial of a factor of safety.
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
