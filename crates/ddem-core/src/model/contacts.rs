//! Contacts of a model.

use super::Model;
use ddem_joint::contact::{BondedPatch, ContactModel, Contacts, at_nodes};
use ddem_mesh::Geometry;
use ddem_mesh::properties::{JointProperties, Properties};

/// Nodal masses `[kg]` and stiffness diagonals `[N/m]` of nonconforming joints, by node; empty without
/// such joints.
pub(super) fn at_bonds(
    properties: &Properties,
    geometry: &Geometry,
    contact: Option<&ContactModel>,
    bonded_patches: &[BondedPatch],
) -> Vec<[f64; 4]> {
    let numbers = |joint: &JointProperties| {
        [joint.thickness, joint.layer().map_or(0.0, |layer| layer.density)]
    };
    let layers: Vec<[f64; 2]> = properties.joints.iter().map(numbers).collect();
    contact.filter(|_| !bonded_patches.is_empty()).map_or_else(Vec::new, |contact| {
        at_nodes(bonded_patches, &contact.blocks, geometry, &layers)
    })
}

impl Model {
    /// Contacts at the start of a run: the patches of nonconforming joints.
    pub(crate) fn contacts(&self) -> Contacts {
        let packs = if self.contact.is_some() { self.packs.packs.len() } else { 0 };
        let bodies = self.contact.as_ref().map(ContactModel::bodies).unwrap_or_default();
        let mut contacts = Contacts::new(self.n_blocks(), packs, bodies);
        contacts.patches = self.bonded_patches.iter().map(|joint| joint.patch.clone()).collect();
        contacts.index();
        contacts
    }

    /// Contact data, if blocks may meet before any joint has failed or if there are nonconforming
    /// joints.
    pub(crate) fn open_surfaces(&self) -> Option<&ContactModel> {
        self.contact.as_ref().filter(|contact_model| {
            contact_model.from_start || contact_model.has_nonconforming_joints
        })
    }

    /// True if contacts are searched for.
    #[must_use]
    pub fn can_meet(&self) -> bool {
        self.searched().is_some()
    }

    /// Contact data, if contacts are searched for.
    pub(crate) fn searched(&self) -> Option<&ContactModel> {
        self.contact.as_ref().filter(|contact_model| contact_model.search)
    }
}
