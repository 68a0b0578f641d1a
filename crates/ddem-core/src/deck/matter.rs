//! Materials and joints.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A linear elastic, isotropic material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Density ρ `[kg/m³]`.
    pub density: f64,
    /// Young's modulus E `[Pa]`.
    pub young: f64,
    /// Poisson's ratio ν, in (−1, 0.5).
    pub poisson: f64,
}

/// A joint: a layer of real thickness between blocks, or a pair of stiffnesses (§4).
///
/// Elastic constants come from `material`, or from `density`, `young` and `poisson` given here;
/// with `normal_stiffness` and `shear_stiffness` instead it is a spring joint. A joint with none
/// of `cohesion`, `friction` and `tension` never fails; with any given, those left out are 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Joint {
    /// Thickness t, measured along the joint's normal `[m]`.
    pub thickness: f64,
    /// Name of the material whose elastic constants and density the joint has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Density ρ `[kg/m³]`, when no material is named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Young's modulus E `[Pa]`, when no material is named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young: Option<f64>,
    /// Poisson's ratio ν, when no material is named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Normal stiffness k_n of a spring joint `[Pa/m]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal_stiffness: Option<f64>,
    /// Shear stiffness k_s of a spring joint `[Pa/m]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_stiffness: Option<f64>,
    /// Cohesion c `[Pa]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cohesion: Option<f64>,
    /// Friction angle φ `[degrees]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Tensile strength σ_t `[Pa]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tension: Option<f64>,
    /// Cohesion left after failure `[Pa]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_cohesion: Option<f64>,
    /// Friction angle after failure `[degrees]`; default `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_friction: Option<f64>,
    /// Dilation angle ψ `[degrees]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dilation: Option<f64>,
    /// Fracture energies in opening and sliding `[J/m²]`; absent means brittle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy: Option<[f64; 2]>,
}
