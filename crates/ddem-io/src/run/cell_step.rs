//! Cells of regions that allow the shortest time steps.

use std::collections::BTreeMap;
use std::fmt;

use ddem_core::{Model, RunError, Simulation};

use crate::summary::TimeStepLimit;

/// Number of the cells that are listed.
const LISTED: usize = 10;

/// Block of a region with its critical step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellStep {
    /// Number of the block.
    pub block: u64,
    /// Number of its thinnest cell, as `ddem cut` numbers them.
    pub cell: u64,
    /// Name of the region.
    pub region: String,
    /// Centroid of the cell `[m]`.
    pub centroid: [f64; 3],
    /// Least width of the cell `[m]`.
    pub width: f64,
    /// Critical step that the block alone allows, with its joints and contacts `[s]`.
    pub step: f64,
}

impl CellStep {
    /// The blocks with the shortest steps, if one of them is the `limit` of the model.
    pub(super) fn shortest(
        simulation: &mut Simulation,
        limit: &TimeStepLimit,
    ) -> Result<Vec<Self>, RunError> {
        let steps = simulation.cell_steps()?;
        if !limit.blocks.iter().any(|block| steps.contains_key(&(*block as usize))) {
            return Ok(Vec::new());
        }
        let mut shortest: Vec<(usize, f64)> = steps.into_iter().collect();
        shortest.sort_by(|a, b| a.1.total_cmp(&b.1));
        shortest.truncate(LISTED);
        let thinnest = thinnest_parts(simulation.model());
        let of = |(block, step): (usize, f64)| {
            Some(Self::new(simulation.model(), *thinnest.get(&block)?, step))
        };
        Ok(shortest.into_iter().filter_map(of).collect())
    }

    fn new(model: &Model, part: usize, step: f64) -> Self {
        let of = model.geometry().part(part);
        Self {
            block: model.whole_block(part) as u64,
            cell: of.map_or(0, |part| part.cell.into()),
            region: model.set_name(part),
            centroid: of.map_or([f64::NAN; 3], |part| part.centroid.into()),
            width: of.map_or(f64::NAN, |part| part.width),
            step,
        }
    }

    /// Head of a table of such blocks.
    pub(super) const HEAD: &str =
        "   block      cell     width m       step s  centroid of the cell m        region";
}

/// Line of the table.
impl fmt::Display for CellStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { block, cell, region, centroid: [x, y, z], width, step } = self;
        let at = format!("[{x:.3}, {y:.3}, {z:.3}]");
        write!(f, "{block:>8}  {cell:>8}  {width:>10.3e}  {step:>11.4e}  {at:<28}  {region}")
    }
}

/// Part of the thinnest cell of each whole block.
fn thinnest_parts(model: &Model) -> BTreeMap<usize, usize> {
    let mut thinnest: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
    for block in 0..model.n_blocks() {
        let Some(part) = model.geometry().part(block) else { continue };
        let known = thinnest.entry(model.whole_block(block)).or_insert((f64::INFINITY, block));
        if part.width < known.0 {
            *known = (part.width, block);
        }
    }
    thinnest.into_iter().map(|(whole, (_, part))| (whole, part)).collect()
}
