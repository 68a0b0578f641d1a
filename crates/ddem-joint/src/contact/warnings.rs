//! Contacts that are allowed but perhaps not meant: far stiffer or softer than the blocks.

use super::{ContactModel, ContactSurfaces, bound};
use ddem_mesh::Geometry;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::Properties;

/// Times the blocks' own stiffness above which a given one only shortens the step.
const STIFF: f64 = 100.0;
/// Part by which it may shorten the step before something is said.
const SHORT: f64 = 0.1;
/// Times the blocks' own stiffness below which the blocks are no longer what they look like.
const SOFT: f64 = 1e-3;
/// Part of its edge by which a block may sink in under its own weight.
const SINKS: f64 = 0.01;

/// A stiffness of contacts far from that of the blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactWarning {
    /// A given stiffness that shortens the time step.
    Stiff {
        /// Stiffness along the faces, not across them.
        shear: bool,
        /// Stiffness that is given `[Pa/m]`.
        given: f64,
        /// Stiffness of the faces that meet `[Pa/m]`.
        own: f64,
        /// Longest time step with it `[s]`.
        step: f64,
        /// Longest time step without it `[s]`.
        without: f64,
    },
    /// A given stiffness with which blocks sink into each other.
    Soft {
        /// Stiffness along the faces, not across them.
        shear: bool,
        /// Stiffness that is given `[Pa/m]`.
        given: f64,
        /// Stiffness of the faces that meet `[Pa/m]`.
        own: f64,
    },
    /// Blocks that sink in under their own weight.
    Sinks {
        /// Depth as a part of an edge of the block.
        part: f64,
        /// Density of the block `[kg/m³]`.
        density: f64,
        /// Normal stiffness of its contact `[Pa/m]`.
        stiffness: f64,
    },
}

impl ContactModel {
    /// Stiffnesses of contacts far from those of the blocks.
    pub fn warnings(
        &self,
        properties: &Properties,
        geometry: &Geometry,
        packs: &Packs,
        assembly: &Assembly,
    ) -> Vec<ContactWarning> {
        // Longest step that undamped contacts leave, whatever the blocks are.
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
        let sinks = sinks.map(|[part, density, stiffness]| ContactWarning::Sinks {
            part,
            density,
            stiffness,
        });
        warnings.extend(sinks);
        warnings
    }
}
