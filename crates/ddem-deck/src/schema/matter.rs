//! Materials and joints.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A linear elastic, isotropic material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Density ρ, above 0 `[kg/m³]`.
    pub density: f64,
    /// Young's modulus E, above 0 `[Pa]`.
    pub young: f64,
    /// Poisson's ratio ν, in (−1, 0.5).
    pub poisson: f64,
}

/// A joint: a layer of real thickness between blocks, or a pair of stiffnesses (docs/method.md,
/// §4).
///
/// Elastic constants come from `material`, or from `density`, `young` and `poisson` given here.
/// With `normal_stiffness` and `shear_stiffness` instead it is a spring joint, which may have no
/// thickness. A joint with none of `cohesion`, `friction`, `tension`, `jrc` and `jcs` never fails.
/// If any of them is given it can fail, and omitted values of `cohesion`, `friction` and `tension`
/// are 0.
///
/// The shear strength under a compressive normal stress σ_n is `c + σ_n tan φ` (Mohr–Coulomb). With
/// `jrc` and `jcs` it is `σ_n tan(φ_r + JRC log10(JCS/σ_n))` (Barton), where φ_r is
/// `residual_friction`. `fracture_energy` makes a Mohr–Coulomb joint soften over a distance.
/// Otherwise it loses its strength at once.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Joint {
    /// Thickness t along the normal of the joint, equal for all joints on one plane `[m]`; needed
    /// unless it is a spring joint.
    pub thickness: f64,
    /// Name of the material whose constants the joint has; needed without constants or stiffnesses
    /// of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Density ρ of the joint's own material, with `young` and `poisson`, instead of
    /// `material` `[kg/m³]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Young's modulus E of the joint's own material `[Pa]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young: Option<f64>,
    /// Poisson's ratio ν of the joint's own material; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Normal stiffness k_n of a spring joint, above 0, instead of constants `[Pa/m]`; default
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal_stiffness: Option<f64>,
    /// Shear stiffness k_s of a spring joint, above 0, with `normal_stiffness` `[Pa/m]`; default
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_stiffness: Option<f64>,
    /// Cohesion c, 0 or more `[Pa]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub cohesion: Option<f64>,
    /// Friction angle φ, in [0, 90) `[degrees]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub friction: Option<f64>,
    /// Tensile strength σ_t, 0 or more `[Pa]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub tension: Option<f64>,
    /// Cohesion c_r after failure, not above `cohesion`; open points have none `[Pa]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub residual_cohesion: Option<f64>,
    /// Friction angle φ_r after failure, at most `friction`; needed with `jrc`, then at most 70
    /// `[degrees]`; default `friction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_friction: Option<f64>,
    /// Dilation angle ψ, not above `friction`, or 70 with `jrc`: sliding by s opens a failed joint
    /// by s tan ψ `[degrees]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub dilation: Option<f64>,
    /// Fracture energies G_I in opening and G_II in sliding `[J/m²]`; default none: brittle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy: Option<[f64; 2]>,
    /// Joint roughness coefficient JRC of Barton's criterion, from 0 to 20 `[1]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jrc: Option<f64>,
    /// Compressive strength JCS of the joint walls, above 0, with `jrc` `[Pa]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jcs: Option<f64>,
}

impl Joint {
    /// Normal and shear stiffness per area, k_n and k_s `[Pa/m]` (docs/method.md, §5): the given
    /// ones, otherwise `(λ + 2G)/t` and `G/t`. `None` if constants are missing or the layer of a
    /// material has no thickness.
    #[must_use]
    pub fn stiffness(&self, materials: &BTreeMap<String, Material>) -> Option<[f64; 2]> {
        if let (Some(normal), Some(shear)) = (self.normal_stiffness, self.shear_stiffness) {
            return Some([normal, shear]);
        }
        let (young, poisson) = match &self.material {
            Some(name) => materials.get(name).map(|material| (material.young, material.poisson))?,
            None => (self.young?, self.poisson?),
        };
        let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        let shear = young / (2.0 * (1.0 + poisson));
        let layer = self.thickness > 0.0;
        layer.then(|| [(lambda + 2.0 * shear) / self.thickness, shear / self.thickness])
    }

    /// True if the joint can fail: any strength is given.
    #[must_use]
    pub fn can_fail(&self) -> bool {
        [self.cohesion, self.friction, self.tension, self.jrc, self.jcs].iter().any(Option::is_some)
    }
}
