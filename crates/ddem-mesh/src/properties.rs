//! Properties of materials, joints and contacts, and settings of the whole model.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use ddem_mechanics::element::{Elastic, ElementKind};
use ddem_mechanics::law::{JointLaw, SpringStiffness};

/// Friction angle of contacts if neither the deck nor a joint gives one `[degrees]`.
pub const FRICTION: f64 = 30.0;
/// Default damping of contacts as a fraction of critical.
pub const DAMPING: f64 = 0.2;

/// Properties and settings of a model; materials and joints are numbered.
#[derive(Clone, Debug)]
pub struct Properties {
    /// Acceleration of gravity `[m/s²]`.
    pub gravity: Vector3<f64>,
    /// Treatment of the rotation of blocks.
    pub kinematics: Kinematics,
    /// Element of the blocks.
    pub element: ElementKind,
    /// True if the largest velocities and principal stresses of the run are recorded.
    pub peaks: bool,
    /// Properties of contacts.
    pub contact: ContactProperties,
    /// Elastic constants and densities of the materials.
    pub materials: Vec<Elastic>,
    /// Properties of the joints.
    pub joints: Vec<JointProperties>,
}

/// Treatment of block rotation (§3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Kinematics {
    /// The paper's linear theory.
    Small,
    /// Each block follows its own finite rotation.
    #[default]
    Corotational,
}

/// Properties of a joint.
#[derive(Clone, Debug)]
pub struct JointProperties {
    /// Name in results and messages.
    pub name: String,
    /// Thickness along the normal `[m]`.
    pub thickness: f64,
    /// Elasticity before failure.
    pub elasticity: JointElasticity,
    /// Law of strength; without a law the joint never fails.
    pub law: Option<Arc<dyn JointLaw>>,
}

/// Elasticity of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointElasticity {
    /// Layer of a material.
    Layer(Elastic),
    /// Springs without mass.
    Springs(SpringStiffness),
    /// Springs as stiff as a layer of the rock that they hold together. Results, counts and names of
    /// joints leave them out.
    WholeRock(Elastic),
}

impl JointProperties {
    /// Constants of the layer; `None` for springs.
    pub fn layer(&self) -> Option<&Elastic> {
        match &self.elasticity {
            JointElasticity::Layer(layer) => Some(layer),
            JointElasticity::Springs(_) | JointElasticity::WholeRock(_) => None,
        }
    }

    /// True for springs within whole rock.
    pub fn is_whole_rock(&self) -> bool {
        matches!(self.elasticity, JointElasticity::WholeRock(_))
    }

    /// Stiffness per area `[Pa/m]`; `(λ + 2G)/t` and `G/t` for a layer (§5).
    pub fn stiffness(&self) -> SpringStiffness {
        match &self.elasticity {
            JointElasticity::Layer(layer) | JointElasticity::WholeRock(layer) => SpringStiffness {
                normal: layer.p_modulus() / self.thickness,
                shear: layer.shear / self.thickness,
            },
            JointElasticity::Springs(stiffness) => *stiffness,
        }
    }
}

/// Properties of contacts. Defaults follow from the faces that meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactProperties {
    /// True if new contacts are searched for.
    pub search: bool,
    /// True if the deck says whether contacts are searched for.
    pub given: bool,
    /// Normal stiffness of all contacts `[Pa/m]`.
    pub normal_stiffness: Option<f64>,
    /// Shear stiffness of all contacts `[Pa/m]`.
    pub shear_stiffness: Option<f64>,
    /// Tangent of the friction angle of all contacts, `tan φ`.
    pub tan_friction: Option<f64>,
    /// Damping as a fraction of critical.
    pub damping: Option<f64>,
}

impl ContactProperties {
    /// Damping of contacts, of failed pairs and of the blocks around them, as a fraction of
    /// critical.
    pub fn damping_ratio(&self) -> f64 {
        self.damping.unwrap_or(DAMPING)
    }
}
