//! Conversion of a deck to a problem.

mod boundaries;
mod charge;
mod conditions;
mod default_friction;
mod faces;
mod geometry;
mod mechanism;
mod progress;
mod properties;
mod rock;
mod selections;
mod stress;
mod unbalanced;
mod warnings;

use std::sync::Arc;

use ddem_core::problem::{Boundaries, BoundaryHold, Conditions, Geometry, Stages};
use ddem_core::{Fault, Model, ModelError, Problem};

use geometry::{Cut, Names, Selector};
pub use geometry::{Interface, Selection};
pub use progress::{BuildPhase, BuildProgress};
pub(crate) use rock::parts as rock_parts;
pub use rock::{BlockMode, BlockVerdict, CutRock, RockFracture, RockPlane};

use crate::lint::Diagnostic;
use crate::schema::{Deck, Where};

/// Deck whose blocks have been cut: its problem, and the blocks that its entries select.
#[derive(Clone, Debug)]
pub struct BuiltDeck {
    deck: Deck,
    problem: Arc<Problem>,
    /// Blocks that curved and slanted shapes have split or removed.
    selections: Vec<Selection>,
    /// Warnings about each charge.
    charges: Vec<Vec<Diagnostic>>,
    /// Supports at boundaries in each stage.
    holds: Vec<Vec<BoundaryHold>>,
    /// Faces of cells that look into holes.
    walls: rock::CellWalls,
}

impl Deck {
    /// The model of a deck.
    ///
    /// # Errors
    ///
    /// Those of [`BuiltDeck::new`].
    pub fn build(&self) -> Result<Model, ModelError> {
        Ok(BuiltDeck::new(self)?.model())
    }
}

impl BuiltDeck {
    /// Checks a deck, cuts its blocks and finds what its entries select.
    ///
    /// # Errors
    ///
    /// All mistakes of the deck; each [`Fault`] names the key it is about.
    pub fn new(deck: &Deck) -> Result<Self, ModelError> {
        Self::within(deck, u64::MAX, &BuildProgress::default())
    }

    /// As [`new`](Self::new), with `available` memory `[bytes]`: cuts of regions stop when their cells would need
    /// more. Other threads may read the progress.
    ///
    /// # Errors
    ///
    /// Those of [`new`](Self::new), and cuts that make too many cells.
    pub fn within(
        deck: &Deck,
        available: u64,
        progress: &BuildProgress,
    ) -> Result<Self, ModelError> {
        let faults = crate::check(deck);
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        Self::build(&deck.with_tunnels().with_grounds(), available, progress)
            .map_err(|faults| ModelError { faults })
    }

    /// A new model of the problem.
    #[must_use]
    pub fn model(&self) -> Model {
        Model::new(self.problem.clone())
    }

    /// The deck.
    #[must_use]
    pub fn deck(&self) -> &Deck {
        &self.deck
    }

    /// Problem that the deck describes.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    fn build(deck: &Deck, available: u64, progress: &BuildProgress) -> Result<Self, Vec<Fault>> {
        let names = Names::new(deck);
        let Cut { stages, sets, selections, joints, walls } =
            geometry::cut(deck, &names, available, progress)?;
        let mut problem = Problem {
            properties: properties::properties(deck, joints),
            stages,
            conditions: Conditions::default(),
            boundaries: Boundaries::default(),
            stresses: Vec::new(),
            motions: Vec::new(),
            kinds: deck.stage.iter().map(|stage| stage.kind).collect(),
            sets,
        };
        let charges;
        (problem.conditions, charges) = conditions::conditions(deck, &problem)?;
        sound(mechanism::check(deck, &problem))?;
        problem.boundaries = boundaries::boundaries(deck, &problem)?;
        let holds = problem.boundary_holds();
        sound(boundaries::held_faults(deck, &problem, &holds))?;
        problem.stresses = stress::stresses(deck, &problem)?;
        sound(stress::unjoined(deck, &problem))?;
        problem.motions = conditions::motions(deck, &problem);
        let (deck, problem) = (deck.clone(), Arc::new(problem));
        Ok(Self { deck, problem, selections, charges, holds, walls })
    }

    fn selector(&self, selector: &Where) -> Selector {
        Selector::new(selector, &self.problem.sets)
    }

    /// Blocks and joints in the named stage, or at the start if there is no name.
    fn at_stage(&self, name: Option<&String>) -> &Geometry {
        at_stage(&self.deck, &self.problem.stages, name)
    }
}

/// Blocks and joints in the named stage, or at the start if there is no name.
fn at_stage<'a>(deck: &Deck, stages: &'a Stages, name: Option<&String>) -> &'a Geometry {
    stages.at(name.and_then(|name| deck.stage_number(name)).unwrap_or(0))
}

/// Returns the faults as an error, if there are any.
fn sound(faults: Vec<Fault>) -> Result<(), Vec<Fault>> {
    if faults.is_empty() { Ok(()) } else { Err(faults) }
}
