//! Blocks that are taken out, and joints and materials that are assigned, at the start of a stage.

use std::sync::Arc;

use super::{Geometry, Names, Region, Selection, assign, no_block, nothing, refined};
use crate::deck::{Deck, Where};
use crate::error::Fault;

/// What is where from which stage on, in order. Where blocks are taken out and joints or materials change in
/// one stage, that is one after the other.
#[derive(Clone, Debug)]
pub(crate) struct Stages {
    geometries: Vec<(usize, Arc<Geometry>)>,
    /// Stages at whose start joints or materials change.
    assigns: Vec<usize>,
    /// Blocks are taken out.
    pub(crate) dug: bool,
    /// Blocks that curved and slanted shapes take out.
    pub(crate) taken: Vec<Selection>,
}

impl Stages {
    pub(crate) fn new(deck: &Deck, all: &Names, start: Arc<Geometry>) -> Result<Self, Vec<Fault>> {
        let region = |region: &Where| Region::new(region, &start.frame);
        let (mut geometries, mut faults) = (vec![(0, start.clone())], Vec::new());
        let mut taken = Vec::new();
        for (stage, entry) in deck.stage.iter().enumerate() {
            let mut now: Option<Geometry> = None;
            for (index, remove) in deck.remove.iter().enumerate() {
                if remove.from.as_ref() != Some(&entry.name) {
                    continue;
                }
                let last = geometries.last().map(|(_, geometry)| geometry.as_ref());
                let before = now.as_ref().or(last).unwrap_or(&start);
                let region = region(&remove.region);
                let blocks = before.blocks_in(&region);
                if blocks.is_empty() {
                    let fault = nothing(format!("remove[{index}].where"), "no block");
                    faults.push(no_block(fault, &region, &before.lattices));
                    continue;
                }
                let what = (format!("remove[{index}]"), format!("excavate `{}`", entry.name));
                taken.extend(Selection::new(what, &region, &start.frame, &before.lattices));
                let mut after = before.clone();
                after.take_out(&blocks);
                if (0..after.bodies.len()).all(|block| after.is_gone(block)) {
                    let message = "every block is taken out: nothing is left";
                    faults.push(Fault::new(format!("remove[{index}]"), message));
                }
                now = Some(after);
            }
            let dug = now.map(Arc::new);
            let last = geometries.last().map_or(&start, |(_, geometry)| geometry);
            let last = dug.as_ref().unwrap_or(last).clone();
            let assigned = assign::changes(deck, stage).then(|| Geometry::clone(&last));
            geometries.extend(dug.map(|geometry| (stage, geometry)));
            if let Some(mut after) = assigned {
                let lattices = refined(deck, all)?.lattices;
                let wrong = after.assign_anew(lattices, (deck, all), stage).into_iter();
                // What is wrong from a stage on is so up to another.
                let known = |fault: &Fault| faults.iter().any(|other| other.place == fault.place);
                let wrong: Vec<Fault> = wrong.filter(|fault| !known(fault)).collect();
                faults.extend(wrong);
                geometries.push((stage, Arc::new(after)));
            }
        }
        let assigns = (0..deck.stage.len()).filter(|&stage| assign::changes(deck, stage)).collect();
        let dug = deck.remove.iter().any(|remove| remove.from.is_some());
        if faults.is_empty() { Ok(Self { geometries, assigns, dug, taken }) } else { Err(faults) }
    }

    /// In a stage.
    pub(crate) fn at(&self, stage: usize) -> &Arc<Geometry> {
        let at = self.geometries.partition_point(|(first, _)| *first <= stage);
        &self.geometries[at.max(1) - 1].1
    }

    /// In a stage that is entered when what goes up to another one has been taken out: that stays away, and
    /// joints and materials are those of the stage.
    pub(crate) fn back(&self, stage: usize, dug: usize) -> Arc<Geometry> {
        let last = self.at(dug);
        if !self.assigns.iter().any(|assigned| (stage + 1..=dug).contains(assigned)) {
            return last.clone();
        }
        let mut back = Geometry::clone(last);
        back.assign_as(self.at(stage));
        Arc::new(back)
    }

    /// The stage at whose start a block is taken out.
    pub(crate) fn removes(&self, block: usize) -> Option<usize> {
        let gone = |(_, geometry): &&(usize, Arc<Geometry>)| geometry.is_gone(block);
        self.geometries.iter().find(gone).map(|(first, _)| *first)
    }

    /// Memory of all of them `[bytes]`.
    pub(crate) fn bytes(&self) -> usize {
        self.geometries.iter().map(|(_, geometry)| geometry.bytes()).sum()
    }

    /// In the stage of a name, or at the start.
    pub(crate) fn from(&self, deck: &Deck, name: Option<&String>) -> &Geometry {
        let stage = name.and_then(|name| deck.stage.iter().position(|s| s.name == *name));
        self.at(stage.unwrap_or(0))
    }

    /// Whether something is so in any.
    pub(crate) fn any(&self, so: impl Fn(&Geometry) -> bool) -> bool {
        self.geometries.iter().any(|(_, geometry)| so(geometry))
    }

    /// What changes on the way from one stage to another.
    pub(crate) fn steps(&self, from: usize, to: usize) -> Vec<(usize, Arc<Geometry>)> {
        self.geometries.iter().filter(|(first, _)| from < *first && *first <= to).cloned().collect()
    }
}
