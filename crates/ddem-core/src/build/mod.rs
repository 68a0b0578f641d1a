//! From a deck to the arrays of a model, and what is to be said of them.

mod boundaries;
mod charge;
mod conditions;
mod doubts;
mod faces;
mod mechanism;
mod properties;
mod selections;
mod stress;
mod unbalanced;

use std::sync::Arc;

use crate::deck::{Deck, Where};
use crate::error::{Fault, ModelError};
use crate::geometry::{Geometry, Names, Region, Stages};
use crate::model::{Model, Problem};
use crate::properties::Properties;

/// A deck, and what is where from which stage on.
#[derive(Clone, Copy)]
struct Site<'a> {
    deck: &'a Deck,
    stages: &'a Stages,
    properties: &'a Properties,
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
        let model = Self::of(Arc::new(problem));
        let mut faults = mechanism::check(&model);
        if faults.is_empty() {
            faults = boundaries::idle(&model);
        }
        if faults.is_empty() { Ok(model) } else { Err(ModelError { faults }) }
    }

    /// The deck that the model was built from.
    #[must_use]
    pub fn deck(&self) -> &Deck {
        &self.problem.deck
    }

    fn region(&self, region: &Where) -> Region {
        Region::new(region, &self.geometry.frame)
    }
}

/// The problem that a deck states.
fn problem(deck: &Deck) -> Result<Problem, Vec<Fault>> {
    let names = Names::new(deck);
    let geometry = Arc::new(Geometry::new(deck, &names)?);
    let stages = Stages::new(deck, &names, geometry.clone())?;
    let conditions = conditions::conditions(deck, &stages)?;
    let properties = properties::properties(deck);
    let borders = boundaries::borders(Site { deck, stages: &stages, properties: &properties })?;
    let region = |region: &Where| Region::new(region, &geometry.frame);
    let stresses = stress::stresses(deck, &geometry, region)?;
    let faults = stress::met(deck, &geometry, &stresses);
    if !faults.is_empty() {
        return Err(faults);
    }
    let motions = conditions::motions(deck, &geometry);
    Ok(Problem {
        properties,
        stages,
        conditions,
        borders,
        stresses,
        motions,
        kinds: deck.stage.iter().map(|stage| stage.kind).collect(),
        sets: (0..deck.blocks.len()).map(|set| deck.set_name(set)).collect(),
        deck: deck.clone(),
    })
}
