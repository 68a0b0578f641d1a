//! What Python writes, as a deck has it.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyMapping, PySequence, PyString};
use toml::{Table, Value};

use crate::errors::model_error;
use crate::matter::{Joint, Material};

/// Most entries of one argument: more is a mistake, or a sequence without end.
const MOST: usize = 5_000_000;
/// Entries after which Ctrl-C is looked for.
const LOOK: usize = 1 << 16;

/// Levels of lists and dictionaries in which a deck can be written; a list may contain itself.
const DEEPEST: usize = 12;

/// Puts a material or a joint among those of a model, and says its name there.
pub(crate) type Name<'a> = dyn FnMut(&Matter<'_>) -> PyResult<String> + 'a;

/// A material or a joint as an object.
pub(crate) enum Matter<'a> {
    Material(&'a Bound<'a, Material>),
    Joint(&'a Bound<'a, Joint>),
}

/// A value of a deck.
///
/// NumPy's numbers and arrays are taken for what they hold; materials and joints for their names.
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
        return refused("lists in lists without end".to_owned());
    }
    if let Ok(material) = any.cast::<Material>() {
        return name(&Matter::Material(material)).map(Value::String);
    }
    if let Ok(joint) = any.cast::<Joint>() {
        return name(&Matter::Joint(joint)).map(Value::String);
    }
    if let Ok(truth) = any.cast::<PyBool>() {
        return Ok(Value::Boolean(truth.is_true()));
    }
    if let Ok(text) = any.cast::<PyString>() {
        return Ok(Value::String(text.to_str()?.to_owned()));
    }
    if let Ok(number) = any.cast::<PyInt>() {
        return match number.extract::<i64>() {
            Ok(number) => Ok(Value::Integer(number)),
            Err(_) => refused("a whole number with too many digits".to_owned()),
        };
    }
    if let Ok(number) = any.cast::<PyFloat>() {
        let number = number.value();
        return match number.is_finite() {
            true => Ok(Value::Float(number)),
            false => refused(format!("{number} where a finite number must be")),
        };
    }
    if let Ok(number) = any.call_method0("__index__") {
        return at_depth(&number, place, name, (depth + 1, entries));
    }
    let size = any.getattr("size").and_then(|size| size.extract::<usize>());
    if size.is_ok_and(|size| size > MOST) {
        return refused(format!("has more than {MOST} entries"));
    }
    // NumPy's arrays, as Python's own lists; its odd numbers give themselves.
    if let Ok(plain) = any.call_method0("tolist")
        && !plain.get_type().is(any.get_type())
    {
        return at_depth(&plain, place, name, (depth + 1, entries));
    }
    if let Ok(number) = any.call_method0("__float__") {
        return at_depth(&number, place, name, (depth + 1, entries));
    }
    if let Ok(mapping) = any.cast::<PyMapping>() {
        let mut table = Table::new();
        for item in mapping.items()? {
            let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
            let Ok(key) = key.extract::<String>() else {
                return refused(format!("the key {} is no text", key.repr()?));
            };
            if !value.is_none() {
                let place = format!("{place}.{key}");
                table.insert(key, at_depth(&value, &place, name, (depth + 1, entries))?);
            }
        }
        return Ok(Value::Table(table));
    }
    if let Ok(list) = any.cast::<PySequence>() {
        // Its length may be anything, and need not be true.
        let mut array = Vec::new();
        for (i, entry) in list.try_iter()?.enumerate() {
            *entries += 1;
            if *entries > MOST {
                return refused(format!("has more than {MOST} entries"));
            }
            if entries.is_multiple_of(LOOK) {
                any.py().check_signals()?;
            }
            let place = format!("{place}[{i}]");
            array.push(at_depth(&entry?, &place, name, (depth + 1, entries))?);
        }
        return Ok(Value::Array(array));
    }
    let found = any.get_type().qualname()?;
    refused(format!("expected a number, text, a list or a dictionary, found `{found}`"))
}

/// Keyword arguments as the table of a deck, and the history if it is a function. What is `None`
/// is left out.
pub(crate) fn table<'py>(
    section: &str,
    keys: Option<&Bound<'py, PyDict>>,
    name: &mut Name<'_>,
) -> PyResult<(Table, Option<Bound<'py, PyAny>>)> {
    let (mut table, mut function) = (Table::new(), None);
    for (key, given) in keys.into_iter().flatten() {
        let key: String = key.extract()?;
        if given.is_none() {
            continue;
        }
        if key == "history" && given.is_callable() {
            function = Some(given);
            continue;
        }
        let value = shorthand(&key, value(&given, &key, name)?);
        match key.as_str() {
            "x" | "y" | "z" | "sphere" | "set" if has_where(section) => {
                region(&mut table).insert(key, value);
            }
            // A word of Python's own.
            "from_" => {
                table.insert("from".to_owned(), value);
            }
            "where" if has_where(section) && value.is_table() => {
                region(&mut table).extend(value.as_table().cloned().unwrap_or_default());
            }
            _ => {
                table.insert(key, value);
            }
        }
    }
    Ok((table, function))
}

/// What may be written shorter than in a deck: the ratio of damping, the rows of a table.
fn shorthand(key: &str, value: Value) -> Value {
    let only = |key: &str, value| Value::Table(Table::from_iter([(key.to_owned(), value)]));
    match (key, value) {
        ("damping", ratio @ (Value::Integer(_) | Value::Float(_))) => only("ratio", ratio),
        ("history", rows @ Value::Array(_)) => only("table", rows),
        (_, value) => value,
    }
}

fn has_where(section: &str) -> bool {
    !matches!(section, "blocks" | "stage" | "materials" | "joints")
}

fn region(table: &mut Table) -> &mut Table {
    let entry = table.entry("where").or_insert_with(|| Value::Table(Table::new()));
    // Nothing but a table is ever put there.
    if !entry.is_table() {
        *entry = Value::Table(Table::new());
    }
    match entry {
        Value::Table(table) => table,
        _ => unreachable!("just made a table"),
    }
}

/// A value of a deck as Python's own numbers, texts, lists and dictionaries.
pub(crate) fn to_python<'py>(
    py: Python<'py>,
    value: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).unwrap_or_else(|_| "null".to_owned());
    py.import("json")?.call_method1("loads", (text,))
}
