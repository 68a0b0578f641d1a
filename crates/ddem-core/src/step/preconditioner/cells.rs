//! Cells in the masses of a relaxation.

use std::collections::HashMap;

use super::smooth::SmoothMotions;
use super::springs::patches_of_bodies;
use super::{ContactMasses, MassContext, Preconditioner};
use crate::model::Model;
use ddem_joint::contact::bounds_at_nodes;
use ddem_mesh::PartShape;

impl Preconditioner {
    /// Adds contacts to the masses of more rigid cells. Other masses stay as they are, to the bit.
    pub(crate) fn add_contacts(
        &mut self,
        model: &Model,
        held: &HashMap<u32, [bool; 3]>,
        contact_masses: ContactMasses,
    ) {
        let known = &self.contact_masses.cells;
        let is_new = |cell: &u32| known.binary_search(cell).is_err();
        let more: Vec<u32> = contact_masses.cells.iter().copied().filter(is_new).collect();
        let is_more = |block: usize| is_part_of(model, &more, block);
        let bonds = bond_bounds(model, &contact_masses, &is_more);
        let around = MassContext {
            model,
            couplings: &[],
            held,
            bonds: &bonds,
            contact_model: model.contact.as_ref(),
            contact_masses: &contact_masses,
        };
        let patches = patches_of_bodies(model);
        for (body, patches) in patches.iter().enumerate() {
            if is_more(self.rigid.parts(model, body)[0].block) {
                self.springs[body] = self.rigid.renew(around, body, patches, self.factor);
            }
        }
        self.contact_masses = contact_masses;
        self.find_smooth_motions(model, held);
        self.smooth.iter_mut().for_each(|smooth| smooth.scale(self.factor));
    }

    pub(super) fn find_smooth_motions(&mut self, model: &Model, held: &HashMap<u32, [bool; 3]>) {
        let exist =
            self.contact_masses.smooth && self.bonds.are_all(model) && !has_deformable_cells(model);
        let motions = || SmoothMotions::new(model, held, &self.rigid, &self.springs);
        self.smooth = exist.then(motions).flatten();
    }
}

/// Upper bounds of the stiffness of springs at each node of parts of cells `[N/m]`, the two sides and
/// tied nodes together: joints and contacts of deformable cells, and contacts of rigid ones. A matrix
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
    let bonds = bounds_at_nodes(bonded, meets, blocks, geometry, has_springs);
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

/// True if some cells are deformable.
fn has_deformable_cells(model: &Model) -> bool {
    let is_cell = |block: u32| model.geometry.part(block as usize).is_some();
    model.packs.packs.iter().any(|pack| !pack.rigid && is_cell(pack.blocks[0]))
}
