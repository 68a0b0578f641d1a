//! Public view of a simulation: one table, [`FIELDS`], for all writers and bindings, and the
//! functions that fill it range by range.

mod contacts;
pub(crate) mod energy;
mod fragments;
mod momentum;
mod pairs;
mod peaks;
mod snapshot;
mod state;
mod stress;
pub(crate) mod tractions;
mod velocities;

use std::ops::Range;

use crate::model::Model;
use crate::model::stage::StageKind;

use peaks::PEAK_FIELDS;

pub use contacts::{CONTACT_FIELDS, Contact, ContactCounts, ContactField};
pub use fragments::Fragment;
pub use snapshot::Snapshot;
pub use state::{ContactSummary, FragmentSummary, JointSummary, Largest, Reaction, StateSummary};

/// Location of the values of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldLocation {
    /// Nodes.
    Node,
    /// Hex8 elements of the blocks.
    Element,
    /// Pairs of joints.
    Pair,
}

/// Kind of the numbers of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// Real numbers.
    Real,
    /// Integers.
    Integer,
    /// One of a few states, numbered from 0.
    State,
    /// 0 or 1.
    Flag,
}

/// One output field.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Name in files and bindings.
    pub name: &'static str,
    /// Unit, "1" for a plain number.
    pub unit: &'static str,
    /// Location of its values.
    pub on: FieldLocation,
    /// Numbers per value.
    pub components: usize,
    /// Kind of the numbers.
    pub kind: FieldKind,
    /// True if the numbers differ from place to place, at least where joints have failed; those of other fields
    /// mostly repeat.
    pub dense: bool,
    fill: FillValues,
}

/// Writes the numbers of a range of values, one value after another.
type FillValues = fn(&Snapshot<'_>, Range<usize>, &mut [f64]);

impl Field {
    /// Field of real numbers. `fill` writes the numbers of a range of values, one value after
    /// another. It can read other fields from the snapshot.
    #[must_use]
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        on: FieldLocation,
        components: usize,
        fill: fn(&Snapshot<'_>, Range<usize>, &mut [f64]),
    ) -> Self {
        Self { name, unit, on, components, kind: FieldKind::Real, dense: false, fill }
    }

    /// The field with another kind of numbers.
    #[must_use]
    pub const fn kind(self, kind: FieldKind) -> Self {
        Self { kind, ..self }
    }

    /// The field as a dense one.
    #[must_use]
    pub const fn dense(self) -> Self {
        Self { dense: true, ..self }
    }
}

/// Output fields of every model that change with time; [`fields`] adds those that the deck
/// requests. All components are in global axes, including those of tractions and slip.
/// [`Simulation::snapshot`](crate::Simulation::snapshot) gives their values.
///
/// | On | Fields |
/// |---|---|
/// | nodes | `displacement`, `velocity` |
/// | elements | `stress` (xx yy zz xy yz zx), `fragment` (its number) |
/// | pairs | `displacement` (mean of both sides), `traction`, `slip`, `opening`, `state` (0 bonded, 1 failed in shear, 2 failed in tension), `open`, `released` (a contact has replaced the joint), `failure_time`, `damage` |
pub const FIELDS: [Field; 13] = [
    Field::new("displacement", "m", FieldLocation::Node, 3, displacement).dense(),
    Field::new("velocity", "m/s", FieldLocation::Node, 3, velocity).dense(),
    Field::new("stress", "Pa", FieldLocation::Element, 6, stress::stress).dense(),
    Field::new("fragment", "1", FieldLocation::Element, 1, fragments::fragment)
        .kind(FieldKind::Integer),
    Field::new("displacement", "m", FieldLocation::Pair, 3, pairs::displacement).dense(),
    Field::new("traction", "Pa", FieldLocation::Pair, 3, pairs::traction).dense(),
    Field::new("slip", "m", FieldLocation::Pair, 3, pairs::slip).dense(),
    Field::new("opening", "m", FieldLocation::Pair, 1, pairs::opening).dense(),
    Field::new("state", "1", FieldLocation::Pair, 1, pairs::failure_mode).kind(FieldKind::State),
    Field::new("open", "1", FieldLocation::Pair, 1, pairs::open).kind(FieldKind::Flag),
    Field::new("released", "1", FieldLocation::Pair, 1, pairs::released).kind(FieldKind::Flag),
    Field::new("failure_time", "s", FieldLocation::Pair, 1, pairs::failure_time),
    Field::new("damage", "1", FieldLocation::Pair, 1, pairs::damage),
];

/// Force that accelerates each node, [`Simulation::forces`](crate::Simulation::forces). It is not
/// written to files.
pub const FORCE: Field = Field::new("force", "N", FieldLocation::Node, 3, force);

/// Additional fields of a model with excavations.
const EXCAVATION_FIELDS: [Field; 2] = [
    Field::new("removed", "1", FieldLocation::Element, 1, removed).kind(FieldKind::Flag),
    Field::new("removed", "1", FieldLocation::Pair, 1, pairs::removed).kind(FieldKind::Flag),
];

/// Additional fields of a model with a stage that determines a factor of safety.
const SAFETY_FIELDS: [Field; 1] =
    [Field::new("unstable", "1", FieldLocation::Element, 1, unstable)];

/// Writes 1 in removed blocks, 0 in others.
fn removed(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let model = snapshot.model;
    model.fill_elements(range, out, |block| {
        let removed = model.is_removed(block);
        move |_| [f64::from(u8::from(removed))]
    });
}

/// Writes 1 in blocks that move in the failing trial of a factor of safety, 0 in others.
fn unstable(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let moving = snapshot.moving();
    snapshot.model.fill_elements(range, out, |block| {
        let moving = moving[block];
        move |_| [f64::from(u8::from(moving))]
    });
}

fn displacement(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.model.fill_nodal(&snapshot.state.u, range, out);
}

fn velocity(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.fill_velocities(range, out);
}

fn force(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.model.fill_nodal(&snapshot.scratch.f, range, out);
}

/// All output fields of a model that change with time: [`FIELDS`], and `peak_velocity`,
/// `peak_tension` and `peak_compression` if the deck has `peaks`, `removed` if blocks are removed,
/// and `unstable` if a stage determines a factor of safety.
pub fn fields(model: &Model) -> impl Iterator<Item = &'static Field> + use<> {
    let peaks: &[Field] = if model.properties.peaks { &PEAK_FIELDS } else { &[] };
    let removed: &[Field] = if model.has_excavations() { &EXCAVATION_FIELDS } else { &[] };
    let searches = model.problem.kinds.contains(&StageKind::Safety);
    let safety: &[Field] = if searches { &SAFETY_FIELDS } else { &[] };
    FIELDS.iter().chain(peaks).chain(removed).chain(safety)
}
