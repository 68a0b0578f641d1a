//! Histories that are Python functions.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use ddem_core::{Fault, Model};
use pyo3::prelude::*;

/// A load or a driven support, by its number in the deck.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Timed {
    Load(usize),
    Fix(usize),
}

impl Timed {
    pub(crate) fn new(section: &str, index: usize) -> Option<Self> {
        match section {
            "load" => Some(Self::Load(index)),
            "fix" => Some(Self::Fix(index)),
            _ => None,
        }
    }
}

/// What a function raised, kept until the call that it ended is over.
#[derive(Clone, Default)]
pub(crate) struct Raised(Arc<Mutex<Option<PyErr>>>);

impl Raised {
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// The functions of a model.
#[derive(Default)]
pub(crate) struct Functions(BTreeMap<Timed, Py<PyAny>>);

impl Functions {
    pub(crate) fn insert(&mut self, timed: Timed, function: Py<PyAny>) {
        self.0.insert(timed, function);
    }

    pub(crate) fn clone_ref(&self, py: Python<'_>) -> Self {
        Self(self.0.iter().map(|(timed, function)| (*timed, function.clone_ref(py))).collect())
    }

    /// Their places in the deck.
    pub(crate) fn places(&self) -> impl Iterator<Item = String> + '_ {
        self.0.keys().map(|timed| match timed {
            Timed::Load(index) => format!("load[{index}].history"),
            Timed::Fix(index) => format!("fix[{index}].history"),
        })
    }

    /// Puts them into the model.
    pub(crate) fn set(self, model: &mut Model, raised: &Raised) -> Result<(), Fault> {
        for (timed, function) in self.0 {
            let raised = raised.clone();
            let factor = move |time: f64| {
                Python::attach(|py| {
                    let factor = function.call1(py, (time,)).and_then(|f| f.extract::<f64>(py));
                    factor.map_err(|error| {
                        let message = error.to_string();
                        *raised.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                        message
                    })
                })
            };
            match timed {
                Timed::Load(index) => model.set_load_history(index, Arc::new(factor))?,
                Timed::Fix(index) => model.set_fix_history(index, Arc::new(factor))?,
            }
        }
        Ok(())
    }
}
