//! Contacts in the masses of a relaxation.

use super::MassContext;
use crate::model::Model;
use ddem_joint::contact::{ContactModel, ContactSurfaces, Contacts, JointStatus, outer};
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::law::SpringStiffness;

/// Contacts that the masses account for; a function of the state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ContactMasses {
    /// True if contacts may be on faces without a joint.
    pub(crate) any: bool,
    /// True if all blocks that touch are still joined as at the start. Then facing corners move as
    /// one in smooth motions of many blocks.
    pub(crate) joined: bool,
    /// True if contacts may replace joints, some of which have moved.
    pub(super) released: bool,
}

impl ContactMasses {
    /// `joined` is false if contacts have been found before in the same relaxation, and `failed` is
    /// true if pairs have failed.
    pub(crate) fn new(model: &Model, contacts: &Contacts, joined: bool, failed: bool) -> Self {
        // Without a search for contacts nobody knows how far failed pairs have moved apart.
        let searched = model.contact.as_ref().is_some_and(|contact| contact.search);
        let joined = joined && (searched || !failed);
        if model.contact.is_none() {
            return Self { joined, ..Self::default() };
        }
        let released = contacts.joints.iter().flatten().any(|&joint| joint > JointStatus::InPlace);
        let met = released || !contacts.patches.is_empty();
        let any = met || model.open_surfaces().is_some();
        Self { any, released, joined: joined && !met }
    }
}

/// Contact stiffness of a face per unit of area, normal and shear, doubled for the other block
/// `[Pa/m]`. Before any joint has moved it is the excess over the joint's stiffness, so that it
/// acts on faces without a joint, where contacts may form. Once joints have moved (`released`), all
/// faces have it: a joint's part of the masses couples facing nodes, but the contact after it may
/// join others.
pub(super) fn of_contacts(
    surfaces: &ContactSurfaces,
    block: usize,
    face: FaceId,
    released: bool,
) -> [f64; 2] {
    if !released {
        return outer(surfaces, block, face);
    }
    let SpringStiffness { normal, shear } = surfaces.largest_with_joint(block as u32, face);
    [2.0 * normal, 2.0 * shear]
}

/// Adds the stiffness of contacts at a node.
pub(super) fn contact_diagonal(
    around: &MassContext<'_>,
    contact_model: &ContactModel,
    block: usize,
    at: [usize; 3],
    sum: &mut [f64; 3],
) {
    let contact_block = &contact_model.blocks[block];
    let geometry = &around.model.geometry;
    let topology = geometry.topology(block);
    for face in FaceId::all().filter(|&face| topology.is_on(face, at)) {
        let area = contact_block.element_area(face) / 4.0 * topology.quads_at(face, at) as f64;
        let [stiff, shear] =
            of_contacts(&contact_model.surfaces, block, face, around.contact_masses.released);
        let normal = geometry.normal(block, face.direction);
        for c in 0..3 {
            sum[c] += area * (shear + (stiff - shear) * normal[c] * normal[c]);
        }
    }
}
