//! Warnings about contacts that are much stiffer or softer than the blocks.

use super::{ContactModel, ContactSurfaces, bound};
use ddem_mesh::Geometry;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::Properties;

/// Ratio of a given stiffness to that of the faces above which a warning is issued.
const STIFF: f64 = 100.0;
/// Shortening of the time step above which a warning is issued: ratio of the steps with and without
/// a given stiffness.
const SHORT: f64 = 0.1;
/// Ratio of a given stiffness to that of the faces below which a warning is issued.
const SOFT: f64 = 1e-3;
/// Penetration of a block under its own weight, as a fraction of its edge, above which a warning is
/// issued.
const SINKS: f64 = 0.01;

/// Warning about a contact stiffness far from that of the blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactWarning {
    /// A given stiffness that shortens the time step.
    Stiff {
        /// True for the shear stiffness, false for the normal stiffness.
        shear: bool,
        /// Given stiffness `[Pa/m]`.
        given: f64,
        /// Stiffness that the two faces have without it `[Pa/m]`.
        own: f64,
        /// Longest time step with it `[s]`.
        step: f64,
        /// Longest time step without it `[s]`.
        without: f64,
    },
    /// A given stiffness with which blocks penetrate each other.
    Soft {
        /// True for the shear stiffness, false for the normal stiffness.
        shear: bool,
        /// Given stiffness `[Pa/m]`.
        given: f64,
        /// Stiffness that the two faces have without it `[Pa/m]`.
        own: f64,
    },
    /// Blocks that penetrate each other under their own weight.
    Sinks {
        /// Penetration as a fraction of the edge of the block.
        fraction: f64,
        /// Density of the block `[kg/m³]`.
        density: f64,
        /// Normal stiffness of its contact `[Pa/m]`.
        stiffness: f64,
    },
}

impl ContactModel {
    /// Warnings about contact stiffnesses far from those of the blocks.
    pub fn warnings(
        &self,
        properties: &Properties,
        geometry: &Geometry,
        packs: &Packs,
        assembly: &Assembly,
    ) -> Vec<ContactWarning> {
        // Longest step that undamped contacts allow, without the stiffness of deformable blocks.
        let longest_step = |surfaces: &ContactSurfaces| {
            let [more, rigid] = bound(surfaces, geometry, packs, assembly);
            2.0 / more.max(rigid).sqrt()
        };
        let contact = &properties.contact;
        let mut warnings = Vec::new();
        let sinks = self.surfaces.settlement(properties.gravity.norm(), SINKS);
        for (direction, given) in
            [contact.normal_stiffness, contact.shear_stiffness].iter().enumerate()
        {
            let Some(given) = *given else { continue };
            let shear = direction == 1;
            let bare = self.surfaces.without(direction);
            let [least, most] = bare.range(direction);
            let own = if given > most { most } else { least };
            let times = given / own;
            let [step, without] = [&self.surfaces, &bare].map(longest_step);
            if times > STIFF || (times > 1.0 && step < SHORT * without) {
                warnings.push(ContactWarning::Stiff { shear, given, own, step, without });
            } else if times < SOFT && (shear || sinks.is_none()) {
                warnings.push(ContactWarning::Soft { shear, given, own });
            }
        }
        let sinks = sinks.map(|[fraction, density, stiffness]| ContactWarning::Sinks {
            fraction,
            density,
            stiffness,
        });
        warnings.extend(sinks);
        warnings
    }
}
