//! A model is a deck being written.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use ddem_core::Deck;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyTuple};
use toml::{Table, Value};

use crate::errors::{self, model_error};
use crate::functions::{Functions, Timed};
use crate::simulation::{Simulation, assembled};
use crate::values::{Matter, table, to_python, value};

/// A model: blocks, joints, supports and loads, as a deck has them.
///
/// Keywords are the keys of the deck (docs/deck.md) and checked by its rules. In place of
/// `where = {...}` its keys are given: `x`, `y`, `z` as a number (a plane) or `(from, to)`,
/// `sphere={"centre": ..., "radius": ...}` and `set="name"`. The key `from` is `from_`.
///
/// Parameters
/// ----------
/// title : str, optional
///     A line that says what this is.
/// gravity : (float, float, float), optional
///     Acceleration of gravity [m/s²]; none without it.
/// kinematics : {"corotational", "small"}, optional
///     Whether each block follows its own finite rotation.
/// element : {"standard", "incompatible"}, optional
///     The element of the blocks.
/// contact : bool, optional
///     Find new contacts between blocks.
///
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
#[pyclass(frozen, module = "ddem")]
pub(crate) struct Model {
    draft: Mutex<Draft>,
}

/// What has been written so far.
#[derive(Default)]
struct Draft {
    root: Table,
    functions: Functions,
    /// File and line where each entry was made, by its place in the deck.
    lines: BTreeMap<String, String>,
}

#[pymethods]
impl Model {
    #[new]
    #[pyo3(signature = (*, title=None, **keys))]
    fn new(
        py: Python<'_>,
        title: Option<&str>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (keys, _) = table("model", keys, &mut no_matter)?;
        let mut root = Table::from_iter([("model".to_owned(), Value::Table(keys))]);
        if let Some(title) = title {
            root.insert("title".to_owned(), Value::String(title.to_owned()));
        }
        Self::of(py, root)
    }

    /// Adds a lattice of blocks divided by joint planes.
    ///
    /// Parameters
    /// ----------
    /// material : Material or str
    ///     What the blocks are of; a name is that of a material the model has already.
    /// size : (float, float, float), optional
    ///     Length of the three edges of the whole set [m].
    /// count : (int, int, int), optional
    ///     Blocks along the three edges; one without it.
    /// edges : dict, optional
    ///     Uneven cuts [m], as in ``{"x": [0, 1, 2.5]}``, for which `size` and `count` are not
    ///     needed.
    /// divisions : int, optional
    ///     Elements along each edge of a block; 4 without it.
    /// joint : Joint, str or dict, optional
    ///     Between the blocks; a dict gives one for each normal, ``{"x": a, "z": b}``.
    /// name : str, optional
    ///     For ``set="name"`` in other calls.
    /// origin : (float, float, float), optional
    ///     The corner from which edges are measured [m].
    /// axes : three vectors, optional
    ///     Directions of the three edges; oblique ones give parallelepipeds.
    /// body : {"deformable", "rigid"}, optional
    ///     What the blocks are.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn add_blocks(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "blocks", None, keys)
    }

    /// Gives a part of the model another joint or material; later calls win.
    ///
    /// Parameters
    /// ----------
    /// joint : Joint or str, optional
    ///     For the joints whose face centre lies inside.
    /// material : Material or str, optional
    ///     For the blocks whose centroid lies inside.
    /// x, y, z, sphere, set : optional
    ///     Where.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn assign(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "assign", None, keys)
    }

    /// Takes out the blocks whose centroid lies inside.
    ///
    /// Parameters
    /// ----------
    /// x, y, z, sphere, set : optional
    ///     Where.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn remove(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "remove", None, keys)
    }

    /// Splits the blocks whose centroid lies inside.
    ///
    /// Parameters
    /// ----------
    /// factor : int
    ///     Parts along each edge.
    /// x, y, z, sphere, set : optional
    ///     Where.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn refine(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "refine", None, keys)
    }

    /// Holds nodes, or drives them.
    ///
    /// Parameters
    /// ----------
    /// axes : str
    ///     Which of "xyz".
    /// velocity : (float, float, float), optional
    ///     Of the named axes [m/s]; at rest without it.
    /// history : callable, dict or rows, optional
    ///     Factor on the velocity in time [s]: a function of the time since the support came into
    ///     force, ``{"ramp": seconds}``, or rows of time and factor.
    /// x, y, z, sphere, set : optional
    ///     Where; every node without any.
    /// from_, until : str, optional
    ///     Stages from whose start, and up to whose start, it is in force.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (axes, **keys))]
    fn fix(
        &self,
        py: Python<'_>,
        axes: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "fix", Some(("axes", axes)), keys)
    }

    /// Loads a part of the model, by one of `traction`, `pressure`, `line` and `force`.
    ///
    /// Parameters
    /// ----------
    /// traction : (float, float, float), optional
    ///     On the outer faces selected [Pa].
    /// pressure : float, optional
    ///     On the outer faces selected, inward positive [Pa].
    /// line : (float, float, float), optional
    ///     Along the selected line [N/m].
    /// force : (float, float, float), optional
    ///     In all, shared by the selected nodes [N].
    /// history : callable, dict or rows, optional
    ///     Factor in time [s]: a function of the time since the load came into force,
    ///     ``{"ramp": seconds}``, or rows of time and factor. A function is called at every step,
    ///     and must depend on the time alone.
    /// x, y, z, sphere, set : optional
    ///     Where.
    /// from_, until : str, optional
    ///     Stages from whose start, and up to whose start, it is in force.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn load(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "load", None, keys)
    }

    /// Adds a non-reflecting boundary.
    ///
    /// Parameters
    /// ----------
    /// kind : {"viscous"}
    ///     Dashpots of Lysmer and Kuhlemeyer.
    /// x, y, z, sphere, set : optional
    ///     Which outer faces.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (kind, **keys))]
    fn boundary(
        &self,
        py: Python<'_>,
        kind: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "boundary", Some(("kind", kind)), keys)
    }

    /// Sets the motion at the start.
    ///
    /// Parameters
    /// ----------
    /// velocity : (float, float, float), optional
    ///     [m/s].
    /// spin : (float, float, float), optional
    ///     Angular velocity about `centre` [rad/s], added to `velocity`.
    /// centre : (float, float, float), optional
    ///     [m]; the origin without it.
    /// x, y, z, sphere, set : optional
    ///     Where; every node without any.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn initial(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "initial", None, keys)
    }

    /// Adds a stage of the deck, which :func:`run_deck` and the command line run in order. A
    /// simulation moves by :meth:`Simulation.relax` and :meth:`Simulation.run` as well, and
    /// :meth:`Simulation.enter` brings the supports and loads of a stage into force.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     For `from_` and `until`.
    /// kind : {"relax", "dynamic"}
    ///     Static or in time; its keys are those of :meth:`Simulation.relax` and
    ///     :meth:`Simulation.run`.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (name, **keys))]
    fn stage(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "stage", Some(("name", name)), keys)
    }

    /// Records something as a run goes.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Column in `probes.csv`, and key of :attr:`Simulation.probes`.
    /// at : (float, float, float), optional
    ///     The node nearest to this reference position [m].
    /// quantity : {"displacement", "velocity", "stress", "reaction"}, optional
    ///     Displacement without it.
    /// every : float, optional
    ///     Time between samples [s]; a thousandth of a run without it.
    /// every_steps : int, optional
    ///     Steps between samples in a relaxation; 100 without it.
    /// x, y, z, sphere, set : optional
    ///     Instead of `at`: the sum of reactions, the mean of anything else.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (name, **keys))]
    fn probe(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "probe", Some(("name", name)), keys)
    }

    /// Checks everything and builds what can be moved. Warnings are Python's.
    ///
    /// Parameters
    /// ----------
    /// threads : int, optional
    ///     How many; one for each processor without it. Results do not depend on it.
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
    ///     Everything that is wrong with the model, each fault with the line of the script that
    ///     wrote it.
    /// MemoryError
    ///     The model does not fit.
    #[pyo3(signature = (*, threads=None))]
    fn build(&self, py: Python<'_>, threads: Option<usize>) -> PyResult<Simulation> {
        let (deck, functions) = self.parts(py)?;
        assembled(py, threads, functions, &|error| self.located(py, error), |change| {
            ddem_io::run::Session::with(&deck, ddem_core::Simd::default(), change)
        })
    }

    /// A model from a deck.
    ///
    /// Parameters
    /// ----------
    /// deck : path or dict
    ///     A TOML file, or what :attr:`deck` gives.
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
                Value::Table(root) => Self::of(py, root),
                _ => Err(model_error(py, "deck", "a deck is a dictionary", None)),
            };
        }
        let path: PathBuf = deck.extract().map_err(|_| {
            model_error(py, "deck", "expected the path of a deck or a dictionary", None)
        })?;
        let (deck, _) = ddem_io::deck::read(&path).map_err(|error| errors::deck(py, &error))?;
        Ok(Self::holding(&deck))
    }

    /// Writes the model as a deck, which the command line runs to the same bits.
    ///
    /// Parameters
    /// ----------
    /// path : path, optional
    ///     Where to; nothing is written without it.
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
        let text = self.text(py)?;
        if let Some(path) = path {
            std::fs::write(&path, &text).map_err(|error| {
                errors::os_error(&error, &path, &format!("writing {}: {error}", path.display()))
            })?;
        }
        Ok(text)
    }

    /// The deck as a dictionary, a copy: change it and give it to :meth:`from_deck`.
    #[getter]
    fn deck<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let draft = self.draft();
        draft.without_functions(py)?;
        to_python(py, &draft.deck(py)?)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let deck = self.draft().deck(py)?;
        let size = ddem_core::Size::of(&deck);
        Ok(format!("<Model \"{}\": {} blocks, {} nodes>", deck.title, size.blocks, size.nodes))
    }

    /// For `copy` and `pickle`.
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let make = slf.get_type().getattr("from_deck")?;
        let deck = slf.get().deck(slf.py())?;
        Ok((make, PyTuple::new(slf.py(), [deck])?))
    }
}

impl Model {
    /// A model of a deck that has not been read yet.
    fn of(py: Python<'_>, root: Table) -> PyResult<Self> {
        Ok(Self::holding(&Draft { root, ..Draft::default() }.deck(py)?))
    }

    fn holding(deck: &Deck) -> Self {
        // As a deck writes itself, so that equal materials are equal tables.
        let root = Table::try_from(deck).unwrap_or_default();
        Self { draft: Mutex::new(Draft { root, ..Draft::default() }) }
    }

    fn draft(&self) -> std::sync::MutexGuard<'_, Draft> {
        // Nothing can go wrong half way through a change of it.
        self.draft.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The deck and its text, if a deck can hold it.
    pub(crate) fn text(&self, py: Python<'_>) -> PyResult<String> {
        let draft = self.draft();
        draft.without_functions(py)?;
        let deck = draft.deck(py)?;
        ddem_io::deck::write(&deck).map_err(|error| errors::deck(py, &error))
    }

    /// The deck, and the functions beside it.
    pub(crate) fn parts(&self, py: Python<'_>) -> PyResult<(Deck, Functions)> {
        let draft = self.draft();
        Ok((draft.deck(py)?, draft.functions.clone_ref(py)))
    }

    /// What is wrong with the model, and in which line of the script.
    pub(crate) fn located(&self, py: Python<'_>, error: &ddem_core::ModelError) -> PyErr {
        let draft = self.draft();
        errors::faults(py, &error.faults, &|place| {
            let entry = place.find(']').map_or(place, |end| &place[..=end]);
            draft.lines.get(entry).cloned()
        })
    }

    /// Adds an entry to a section of the deck.
    fn add(
        &self,
        py: Python<'_>,
        section: &str,
        first: Option<(&str, &Bound<'_, PyAny>)>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        // What the entry names, besides what the model has; converting may call Python, which may
        // come back here.
        let mut matter = self.draft().matter();
        let mut name = |found: &Matter<'_>| named(py, &mut matter, found);
        let (mut entry, function) = table(section, keys, &mut name)?;
        if let Some((key, given)) = first {
            entry.insert(key.to_owned(), value(given, key, &mut name)?);
        }
        if function.is_some() && Timed::new(section, 0).is_none() {
            let message = "only loads and driven supports have a history";
            return Err(model_error(py, "history", message, None));
        }
        // Read alone, so that what is wrong is wrong in this entry.
        let entries = Value::Array(vec![Value::Table(entry.clone())]);
        let alone = Table::from_iter([(section.to_owned(), entries)]);
        ddem_io::deck::from_table(&alone)
            .map_err(|error| errors::arguments(py, error, &format!("{section}[0]")))?;
        let line = line(py);
        let mut draft = self.draft();
        for (section, all) in matter {
            if let (Value::Table(all), Value::Table(known)) = (all, draft.section(&section)) {
                known.extend(all);
            }
        }
        let list = draft.root.entry(section).or_insert_with(|| Value::Array(Vec::new()));
        let Value::Array(list) = list else {
            return Err(model_error(py, section, "is not a list of entries", None));
        };
        let index = list.len();
        list.push(Value::Table(entry));
        if let Some(line) = line {
            draft.lines.insert(format!("{section}[{index}]"), line);
        }
        if let (Some(timed), Some(function)) = (Timed::new(section, index), function) {
            draft.functions.insert(timed, function.unbind());
        }
        Ok(())
    }
}

impl Draft {
    /// The deck; places in errors are those of the deck.
    fn deck(&self, py: Python<'_>) -> PyResult<Deck> {
        ddem_io::deck::from_table(&self.root).map_err(|error| errors::model(py, &error))
    }

    /// Its materials and joints.
    fn matter(&self) -> Table {
        let sections = ["materials", "joints"].into_iter();
        sections.filter_map(|s| Some((s.to_owned(), self.root.get(s)?.clone()))).collect()
    }

    /// A table of tables by name.
    fn section(&mut self, section: &str) -> &mut Value {
        self.root.entry(section).or_insert_with(|| Value::Table(Table::new()))
    }

    fn without_functions(&self, py: Python<'_>) -> PyResult<()> {
        let Some(place) = self.functions.places().next() else { return Ok(()) };
        let message = "is a Python function, which a deck cannot hold";
        Err(model_error(py, &place, message, Some("give rows of time and factor instead")))
    }
}

fn no_matter(matter: &Matter<'_>) -> PyResult<String> {
    let py = match matter {
        Matter::Material(material) => material.py(),
        Matter::Joint(joint) => joint.py(),
    };
    Err(model_error(py, "", "materials and joints go where the deck has their names", None))
}

/// The name of a material or a joint in a model, which gets it if it has none equal to it.
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
            let message = format!("there is another {kind} named `{name}`, with other values");
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
