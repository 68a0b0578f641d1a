//! Blocks that are taken out, and joints and materials that are assigned, at the start of a stage.

use std::sync::Arc;

use super::{Geometry, Names, Region, assign, no_block, nothing, refined};
use crate::deck::{Deck, Where};
use crate::error::Fault;

/// What is where in each stage.
#[derive(Clone, Debug)]
pub(crate) struct Stages {
    /// The first stage of each, in order.
    first: Vec<usize>,
    geometries: Vec<Arc<Geometry>>,
}

impl Stages {
    pub(crate) fn new(deck: &Deck, all: &Names, start: Arc<Geometry>) -> Result<Self, Vec<Fault>> {
        let names: Vec<_> = deck.blocks.iter().map(|set| set.name.as_deref()).collect();
        let region = |region: &Where| Region::new(region, &start.bounds, &names);
        let (mut first, mut geometries, mut faults) = (vec![0], vec![start.clone()], Vec::new());
        for (stage, entry) in deck.stage.iter().enumerate() {
            let mut now: Option<Geometry> = None;
            for (index, remove) in deck.remove.iter().enumerate() {
                if remove.from.as_ref() != Some(&entry.name) {
                    continue;
                }
                let before = now.as_ref().or(geometries.last().map(Arc::as_ref)).unwrap_or(&start);
                let region = region(&remove.region);
                let blocks = before.blocks_in(&region);
                if blocks.is_empty() {
                    let fault = nothing(format!("remove[{index}].where"), "no block");
                    faults.push(no_block(fault, &region, &before.lattices));
                    continue;
                }
                let mut after = before.clone();
                after.take_out(&blocks);
                if (0..after.bodies.len()).all(|block| after.is_gone(block)) {
                    let message = "every block is taken out: nothing is left";
                    faults.push(Fault::new(format!("remove[{index}]"), message));
                }
                now = Some(after);
            }
            if assign::changes(deck, stage) {
                let last = || geometries.last().map_or(&start, |last| last).as_ref().clone();
                let mut after = now.unwrap_or_else(last);
                let (lattices, _) = refined(deck, all)?;
                let wrong = after.assign_anew(lattices, (deck, all), stage).into_iter();
                // What is wrong from a stage on is so up to another.
                let known = |fault: &Fault| faults.iter().any(|other| other.place == fault.place);
                let wrong: Vec<Fault> = wrong.filter(|fault| !known(fault)).collect();
                faults.extend(wrong);
                now = Some(after);
            }
            if let Some(now) = now {
                first.push(stage);
                geometries.push(Arc::new(now));
            }
        }
        if faults.is_empty() { Ok(Self { first, geometries }) } else { Err(faults) }
    }

    /// In a stage.
    pub(crate) fn at(&self, stage: usize) -> &Arc<Geometry> {
        let at = self.first.partition_point(|&first| first <= stage);
        &self.geometries[at.max(1) - 1]
    }

    /// The stage at whose start a block is taken out.
    pub(crate) fn removes(&self, block: usize) -> Option<usize> {
        let gone = |(_, geometry): &(&usize, &Arc<Geometry>)| geometry.is_gone(block);
        self.first.iter().zip(&self.geometries).find(gone).map(|(&first, _)| first)
    }

    /// Memory of all of them `[bytes]`.
    pub(crate) fn bytes(&self) -> usize {
        self.geometries.iter().map(|geometry| geometry.bytes()).sum()
    }

    /// In the stage of a name, or at the start.
    pub(crate) fn from(&self, deck: &Deck, name: Option<&String>) -> &Geometry {
        let stage = name.and_then(|name| deck.stage.iter().position(|s| s.name == *name));
        self.at(stage.unwrap_or(0))
    }

    /// Whether blocks are taken out, or joints or materials change, on the way from one stage to another.
    pub(crate) fn changes(&self, from: usize, to: usize) -> bool {
        self.first.iter().any(|&first| from < first && first <= to)
    }

    /// The stages in which they are.
    pub(crate) fn digs(&self, from: usize, to: usize) -> Vec<usize> {
        self.first.iter().copied().filter(|&first| from < first && first <= to).collect()
    }
}
