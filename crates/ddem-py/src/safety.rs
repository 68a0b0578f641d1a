//! Factors of safety.

use ddem_core::{ModelError, Safety, SafetyTrial};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::drive::read_stage;
use crate::errors;
use crate::run::{later, waiting};
use crate::simulation::PySimulation;
use crate::worker::{on_worker_thread, outcome};

/// Factor, bracket, trials, and set and number of the moving blocks in the failing trial.
type Found = (Option<f64>, [Option<f64>; 2], Vec<(f64, String, u64)>, Vec<(String, usize)>);

#[pymethods]
impl PySimulation {
    /// Names of later stages at which the model changes.
    fn _waiting(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let inner = self.lock_to_move(py)?;
        let session = &inner.session;
        let mut names = waiting(session);
        let deck = session.site().deck();
        let others = (deck.remove.iter().map(|entry| &entry.from))
            .chain(deck.assign.iter().map(|entry| &entry.from))
            .chain(deck.fix.iter().map(|entry| &entry.until))
            .chain(deck.load.iter().map(|entry| &entry.until));
        names.extend(later(session, &others.flatten().collect::<Vec<_>>()));
        names.sort();
        names.dedup();
        Ok(names)
    }

    /// Result of :func:`ddem.factor_of_safety`.
    #[pyo3(signature = (**keys))]
    fn _factor_of_safety(
        &self,
        py: Python<'_>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Found> {
        let stage = read_stage(py, "safety", None, keys)?;
        let mut inner = self.lock_to_move(py)?;
        let mut faults = stage.check();
        let wrong = inner.session.site().deck().check_search(&stage.search());
        let known = |key: &str| faults.iter().any(|known| known.place == format!("stage[0].{key}"));
        let new: Vec<_> = wrong.into_iter().filter(|fault| !known(&fault.place)).collect();
        faults.extend(new);
        if !faults.is_empty() {
            return Err(errors::arguments(py, ModelError { faults }, "stage[0]."));
        }
        let simulation = inner.session.simulation_mut();
        let (found, stopped) = on_worker_thread(py, self.pool(), None, |worker| {
            simulation.stop_when(worker.stop_flag());
            simulation.factor_of_safety(&stage.search(), &|_| {})
        })?;
        let Safety { factor, bracket, trials, failing } =
            outcome(found, stopped, |error| errors::run_error(py, &error, ""))?;
        let trials = trials.into_iter().map(|trial| {
            let SafetyTrial { factor, verdict, steps } = trial;
            (factor, verdict.to_string(), steps)
        });
        let moving = failing.map(|failing| failing.moving_blocks()).unwrap_or_default();
        let moving = moving.into_iter().map(|moving| (moving.set, moving.block));
        Ok((factor, bracket, trials.collect(), moving.collect()))
    }
}
