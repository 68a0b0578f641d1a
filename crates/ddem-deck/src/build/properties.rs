//! Properties of a model from its deck.

use std::sync::Arc;

use crate::schema::{Deck, Joint, Material};
use ddem_core::element::Elastic;
use ddem_core::law::{Barton, JointLaw, MohrCoulomb, Softening, SpringStiffness};
use ddem_core::problem::Vec3;
use ddem_core::problem::{ContactProperties, JointElasticity, JointProperties, Properties};

/// Properties and settings of a deck without faults; materials and joints are in the order of their
/// names. Joints that the deck does not name follow.
pub(super) fn properties(deck: &Deck, more: Vec<JointProperties>) -> Properties {
    let contact = &deck.contact;
    Properties {
        gravity: Vec3::from(deck.model.gravity),
        kinematics: deck.model.kinematics,
        element: deck.model.element,
        peaks: deck.model.peaks,
        contact: ContactProperties {
            search: deck.finds_contacts(),
            given: deck.model.contact.is_some(),
            normal_stiffness: contact.normal_stiffness,
            shear_stiffness: contact.shear_stiffness,
            tan_friction: contact.friction.map(tan),
            damping: contact.damping_ratio(),
        },
        materials: deck.materials.values().map(elastic).collect(),
        joints: deck.joints.iter().map(|joint| joint_properties(deck, joint)).chain(more).collect(),
    }
}

fn elastic(material: &Material) -> Elastic {
    Elastic::new(material.density, material.young, material.poisson)
}

fn joint_properties(deck: &Deck, (name, joint): (&String, &Joint)) -> JointProperties {
    let named = joint.material.as_ref().and_then(|name| deck.materials.get(name)).map(elastic);
    let own = || Some(Elastic::new(joint.density?, joint.young?, joint.poisson?));
    let springs = || SpringStiffness {
        normal: joint.normal_stiffness.unwrap_or_default(),
        shear: joint.shear_stiffness.unwrap_or_default(),
    };
    let elasticity = match named.or_else(own) {
        Some(layer) => JointElasticity::Layer(layer),
        None => JointElasticity::Springs(springs()),
    };
    let law = || -> Arc<dyn JointLaw> {
        match (joint.jrc, joint.jcs) {
            (Some(jrc), Some(jcs)) => Arc::new(barton(joint, [jrc, jcs])),
            _ => Arc::new(mohr_coulomb(joint)),
        }
    };
    JointProperties {
        name: name.clone(),
        thickness: joint.thickness,
        elasticity,
        law: joint.can_fail().then(law),
    }
}

/// Mohr–Coulomb law of a joint; missing strengths are 0.
fn mohr_coulomb(joint: &Joint) -> MohrCoulomb {
    let friction = joint.friction.unwrap_or_default();
    let tension = joint.tension.unwrap_or_default();
    let softening = joint.fracture_energy.map(|[opening, sliding]| Softening {
        // Without tensile strength there is nothing to soften.
        opening: if tension > 0.0 { 2.0 * opening / tension } else { 0.0 },
        sliding,
    });
    MohrCoulomb {
        cohesion: joint.cohesion.unwrap_or_default(),
        tan_friction: tan(friction),
        tension,
        residual_cohesion: joint.residual_cohesion.unwrap_or_default(),
        tan_residual_friction: tan(joint.residual_friction.unwrap_or(friction)),
        tan_dilation: tan(joint.dilation.unwrap_or_default()),
        softening,
    }
}

fn barton(joint: &Joint, [jrc, jcs]: [f64; 2]) -> Barton {
    Barton {
        jrc,
        jcs,
        residual_friction: joint.residual_friction.unwrap_or_default(),
        tension: joint.tension.unwrap_or_default(),
        tan_dilation: tan(joint.dilation.unwrap_or_default()),
    }
}

/// Tangent of an angle in degrees.
fn tan(degrees: f64) -> f64 {
    libm::tan(degrees.to_radians())
}
