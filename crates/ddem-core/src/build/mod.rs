//! From a deck to the arrays of a model, and what is to be said of them.

mod boundaries;
mod charge;
mod conditions;
mod doubts;
mod faces;
mod geometry;
mod mechanism;
mod properties;
mod selections;
mod stress;
mod unbalanced;

use std::sync::Arc;

use boundaries::InForce;
use geometry::{Cut, Frame, Names, Region};
pub use geometry::{Interface, Selection};

use crate::deck::{Deck, Where};
use crate::error::{Fault, ModelError};
use crate::geometry::{Geometry, Stages};
use crate::model::{Model, Problem};
use crate::pack::Packs;

/// A deck, and what its parts of space refer to.
#[derive(Debug)]
struct Site {
    deck: Deck,
    frame: Frame,
    /// Blocks that curved and slanted shapes have split and taken out.
    taken: Vec<Selection>,
}

impl Site {
    fn region(&self, region: &Where) -> Region {
        Region::new(region, &self.frame)
    }
}

/// What is where in the stage of a name, or at the start.
fn at_stage<'a>(deck: &Deck, stages: &'a Stages, name: Option<&String>) -> &'a Geometry {
    stages.at(name.and_then(|name| deck.stage_number(name)).unwrap_or(0))
}

impl Model {
    /// Builds the model that a deck describes.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with the deck, each [`Fault`] with the key it is about.
    pub fn new(deck: &Deck) -> Result<Self, ModelError> {
        let faults = crate::deck::check(deck);
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        let problem = problem(deck).map_err(|faults| ModelError { faults })?;
        Ok(Self::of(Arc::new(problem)))
    }

    /// The deck that the model was built from.
    #[must_use]
    pub fn deck(&self) -> &Deck {
        &self.site().deck
    }

    fn site(&self) -> &Site {
        let site = self.problem.origin.downcast_ref();
        site.unwrap_or_else(|| unreachable!("models are of decks"))
    }

    fn region(&self, region: &Where) -> Region {
        self.site().region(region)
    }
}

/// Fails where there are faults.
fn sound(faults: Vec<Fault>) -> Result<(), Vec<Fault>> {
    if faults.is_empty() { Ok(()) } else { Err(faults) }
}

/// The problem that a deck states.
fn problem(deck: &Deck) -> Result<Problem, Vec<Fault>> {
    let names = Names::new(deck);
    let Cut { geometry, frame, mut taken } = geometry::cut(deck, &names)?;
    let geometry = Arc::new(geometry);
    let (stages, dug) = geometry::stages((deck, &names), geometry.clone(), &frame)?;
    taken.extend(dug);
    let site = Site { deck: deck.clone(), frame, taken };
    let conditions = conditions::conditions(&site, &stages)?;
    let packs = Packs::new(&geometry);
    sound(mechanism::check(&site, &stages, &conditions, &packs))?;
    let properties = properties::properties(deck);
    let borders = boundaries::borders(&site, &stages, &properties)?;
    let in_force =
        InForce { stages: &stages, conditions: &conditions, borders: &borders, packs: &packs };
    sound(boundaries::idle(deck, &in_force))?;
    let stresses = stress::stresses(deck, &geometry, |region| site.region(region))?;
    sound(stress::met(deck, &geometry, &stresses))?;
    let motions = conditions::motions(&site, &geometry);
    Ok(Problem {
        properties,
        stages,
        conditions,
        borders,
        stresses,
        motions,
        kinds: deck.stage.iter().map(|stage| stage.kind).collect(),
        sets: (0..deck.blocks.len()).map(|set| deck.set_name(set)).collect(),
        origin: Arc::new(site),
    })
}
