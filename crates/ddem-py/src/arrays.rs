//! Conversion between Rust numbers and NumPy arrays.

use std::ops::Range;

use numpy::ndarray::{Axis, Slice};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::{model_error, refuse};

/// Largest number of node numbers in one call for a small model; more are a mistake.
const MOST: usize = 1_000_000;

/// New array of rows, which takes over the numbers without copying them.
pub(crate) fn rows<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'py, PyAny>> {
    let n = rows.len();
    Ok(PyArray1::from_vec(py, rows.into_flattened()).reshape([n, N])?.into_any())
}

/// New array of numbers, in rows if they have several components.
pub(crate) fn components<'py>(
    py: Python<'py>,
    values: Vec<f64>,
    components: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let n = values.len() / components.max(1);
    let flat = PyArray1::from_vec(py, values);
    Ok(if components == 1 { flat.into_any() } else { flat.reshape([n, components])?.into_any() })
}

/// Array of an argument that NumPy accepts as real numbers.
fn real<'py>(any: &Bound<'py, PyAny>, argument: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = any.py();
    let refused = |message: &str| model_error(py, argument, message, None);
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (any,)).map_err(|error| {
        refuse(
            py,
            argument,
            "is no array of numbers: expected numbers, or rows of equal length",
            error,
        )
    })?;
    let fits = numpy.call_method1("can_cast", (array.getattr("dtype")?, "f8", "same_kind"))?;
    if !fits.is_truthy()? {
        let dtype = array.getattr("dtype")?.str()?;
        return Err(refused(&format!("has dtype {dtype}, expected real numbers")));
    }
    Ok(array)
}

/// Whole number that is not negative.
pub(crate) fn integer(any: &Bound<'_, PyAny>, argument: &str) -> PyResult<u64> {
    let number = any.call_method0("__index__").and_then(|number| number.extract::<u64>());
    number.map_err(|error| {
        let found = any.repr().map_or_else(|_| "?".to_owned(), |text| text.to_string());
        let message = format!("must be a whole number that is not negative, found {found}");
        refuse(any.py(), argument, &message, error)
    })
}

/// Rows of three finite numbers, from an array of one of the shapes.
pub(crate) fn vectors(
    any: &Bound<'_, PyAny>,
    argument: &str,
    shapes: &[&[usize]],
) -> PyResult<Vec<[f64; 3]>> {
    let py = any.py();
    let refused = |message: String| model_error(py, argument, &message, None);
    let array = real(any, argument)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if !shapes.contains(&shape.as_slice()) {
        let wanted: Vec<String> = shapes.iter().map(|shape| shown(shape)).collect();
        let wanted = wanted.join(" or ");
        return Err(refused(format!("has shape {}, expected {wanted}", shown(&shape))));
    }
    let array = converted(&array, "f8")?.cast_into::<PyArrayDyn<f64>>()?;
    let numbers = array.try_readonly().map_err(|error| refused(error.to_string()))?;
    let numbers = numbers.as_slice().map_err(|error| refused(error.to_string()))?;
    if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
        let number = numbers[at];
        return Err(refused(format!("is {number} in row {}, but must be finite", at / 3)));
    }
    Ok(numbers.as_chunks::<3>().0.to_vec())
}

/// Node numbers, from an array of numbers or a mask.
pub(crate) fn nodes(any: &Bound<'_, PyAny>, argument: &str, n_nodes: usize) -> PyResult<Vec<u32>> {
    let py = any.py();
    let refused = |message: String| model_error(py, argument, &message, None);
    let mut array = real(any, argument)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let size = shape.iter().fold(1_usize, |size, n| size.saturating_mul(*n));
    if size > MOST.max(10 * n_nodes) {
        return Err(refused(format!(
            "has shape {}, which is too large for {n_nodes} nodes",
            shown(&shape)
        )));
    }
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let numpy = py.import("numpy")?;
    match kind.as_str() {
        "b" if shape == [n_nodes] => array = numpy.call_method1("flatnonzero", (array,))?,
        "b" => {
            let message = format!("is a mask of shape {}, expected ({n_nodes},)", shown(&shape));
            return Err(refused(message));
        }
        "i" | "u" => {}
        // NumPy makes floats of an empty list.
        _ if shape == [0] => {}
        _ => {
            return Err(refused(format!(
                "must be whole numbers of nodes, or a mask of shape ({n_nodes},)"
            )));
        }
    }
    if shape.len() > 1 {
        return Err(refused(format!("has shape {}, expected one dimension", shown(&shape))));
    }
    let array = converted(&array, "i8")?.cast_into::<PyArrayDyn<i64>>()?;
    let numbers = array.try_readonly().map_err(|error| refused(error.to_string()))?;
    let numbers = numbers.as_slice().map_err(|error| refused(error.to_string()))?;
    match numbers.iter().find(|&&node| node < 0 || node as u64 >= n_nodes as u64) {
        Some(node) => {
            Err(refused(format!("there is no node {node}: they go from 0 to {}", n_nodes - 1)))
        }
        None => Ok(numbers.iter().map(|&node| node as u32).collect()),
    }
}

/// Array with another number type, contiguous in memory.
fn converted<'py>(array: &Bound<'py, PyAny>, kind: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = array.py();
    let needs = ["C_CONTIGUOUS", "ALIGNED"];
    py.import("numpy")?.call_method1("require", (array, kind, needs))
}

/// Copies numbers into some rows of the array `out`.
pub(crate) fn fill(
    out: &Bound<'_, PyAny>,
    values: &[f64],
    shape: &[usize],
    rows: Range<usize>,
) -> PyResult<()> {
    let py = out.py();
    let refused = |message: String| model_error(py, "out", &message, None);
    let Ok(untyped) = out.cast::<PyUntypedArray>() else {
        return Err(refused("must be a NumPy array of float64".to_owned()));
    };
    if untyped.shape() != shape {
        let (found, wanted) = (shown(untyped.shape()), shown(shape));
        return Err(refused(format!("has shape {found}, expected {wanted}")));
    }
    let Ok(array) = out.cast::<PyArrayDyn<f64>>() else {
        let dtype = untyped.dtype().str()?;
        return Err(refused(format!("has dtype {dtype}, expected float64")));
    };
    let mut array = array.try_readwrite().map_err(|error| refused(error.to_string()))?;
    let mut array = array.as_array_mut();
    let mut rows = array.slice_axis_mut(Axis(0), Slice::from(rows));
    rows.iter_mut().zip(values).for_each(|(out, x)| *out = *x);
    Ok(())
}

/// Table of `n` rows from named columns, each with its NumPy type.
pub(crate) fn structured<'py>(
    py: Python<'py>,
    n: usize,
    columns: Vec<(&str, &str, Bound<'py, PyAny>)>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut types = Vec::new();
    for (name, kind, column) in &columns {
        let shape: Vec<usize> = column.getattr("shape")?.extract()?;
        types.push((*name, *kind, pyo3::types::PyTuple::new(py, shape.iter().skip(1))?));
    }
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("empty", (n, numpy.call_method1("dtype", (types,))?))?;
    for (name, _, column) in columns {
        array.set_item(name, column)?;
    }
    array.call_method1("view", (py.import("ddem._table")?.getattr("Table")?,))
}

fn shown(shape: &[usize]) -> String {
    let parts: Vec<String> = shape.iter().map(ToString::to_string).collect();
    match parts.len() {
        1 => format!("({},)", parts[0]),
        _ => format!("({})", parts.join(", ")),
    }
}
