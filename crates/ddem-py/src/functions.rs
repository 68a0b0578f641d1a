//! Histories that are Python functions.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ddem_core::{Fault, Model};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;

use crate::errors::refuse;

/// A load, a charge, a boundary or a driven support, by its number in the deck.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Timed {
    Load(usize),
    Fix(usize),
    Boundary(usize),
    Charge(usize),
}

impl Timed {
    pub(crate) fn new(section: &str, index: usize) -> Option<Self> {
        match section {
            "load" => Some(Self::Load(index)),
            "fix" => Some(Self::Fix(index)),
            "boundary" => Some(Self::Boundary(index)),
            "charge" => Some(Self::Charge(index)),
            _ => None,
        }
    }

    /// Section and number of the entry.
    fn entry(self) -> (&'static str, usize) {
        match self {
            Self::Load(index) => ("load", index),
            Self::Fix(index) => ("fix", index),
            Self::Boundary(index) => ("boundary", index),
            Self::Charge(index) => ("charge", index),
        }
    }

    /// Place of its history in the deck.
    fn place(self) -> String {
        let (section, index) = self.entry();
        format!("{section}[{index}].history")
    }
}

/// Functions of a model.
#[derive(Default)]
pub(crate) struct Functions(BTreeMap<Timed, Py<PyAny>>);

impl Functions {
    pub(crate) fn insert(&mut self, timed: Timed, function: Py<PyAny>) {
        self.0.insert(timed, function);
    }

    pub(crate) fn clone_ref(&self, py: Python<'_>) -> Self {
        Self(self.0.iter().map(|(timed, function)| (*timed, function.clone_ref(py))).collect())
    }

    /// Functions from a list by section and index.
    pub(crate) fn of(listed: Vec<(String, usize, Py<PyAny>)>) -> Self {
        let timed = listed.into_iter().filter_map(|(section, index, function)| {
            Some((Timed::new(&section, index)?, function))
        });
        Self(timed.collect())
    }

    /// List by section and index.
    pub(crate) fn listed(&self, py: Python<'_>) -> Vec<(String, usize, Py<PyAny>)> {
        let listed = |(timed, function): (&Timed, &Py<PyAny>)| {
            let (section, index) = timed.entry();
            (section.to_owned(), index, function.clone_ref(py))
        };
        self.0.iter().map(listed).collect()
    }

    /// Places of the functions in the deck.
    pub(crate) fn places(&self) -> impl Iterator<Item = String> + '_ {
        self.0.keys().map(|timed| timed.place())
    }

    /// Visits the functions for the garbage collector.
    pub(crate) fn traverse(&self, visit: &PyVisit<'_>) -> Result<(), PyTraverseError> {
        self.0.values().try_for_each(|function| visit.call(function))
    }
}

/// Functions that a simulation calls, and the exception that the last one raised. The exception is
/// kept until the call that it ended is over. The simulation and the histories of its model share
/// this, so that the garbage collector can find the functions and remove them.
#[derive(Clone, Default)]
pub(crate) struct Called {
    functions: Arc<Mutex<Functions>>,
    raised: Arc<Mutex<Option<PyErr>>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Called {
    pub(crate) fn new(functions: Functions) -> Self {
        Self { functions: Arc::new(Mutex::new(functions)), raised: Arc::default() }
    }

    pub(crate) fn take_raised(&self) -> Option<PyErr> {
        locked(&self.raised).take()
    }

    /// Sets the functions as histories of a model.
    pub(crate) fn set_on(&self, model: &mut Model) -> Result<(), Fault> {
        let all: Vec<Timed> = locked(&self.functions).0.keys().copied().collect();
        for timed in all {
            let called = self.clone();
            let factor = move |time: f64| called.factor(timed, time);
            match timed {
                Timed::Load(index) => model.set_load_history(index, Arc::new(factor))?,
                Timed::Fix(index) => model.set_fix_history(index, Arc::new(factor))?,
                Timed::Boundary(index) => model.set_boundary_history(index, Arc::new(factor))?,
                Timed::Charge(index) => model.set_charge_history(index, Arc::new(factor))?,
            }
        }
        Ok(())
    }

    fn factor(&self, timed: Timed, time: f64) -> Result<f64, String> {
        Python::attach(|py| {
            let function = locked(&self.functions).0.get(&timed).map(|f| f.clone_ref(py));
            let Some(function) = function else { return Err("it no longer exists".to_owned()) };
            let factor = function.call1(py, (time,)).and_then(|factor| {
                factor.extract::<f64>(py).map_err(|error| {
                    let found = factor.bind(py).get_type().qualname();
                    let found = found.map_or_else(|_| "?".to_owned(), |name| name.to_string());
                    let message = format!("must give a number, gave a `{found}`");
                    refuse(py, &timed.place(), &message, error)
                })
            });
            factor.map_err(|error| {
                let message = error.to_string();
                let before = locked(&self.raised).replace(error);
                drop(before);
                message
            })
        })
    }

    /// Visits the functions for the garbage collector.
    pub(crate) fn traverse(&self, visit: &PyVisit<'_>) -> Result<(), PyTraverseError> {
        match self.functions.try_lock() {
            Ok(functions) => functions.traverse(visit),
            Err(_) => Ok(()),
        }
    }

    /// Removes the functions.
    pub(crate) fn clear(&self) {
        let functions = self.functions.try_lock().map(|mut all| std::mem::take(&mut *all));
        drop(functions);
    }
}
