//! Cells in the masses of a relaxation.

use std::collections::HashMap;

use super::smooth::{SmoothBody, SmoothMotions, smooth_bodies};
use super::springs::{joins_cells, patches_of};
use super::{ContactMasses, MassContext, Preconditioner};
use crate::error::RunError;
use crate::model::Model;
use ddem_joint::contact::bounds_at_nodes;
use ddem_mesh::PartShape;

/// Factor of the smooth motions if there are deformable cells. These take part twice, and have rigid
/// motions besides. More saves steps on stiff joints and costs steps on soft ones.
const OF_CELLS: f64 = 0.15;

impl Preconditioner {
    /// Adds contacts to the masses of more cells. The masses of other nodes and bodies stay as they are, to
    /// the bit; smooth motions change.
    pub(crate) fn add_contacts(
        &mut self,
        model: &Model,
        held: &HashMap<u32, [bool; 3]>,
        contact_masses: ContactMasses,
    ) -> Result<(), RunError> {
        let known = &self.contact_masses.cells;
        let is_new = |cell: &u32| known.binary_search(cell).is_err();
        let more: Vec<u32> = contact_masses.cells.iter().copied().filter(is_new).collect();
        let is_more = |block: usize| is_part_of(model, &more, block);
        let (bodies, packs) = self.cells.with_parts(is_more);
        // The masses of a pack are computed together, and those of tied nodes are sums.
        let sharing = self.cells.bodies_in(&packs);
        let has_springs = |block: usize| {
            let (pack, lane) = model.packs.slot(block);
            let own = self.cells.body(pack, lane);
            own.map_or_else(|| is_more(block), |body| sharing.contains(&body))
        };
        let bonds = bond_bounds(model, &contact_masses, &has_springs);
        let around = MassContext {
            model,
            couplings: &[],
            held,
            bonds: &bonds,
            contact_model: model.contact.as_ref(),
            contact_masses: &contact_masses,
        };
        let patches = patches_of(model, &model.assembly.bodies);
        for (body, patches) in patches.iter().enumerate() {
            if is_more(self.rigid.parts(model, body)[0].block) {
                self.springs[body] = self.rigid.renew(around, body, patches, self.factor);
            }
        }
        self.nodes.renew(around, &packs, self.factor)?;
        if !self.frames.is_empty() {
            self.nodes.equalize_cells(model);
        }
        self.cells.renew(around, &bodies, self.factor);
        self.contact_masses = contact_masses;
        self.find_smooth_motions(model, held);
        self.smooth.iter_mut().for_each(|smooth| smooth.scale(self.factor));
        Ok(())
    }

    /// Finds the smooth motions, if the contacts of the masses allow for any. Deformable cells take part
    /// twice. On soft joints they move as rigid bodies; on stiff ones their nodes move together.
    pub(super) fn find_smooth_motions(&mut self, model: &Model, held: &HashMap<u32, [bool; 3]>) {
        self.smooth.clear();
        let exists = |&block: &u32| !model.geometry.is_removed(block as usize);
        let mut joints = model.bonded_patches.iter().map(|joint| joint.patch.blocks);
        let others = joints.any(|blocks| {
            blocks.iter().all(exists) && !joins_cells(model, blocks.map(|block| block as usize))
        });
        if others || !self.contact_masses.smooth {
            return;
        }
        let mut bodies: Vec<SmoothBody<'_>> = smooth_bodies(model, &self.rigid, &self.springs);
        if self.cells.is_empty() {
            self.smooth.extend(SmoothMotions::new(model, held, &bodies, false));
            return;
        }
        let by_nodes = parts_are_elements(model);
        let by_nodes = by_nodes.then(|| SmoothMotions::new(model, held, &bodies, true)).flatten();
        bodies.extend(self.cells.smooth_bodies());
        let as_bodies = SmoothMotions::new(model, held, &bodies, false);
        self.smooth.extend([as_bodies, by_nodes].into_iter().flatten());
        self.smooth.iter_mut().for_each(|smooth| smooth.scale(OF_CELLS));
    }
}

/// True if the parts of all deformable cells are single elements, whose corners are all their nodes.
fn parts_are_elements(model: &Model) -> bool {
    let is_part = |block: u32| model.geometry.part(block as usize).is_some();
    let packs = model.packs.packs.iter().filter(|pack| !pack.rigid && is_part(pack.blocks[0]));
    packs.map(|pack| model.packs.numbering_of(pack).divisions).all(|divisions| divisions == 1)
}

/// Upper bounds of the stiffness of contacts at each node of deformable cells that have some `[N/m]`;
/// empty without contacts.
pub(super) fn contact_bounds(model: &Model, contact_masses: &ContactMasses) -> Vec<f64> {
    let geometry = &model.geometry;
    let Some(contact) = model.contact.as_ref().filter(|contact| contact.search) else {
        return Vec::new();
    };
    if !contact_masses.exist() {
        return Vec::new();
    }
    let deformable = |block: usize| !geometry.is_rigid(block);
    let meet = |block: usize| is_part_of(model, &contact_masses.cells, block);
    let (surfaces, blocks) = (Some(&contact.surfaces), &contact.blocks);
    let bounds = bounds_at_nodes(&[], surfaces, blocks, geometry, &deformable, &meet);
    bounds.into_iter().map(|[stiffness, _]| 2.0 * stiffness).collect()
}

/// Upper bounds of the stiffness of springs at each node of parts of cells `[N/m]`, the two sides and
/// tied nodes together: joints of deformable cells, and contacts of cells that have some. A matrix
/// `k A w wᵀ` of a point with weights w, whose sizes sum to 2, is at most the diagonal matrix of
/// `2 k A w`. Only blocks that have such springs get any.
pub(super) fn bond_bounds(
    model: &Model,
    contact_masses: &ContactMasses,
    has_springs: &dyn Fn(usize) -> bool,
) -> Vec<f64> {
    let geometry = &model.geometry;
    let Some(contact) = model.contact.as_ref().filter(|_| model.has_cells()) else {
        return Vec::new();
    };
    let mut bounds = vec![0.0; model.n_nodes()];
    let meets = (contact_masses.exist() && contact.search).then_some(&contact.surfaces);
    let (bonded, blocks) = (&model.bonded_patches, &contact.blocks);
    let meet = |block: usize| is_part_of(model, &contact_masses.cells, block);
    let bonds = bounds_at_nodes(bonded, meets, blocks, geometry, has_springs, &meet);
    for (node, [stiffness, _]) in bonds.into_iter().enumerate() {
        if stiffness > 0.0 && has_springs(geometry.block_of(node)) {
            bounds[node] = 2.0 * stiffness;
        }
    }
    for group in model.geometry.tied_deformable() {
        let sum: f64 = group.iter().map(|&node| bounds[node as usize]).sum();
        group.iter().for_each(|&node| bounds[node as usize] = sum);
    }
    bounds
}

/// True if a block is a part of one of some cells, which are sorted.
pub(super) fn is_part_of(model: &Model, cells: &[u32], block: usize) -> bool {
    let is_one = |part: &PartShape| cells.binary_search(&part.cell).is_ok();
    model.geometry.part(block).is_some_and(is_one)
}
