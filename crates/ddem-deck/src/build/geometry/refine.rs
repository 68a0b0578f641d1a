//! Refinement: blocks are split along each edge, and a finer lattice takes the place of coarser
//! blocks.
//!
//! The finer lattice has the planes of the coarser one and others between them, so that blocks of
//! both keep the gaps of the joints between them. Cells of unsplit blocks are `ELSEWHERE` in the
//! finer lattice, and cells of split blocks are `ELSEWHERE` in the coarser one.

use std::sync::Arc;

use super::Names;
use super::empty_selection::{no_block, nothing};
use super::lattice::{MOST_NODES, too_many};
use super::selector::Selector;
use crate::schema::Deck;
use crate::schema::names::segment;
use ddem_core::problem::{ELSEWHERE, Lattice, NO_JOINT, Pages};
use ddem_core::{ErrorCode, Fault};

/// Largest number of cells in the lattices of one `[[refine]]`, with or without split blocks.
const MOST_CELLS: f64 = 1e8;

/// Smallest ratio of a refined edge to the thickness of the joint across it.
const THICKEST: f64 = 4.0;

/// Splits the selected blocks of all lattices. Returns the fault of the entry `index`, if there is
/// one; the error is a number of nodes that is too large to continue.
pub(super) fn refine(
    lattices: &mut Vec<Arc<Lattice>>,
    selector: &Selector,
    (index, factor): (usize, u32),
) -> Result<Option<Fault>, Vec<Fault>> {
    let selected: Vec<Vec<usize>> = lattices
        .iter()
        .map(|lattice| {
            let chosen =
                |&at: &usize| lattice.has_block(at) && selector.selects(lattice, lattice.cell(at));
            let cells = (0..lattice.block.len()).filter(chosen);
            if selector.has_set(lattice.set) { cells.collect() } else { Vec::new() }
        })
        .collect();
    if selected.iter().all(Vec::is_empty) {
        let fault = nothing(format!("refine[{index}].where"), "no block");
        return Ok(Some(no_block(fault, selector, lattices)));
    }
    let nodes = |lattice: &Lattice, cells: f64| cells * lattice.nodes_per_block() as f64;
    let kept = lattices
        .iter()
        .map(|l| nodes(l, (0..l.block.len()).filter(|&at| l.has_block(at)).count() as f64));
    let added = lattices.iter().zip(&selected).map(|(lattice, cells)| {
        nodes(lattice, (f64::from(factor).powi(3) - 1.0) * cells.len() as f64)
    });
    let all: f64 = kept.chain(added).sum();
    if all >= MOST_NODES {
        return Err(too_many(format!("refine[{index}].factor"), all));
    }
    let boxes =
        lattices.iter().zip(&selected).map(|(l, cells)| around(l, cells, factor as usize).2);
    let boxes: f64 = boxes.map(|count| count.iter().map(|&n| n as f64).product::<f64>()).sum();
    if boxes >= MOST_CELLS {
        let message = format!(
            "the boxes around the split blocks would have {boxes:.1e} cells; at most {MOST_CELLS:e} are possible"
        );
        return Ok(Some(Fault::new(ErrorCode::TooLarge, format!("refine[{index}].where"), message).help(
            "use several `[[refine]]` for blocks that lie far apart or in an oblique row, or a smaller `factor`",
        )));
    }
    for (at, cells) in selected.iter().enumerate().filter(|(_, cells)| !cells.is_empty()) {
        if lattices[at].joint.iter().any(|joint| joint.contains(&NO_JOINT)) {
            let message = format!(
                "split blocks need a joint between their parts: blocks[{}] has none",
                lattices[at].set
            );
            return Ok(Some(
                Fault::new(ErrorCode::MissingKey, format!("refine[{index}]"), message)
                    .help("name it with `joint` in that `[[blocks]]`"),
            ));
        }
        let mut finer = split(&lattices[at], cells, factor as usize);
        finer.refined = Some(index);
        let coarser = Arc::make_mut(&mut lattices[at]);
        cells.iter().for_each(|&cell| coarser.block[cell] = ELSEWHERE);
        lattices.push(Arc::new(finer));
    }
    Ok(None)
}

/// Box around some cells, enlarged by one cell on each side within the lattice: its first cells,
/// the cells after its last, and its numbers of cells after splitting.
fn around(
    lattice: &Lattice,
    cells: &[usize],
    factor: usize,
) -> ([usize; 3], [usize; 3], [usize; 3]) {
    if cells.is_empty() {
        return ([0; 3], [0; 3], [0; 3]);
    }
    let mut range = [[usize::MAX, 0]; 3];
    for cell in cells.iter().map(|&at| lattice.cell(at)) {
        for d in 0..3 {
            range[d] = [range[d][0].min(cell[d]), range[d][1].max(cell[d])];
        }
    }
    let from = range.map(|[low, _]| low.saturating_sub(1));
    let to = [0, 1, 2].map(|d| (range[d][1] + 2).min(lattice.count[d]));
    (from, to, [0, 1, 2].map(|d| (to[d] - from[d]) * factor))
}

/// Finer lattice of some cells, with one more cell on each side within the lattice.
fn split(lattice: &Lattice, cells: &[usize], factor: usize) -> Lattice {
    let (from, to, count) = around(lattice, cells, factor);
    let lengths = [0, 1, 2].map(|d| {
        let coarse = (from[d]..to[d]).map(|cell| lattice.lengths[d][cell] / factor as f64);
        coarse.flat_map(|length| std::iter::repeat_n(length, factor)).collect()
    });
    let cuts = [0, 1, 2].map(|d| {
        let at = |i: usize| {
            let (cell, part) = (from[d] + i / factor, i % factor);
            let low = lattice.cuts[d][cell];
            if part == 0 {
                low
            } else {
                low + lattice.lengths[d][cell] * part as f64 / factor as f64
            }
        };
        (0..=count[d]).map(at).collect()
    });
    let mut finer = Lattice {
        count,
        cuts,
        lengths,
        gaps: count.map(|n| vec![0.0; n + 1]),
        block: Pages::default(),
        material: Arc::default(),
        joint: std::array::from_fn(|_| Arc::default()),
        ..lattice.clone()
    };
    let chosen: std::collections::BTreeSet<usize> = cells.iter().copied().collect();
    let (mut block, mut material, mut joint) = (Vec::new(), Vec::new(), [const { Vec::new() }; 3]);
    for at in 0..count.iter().product() {
        let cell = finer.cell(at);
        let coarse = lattice.index([0, 1, 2].map(|d| from[d] + cell[d] / factor));
        block.push(if chosen.contains(&coarse) { 0 } else { ELSEWHERE });
        material.push(lattice.material[coarse]);
        (0..3).for_each(|d| joint[d].push(lattice.joint[d][coarse]));
    }
    finer.block = block.into();
    (finer.material, finer.joint) = (Arc::new(material), joint.map(Arc::new));
    finer
}

/// Fault of a refined lattice whose blocks are hardly larger than the joints between them.
pub(super) fn too_fine(lattice: &Lattice, deck: &Deck, names: &Names) -> Option<Fault> {
    let index = lattice.refined?;
    let thickness: Vec<f64> = deck.joints.values().map(|joint| joint.thickness).collect();
    let blocks = (0..lattice.block.len()).filter(|&at| lattice.has_block(at));
    let mut edges = blocks.flat_map(|at| {
        let cell = lattice.cell(at);
        [0, 1, 2].map(|d| (lattice.lengths[d][cell[d]], lattice.joint[d][at]))
    });
    let (edge, joint) = edges.find(|&(edge, joint)| edge < THICKEST * thickness[joint as usize])?;
    let message = format!(
        "{} parts leave blocks of {edge:.3e} m, less than four times the thickness of joint `{}`, {} m",
        deck.refine[index].factor,
        names.joint_name(joint),
        thickness[joint as usize]
    );
    Some(Fault::new(ErrorCode::ThickJoint, format!("refine[{index}].factor"), message).help(
        format!(
            "a smaller factor, or a smaller joints.{}.thickness",
            segment(names.joint_name(joint))
        ),
    ))
}
