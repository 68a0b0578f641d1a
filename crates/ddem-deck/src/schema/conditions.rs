//! Supports, loads, boundaries, initial state and probes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{History, Where, forms};

/// A support: holds the selected nodes along the given axes, or moves them as prescribed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fix {
    /// Supported nodes; default all.
    #[serde(default, skip_serializing_if = "Where::is_everywhere")]
    pub r#where: Where,
    /// Supported directions, of `"xyz"`; if two entries support the same one, the later counts.
    pub axes: String,
    /// Velocity of the supported directions in dynamic stages `[m/s]`; default at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<[f64; 3]>,
    /// Displacement of the supported directions in the relax stage in which the support comes into
    /// force `[m]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<[f64; 3]>,
    /// Factor on the velocity in time; default constant.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "forms::optional_history"
    )]
    pub history: Option<History>,
    /// Stage at whose start the entry comes into force; default the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage at whose start the entry ends; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// A load. Give exactly one of `traction`, `pressure`, `line` and `force`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Outer faces, a line, or nodes; default everywhere.
    #[serde(default, skip_serializing_if = "Where::is_everywhere")]
    pub r#where: Where,
    /// Force per area of the selected outer faces `[Pa]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<[f64; 3]>,
    /// Pressure on the selected outer faces, inward positive, along their initial normals `[Pa]`;
    /// default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<f64>,
    /// Force per length of the line in which two planes of `where` meet `[N/m]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<[f64; 3]>,
    /// Total force, shared by the selected nodes `[N]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<[f64; 3]>,
    /// Factor on the load in time; default constant.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "forms::optional_history"
    )]
    pub history: Option<History>,
    /// Stage at whose start the entry comes into force; default the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage at whose start the entry ends; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// A non-reflecting boundary: waves leave the model as if the rock continued there (docs/method.md,
/// §10).
///
/// If a `[[fix]]` on the same nodes ends, its last reactions remain as constant forces as long as
/// the boundary is in force. Apart from that the boundary does nothing at rest and in relax stages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundary {
    /// Outer faces of deformable blocks; default all.
    #[serde(default, skip_serializing_if = "Where::is_everywhere")]
    pub r#where: Where,
    /// Kind: `"viscous"`, absorbing dashpots, or `"free-field"`, for upright sides of a model that
    /// is shaken from below.
    pub kind: BoundaryKind,
    /// Velocity of an incoming wave, for `"viscous"`; a free surface moves twice as fast `[m/s]`;
    /// default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<[f64; 3]>,
    /// Factor on the velocity in time; default constant.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "forms::optional_history"
    )]
    pub history: Option<History>,
    /// Stage at whose start the entry comes into force; default the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage at whose start the entry ends; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// Kind of a boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BoundaryKind {
    /// Dashpots of Lysmer and Kuhlemeyer, which absorb waves with normal incidence.
    Viscous,
    /// Free field, for upright sides of a model that is shaken from below. Dashpots connect the
    /// side to columns of the same rock on the same base, which move as level ground without the
    /// model.
    FreeField,
}

/// Initial state of the run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Nodes; for `stress` blocks and their joints; default everything.
    #[serde(default, skip_serializing_if = "Where::is_everywhere")]
    pub r#where: Where,
    /// Velocity `[m/s]`; default `[0, 0, 0]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = <[f64; 3]>::default()))]
    pub velocity: Option<[f64; 3]>,
    /// Angular velocity about `centre`, added to `velocity` `[rad/s]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spin: Option<[f64; 3]>,
    /// Point on the axis of `spin` `[m]`; default `[0, 0, 0]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = <[f64; 3]>::default()))]
    pub centre: Option<[f64; 3]>,
    /// Stress xx, yy, zz, xy, yz, zx at the origin, tension positive `[Pa]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<[f64; 6]>,
    /// Change of `stress` per metre along x, y or z, as in `{ z = [xx, yy, zz, xy, yz, zx] }`
    /// `[Pa/m]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gradient: Option<Gradient>,
}

/// Gradient of the stress xx yy zz xy yz zx `[Pa/m]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Gradient {
    /// Change per metre along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<[f64; 6]>,
    /// Change per metre along y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<[f64; 6]>,
    /// Change per metre along z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<[f64; 6]>,
}

/// Steps of a relax stage between samples.
const EVERY_STEPS: u64 = 100;

/// A quantity that is recorded during the run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name: the beginning of its columns in `probes.csv`.
    pub name: String,
    /// Reference position; the probe records the nearest node `[m]`; needed without `where`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<[f64; 3]>,
    /// Nodes; the probe records the sum of their reactions, or the mean of another quantity; needed
    /// without `at`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub r#where: Option<Where>,
    /// Recorded quantity; default `"displacement"`.
    #[serde(default)]
    pub quantity: Quantity,
    /// dynamic stages: time between samples `[s]`; default a thousandth of the stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<f64>,
    /// relax stages: number of steps between samples; default 100.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = EVERY_STEPS))]
    pub every_steps: Option<u64>,
}

impl Probe {
    /// Number of samples in a dynamic stage without `every`.
    pub const SAMPLES: u64 = 1000;

    /// Steps of a relax stage between samples: `every_steps` or its default.
    #[must_use]
    pub fn every_steps(&self) -> u64 {
        self.every_steps.unwrap_or(EVERY_STEPS)
    }
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
    /// Name of the recorded output field; `None` for a reaction.
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
