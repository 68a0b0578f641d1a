//! Arrays of a simulation.

use ddem_core::{
    CONTACT_FIELDS, Contact, ErrorCode, FORCE, Fault, Field, FieldKind, FieldLocation, Fragment,
    Model,
};
use ddem_deck::names;
use ddem_io::run::Session;
use numpy::PyArray1;
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors;
use crate::simulation::Inner;

/// Fields that a simulation has.
pub(crate) fn fields(session: &Session) -> Vec<&'static Field> {
    ddem_core::fields(model(session)).collect()
}

/// Field with a name, among the given ones. If nodes and pairs have a field of the same name, it is
/// that of the nodes.
pub(crate) fn field(py: Python<'_>, name: &str, fields: &[&Field]) -> PyResult<Field> {
    if name == FORCE.name {
        return Ok(FORCE);
    }
    let Some(field) = fields.iter().find(|field| field.name == name) else {
        if ["peak_velocity", "peak_tension", "peak_compression"].contains(&name) {
            let help = "`Model(peaks=True)` keeps peaks from the start of the run on";
            return Err(no_name(py, "name", name, help));
        }
        let mut known: Vec<&str> = fields.iter().map(|field| field.name).collect();
        known.push(FORCE.name);
        known.sort_unstable();
        known.dedup();
        return Err(unknown(py, "name", name, &known));
    };
    Ok(**field)
}

/// Type of the numbers of a field in NumPy.
fn kind(kind: FieldKind) -> &'static str {
    match kind {
        FieldKind::Real => "f8",
        FieldKind::Integer => "i8",
        FieldKind::State => "u1",
        FieldKind::Flag => "?",
    }
}

/// Exception for an argument that is not among the known names.
pub(crate) fn unknown(py: Python<'_>, argument: &str, name: &str, known: &[&str]) -> PyErr {
    let near = names::nearest(name, known.iter().copied());
    let near = near.map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
    let help = match known {
        [] => "the model has none".to_owned(),
        known => format!("{near}there are {}", names::list(known.iter().copied())),
    };
    no_name(py, argument, name, &help)
}

fn no_name(py: Python<'_>, argument: &str, name: &str, help: &str) -> PyErr {
    let message = format!("there is no `{name}`");
    let fault = Fault::new(ErrorCode::UnknownName, argument, message).help(help);
    errors::faults(py, &[fault], &|_| None)
}

/// Exception for an attribute that an object does not have, with the nearest name.
pub(crate) fn no_attribute(object: &Bound<'_, PyAny>, name: &str) -> PyErr {
    let found = || -> PyResult<String> {
        let class = object.get_type().name()?;
        let known: Vec<String> = object.get_type().dir()?.extract()?;
        let known = known.iter().map(String::as_str).filter(|known| !known.starts_with('_'));
        let near = names::nearest(name, known).filter(|_| !name.starts_with('_'));
        let near = near.map(|near| format!(" (did you mean `{near}`?)")).unwrap_or_default();
        Ok(format!("'{class}' object has no attribute '{name}'{near}"))
    };
    found().map_or_else(|error| error, PyAttributeError::new_err)
}

fn model(session: &Session) -> &Model {
    session.simulation().model()
}

pub(crate) fn points(session: &Session) -> Vec<[f64; 3]> {
    let model = model(session);
    (0..model.n_nodes()).map(|node| model.point(node)).collect()
}

pub(crate) fn masses(session: &Session) -> Vec<f64> {
    let model = model(session);
    (0..model.n_nodes()).map(|node| model.mass(node)).collect()
}

pub(crate) fn node_blocks(session: &Session) -> Vec<i64> {
    let model = model(session);
    (0..model.n_nodes()).map(|node| model.whole_block(model.block_of(node)) as i64).collect()
}

pub(crate) fn elements(session: &Session) -> Vec<[i64; 8]> {
    let model = model(session);
    let hexes = (0..model.n_blocks()).flat_map(|block| model.hexes(block));
    hexes.map(|hex| hex.map(i64::from)).collect()
}

pub(crate) fn element_blocks(session: &Session) -> Vec<i64> {
    let model = model(session);
    of_elements(model, |block| model.whole_block(block) as i64)
}

/// Fragment of each whole block: of its parts the one with the lowest number, which is the largest.
pub(crate) fn block_fragments(session: &mut Session) -> Vec<i64> {
    let numbers = session.simulation_mut().block_fragments();
    let model = model(session);
    let there = numbers.iter().enumerate().filter(|(block, _)| !model.is_removed(*block));
    let gone = there.map(|(_, number)| number + 1).max().unwrap_or_default();
    let whole: Vec<usize> = (0..numbers.len()).map(|block| model.whole_block(block)).collect();
    let mut all = vec![gone; whole.iter().max().map_or(0, |last| last + 1)];
    for (block, number) in whole.into_iter().zip(numbers) {
        all[block] = all[block].min(number);
    }
    all.into_iter().map(|number| number as i64).collect()
}

pub(crate) fn element_materials(session: &Session) -> Vec<i64> {
    let model = model(session);
    of_elements(model, |block| i64::from(model.material(block)))
}

pub(crate) fn element_rigid(session: &Session) -> Vec<bool> {
    let model = model(session);
    of_elements(model, |block| i64::from(model.is_rigid(block))).iter().map(|&n| n == 1).collect()
}

/// Values of all elements, from a value of each block.
fn of_elements(model: &Model, value: impl Fn(usize) -> i64) -> Vec<i64> {
    let of = |block| std::iter::repeat_n(value(block), model.elements_of(block).len());
    (0..model.n_blocks()).flat_map(of).collect()
}

pub(crate) fn quads(session: &Session) -> Vec<[i64; 4]> {
    model(session).quads().map(|quad| quad.map(i64::from)).collect()
}

pub(crate) fn integers<'py>(py: Python<'py>, numbers: Vec<i64>) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, numbers).into_any())
}

/// All pairs: their points, normals, nodes, joints and fields.
pub(crate) struct Pairs {
    points: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    nodes: Vec<[i64; 2]>,
    joints: Vec<i64>,
    fields: Vec<(&'static Field, Vec<f64>)>,
}

pub(crate) fn pairs(session: &mut Session) -> Pairs {
    let here = |field: &&Field| field.on == FieldLocation::Pair;
    let fields: Vec<&'static Field> = fields(session).into_iter().filter(here).collect();
    let snapshot = session.simulation_mut().snapshot();
    let fields = fields.into_iter().map(|field| (field, snapshot.values(field))).collect();
    let model = model(session);
    Pairs {
        points: model.pairs().map(|pair| pair.point).collect(),
        normals: model.pairs().map(|pair| pair.normal).collect(),
        nodes: model.pairs().map(|pair| pair.nodes.map(i64::from)).collect(),
        joints: model.pairs().map(|pair| i64::from(pair.joint)).collect(),
        fields,
    }
}

pub(crate) fn pair_array<'py>(py: Python<'py>, pairs: Pairs) -> PyResult<Bound<'py, PyAny>> {
    let n = pairs.joints.len();
    let mut columns = vec![
        ("point", "f8", arrays::rows(py, pairs.points)?),
        ("normal", "f8", arrays::rows(py, pairs.normals)?),
        ("nodes", "i8", arrays::rows(py, pairs.nodes)?),
        ("joint", "i8", integers(py, pairs.joints)?),
    ];
    for (field, values) in pairs.fields {
        let values = arrays::components(py, values, field.components)?;
        columns.push((field.name, kind(field.kind), values));
    }
    arrays::structured(py, n, columns)
}

pub(crate) fn contact_array<'py>(
    py: Python<'py>,
    contacts: &[Contact],
) -> PyResult<Bound<'py, PyAny>> {
    let points = contacts.iter().map(|contact| contact.position).collect();
    let mut columns = vec![("point", "f8", arrays::rows(py, points)?)];
    for field in &CONTACT_FIELDS {
        let mut values = vec![0.0; contacts.len() * field.components];
        field.fill(contacts, &mut values);
        let values = arrays::components(py, values, field.components)?;
        columns.push((field.name, kind(field.kind), values));
    }
    arrays::structured(py, contacts.len(), columns)
}

/// Structured array of fragments.
pub(crate) fn fragment_array<'py>(
    py: Python<'py>,
    fragments: &[Fragment],
) -> PyResult<Bound<'py, PyAny>> {
    let number = |of: &dyn Fn(&Fragment) -> f64| {
        arrays::components(py, fragments.iter().map(of).collect(), 1)
    };
    let vector = |of: &dyn Fn(&Fragment) -> [f64; 3]| {
        arrays::rows(py, fragments.iter().map(of).collect::<Vec<_>>())
    };
    let blocks = fragments.iter().map(|fragment| fragment.blocks.len() as i64).collect();
    let columns = vec![
        ("blocks", "i8", integers(py, blocks)?),
        ("volume", "f8", number(&|fragment| fragment.volume)?),
        ("mass", "f8", number(&|fragment| fragment.mass)?),
        ("size", "f8", number(&Fragment::size)?),
        ("passing", "f8", number(&|fragment| fragment.passing)?),
        ("centroid", "f8", vector(&|fragment| fragment.centroid)?),
        ("velocity", "f8", vector(&|fragment| fragment.velocity)?),
    ];
    arrays::structured(py, fragments.len(), columns)
}

/// Histories of the probes.
pub(crate) fn probes<'py>(py: Python<'py>, inner: &Inner) -> PyResult<Bound<'py, PyAny>> {
    let all = PyDict::new(py);
    let mut first = 0;
    for (name, components) in inner.session.probes() {
        let at = first..first + components.len();
        first = at.end;
        // All columns of a probe are due together.
        let (steps, times) = inner.samples.times(at.start);
        let n = steps.len();
        let mut columns = vec![
            ("time", "f8", arrays::components(py, times, 1)?),
            ("step", "i8", integers(py, steps)?),
        ];
        for (column, component) in at.zip(components) {
            let numbers = inner.samples.numbers(column);
            columns.push((component, "f8", arrays::components(py, numbers, 1)?));
        }
        all.set_item(name, arrays::structured(py, n, columns)?)?;
    }
    py.import("ddem._table")?.getattr("Histories")?.call1((all,))
}
