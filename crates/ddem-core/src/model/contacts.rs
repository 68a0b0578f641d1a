//! Contacts of a model.

use super::Model;
use ddem_joint::contact::{BondedPatch, ContactModel, Contacts, at_nodes};
use ddem_mesh::Geometry;
use ddem_mesh::properties::{JointProperties, Properties};

/// Mass and stiffness that joints between faces that do not match have at nodes.
pub(super) fn at_bonds(
    properties: &Properties,
    geometry: &Geometry,
    contact: Option<&ContactModel>,
    bonded_patches: &[BondedPatch],
) -> Vec<(usize, [f64; 4])> {
    let numbers = |joint: &JointProperties| {
        [joint.thickness, joint.layer().map_or(0.0, |layer| layer.density)]
    };
    let layers: Vec<[f64; 2]> = properties.joints.iter().map(numbers).collect();
    contact.map_or_else(Vec::new, |contact| {
        at_nodes(bonded_patches, &contact.blocks, geometry, &layers)
    })
}

impl Model {
    /// Contacts at the start of a run: joints between faces that do not match.
    pub(crate) fn contacts(&self) -> Contacts {
        let packs = if self.contact.is_some() { self.packs.packs.len() } else { 0 };
        let mut contacts = Contacts::new(self.n_blocks(), packs);
        contacts.patches = self.bonded_patches.iter().map(|joint| joint.patch.clone()).collect();
        contacts.index();
        contacts
    }

    /// The faces of the blocks, where contacts may be before any joint has failed, or joints are that no
    /// lattice has.
    pub(crate) fn open_surfaces(&self) -> Option<&ContactModel> {
        self.contact.as_ref().filter(|contact_model| contact_model.open || contact_model.joins)
    }

    /// True if contacts are searched for.
    #[must_use]
    pub fn can_meet(&self) -> bool {
        self.searched().is_some()
    }

    /// The faces of the blocks, where contacts are looked for.
    pub(crate) fn searched(&self) -> Option<&ContactModel> {
        self.contact.as_ref().filter(|contact_model| contact_model.search)
    }
}
