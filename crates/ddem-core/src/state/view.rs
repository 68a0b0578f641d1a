//! Quantities derived from model, state and stage that act in the next step.

use crate::model::Model;
use crate::model::boundary::{ActiveBoundaries, BoundaryForce, ColumnMotion};
use crate::model::conditions::ActiveConditions;
use crate::state::State;
use ddem_mechanics::math::lanes::Lanes;

/// Supports, loads and boundaries in force, and their values at the present time.
#[derive(Debug)]
pub(crate) struct StageView {
    pub(crate) conditions: ActiveConditions,
    pub(crate) boundaries: ActiveBoundaries,
    /// Forces of boundaries without those of their dashpots.
    pub(crate) boundary_forces: Vec<BoundaryForce>,
    /// Motion of the free-field columns before and after the next step.
    pub(crate) columns: ColumnMotion,
    /// Factors of the loads and charges, of the forces of programs, and of gravity.
    pub(crate) factors: Vec<f64>,
    /// Velocity of each support (`fix`) half a step ahead `[m/s]`.
    pub(crate) velocities: Vec<[f64; 3]>,
    /// α of the sliding blocks of each pack `[1/s]`; empty if none slides.
    pub(crate) sliding: Vec<Lanes>,
}

impl StageView {
    /// View with everything at rest.
    pub(crate) fn new(model: &Model, state: &State) -> Self {
        let conditions = model.active(state.stage, &state.applied);
        let boundaries = ActiveBoundaries::new(
            &model.boundaries,
            model.geometries(),
            &model.conditions,
            state.stage,
            &conditions,
            &state.locked_reactions,
        );
        Self {
            boundary_forces: boundaries.locked_reactions().collect(),
            conditions,
            boundaries,
            columns: ColumnMotion::default(),
            factors: state.load_factors.clone(),
            velocities: vec![[0.0; 3]; model.conditions.fixed.len()],
            sliding: Vec::new(),
        }
    }

    /// Renews supports, loads and boundaries after a change of the stage, the model or the forces
    /// of programs. Factors and velocities stay as they are.
    pub(crate) fn renew(&mut self, model: &Model, state: &State) {
        let Self { conditions, boundaries, boundary_forces, .. } = Self::new(model, state);
        (self.conditions, self.boundaries, self.boundary_forces) =
            (conditions, boundaries, boundary_forces);
    }
}
