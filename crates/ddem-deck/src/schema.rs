//! The deck as plain data, with one field per key under the same name.
//!
//! A deck names materials, joints and stages by strings and gives angles in degrees, as a user
//! writes them. `reader` reads it from TOML; Rust programs can build it directly. [`Deck::build`]
//! checks every value and turns the deck into a model. `check` finds mistakes from the deck alone.
//! The types here hold data only; the model is computed elsewhere.

mod blocks;
mod charge;
mod conditions;
mod contact;
pub(crate) mod decimal;
pub(crate) mod examples;
mod files;
mod forms;
mod fractures;
mod keys;
mod lint;
mod matter;
pub mod names;
mod orientation;
mod output;
mod rock;
mod rock_file;
mod selection;
mod size;
mod stages;
mod surface;

pub use ddem_core::{
    Damping, Duvall, ElementKind, History, Kinematics, SafetySearch, StageKind, TimeStep, Triangle,
};

pub(crate) use blocks::COORDINATES;
pub use blocks::{
    Assign, BlockMesh, BlockSet, Body, Edges, Join, JointChoice, MeshJoint, Refine, Remove,
};
pub(crate) use charge::EXPLOSIVES;
pub use charge::{Charge, ChargeHistory, Detonation, Explosive, GasWord};
pub use conditions::{Boundary, BoundaryKind, Fix, Gradient, Initial, Load, Probe, Quantity};
pub(crate) use contact::CRITICAL;
pub use contact::ContactTable;
pub use files::{FileIn, FileOf, FractureTable, Heights, SurfaceFile, Triangles};
pub use fractures::{DiscCut, DiscSizes, NetworkCut, PowerTable};
pub(crate) use keys::{is_list, kinds};
pub use keys::{keys, section_keys, stage_keys};
pub use lint::LintTable;
pub use matter::{Joint, Material};
pub(crate) use orientation::normal_of;
pub use orientation::{Orientation, Orientations};
pub use output::OutputTable;
pub(crate) use rock::TIED;
pub use rock::{
    AxisName, BoxShape, PlaneCut, PrismShape, RockCut, RockRegion, SetCut, SetSpacing, SmallBlocks,
    SmallKind, SpacingLaw, SpacingTable, TunnelCut, VoronoiCut,
};
pub use rock_file::{FileCells, RockFile};
pub use selection::{Cylinder, Extent, Plane, Sheet, Side, Sphere, Where};
pub use size::Size;
pub use stages::{OnFailure, Stage};
pub(crate) use surface::{SurfaceMesh, welded};

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A model with its supports, loads and stages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Deck {
    /// Title of the results; default empty.
    pub title: String,
    /// Settings of the whole model.
    pub model: ModelTable,
    /// Contacts between blocks that no joint holds together.
    #[serde(skip_serializing_if = "ContactTable::is_empty")]
    pub contact: ContactTable,
    /// Diagnostics.
    #[serde(skip_serializing_if = "LintTable::is_empty")]
    pub lint: LintTable,
    /// Results of a run.
    #[serde(skip_serializing_if = "OutputTable::is_empty")]
    pub output: OutputTable,
    /// Materials by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, Material>,
    /// Joints by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub joints: BTreeMap<String, Joint>,
    /// Sets of blocks, each a lattice or a mesh.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockSet>,
    /// Regions of rock that cuts divide into blocks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub region: Vec<RockRegion>,
    /// Cuts of the regions, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cut: Vec<RockCut>,
    /// Joints of regions that are left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub join: Vec<Join>,
    /// Other joints or materials for a part of the model; later entries win.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub assign: Vec<Assign>,
    /// Removed blocks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub remove: Vec<Remove>,
    /// Blocks split into smaller ones.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refine: Vec<Refine>,
    /// Supports, fixed or driven.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fix: Vec<Fix>,
    /// Loads.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub load: Vec<Load>,
    /// Explosive charges.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub charge: Vec<Charge>,
    /// Non-reflecting boundaries.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boundary: Vec<Boundary>,
    /// Initial state.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub initial: Vec<Initial>,
    /// Stages, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stage: Vec<Stage>,
    /// Probes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub probe: Vec<Probe>,
}

/// Settings of the whole model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ModelTable {
    /// Search for contacts between blocks; default `true` if there are several sets of blocks or a
    /// joint that can fail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<bool>,
    /// Acceleration of gravity in all stages `[m/s²]`; default `[0, 0, 0]`.
    pub gravity: [f64; 3],
    /// Rotation of blocks: `"corotational"` (finite) or `"small"` (linear theory); default
    /// `"corotational"`.
    pub kinematics: Kinematics,
    /// Element of deformable blocks: `"incompatible"` or `"standard"`; default `"incompatible"`.
    pub element: ElementKind,
    /// Record the largest velocities and principal stresses of the run; default `false`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = bool::default()))]
    pub peaks: bool,
}
