//! Materials and joints.

use std::collections::BTreeMap;

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
    /// Joint roughness coefficient JRC of a Barton–Bandis joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jrc: Option<f64>,
    /// Joint wall compressive strength JCS of a Barton–Bandis joint `[Pa]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jcs: Option<f64>,
}

impl Joint {
    /// Whether the joint can fail.
    #[must_use]
    pub fn breaks(&self) -> bool {
        let given = [self.cohesion, self.friction, self.tension, self.jrc, self.jcs];
        given.iter().any(Option::is_some)
    }

    /// Normal and shear stiffness.
    #[must_use]
    pub fn stiffness(&self, materials: &BTreeMap<String, Material>) -> Option<[f64; 2]> {
        if let (Some(normal), Some(shear)) = (self.normal_stiffness, self.shear_stiffness) {
            return Some([normal, shear]);
        }
        let named = self.material.as_ref().and_then(|name| materials.get(name));
        let (young, poisson) = match named {
            Some(material) => (material.young, material.poisson),
            None => (self.young?, self.poisson?),
        };
        let shear = young / (2.0 * (1.0 + poisson));
        let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        (self.thickness > 0.0)
            .then(|| [(lambda + 2.0 * shear) / self.thickness, shear / self.thickness])
    }
}
