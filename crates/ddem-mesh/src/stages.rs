//! Geometries of the stages: blocks removed, and joints and materials assigned, at the start of a
//! stage.

use std::sync::Arc;

use super::Geometry;

/// Geometries of the stages, in order. If one stage removes blocks and changes joints or materials,
/// it has two geometries, one after the other.
#[derive(Clone, Debug)]
pub struct Stages {
    /// Geometries, each with the first stage in which it is in force.
    pub geometries: Vec<(usize, Arc<Geometry>)>,
    /// Stages that begin with a change of joints or materials.
    pub assigns: Vec<usize>,
    /// True if blocks are removed.
    pub excavated: bool,
}

impl Stages {
    /// Geometry of a stage.
    pub fn at(&self, stage: usize) -> &Arc<Geometry> {
        let at = self.geometries.partition_point(|(first, _)| *first <= stage);
        &self.geometries[at.max(1) - 1].1
    }

    /// Geometry with the blocks of a stage and the joints and materials of an earlier one.
    pub fn back(&self, earlier: usize, stage: usize) -> Arc<Geometry> {
        let last = self.at(stage);
        if !self.assigns.iter().any(|assigned| (earlier + 1..=stage).contains(assigned)) {
            return last.clone();
        }
        let mut back = Geometry::clone(last);
        back.assign_as(self.at(earlier));
        Arc::new(back)
    }

    /// Stage that begins with the removal of a block; `None` if the block stays.
    pub fn removal_stage(&self, block: usize) -> Option<usize> {
        let removed = |(_, geometry): &&(usize, Arc<Geometry>)| geometry.is_removed(block);
        self.geometries.iter().find(removed).map(|(first, _)| *first)
    }

    /// Memory of all geometries `[bytes]`.
    pub fn bytes(&self) -> usize {
        let before = self.geometries.iter().map(|(_, geometry)| Some(&**geometry));
        let before = std::iter::once(None).chain(before);
        self.geometries.iter().zip(before).map(|((_, own), other)| own.bytes(other)).sum()
    }

    /// True if at least one geometry has a property.
    pub fn any(&self, so: impl Fn(&Geometry) -> bool) -> bool {
        self.geometries.iter().any(|(_, geometry)| so(geometry))
    }

    /// Geometries that come into force after stage `from`, up to stage `to`.
    pub fn steps(&self, from: usize, to: usize) -> Vec<(usize, Arc<Geometry>)> {
        self.geometries.iter().filter(|(first, _)| from < *first && *first <= to).cloned().collect()
    }
}
