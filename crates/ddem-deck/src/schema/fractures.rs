//! Cuts of finite size: discs, and networks of discs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FileOf, FractureTable};

/// A disc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiscCut {
    /// Angle below the horizontal of the steepest line, from 0 to 90 `[degrees]`.
    pub dip: f64,
    /// Direction in which that line goes down, clockwise from `north` of the region, from 0 to 360
    /// `[degrees]`.
    pub dip_direction: f64,
    /// Middle `[m]`.
    pub centre: [f64; 3],
    /// Radius, above 0 `[m]`.
    pub radius: f64,
}

/// A network of discs, by its statistics or from a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NetworkCut {
    /// Area of discs in a volume on average, above 0 `[1/m]`; needed without `number` and `file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p32: Option<f64>,
    /// Number of discs whose centres lie in the box around the regions; needed without `p32` and
    /// `file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<u32>,
    /// Radius of the discs, above 0, or its law, `{ power, from, to }` `[m]`; needed without `file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<DiscSizes>,
    /// Mean angle below the horizontal of the steepest line, from 0 to 90 `[degrees]`; needed
    /// without `file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip: Option<f64>,
    /// Mean direction in which that line goes down, clockwise from `north` of the region, from 0 to
    /// 360 `[degrees]`; needed without `file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip_direction: Option<f64>,
    /// Concentration κ of the Fisher distribution of the normals, above 0; default none: parallel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fisher: Option<f64>,
    /// Radius below which discs do not cut `[m]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub least: Option<f64>,
    /// CSV with the columns x, y, z, dip, dip_direction and radius, a row for each disc, whose path is
    /// relative to the folder of the deck `[m, degrees]`; needed without `p32` and `number`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<FileOf<FractureTable>>,
}

/// Radii of the discs of a network.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum DiscSizes {
    /// The same radius everywhere `[m]`.
    Constant(f64),
    /// Radii by a power law.
    Power(PowerTable),
}

/// Power law of radii.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerTable {
    /// Exponent a: the density of radii is proportional to r⁻ᵃ, from 0 to 20.
    pub power: f64,
    /// Least radius, above 0 `[m]`.
    pub from: f64,
    /// Largest radius, at least `from` `[m]`.
    pub to: f64,
}
