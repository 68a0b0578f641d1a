//! Contacts in the masses of a relaxation.

use super::Around;
use crate::model::Model;
use ddem_joint::contact::{Contacts, Release, Skins, Surfaces, outer};
use ddem_mechanics::collide::FaceOf;
use ddem_mechanics::law::Stiffness;

/// What contacts masses are to reckon with: it follows from the state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Meeting {
    /// Those on the faces without a joint.
    pub(crate) any: bool,
    /// Those in the place of joints, of which some have moved.
    pub(super) released: bool,
}

impl Meeting {
    pub(crate) fn new(model: &Model, contacts: &Contacts) -> Self {
        if model.contact.is_none() {
            return Self::default();
        }
        let released = contacts.joints.iter().flatten().any(|&joint| joint > Release::Holds);
        let met = released || !contacts.patches.is_empty();
        Self { any: met || model.open_surfaces().is_some(), released }
    }
}

/// Stiffness of contacts on a face for each unit of area, twice for the other block `[Pa/m]`: where no
/// joint is, as they may come there, and once joints have moved on all faces. What a joint has put into
/// the masses couples nodes that face each other; those in contact after it may be others.
pub(super) fn of_contacts(skins: &Skins, body: usize, face: FaceOf, released: bool) -> [f64; 2] {
    if !released {
        return outer(skins, body, face);
    }
    let Stiffness { normal, shear } = skins.stiffest(body as u32, face);
    [2.0 * normal, 2.0 * shear]
}

/// Adds contacts.
pub(super) fn contact_diagonal(
    around: &Around<'_>,
    surfaces: &Surfaces,
    body: usize,
    at: [usize; 3],
    sum: &mut [f64; 3],
) {
    let placed = &surfaces.blocks[body];
    let geometry = &around.model.geometry;
    let topology = geometry.topology(body);
    for face in FaceOf::all().filter(|&face| topology.is_on(face, at)) {
        let area = placed.element_area(face) / 4.0 * topology.quads_at(face, at) as f64;
        let [stiff, shear] = of_contacts(&surfaces.skins, body, face, around.meeting.released);
        let normal = geometry.normal(body, face.direction);
        for c in 0..3 {
            sum[c] += area * (shear + (stiff - shear) * normal[c] * normal[c]);
        }
    }
}
