//! Supports, loads, boundaries, initial state and probes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{History, Where, forms};

/// A support: the named axes of the selected nodes stand still, or move as prescribed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fix {
    /// Nodes; every node when left out.
    #[serde(rename = "where", default, skip_serializing_if = "Where::is_everywhere")]
    pub region: Where,
    /// Axes, of `"xyz"`.
    pub axes: String,
    /// Velocity of the named axes `[m/s]`; default at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<[f64; 3]>,
    /// Displacement of the named axes `[m]`, from where they are when the support comes into force; they get
    /// there by the increments of the relax stage in which it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<[f64; 3]>,
    /// Factor on the velocity in time; default constant.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "forms::optional_history"
    )]
    pub history: Option<History>,
    /// Stage from whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage up to whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// A load: exactly one of `traction`, `pressure`, `line` and `force`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Region that it acts on.
    #[serde(rename = "where", default, skip_serializing_if = "Where::is_everywhere")]
    pub region: Where,
    /// Force per area of the outer faces selected `[Pa]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<[f64; 3]>,
    /// Pressure on the outer faces selected, inward positive `[Pa]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<f64>,
    /// Force per length of the selected line `[N/m]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<[f64; 3]>,
    /// Force in all, shared by the selected nodes `[N]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<[f64; 3]>,
    /// Factor in time; default constant.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "forms::optional_history"
    )]
    pub history: Option<History>,
    /// Stage from whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage up to whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// A non-reflecting boundary: what goes on outside of the model as if the rock went on there (§10).
///
/// It does nothing at rest, and in relax stages. Where a `[[fix]]` on the same nodes ends, the forces
/// with which it has held them go on as constant ones for as long as the boundary is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundary {
    /// Outer faces of deformable blocks.
    #[serde(rename = "where", default, skip_serializing_if = "Where::is_everywhere")]
    pub region: Where,
    /// Kind.
    pub kind: BoundaryKind,
    /// viscous: velocity of a wave that comes in through the faces `[m/s]`; a free surface that it
    /// meets moves twice as fast.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<[f64; 3]>,
    /// Factor on the velocity in time; default constant.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "forms::optional_history"
    )]
    pub history: Option<History>,
    /// Stage from whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage up to whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// Kind of a boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BoundaryKind {
    /// Dashpots of Lysmer and Kuhlemeyer: waves that meet the faces head-on leave.
    Viscous,
    /// Upright sides of a model that is shaken from below: dashpots against columns of the same
    /// rock that move as if no model stood beside them, under the same base.
    FreeField,
}

/// The state at the start of the run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Nodes; every node when left out.
    #[serde(rename = "where", default, skip_serializing_if = "Where::is_everywhere")]
    pub region: Where,
    /// Velocity `[m/s]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<[f64; 3]>,
    /// Angular velocity about `centre`, added to `velocity` `[rad/s]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spin: Option<[f64; 3]>,
    /// Point about which `spin` turns `[m]`; default the origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 3]>,
    /// Stress xx yy zz xy yz zx at the origin, tension positive `[Pa]`, in place before the first
    /// step in the blocks whose centroid lies inside, and in their joints (§12).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<[f64; 6]>,
    /// Gradient of `stress`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gradient: Option<Gradient>,
}

/// Gradient of the stress xx yy zz xy yz zx `[Pa/m]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Gradient {
    /// Along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<[f64; 6]>,
    /// Along y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<[f64; 6]>,
    /// Along z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<[f64; 6]>,
}

/// Something recorded as the run goes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name: the column in `probes.csv`.
    pub name: String,
    /// The node nearest to this reference position `[m]`; on a tie the lower node number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<[f64; 3]>,
    /// Selected nodes: the sum of reactions, the mean of anything else.
    #[serde(rename = "where", default, skip_serializing_if = "Option::is_none")]
    pub region: Option<Where>,
    /// Recorded quantity; default displacement.
    #[serde(default)]
    pub quantity: Quantity,
    /// Time between samples in a dynamic stage `[s]`; default a thousandth of the stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<f64>,
    /// Steps between samples in a relax stage; default 100.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every_steps: Option<u64>,
}

/// Recorded quantity of a probe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Displacement `[m]`.
    #[default]
    Displacement,
    /// Velocity `[m/s]`.
    Velocity,
    /// Stress of the element, xx yy zz xy yz zx, tension positive `[Pa]`.
    Stress,
    /// Sum of the support forces, as they act on the model `[N]`.
    Reaction,
    /// Number of the fragment, from 0 by decreasing volume.
    Fragment,
    /// Largest speed so far, with `peaks` `[m/s]`.
    PeakVelocity,
    /// Largest principal tension of the element so far, with `peaks` `[Pa]`.
    PeakTension,
    /// Largest principal compression of the element so far, with `peaks` `[Pa]`.
    PeakCompression,
}

impl Quantity {
    /// Name of the output field that is recorded; a reaction is none.
    #[must_use]
    pub fn field(self) -> Option<&'static str> {
        Some(match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Stress => "stress",
            Self::Reaction => return None,
            Self::Fragment => "fragment",
            Self::PeakVelocity => "peak_velocity",
            Self::PeakTension => "peak_tension",
            Self::PeakCompression => "peak_compression",
        })
    }
}
