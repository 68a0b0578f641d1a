//! Python model: a deck under construction.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use ddem_deck::Deck;
use ddem_io::run::model_name;
use pyo3::exceptions::PyValueError;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyTuple, PyType};
use toml::{Table, Value};

use crate::draft::{Draft, DraftState};
use crate::drive::assembled;
use crate::errors::{self, model_error, refuse};
use crate::fields;
use crate::functions::Functions;
use crate::matter::{Matter, no_matter};
use crate::simulation::PySimulation;
use crate::values::{alone, table, table_alone, to_python, value, with_files, without_tunnel};
use crate::worker::Pool;

/// A model: blocks, joints, supports and loads, as a deck has them.
///
/// Keywords are the keys of the deck (docs/deck.md) and checked by its rules. In place of
/// `where = {...}` its keys are given, those of :meth:`Simulation.nodes`. Paths of files are relative
/// to the current directory. The key `from` is `from_`.
///
#[doc = include_str!("keys/ModelTable.txt")]
/// Raises
/// ------
/// ModelError
///     A key that does not exist or a value of the wrong type.
///
/// Examples
/// --------
/// >>> rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
/// >>> model = ddem.Model(title="cube", gravity=(0, 0, -9.81))
/// >>> model.add_blocks(size=(1, 1, 1), divisions=2, material=rock)
/// >>> model.fix("xyz", z=0.0)
/// >>> simulation = model.build()
/// >>> simulation.n_nodes
/// 27
#[pyclass(name = "Model", frozen, module = "ddem")]
pub(crate) struct PyModel {
    draft: Mutex<Draft>,
}

#[pymethods]
impl PyModel {
    #[new]
    #[pyo3(signature = (*, title="", **keys))]
    fn new(py: Python<'_>, title: &str, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let (keys, _) = table("model", keys, &mut no_matter)?;
        let mut root = Table::from_iter([("model".to_owned(), Value::Table(keys))]);
        root.insert("title".to_owned(), Value::String(title.to_owned()));
        Self::of(py, &root)
    }

    /// Checks everything and builds a simulation. Warnings are Python warnings.
    ///
    /// Parameters
    /// ----------
    /// threads : int, optional
    ///     Number of threads; default one for each processor. Results do not depend on it.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     At the start: time 0, nothing displaced, the supports and loads of the first stage in
    ///     force.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     All faults of the model, each with the line of the script that made the entry.
    /// MemoryError
    ///     The model does not fit in memory.
    /// KeyboardInterrupt
    ///     There is no simulation. A thread may go on with the model for a while.
    #[pyo3(signature = (*, threads=None))]
    fn build(&self, py: Python<'_>, threads: Option<&Bound<'_, PyAny>>) -> PyResult<PySimulation> {
        let pool = Pool::new(threads)?;
        let (deck, functions) = self.parts_with_files(py)?;
        assembled(py, pool, functions, &|error| self.located(py, error), move |change| {
            ddem_io::run::Session::with(&deck, ddem_core::Simd::default(), change)
        })
    }

    /// A model from a deck.
    ///
    /// Parameters
    /// ----------
    /// deck : path or dict
    ///     A TOML file, or a dictionary like :attr:`deck`.
    ///
    /// Returns
    /// -------
    /// Model
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ModelError
    ///     The deck is wrong: the message shows where.
    #[staticmethod]
    pub(crate) fn from_deck(deck: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = deck.py();
        if let Ok(mapping) = deck.cast::<PyMapping>() {
            return match value(mapping.as_any(), "deck", &mut no_matter)? {
                Value::Table(root) => Self::of(py, &root),
                _ => Err(model_error(
                    py,
                    "deck",
                    "expected the path of a deck or a dictionary",
                    None,
                )),
            };
        }
        let path: PathBuf = deck.extract().map_err(|error| {
            refuse(py, "deck", "expected the path of a deck or a dictionary", error)
        })?;
        let (mut deck, _) = ddem_deck::read(&path).map_err(|error| errors::deck(py, &error))?;
        ddem_deck::join_paths(&mut deck, path.parent().unwrap_or(Path::new("")));
        Ok(Self { draft: Mutex::new(Draft::of(&deck)) })
    }

    /// Writes the model as a deck, which the command line runs to the same bits.
    ///
    /// Parameters
    /// ----------
    /// path : path, optional
    ///     File to write; by default nothing is written.
    ///
    /// Returns
    /// -------
    /// str
    ///     The text of the deck.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A history is a Python function, which a deck cannot hold.
    /// OSError
    ///     The file cannot be written.
    ///
    /// Examples
    /// --------
    /// >>> print(ddem.Model(title="nothing yet").to_deck().splitlines()[0])
    /// title = "nothing yet"
    #[pyo3(signature = (path=None))]
    fn to_deck(&self, py: Python<'_>, path: Option<PathBuf>) -> PyResult<String> {
        let (text, _) = self.text(py)?;
        if let Some(path) = path {
            std::fs::write(&path, &text).map_err(|error| {
                let message = format!("writing {}: {error}", path.display());
                errors::os_error(&error, &path, &message, ddem_core::ErrorCode::FileAccess)
            })?;
        }
        Ok(text)
    }

    /// The deck as a dictionary, a copy: change it and give it to :meth:`from_deck`.
    #[getter]
    fn deck<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.complete_deck(py)?)
    }

    fn __getattr__(slf: &Bound<'_, Self>, name: &str) -> PyResult<Py<PyAny>> {
        Err(fields::no_attribute(slf.as_any(), name))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (deck, _) = self.parts(py)?;
        Ok(format!("<Model \"{}\": {}>", deck.title, size(&deck)))
    }

    /// Table for notebooks.
    fn _repr_html_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (mut deck, _) = self.parts(py)?;
        let size = size(&deck);
        // Of these only the number is shown.
        deck.blocks.iter_mut().for_each(|set| set.mesh = None);
        let shown = (deck.title.clone(), size, to_python(py, &deck)?);
        py.import("ddem._html")?.call_method1("of_model", shown)
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        match self.draft.try_lock() {
            Ok(draft) => draft.functions.traverse(&visit),
            Err(_) => Ok(()),
        }
    }

    fn __clear__(&self) {
        let functions = self.draft.try_lock().map(|mut draft| std::mem::take(&mut draft.functions));
        drop(functions);
    }

    /// Support of `copy` and `pickle`.
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyType>, Bound<'py, PyTuple>, DraftState)> {
        let state = slf.get().draft().state(slf.py());
        let state = state.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok((slf.get_type(), PyTuple::empty(slf.py()), state))
    }

    fn __setstate__(&self, state: DraftState) -> PyResult<()> {
        let draft = Draft::from_state(state);
        let draft = draft.map_err(|error| PyValueError::new_err(error.to_string()))?;
        // Its functions are dropped without the lock, as they may call Python.
        let before = std::mem::replace(&mut *self.draft(), draft);
        drop(before);
        Ok(())
    }
}

impl PyModel {
    /// Model from the table of a deck that has not been read yet.
    fn of(py: Python<'_>, root: &Table) -> PyResult<Self> {
        let deck = ddem_deck::from_table(root).map_err(|error| errors::model(py, &error))?;
        Ok(Self { draft: Mutex::new(Draft::of(&deck)) })
    }

    /// Locked draft. Python must not be called while it is held, since another thread may lock it.
    fn draft(&self) -> MutexGuard<'_, Draft> {
        // A change of the draft cannot fail halfway, so a poisoned lock does no harm.
        self.draft.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Text of the deck, if a deck can hold the model, and the name of its results.
    pub(crate) fn text(&self, py: Python<'_>) -> PyResult<(String, String)> {
        let deck = self.complete_deck(py)?;
        let text = ddem_deck::write(&deck).map_err(|error| errors::deck(py, &error))?;
        let titled = !deck.title.is_empty();
        let name = if titled { "model.toml".to_owned() } else { model_name(&text) };
        Ok((text, name))
    }

    /// The deck, if a deck can hold the model.
    fn complete_deck(&self, py: Python<'_>) -> PyResult<Deck> {
        let function = self.draft().function();
        if let Some(place) = function {
            let message = "is a Python function, which a deck cannot hold";
            let help = Some("give rows of time and factor instead");
            return Err(model_error(py, &place, message, help));
        }
        Ok(self.parts(py)?.0)
    }

    /// The deck, and its Python functions.
    pub(crate) fn parts(&self, py: Python<'_>) -> PyResult<(Deck, Functions)> {
        let (deck, functions) = {
            let draft = self.draft();
            (draft.deck(), draft.functions.clone_ref(py))
        };
        Ok((deck.map_err(|error| errors::model(py, &error))?, functions))
    }

    /// The deck with the contents of the files that it names, and its Python functions.
    pub(crate) fn parts_with_files(&self, py: Python<'_>) -> PyResult<(Deck, Functions)> {
        let (deck, functions) = self.parts(py)?;
        Ok((with_files(deck).map_err(|error| self.located(py, &error))?, functions))
    }

    /// Exception for faults of the model, with the line of the script.
    pub(crate) fn located(&self, py: Python<'_>, error: &ddem_core::ModelError) -> PyErr {
        errors::faults(py, &error.faults, &|place| self.draft().line(place))
    }

    /// Sets a section of the deck that has one table, without materials or joints.
    pub(crate) fn set(
        &self,
        py: Python<'_>,
        section: &str,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let (entry, _) = table(section, keys, &mut no_matter)?;
        table_alone(py, section, entry.clone())?;
        let line = line(py);
        self.draft().set(section, entry, line);
        Ok(())
    }

    /// Adds an entry to a section of the deck.
    pub(crate) fn add(
        &self,
        py: Python<'_>,
        section: &str,
        first: Option<(&str, &Bound<'_, PyAny>)>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        for _ in 0..MOST_TRIES {
            // Materials and joints of the model, to which those of the entry are added.
            let before = self.draft().matter();
            let mut matter = before.clone();
            let mut name = |found: &Matter<'_>, _: &str| named(py, &mut matter, found);
            let (mut entry, function) = table(section, keys, &mut name)?;
            if let Some((key, given)) = first {
                entry.insert(key.to_owned(), value(given, key, &mut name)?);
            }
            let is_tunnel = |name: &str| self.draft().has_tunnel(name);
            alone(py, section, without_tunnel(&entry, is_tunnel))?;
            let (line, function) = (line(py), function.map(Bound::unbind));
            let mut draft = self.draft();
            // The conversion calls Python, which may have changed the model: names may be taken
            // now.
            if draft.matter() == before {
                let pushed = draft.push(section, entry, matter, (line, function));
                drop(draft);
                let refused = || model_error(py, section, "is not a list of entries", None);
                return if pushed { Ok(()) } else { Err(refused()) };
            }
        }
        Err(errors::busy(py, "the model"))
    }
}

/// Largest number of tries to add an entry while other threads add materials.
const MOST_TRIES: usize = 100;

/// Size of the model of a deck, as text: blocks and nodes, or regions and cuts.
fn size(deck: &Deck) -> String {
    if !deck.region.is_empty() {
        return format!("{} regions, {} cuts", deck.region.len(), deck.cut.len());
    }
    let size = ddem_deck::Size::of(deck);
    format!("{} blocks, {} nodes", size.blocks, size.nodes)
}

/// Name of a material or a joint in a model; it is added if the model has no equal one.
fn named(py: Python<'_>, root: &mut Table, matter: &Matter<'_>) -> PyResult<String> {
    let (section, kind, table, name) = match matter {
        Matter::Material(found) => {
            ("materials", "material", found.get().keys().clone(), found.get().name())
        }
        Matter::Joint(found) => {
            let (keys, material) = found.get().keys();
            let mut table = keys.clone();
            if let Some(material) = material {
                let material = named(py, root, &Matter::Material(material.bind(py)))?;
                table.insert("material".to_owned(), Value::String(material));
            }
            ("joints", "joint", table, found.get().name())
        }
    };
    let all = root.entry(section).or_insert_with(|| Value::Table(Table::new()));
    let Value::Table(all) = all else {
        return Err(model_error(py, section, "is not a table of names", None));
    };
    let table = Value::Table(table);
    let name = match name {
        Some(name) => name.to_owned(),
        None => {
            let same = all.iter().find(|(_, other)| **other == table);
            let number = |n: usize| format!("{kind}-{n}");
            let free = || (1..).map(number).find(|name| !all.contains_key(name));
            same.map(|(name, _)| name.clone()).or_else(free).unwrap_or_default()
        }
    };
    match all.get(&name) {
        Some(other) if *other != table => {
            let message = format!(
                "there is another {kind} named `{name}`, with other values: give it another `name`"
            );
            Err(model_error(py, kind, &message, None))
        }
        _ => {
            all.insert(name.clone(), table);
            Ok(name)
        }
    }
}

/// File and line of the script that is running.
fn line(py: Python<'_>) -> Option<String> {
    let frame = py.import("sys").ok()?.call_method1("_getframe", (0,)).ok()?;
    let number: u32 = frame.getattr("f_lineno").ok()?.extract().ok()?;
    let file: String = frame.getattr("f_code").ok()?.getattr("co_filename").ok()?.extract().ok()?;
    let file = file.rsplit(['/', '\\']).next().unwrap_or(&file);
    Some(format!("{file}:{number}"))
}
