//! Factors of safety.

use ddem_core::{ModelError, RunError, Safety, SafetyTrial};
use ddem_deck::lint::{Code, Diagnostic};
use ddem_io::run::Session;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::drive::read_stage;
use crate::errors;
use crate::notation;
use crate::run::{later, wait_for, waiting};
use crate::simulation::{Inner, PySimulation};
use crate::worker::Worker;

/// Factor, bracket, trials, set and number of the moving blocks in the failing trial, and warnings.
type Found =
    (Option<f64>, [Option<f64>; 2], Vec<(f64, String, u64)>, Vec<(String, usize)>, Vec<String>);

/// Text of a warning, unless the deck allows it. The summary has it, too.
fn reported(session: &mut Session, warning: &Diagnostic) -> Option<String> {
    session.warn(warning).then(|| notation::warning(warning))
}

#[pymethods]
impl PySimulation {
    /// Warning about later stages at which the model changes.
    fn _waiting(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let mut inner = self.lock_to_move(py)?;
        let session = &mut inner.session;
        let mut names = waiting(session);
        let deck = session.site().deck();
        let others = (deck.remove.iter().map(|entry| &entry.from))
            .chain(deck.assign.iter().map(|entry| &entry.from))
            .chain(deck.fix.iter().map(|entry| &entry.until))
            .chain(deck.load.iter().map(|entry| &entry.until));
        names.extend(later(session, &others.flatten().collect::<Vec<_>>()));
        names.sort();
        names.dedup();
        let Some(first) = names.first() else { return Ok(None) };
        let what = "supports, loads, excavations or joints";
        let help = format!(
            "enter(\"{first}\") of a simulation begins it, or add a stage of kind \"safety\" and use run_deck"
        );
        let warning = wait_for(what, &names, "are not included in this factor", help);
        Ok(reported(session, &warning))
    }

    /// Warning about a first relaxation that was undecided after `steps`.
    fn _undecided(&self, py: Python<'_>, steps: u64) -> PyResult<Option<String>> {
        let message = format!(
            "the model is not in equilibrium after {steps} steps: the search starts from the model as built"
        );
        let help = "give a simulation in equilibrium";
        let warning = Diagnostic::warning(Code::NotInEquilibrium, "model", message, help);
        Ok(reported(&mut self.lock_to_move(py)?.session, &warning))
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
        let find = |inner: &mut Inner, worker: &Worker| {
            let search = stage.search();
            let simulation = inner.session.simulation_mut();
            simulation.stop_when(worker.stop_flag());
            let found = simulation.factor_of_safety(&search, &|_| {})?;
            let warnings = inner.session.search_warnings(&search, &found);
            Ok((found, warnings))
        };
        let error = |error: RunError| errors::run_error(py, &error, "");
        let (Safety { factor, bracket, trials, failing, .. }, warnings) =
            self.work(py, &mut inner, None, find, error)?;
        let trials = trials.into_iter().map(|trial| {
            let SafetyTrial { factor, verdict, steps } = trial;
            (factor, verdict.to_string(), steps)
        });
        let moving = failing.map(|failing| failing.moving_blocks()).unwrap_or_default();
        let moving = moving.into_iter().map(|moving| (moving.set, moving.block));
        let warnings = warnings.iter().map(notation::warning);
        Ok((factor, bracket, trials.collect(), moving.collect(), warnings.collect()))
    }
}
