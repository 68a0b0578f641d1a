//! Materials and joints as Python objects.

use std::sync::OnceLock;

use ddem_deck::names;
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use toml::{Table, Value};

use crate::errors::{arguments as arguments_error, model_error};
use crate::values::{table, to_python};

/// A linear elastic, isotropic material.
///
#[doc = include_str!("keys/Material.txt")]
/// name : str, optional
///     Name in decks and results; by default `material-1`, ...
///
/// Raises
/// ------
/// ModelError
///     A key does not exist or is missing, or a value has the wrong type. :meth:`Model.build`
///     checks the values themselves.
///
/// Examples
/// --------
/// >>> rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
/// >>> rock.young
/// 18000000000.0
#[pyclass(name = "Material", frozen, eq, module = "ddem")]
#[derive(Clone, PartialEq)]
pub(crate) struct PyMaterial {
    keys: Table,
    name: Option<String>,
}

/// A joint: a layer of real thickness between blocks, or a pair of stiffnesses.
///
/// With none of `cohesion`, `friction`, `tension`, `jrc` and `jcs` the joint never fails. With any
/// of them it can fail, and missing ones of the first three are 0.
///
#[doc = include_str!("keys/Joint.txt")]
/// name : str, optional
///     Name in decks and results; by default `joint-1`, ...
///
/// Raises
/// ------
/// ModelError
///     A key does not exist, or a value has the wrong type.
///
/// Examples
/// --------
/// >>> rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
/// >>> seam = ddem.Joint(thickness=0.01, material=rock, cohesion=2e6, friction=30, tension=1e6)
/// >>> seam.friction, seam.dilation
/// (30.0, None)
#[pyclass(name = "Joint", frozen, module = "ddem")]
pub(crate) struct PyJoint {
    keys: Table,
    name: Option<String>,
    material: Option<Py<PyMaterial>>,
}

/// A material or a joint as an object.
pub(crate) enum Matter<'a> {
    Material(&'a Bound<'a, PyMaterial>),
    Joint(&'a Bound<'a, PyJoint>),
}

impl<'a> Matter<'a> {
    pub(crate) fn new(any: &'a Bound<'_, PyAny>) -> Option<Self> {
        let joint = || any.cast::<PyJoint>().ok().map(Self::Joint);
        any.cast::<PyMaterial>().ok().map(Self::Material).or_else(joint)
    }

    /// Error for a place without such an object, with its kind and its name.
    fn refused(&self, place: &str, wanted: Option<&str>) -> PyErr {
        let (py, kind, name) = match self {
            Self::Material(found) => (found.py(), "material", found.get().name()),
            Self::Joint(found) => (found.py(), "joint", found.get().name()),
        };
        let found = match name {
            Some(name) => format!("found the {kind} `{name}`"),
            None => format!("found a {kind}"),
        };
        let message = match wanted {
            Some(wanted) => format!("expected {wanted}, {found}"),
            None => format!("{found}, which is allowed only as `{kind}`"),
        };
        model_error(py, place, &message, None)
    }

    /// Checks that a place may name such an object.
    pub(crate) fn check(&self, place: &str) -> PyResult<()> {
        let mut keys = place.rsplit('.');
        let wanted = match (keys.next(), keys.next()) {
            (Some("material"), _) => Some("a material"),
            (Some("joint" | "bridge"), _) | (Some("x" | "y" | "z"), Some("joint")) => {
                Some("a joint")
            }
            _ => None,
        };
        match (self, wanted) {
            (Self::Material(_), Some("a material")) | (Self::Joint(_), Some("a joint")) => Ok(()),
            (_, wanted) => Err(self.refused(place, wanted)),
        }
    }
}

/// Error for a material or joint where only its name is allowed.
pub(crate) fn no_matter(matter: &Matter<'_>, place: &str) -> PyResult<String> {
    Err(matter.refused(place, Some("a name")))
}

/// Reads the table of one material or joint alone. Every number of the result has the form that it
/// has in the deck.
fn read(py: Python<'_>, section: &str, keys: Table) -> PyResult<Table> {
    let named = Table::from_iter([("it".to_owned(), Value::Table(keys))]);
    let root = Table::from_iter([(section.to_owned(), Value::Table(named))]);
    let deck = ddem_deck::from_table(&root)
        .map_err(|error| arguments_error(py, error, &format!("{section}.it")))?;
    let mut root = Table::try_from(&deck).unwrap_or_default();
    let table = root.remove(section).and_then(|mut all| match &mut all {
        Value::Table(all) => all.remove("it"),
        _ => None,
    });
    match table {
        Some(Value::Table(table)) => Ok(table),
        _ => Err(model_error(py, section, "could not be read", None)),
    }
}

/// Schema of decks, which has all keys.
fn schema() -> &'static serde_json::Value {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    SCHEMA.get_or_init(ddem_deck::json_schema)
}

/// Value of a key; `None` for a key that was not given.
fn key<'py>(
    py: Python<'py>,
    (class, definition): (&str, &str),
    keys: &Table,
    key: &str,
) -> PyResult<Bound<'py, PyAny>> {
    if let Some(value) = keys.get(key) {
        return to_python(py, value);
    }
    let known = schema()["$defs"][definition]["properties"].as_object();
    if known.is_some_and(|known| known.contains_key(key)) {
        return Ok(py.None().into_bound(py));
    }
    let near = names::nearest(key, known.into_iter().flatten().map(|(key, _)| key.as_str()));
    let near = near.filter(|_| !key.starts_with('_'));
    let near = near.map(|near| format!(" (did you mean `{near}`?)")).unwrap_or_default();
    Err(PyAttributeError::new_err(format!("'{class}' object has no attribute '{key}'{near}")))
}

/// Hash of the keys and the name, without the values, as equal numbers may be written differently.
fn hash(py: Python<'_>, keys: &Table, name: Option<&str>) -> PyResult<isize> {
    let keys: Vec<&str> = keys.keys().map(String::as_str).chain(name).collect();
    PyString::new(py, &keys.join(" ")).hash()
}

/// Names of attributes for completion: those of the class and all keys.
fn attributes(class: &Bound<'_, PyAny>, definition: &str) -> PyResult<Vec<String>> {
    let mut names: Vec<String> = class.dir()?.extract()?;
    let keys = schema()["$defs"][definition]["properties"].as_object();
    names.extend(keys.into_iter().flatten().map(|(key, _)| key.clone()));
    Ok(names)
}

/// Positional arguments (none) and keywords that make the same object, for `pickle` and `copy`.
type Arguments<'py> = (Bound<'py, PyTuple>, Bound<'py, PyDict>);

fn arguments<'py>(py: Python<'py>, keys: &Table, name: Option<&str>) -> PyResult<Arguments<'py>> {
    let given = to_python(py, keys)?.cast_into::<PyDict>()?;
    if let Some(name) = name {
        given.set_item("name", name)?;
    }
    Ok((PyTuple::empty(py), given))
}

fn repr(class: &str, (_, given): Arguments<'_>) -> PyResult<String> {
    let mut parts = Vec::new();
    for (key, value) in given {
        parts.push(format!("{key}={}", value.repr()?));
    }
    Ok(format!("{class}({})", parts.join(", ")))
}

#[pymethods]
impl PyMaterial {
    #[new]
    #[pyo3(signature = (*, name=None, **keys))]
    fn new(
        py: Python<'_>,
        name: Option<String>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (keys, _) = table("materials", keys, &mut no_matter)?;
        Ok(Self { keys: read(py, "materials", keys)?, name })
    }

    /// Name in decks and results, if one was given.
    #[getter]
    pub(crate) fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        key(py, ("Material", "Material"), &self.keys, name)
    }

    fn __dir__(slf: &Bound<'_, Self>) -> PyResult<Vec<String>> {
        attributes(slf.get_type().as_any(), "Material")
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        hash(py, &self.keys, self.name())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        repr("Material", arguments(py, &self.keys, self.name())?)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<Arguments<'py>> {
        arguments(py, &self.keys, self.name())
    }
}

impl PyMaterial {
    /// The table of the deck.
    pub(crate) fn keys(&self) -> &Table {
        &self.keys
    }
}

#[pymethods]
impl PyJoint {
    #[new]
    #[pyo3(signature = (*, name=None, **keys))]
    fn new(
        py: Python<'_>,
        name: Option<String>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut material = None;
        let (mut keys, _) = table("joints", keys, &mut |matter, place| match matter {
            Matter::Material(found) => {
                material = Some((*found).clone().unbind());
                // The model will give it its name.
                Ok(String::new())
            }
            Matter::Joint(_) => no_matter(matter, place),
        })?;
        keys = read(py, "joints", keys)?;
        if material.is_some() {
            keys.remove("material");
        }
        Ok(Self { keys, name, material })
    }

    /// Name in decks and results, if one was given.
    #[getter]
    pub(crate) fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        match &self.material {
            Some(material) if name == "material" => Ok(material.bind(py).clone().into_any()),
            _ => key(py, ("Joint", "Joint"), &self.keys, name),
        }
    }

    fn __eq__(&self, other: &Self) -> bool {
        let material = |joint: &Self| joint.material.as_ref().map(|m| m.get().clone());
        (&self.keys, &self.name) == (&other.keys, &other.name) && material(self) == material(other)
    }

    fn __dir__(slf: &Bound<'_, Self>) -> PyResult<Vec<String>> {
        attributes(slf.get_type().as_any(), "Joint")
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        hash(py, &self.keys, self.name())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        repr("Joint", self.__getnewargs_ex__(py)?)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<Arguments<'py>> {
        let arguments = arguments(py, &self.keys, self.name())?;
        if let Some(material) = &self.material {
            arguments.1.set_item("material", material)?;
        }
        Ok(arguments)
    }
}

impl PyJoint {
    /// Table of the joint in the deck without the name of the material, and the material.
    pub(crate) fn keys(&self) -> (&Table, Option<&Py<PyMaterial>>) {
        (&self.keys, self.material.as_ref())
    }
}
