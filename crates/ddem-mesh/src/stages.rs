//! Blocks that are taken out, and joints and materials that are assigned, at the start of a stage.

use std::sync::Arc;

use super::Geometry;

/// Geometries of the stages, in order. Where blocks are removed and joints or materials change in one stage, one
/// follows the other.
#[derive(Clone, Debug)]
pub struct Stages {
    /// Blocks and joints, with the first stage in which they are so.
    pub geometries: Vec<(usize, Arc<Geometry>)>,
    /// Stages at whose start joints or materials change.
    pub assigns: Vec<usize>,
    /// Blocks are taken out.
    pub excavated: bool,
}

impl Stages {
    /// In a stage.
    pub fn at(&self, stage: usize) -> &Arc<Geometry> {
        let at = self.geometries.partition_point(|(first, _)| *first <= stage);
        &self.geometries[at.max(1) - 1].1
    }

    /// Blocks of a stage with joints and materials of an earlier one.
    pub fn back(&self, earlier: usize, stage: usize) -> Arc<Geometry> {
        let last = self.at(stage);
        if !self.assigns.iter().any(|assigned| (earlier + 1..=stage).contains(assigned)) {
            return last.clone();
        }
        let mut back = Geometry::clone(last);
        back.assign_as(self.at(earlier));
        Arc::new(back)
    }

    /// The stage at whose start a block is taken out.
    pub fn removes(&self, block: usize) -> Option<usize> {
        let removed = |(_, geometry): &&(usize, Arc<Geometry>)| geometry.is_removed(block);
        self.geometries.iter().find(removed).map(|(first, _)| *first)
    }

    /// Memory of all of them `[bytes]`.
    pub fn bytes(&self) -> usize {
        let before = self.geometries.iter().map(|(_, geometry)| Some(&**geometry));
        let before = std::iter::once(None).chain(before);
        self.geometries.iter().zip(before).map(|((_, own), other)| own.bytes(other)).sum()
    }

    /// True if any geometry has a property.
    pub fn any(&self, so: impl Fn(&Geometry) -> bool) -> bool {
        self.geometries.iter().any(|(_, geometry)| so(geometry))
    }

    /// Geometries on the way from one stage to another.
    pub fn steps(&self, from: usize, to: usize) -> Vec<(usize, Arc<Geometry>)> {
        self.geometries.iter().filter(|(first, _)| from < *first && *first <= to).cloned().collect()
    }
}
