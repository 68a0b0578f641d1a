//! Contacts in the masses of a relaxation.

use super::MassContext;
use crate::model::Model;
use crate::state::RelaxationProgress;
use ddem_joint::contact::{ContactModel, ContactSurfaces, Contacts, JointStatus, outer};
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::law::SpringStiffness;

/// Contacts that the masses account for; a function of the state.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ContactMasses {
    /// True if contacts may be on faces without a joint, other than those of cells.
    any: bool,
    /// True if smooth motions of many blocks are those of neighbours: deformable blocks of sets that
    /// touch are still joined as at the start, and rigid blocks and cells touch only what was beside
    /// them.
    pub(crate) smooth: bool,
    /// True if contacts may replace joints, some of which have moved.
    pub(super) released: bool,
    /// Cells that have been in contact, sorted.
    pub(crate) cells: Vec<u32>,
}

impl ContactMasses {
    /// `progress` tells what contacts have been found before in the same relaxation, and `failed` is
    /// true if pairs have failed.
    pub(crate) fn new(
        model: &Model,
        contacts: &Contacts,
        progress: &RelaxationProgress,
        failed: bool,
    ) -> Self {
        // Without a search for contacts nobody knows how far failed pairs have moved apart.
        let searched = model.contact.as_ref().is_some_and(|contact| contact.search);
        let smooth = !progress.has_met && (searched || !failed);
        let Some(contact) = &model.contact else {
            return Self { smooth, ..Self::default() };
        };
        let released = contacts.joints.iter().flatten().any(|&joint| joint > JointStatus::InPlace);
        let met = released || !contacts.patches.is_empty();
        let packs = &model.packs.packs;
        let cell = |block: u32| model.geometry.part(block as usize).map(|part| part.cell);
        let mut cells = progress.contact_cells.clone();
        cells.extend(contacts.touching().flatten().filter_map(cell));
        cells.sort_unstable();
        cells.dedup();
        let are_loose = packs.iter().all(|pack| pack.rigid || cell(pack.blocks[0]).is_some());
        // Contacts of cells count for the cells that have some.
        let others = packs.iter().any(|pack| cell(pack.blocks[0]).is_none());
        let any = others && (met || model.open_surfaces().is_some());
        let neighbours = if are_loose { contacts.are_of_neighbours(&contact.blocks) } else { !met };
        Self { any, released, smooth: smooth && neighbours, cells }
    }

    /// Notes these contacts in the progress of a relaxation, which keeps them.
    pub(crate) fn note(&self, progress: &mut RelaxationProgress) {
        progress.has_met |= !self.smooth;
        progress.contact_cells.clone_from(&self.cells);
    }

    /// True if contacts may exist.
    pub(crate) fn exist(&self) -> bool {
        self.any || !self.cells.is_empty()
    }

    /// True if these differ from others by contacts of cells alone.
    pub(crate) fn differ_by_cells(&self, others: &Self) -> bool {
        self.cells != others.cells && self.without_cells() == others.without_cells()
    }

    /// The same without contacts of cells.
    pub(crate) fn without_cells(&self) -> Self {
        Self { cells: Vec::new(), ..*self }
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
