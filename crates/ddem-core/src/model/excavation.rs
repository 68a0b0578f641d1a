//! Removal of blocks, and changes of joints and materials, during a run.

use std::sync::Arc;

use super::Model;
use super::contacts::at_bonds;
use crate::model::conditions::{FadingForces, ForceFading, LoadPattern};
use crate::model::sliding::SlidingDamping;
use ddem_joint::contact::ContactModel;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::in_situ::InSitu;
use ddem_mesh::joint_sections::JointSections;
use ddem_mesh::{Geometry, TiedSlots};

impl Model {
    /// Geometries that come into force on the way from one stage to another, with their stages.
    pub(crate) fn steps(&self, from: usize, to: usize) -> Vec<(usize, Arc<Geometry>)> {
        self.stages.steps(from, to)
    }

    /// Blocks of a stage with the joints and materials of an earlier one.
    pub(crate) fn back(&self, earlier: usize, stage: usize) -> Arc<Geometry> {
        self.stages.back(earlier, stage)
    }

    /// True if blocks are removed in any stage.
    #[must_use]
    pub fn has_excavations(&self) -> bool {
        self.stages.excavated
    }

    /// True if a block is removed in the present stage or before.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn is_removed(&self, block: usize) -> bool {
        self.geometry.has_block(block);
        self.geometry.is_removed(block)
    }

    /// Number in the deck of the stage at whose start a block is removed.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn removed_in(&self, block: usize) -> Option<usize> {
        self.geometry.has_block(block);
        self.stages.removal_stage(block)
    }

    /// Stage at whose start a block is removed, or `usize::MAX`. Of equally near blocks, searches
    /// choose the one that stays longest.
    pub(super) fn stays(&self, block: usize) -> usize {
        self.removed_in(block).unwrap_or(usize::MAX)
    }

    /// Panics if the number of values that a program gives is not the number of nodes.
    #[track_caller]
    pub(crate) fn one_for_each_node(&self, what: &str, found: usize) {
        let n = self.n_nodes();
        assert!(
            found == n,
            "the numbers of {what} ({found}) and of nodes of the model ({n}) differ: give one for each node"
        );
    }

    /// Numbers and values of the nodes of blocks that have not been removed. `values` has all
    /// nodes.
    pub(crate) fn existing_nodes<'a, T>(
        &'a self,
        values: &'a [T],
    ) -> impl Iterator<Item = (usize, &'a T)> {
        values.iter().enumerate().filter(|(node, _)| !self.is_removed(self.block_of(*node)))
    }

    /// Removes the blocks that are absent in `now`, with their joints. The other blocks get the
    /// joints and materials of `now`. Returns the geometry before.
    pub(crate) fn excavate(&mut self, now: Arc<Geometry>) -> Arc<Geometry> {
        let before = std::mem::replace(&mut self.geometry, now);
        let Self { geometry, packs, properties, .. } = self;
        for face in &mut self.faces {
            face.joint = face.at(geometry);
        }
        for joint in &mut self.bonded_patches {
            let number = geometry.joint_of(joint.patch.blocks);
            if let (Some(bond), Some(number)) = (&mut joint.patch.bond, number) {
                (bond.joint, bond.law) = (number, number);
            }
        }
        packs.link(geometry);
        self.sections = JointSections::new(properties, geometry, packs, &mut |_, _, joint| joint);
        if let Some(contact_model) = &mut self.contact {
            *contact_model = ContactModel::new(properties, &self.laws, geometry, packs);
        }
        self.assembly = Assembly::new(geometry, packs, properties);
        let contact = self.contact.as_ref();
        let bonds = at_bonds(properties, geometry, contact, &self.bonded_patches);
        self.assembly.assemble(geometry, packs, properties, &self.sections, &bonds);
        self.ties = TiedSlots::new(geometry, packs);
        self.sliding = SlidingDamping::new(&self.laws, contact, properties, geometry, packs);
        if let Some(in_situ) = self.in_situ.take() {
            let blocks = in_situ.without(geometry);
            self.in_situ = InSitu::new(blocks, geometry, packs, &self.assembly);
        }
        before
    }

    /// Loads of the fading forces of blocks that are removed on the way from one stage to another.
    pub(crate) fn fading(&self, from: usize, to: usize) -> Vec<usize> {
        let fades = |load: &LoadPattern| {
            let begins = |fading: &ForceFading| from < fading.from && fading.from <= to;
            load.fading.as_ref().is_some_and(|fading| fading.fades && begins(fading))
        };
        let loads = &self.conditions.loaded;
        (0..loads.len()).filter(|&load| fades(&loads[load])).collect()
    }

    /// Sets the forces of removed blocks that remain as a load.
    pub(crate) fn set_released(&mut self, load: usize, released: &FadingForces) {
        if let Some(load) = self.conditions.loaded.get_mut(load) {
            load.release(released);
        }
    }
}
