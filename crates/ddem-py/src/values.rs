//! Conversion of Python values to those of a deck.

use std::path::Path;
use std::sync::LazyLock;

use ddem_core::ModelError;
use ddem_deck::Deck;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyMapping, PySequence, PyString};
use toml::{Table, Value};

use crate::errors::{arguments, is_interruption, model_error, refuse};
use crate::functions::Timed;
use crate::matter::Matter;

/// Largest number of entries of one argument: more are a mistake, or an endless sequence.
const MOST: usize = 5_000_000;
/// Number of entries between two checks for Ctrl-C.
const CHECK_INTERVAL: usize = 1 << 16;

/// Largest depth of lists and dictionaries in a deck; a list may contain itself.
const DEEPEST: usize = 12;

/// Function that adds a material or a joint at a place to a model and returns its name there.
pub(crate) type Name<'a> = dyn FnMut(&Matter<'_>, &str) -> PyResult<String> + 'a;

/// Value of a deck from a Python value.
///
/// NumPy numbers and arrays become numbers and lists; materials and joints become their names.
pub(crate) fn value(any: &Bound<'_, PyAny>, place: &str, name: &mut Name<'_>) -> PyResult<Value> {
    at_depth(any, place, name, (0, &mut 0))
}

fn at_depth(
    any: &Bound<'_, PyAny>,
    place: &str,
    name: &mut Name<'_>,
    (depth, entries): (usize, &mut usize),
) -> PyResult<Value> {
    let refused = |message: String| Err(model_error(any.py(), place, &message, None));
    if depth > DEEPEST {
        return refused(format!("is nested deeper than {DEEPEST} lists"));
    }
    if let Some(value) = scalar(any, place, name)? {
        return Ok(value);
    }
    if let Some(number) = plain(any, "__index__", place)? {
        return at_depth(&number, place, name, (depth + 1, entries));
    }
    let size = any.getattr_opt("size")?.and_then(|size| size.extract::<usize>().ok());
    if size.is_some_and(|size| size > MOST) {
        return refused(format!("has more than {MOST} entries"));
    }
    if let Some(path) = plain(any, "__fspath__", place)? {
        return at_depth(&path, place, name, (depth + 1, entries));
    }
    // NumPy arrays become Python lists. Some NumPy numbers return themselves.
    if let Some(list) = plain(any, "tolist", place)?
        && !list.get_type().is(any.get_type())
    {
        return at_depth(&list, place, name, (depth + 1, entries));
    }
    if let Some(number) = plain(any, "__float__", place)? {
        return at_depth(&number, place, name, (depth + 1, entries));
    }
    if let Ok(mapping) = any.cast::<PyMapping>() {
        return of_mapping(mapping, place, name, (depth + 1, entries));
    }
    if let Ok(list) = any.cast::<PySequence>() {
        return of_sequence(list, place, name, (depth + 1, entries));
    }
    let found = any.get_type().qualname()?;
    refused(format!("expected a number, text, a list or a dictionary, found `{found}`"))
}

/// Value of a number, a text, a material or a joint of Python's own types; `None` for other types.
fn scalar(any: &Bound<'_, PyAny>, place: &str, name: &mut Name<'_>) -> PyResult<Option<Value>> {
    let refused = |message: String| Err(model_error(any.py(), place, &message, None));
    if let Some(matter) = Matter::new(any) {
        matter.check(place)?;
        return name(&matter, place).map(|name| Some(Value::String(name)));
    }
    if let Ok(truth) = any.cast::<PyBool>() {
        return Ok(Some(Value::Boolean(truth.is_true())));
    }
    if let Ok(text) = any.cast::<PyString>() {
        return Ok(Some(Value::String(text.to_str()?.to_owned())));
    }
    if let Ok(number) = any.cast::<PyInt>() {
        return match number.extract::<i64>() {
            Ok(number) => Ok(Some(Value::Integer(number))),
            Err(_) => refused("a whole number must fit in 64 bits".to_owned()),
        };
    }
    if let Ok(number) = any.cast::<PyFloat>() {
        let number = number.value();
        return match number.is_finite() {
            true => Ok(Some(Value::Float(number))),
            false => refused(format!("must be a finite number, found {number}")),
        };
    }
    Ok(None)
}

fn of_mapping(
    mapping: &Bound<'_, PyMapping>,
    place: &str,
    name: &mut Name<'_>,
    (depth, entries): (usize, &mut usize),
) -> PyResult<Value> {
    let mut table = Table::new();
    for item in mapping.items()? {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let Ok(key) = key.extract::<String>() else {
            let message = format!("the key {} is not a string", key.repr()?);
            return Err(model_error(mapping.py(), place, &message, None));
        };
        if value.is_none() {
            continue;
        }
        // As the keyword of a method, which messages name. Decks have names of their own as keys.
        let is_keyword = key == "from_" && !place.starts_with("deck");
        let key = if is_keyword { "from".to_owned() } else { key };
        let own = format!("{place}.{key}");
        let value = at_depth(&value, &own, name, (depth, entries))?;
        if table.insert(key, value).is_some() {
            let message = "is given twice: leave one out";
            return Err(model_error(mapping.py(), &own, message, None));
        }
    }
    Ok(Value::Table(table))
}

/// List from a sequence. Its length is not used, since it may be wrong.
fn of_sequence(
    list: &Bound<'_, PySequence>,
    place: &str,
    name: &mut Name<'_>,
    (depth, entries): (usize, &mut usize),
) -> PyResult<Value> {
    let mut array = Vec::new();
    for (i, entry) in list.try_iter()?.enumerate() {
        *entries += 1;
        if *entries > MOST {
            let message = format!("has more than {MOST} entries");
            return Err(model_error(list.py(), place, &message, None));
        }
        if entries.is_multiple_of(CHECK_INTERVAL) {
            list.py().check_signals()?;
        }
        array.push(at_depth(&entry?, &format!("{place}[{i}]"), name, (depth, entries))?);
    }
    Ok(Value::Array(array))
}

/// Result of a conversion method, for an object that has it.
fn plain<'py>(
    any: &Bound<'py, PyAny>,
    method: &str,
    place: &str,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let py = any.py();
    let Some(method) = any.getattr_opt(method)? else { return Ok(None) };
    match method.call0() {
        Ok(plain) => Ok(Some(plain)),
        // An array raises this error if it is not a single number.
        Err(error) if error.is_instance_of::<PyTypeError>(py) => Ok(None),
        Err(error) => Err(refuse(py, place, "cannot be read", error)),
    }
}

/// Keys of a `where`, which are arguments of their own.
static WHERE: LazyLock<Vec<&str>> = LazyLock::new(|| ddem_deck::keys("Where"));

/// Keyword arguments as the table of a deck, and the history if it is a function. Keywords with the
/// value `None` are left out.
pub(crate) fn table<'py>(
    section: &str,
    keys: Option<&Bound<'py, PyDict>>,
    name: &mut Name<'_>,
) -> PyResult<(Table, Option<Bound<'py, PyAny>>)> {
    let (mut table, mut selector, mut function) = (Table::new(), Table::new(), None);
    for (key, given) in keys.into_iter().flatten() {
        let key: String = key.extract()?;
        if given.is_none() {
            continue;
        }
        if key == "history" && given.is_callable() {
            if Timed::new(section, 0).is_none() {
                let message = "only loads, charges, driven supports and boundaries have a history";
                return Err(model_error(given.py(), &key, message, None));
            }
            function = Some(given);
            continue;
        }
        let value =
            value(&given, &key, name).map_err(|error| unknown(section, &given, &key, error))?;
        let value = shorthand((section, &key), value);
        let put = |into: &mut Table, key: &str, value| match into.insert(key.to_owned(), value) {
            None => Ok(()),
            Some(_) => Err(model_error(given.py(), key, "is given twice: leave one out", None)),
        };
        match (key.as_str(), value) {
            (key, value) if part_of_where(section, key) => put(&mut selector, key, value)?,
            ("where", Value::Table(all)) if has_where(section) => {
                for (key, value) in all {
                    put(&mut selector, &key, value)?;
                }
            }
            // `from` is a keyword of Python.
            ("from_", value) => put(&mut table, "from", value)?,
            (_, value) => put(&mut table, &key, value)?,
        }
    }
    if !selector.is_empty() {
        // A value that is not a table is refused when it is read.
        table.entry("where").or_insert(Value::Table(selector));
    }
    Ok((table, function))
}

/// Error for a value that cannot be read. If the key does not exist, the error is about the key,
/// for any type of the value.
fn unknown(section: &str, given: &Bound<'_, PyAny>, key: &str, error: PyErr) -> PyErr {
    let py = given.py();
    let part_of_where = part_of_where(section, key) || has_where(section) && key == "where";
    if part_of_where || is_interruption(py, &error) {
        return error;
    }
    let key = if key == "from_" { "from" } else { key };
    let entry = Value::Table(Table::from_iter([(key.to_owned(), Value::Boolean(false))]));
    let (place, entry) = match section {
        "materials" | "joints" => {
            let named = Table::from_iter([("it".to_owned(), entry)]);
            (format!("{section}.it"), Value::Table(named))
        }
        "model" | "contact" | "lint" | "output" => (section.to_owned(), entry),
        _ => (format!("{section}[0]"), Value::Array(vec![entry])),
    };
    let read = ddem_deck::from_table(&Table::from_iter([(section.to_owned(), entry)]));
    let mut faults = read.err().map(|error| error.faults).unwrap_or_default();
    faults.retain(|fault| fault.message.starts_with("unknown key"));
    if faults.is_empty() { error } else { arguments(py, ModelError { faults }, &place) }
}

/// Expands a shorthand: the damping ratio of a stage, two corners of a box, the rows of a table, or `start`
/// and `end` of a tunnel, because `from` is no name in Python.
fn shorthand((section, key): (&str, &str), value: Value) -> Value {
    let only = |key: &str, value| Value::Table(Table::from_iter([(key.to_owned(), value)]));
    match (section, key, value) {
        ("stage", "damping", ratio @ (Value::Integer(_) | Value::Float(_))) => only("ratio", ratio),
        ("region", "box", Value::Array(corners)) if corners.len() == 2 => {
            let ends = ["from", "to"].map(str::to_owned);
            Value::Table(ends.into_iter().zip(corners).collect())
        }
        ("cut", "tunnel", Value::Table(tunnel)) => {
            let name = |key: String| match key.as_str() {
                "start" => "from".to_owned(),
                "end" => "to".to_owned(),
                _ => key,
            };
            Value::Table(tunnel.into_iter().map(|(key, value)| (name(key), value)).collect())
        }
        (_, "history", rows @ Value::Array(_)) => only("table", rows),
        (_, _, value) => value,
    }
}

/// True for an argument that is a key of `where`. Keys of the entry come first: `plane` and `set` of a
/// cut are its shapes.
fn part_of_where(section: &str, key: &str) -> bool {
    let own = ddem_deck::section_keys(section);
    WHERE.contains(&key) && own.contains(&"where") && !own.contains(&key)
}

fn has_where(section: &str) -> bool {
    ddem_deck::section_keys(section).contains(&"where")
}

/// Reads one entry of a section alone, so that all faults belong to it.
pub(crate) fn alone(py: Python<'_>, section: &str, entry: Table) -> PyResult<Deck> {
    let entries = Value::Array(vec![Value::Table(entry)]);
    read(py, section, entries, &format!("{section}[0]"), None)
}

/// Reads one `where` alone; `deck` has the tunnels that it may name.
pub(crate) fn selector_alone(py: Python<'_>, selector: Table, deck: &Deck) -> PyResult<Deck> {
    let entry = Table::from_iter([("where".to_owned(), Value::Table(selector))]);
    read(py, "remove", Value::Array(vec![Value::Table(entry)]), "remove[0]", Some(deck))
}

/// Entry without an `inside` that may be the name of a tunnel, which may also be cut later: `build`
/// finds it.
pub(crate) fn without_tunnel(entry: &Table, is_tunnel: impl Fn(&str) -> bool) -> Table {
    let mut entry = entry.clone();
    if let Some(Value::Table(selector)) = entry.get_mut("where")
        && let Some(Value::String(name)) = selector.get("inside")
        && (is_tunnel(name) || Path::new(name).extension().is_none() && !Path::new(name).exists())
    {
        selector.remove("inside");
    }
    entry
}

/// Reads a section that consists of one table alone.
pub(crate) fn table_alone(py: Python<'_>, section: &str, table: Table) -> PyResult<Deck> {
    read(py, section, Value::Table(table), section, None)
}

/// Deck with the contents of the files that it names; paths are relative to the working directory.
pub(crate) fn with_files(mut deck: Deck) -> Result<Deck, ModelError> {
    ddem_deck::read_files(&mut deck, Path::new("")).map(|()| deck)
}

/// Reads a section alone, with the tunnels of a deck. Errors name arguments without their place in
/// the deck.
fn read(
    py: Python<'_>,
    section: &str,
    value: Value,
    place: &str,
    tunnels: Option<&Deck>,
) -> PyResult<Deck> {
    let with_tunnels = |mut deck: Deck| {
        if let Some(known) = tunnels {
            let cuts = known.cut.iter().filter(|cut| cut.tunnel.is_some());
            deck.cut = cuts.cloned().collect();
            deck.region.clone_from(&known.region);
        }
        with_files(deck)
    };
    ddem_deck::from_table(&Table::from_iter([(section.to_owned(), value)]))
        .and_then(with_tunnels)
        .map_err(|error| arguments(py, error, place))
}

/// A value of a deck as Python's own numbers, texts, lists and dictionaries.
pub(crate) fn to_python<'py>(
    py: Python<'py>,
    value: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).unwrap_or_else(|_| "null".to_owned());
    py.import("json")?.call_method1("loads", (text,))
}
