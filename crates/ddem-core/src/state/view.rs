//! All that follows from model, state and stage, and acts in the next step.

use crate::model::Model;
use crate::model::boundary::{Moving, Outside, Push};
use crate::model::conditions::Active;
use crate::state::State;
use ddem_mechanics::math::lanes::Lanes;

/// Supports, loads and boundaries in force, and their values at the present time.
#[derive(Debug)]
pub(crate) struct StageView {
    pub(crate) active: Active,
    pub(crate) outside: Outside,
    /// Forces of boundaries besides their dashpots.
    pub(crate) pushes: Vec<Push>,
    /// Free-field columns as the next step finds and leaves them.
    pub(crate) columns: Moving,
    /// Factor of each load, and of gravity.
    pub(crate) factors: Vec<f64>,
    /// Velocity of each fix half a step ahead `[m/s]`.
    pub(crate) velocities: Vec<[f64; 3]>,
    /// α of the bodies of each pack that slide, or nothing `[1/s]`.
    pub(crate) sliding: Vec<Lanes>,
}

impl StageView {
    /// Everything at rest.
    pub(crate) fn new(model: &Model, state: &State) -> Self {
        let active = model.active(state.stage, &state.applied);
        let Model { borders, conditions, .. } = model;
        let made = model.made();
        let outside = Outside::new(borders, made, conditions, state.stage, &active, &state.kept);
        Self {
            pushes: outside.kept().collect(),
            active,
            outside,
            columns: Moving::default(),
            factors: state.load_factors.clone(),
            velocities: vec![[0.0; 3]; model.conditions.fixed.len()],
            sliding: Vec::new(),
        }
    }

    /// After a change of the stage, the model or what programs apply: values go on as they are.
    pub(crate) fn renew(&mut self, model: &Model, state: &State) {
        let Self { active, outside, pushes, .. } = Self::new(model, state);
        (self.active, self.outside, self.pushes) = (active, outside, pushes);
    }
}
