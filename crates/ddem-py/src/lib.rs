//! Python module `ddem`. A `Model` is a deck under construction, and a `Simulation` is moved by the
//! core. This crate contains no physics.

mod arrays;
mod callbacks;
mod cells;
mod draft;
mod drive;
mod errors;
mod extremes;
mod fields;
mod functions;
mod matter;
mod mesh;
mod model;
mod notation;
mod run;
mod safety;
mod samples;
mod sections;
mod simulation;
mod values;
mod view;
mod worker;

use std::path::{Path, PathBuf};
use std::time::Duration;

use ddem_core::{ModelError, Simd};
use ddem_deck::DeckError;
use ddem_io::folder::Earlier;
use ddem_io::run::{Options, Session};
use mimalloc::MiMalloc;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use errors::refuse;
use functions::Functions;
use matter::{PyJoint, PyMaterial};
use model::PyModel;
use simulation::PySimulation;
use worker::Pool;

#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// Continues from a file of :meth:`Simulation.save`, or from the `checkpoint.h5` of a run.
/// Histories of probes start empty.
///
/// Parameters
/// ----------
/// path : path
///     The file, or the folder of a run.
/// model : Model, optional
///     Model of the simulation; needed if a history is a Python function, which no file holds.
/// threads : int, optional
///     Number of threads; default one for each processor.
///
/// Returns
/// -------
/// Simulation
///
/// Raises
/// ------
/// OSError
///     The file cannot be read, is not a checkpoint, or belongs to another model.
#[pyfunction]
#[pyo3(signature = (path, *, model=None, threads=None))]
fn load(
    py: Python<'_>,
    path: PathBuf,
    model: Option<&Bound<'_, PyModel>>,
    threads: Option<&Bound<'_, PyAny>>,
) -> PyResult<PySimulation> {
    // A folder of results has a checkpoint.
    let path = if path.is_dir() { path.join("checkpoint.h5") } else { path };
    let parts = model.map(|model| model.get().parts_with_files(py)).transpose()?;
    let (deck, functions) = parts.map_or((None, Functions::default()), |(d, f)| (Some(d), f));
    let located = |error: &ddem_core::ModelError| errors::model(py, error);
    drive::assembled(py, Pool::new(threads)?, functions, &located, move |change| {
        Session::load(&path, Simd::default(), deck.as_ref(), change)
    })
}

/// Runs a deck through all its stages, with all its files, as the command line does.
///
/// Parameters
/// ----------
/// deck : path, dict or Model
///     A TOML file, a dictionary like :attr:`Model.deck`, or a model with stages.
/// out : path, optional
///     Folder of the results; default `results/` and the name of the deck.
/// threads : int, optional
///     Number of threads; default one for each processor. Results do not depend on it.
/// resume : bool, optional
///     Continue from the checkpoint in `out`. The probes of the simulation begin there;
///     :class:`Results` has all of them.
/// overwrite : bool, optional
///     Remove earlier results in `out` that belong to the same file, to a model with the same
///     title, or to the same model without a title. Otherwise they are moved to a folder beside it,
///     ``NAME.1``, ``NAME.2``, ...
/// quiet : bool, optional
///     No progress bar.
/// profile : bool, optional
///     Measure the time of each phase of the steps, for ``stages[i]["profile"]`` of
///     :attr:`Simulation.summary`.
/// checkpoint_every : float, optional
///     Wall time between checkpoints within a stage [s], which does not change the results; default
///     that of :meth:`Model.output`.
///
/// Returns
/// -------
/// Simulation
///     At the end of the last stage.
///
/// Raises
/// ------
/// ModelError
///     The deck is wrong; nothing was written.
/// NotConverged, Collapsed, Diverged
///     A stage failed; the files written so far are intact. A stage with ``on_failure="continue"``
///     that fails raises nothing. A dynamic stage without `until_rest` raises nothing, either, with
///     any verdict.
/// OSError
///     A file cannot be read or written, or the folder has results of another deck, which
///     `overwrite` and `resume` do not change.
/// KeyboardInterrupt
///     A checkpoint was written first, and ``resume=True`` continues the run. While the model is being
///     built nothing has been written.
#[pyfunction]
#[pyo3(signature = (deck, *, out=None, threads=None, resume=false, overwrite=false, quiet=false, profile=false,
    checkpoint_every=None))]
#[expect(clippy::too_many_arguments, reason = "they are those of Python")]
fn run_deck(
    deck: &Bound<'_, PyAny>,
    out: Option<PathBuf>,
    threads: Option<&Bound<'_, PyAny>>,
    resume: bool,
    overwrite: bool,
    quiet: bool,
    profile: bool,
    checkpoint_every: Option<&Bound<'_, PyAny>>,
) -> PyResult<PySimulation> {
    let py = deck.py();
    let checkpoint_every = checkpoint_every.map(seconds).transpose()?;
    let earlier = match (resume, overwrite) {
        (true, true) => {
            return Err(PyValueError::new_err(
                "resume and overwrite exclude each other: give one of them",
            ));
        }
        (true, false) => Earlier::Resume,
        (false, true) => Earlier::Overwrite,
        (false, false) => Earlier::Keep,
    };
    let model = match deck.cast::<PyModel>() {
        Ok(model) => Some(model.clone()),
        Err(_) if deck.cast::<PyMapping>().is_ok() => {
            Some(Bound::new(py, PyModel::from_deck(deck)?)?)
        }
        Err(_) => None,
    };
    let pool = Pool::new(threads)?;
    let (read, name) = match &model {
        Some(model) => {
            let (text, name) = model.get().text(py)?;
            (ddem_deck::parse(&text, &name), "model".into())
        }
        None => {
            let path: PathBuf = deck.extract().map_err(|error| {
                let message = "expected the path of a deck, a dictionary or a Model";
                refuse(py, "deck", message, error)
            })?;
            (ddem_deck::read(&path), path.file_stem().unwrap_or_default().to_owned())
        }
    };
    // Faults of a model are shown at the script lines that made its entries.
    let located = |error: &DeckError| match &model {
        Some(model) if !error.findings().is_empty() => {
            let faults = error.findings().iter().map(|finding| finding.fault.clone()).collect();
            model.get().located(py, &ModelError { faults })
        }
        _ => errors::deck(py, error),
    };
    let (deck, source) = read.map_err(|error| located(&error))?;
    let mut options = Options::new(out.unwrap_or_else(|| Path::new("results").join(name)));
    (options.threads, options.earlier, options.profile) = (pool.threads(), earlier, profile);
    options.checkpoint_every = checkpoint_every;
    drive::driven(py, (deck, source), (options, pool), &located, quiet)
}

/// Wall time that an argument gives in seconds.
fn seconds(given: &Bound<'_, PyAny>) -> PyResult<Duration> {
    let refused = |error| {
        let message = "must be a number of seconds, 0 or more";
        refuse(given.py(), "checkpoint_every", message, error)
    };
    let seconds: f64 = given.extract().map_err(refused)?;
    Duration::try_from_secs_f64(seconds)
        .map_err(|error| refused(PyValueError::new_err(error.to_string())))
}

/// The path that was probably meant by a path that does not exist.
#[pyfunction]
fn _near(path: PathBuf) -> Option<PathBuf> {
    ddem_deck::near(&path, |_| true)
}

/// The JSON Schema of decks, as a dictionary.
#[pyfunction]
fn schema(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    values::to_python(py, &ddem_deck::json_schema())
}

#[pymodule]
fn _ddem(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<PyMaterial>()?;
    module.add_class::<PyJoint>()?;
    module.add_class::<PyModel>()?;
    module.add_class::<PySimulation>()?;
    module.add_function(wrap_pyfunction!(load, module)?)?;
    module.add_function(wrap_pyfunction!(run_deck, module)?)?;
    module.add_function(wrap_pyfunction!(_near, module)?)?;
    module.add_function(wrap_pyfunction!(schema, module)?)
}
