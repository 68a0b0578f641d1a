//! Where blocks of a model may meet.

use super::Model;
use ddem_joint::contact::{Contacts, Seated, Surfaces, at_nodes};
use ddem_mesh::Geometry;
use ddem_mesh::properties::{JointProperties, Properties};

/// Mass and stiffness that joints between faces that do not match have at nodes.
pub(super) fn at_bonds(
    properties: &Properties,
    geometry: &Geometry,
    contact: Option<&Surfaces>,
    seated: &[Seated],
) -> Vec<(usize, [f64; 4])> {
    let numbers = |joint: &JointProperties| {
        [joint.thickness, joint.layer().map_or(0.0, |layer| layer.density)]
    };
    let layers: Vec<[f64; 2]> = properties.joints.iter().map(numbers).collect();
    contact.map_or_else(Vec::new, |contact| at_nodes(seated, &contact.blocks, geometry, &layers))
}

impl Model {
    /// Contacts at the start of a run: joints between faces that do not match.
    pub(crate) fn contacts(&self) -> Contacts {
        let packs = if self.contact.is_some() { self.packs.packs.len() } else { 0 };
        let mut contacts = Contacts::new(self.n_blocks(), packs);
        contacts.patches = self.seated.iter().map(|joint| joint.patch.clone()).collect();
        contacts.index();
        contacts
    }

    /// The faces of the blocks, where contacts may be before any joint has failed, or joints are that no
    /// lattice has.
    pub(crate) fn open_surfaces(&self) -> Option<&Surfaces> {
        self.contact.as_ref().filter(|surfaces| surfaces.open || surfaces.joins)
    }

    /// Whether blocks can meet: contacts are looked for.
    #[must_use]
    pub fn can_meet(&self) -> bool {
        self.searched().is_some()
    }

    /// The faces of the blocks, where contacts are looked for.
    pub(crate) fn searched(&self) -> Option<&Surfaces> {
        self.contact.as_ref().filter(|surfaces| surfaces.search)
    }
}
