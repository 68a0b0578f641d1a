//! Python functions that a run calls between steps.

use pyo3::prelude::*;

use crate::errors::{self, model_error};
use crate::simulation::PySimulation;

/// Number of calls in a run without `every`.
const CALLS: f64 = 100.0;

/// Python functions that a run calls between steps.
pub(crate) struct Callbacks<'py> {
    until: Option<Bound<'py, PyAny>>,
    callback: Option<Bound<'py, PyAny>>,
    /// Simulated time between two callbacks `[s]`.
    pub(crate) every: f64,
}

impl<'py> Callbacks<'py> {
    /// The functions; `None` if there are none.
    pub(crate) fn new(
        py: Python<'py>,
        [until, callback]: [Option<Bound<'py, PyAny>>; 2],
        every: Option<Bound<'py, PyAny>>,
        duration: Option<f64>,
    ) -> PyResult<Option<Self>> {
        for (name, function) in [("until", &until), ("callback", &callback)] {
            if function.as_ref().is_some_and(|function| !function.is_callable()) {
                let help = "such as `lambda simulation: simulation.time > 0.1`";
                return Err(model_error(
                    py,
                    name,
                    "must be a function of the simulation",
                    Some(help),
                ));
            }
        }
        let none = until.is_none() && callback.is_none();
        let every = match every {
            Some(_) if none => {
                let message = "needs `until` or `callback`, whose calls it spaces";
                return Err(model_error(py, "every", message, None));
            }
            Some(every) => Some(every.extract().map_err(|error| {
                errors::refuse(py, "every", "must be a number of seconds", error)
            })?),
            None => None,
        };
        if let Some(every) = every.filter(|every: &f64| !(every.is_finite() && *every > 0.0)) {
            let message = format!("must be a finite number above 0, found {every}");
            return Err(model_error(py, "every", &message, None));
        }
        let every = every.or(duration.map(|duration| duration / CALLS)).unwrap_or(f64::INFINITY);
        Ok((!none).then_some(Self { until, callback, every }))
    }

    /// Calls both functions. Returns true if the run must end.
    pub(crate) fn call(&self, simulation: &Bound<'py, PySimulation>) -> PyResult<bool> {
        self.call_last(simulation)?;
        self.until.as_ref().map_or(Ok(false), |until| until.call1((simulation,))?.is_truthy())
    }

    /// Calls `callback`, as at the end of a run.
    pub(crate) fn call_last(&self, simulation: &Bound<'py, PySimulation>) -> PyResult<()> {
        self.callback.as_ref().map_or(Ok(()), |callback| callback.call1((simulation,)).map(|_| ()))
    }
}
