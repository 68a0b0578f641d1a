//! Checks of boundary faces: no part of a face may belong to two boundaries, and walls of cavities
//! give a warning.

use std::collections::{BTreeMap, BTreeSet};

use ddem_core::problem::{BlockFace, Geometry};
use ddem_core::{ErrorCode, Fault, Problem, counted};

use super::at_stage;
use super::charge::is_wall;
use super::geometry::{Selector, free_centres};
use super::rock::{CellWalls, cell_face};
use crate::lint::{Code, Diagnostic};
use crate::schema::Deck;

/// Largest share of a face that several boundaries may have in total; a larger share is an overlap.
const WHOLE: f64 = 1.0 + 1e-6;

fn shown(geometry: &Geometry, face: &BlockFace) -> String {
    // Other cells may cover the centre of a face.
    let centre = free_centres(geometry, face).first().copied();
    let centre = centre.unwrap_or_else(|| face.centre(geometry));
    let [x, y, z] = <[f64; 3]>::from(centre).map(|x| (x * 1e6).round() / 1e6);
    format!("({x}, {y}, {z})")
}

/// Faults of boundaries that share a part of a face: their dashpots would add up.
pub(super) fn twice(deck: &Deck, problem: &Problem) -> Vec<Fault> {
    let Problem { boundaries, stages, .. } = problem;
    let mut found: BTreeMap<(usize, usize), BlockFace> = BTreeMap::new();
    for stage in 0..deck.stage.len().max(1) {
        let mut claimed: BTreeMap<BlockFace, (usize, [f64; 2])> = BTreeMap::new();
        for index in (0..boundaries.list.len()).filter(|&index| boundaries.has(index, stage)) {
            for (face, areas) in &boundaries.list[index].faces {
                let Some((before, [sum, whole])) = claimed.get_mut(face) else {
                    claimed.insert(*face, (index, *areas));
                    continue;
                };
                let [area, all] = areas;
                *sum += area;
                // A face beside a removed block lacks half of the joint, so the larger area counts.
                *whole = whole.max(*all);
                if *sum > WHOLE * *whole {
                    found.entry((*before, index)).or_insert(*face);
                }
            }
        }
    }
    let geometry_of = |index: usize| at_stage(deck, stages, deck.boundary[index].from.as_ref());
    let fault = |((before, index), face): ((usize, usize), BlockFace)| {
        let at = shown(geometry_of(index), &face);
        let message = format!(
            "takes faces that boundary {before} has, first that at {at}: their dashpots would add up"
        );
        Fault::new(ErrorCode::InvalidBoundary, format!("boundary[{index}].where"), message).help(
            "give each part of the surface one boundary at a time, by `where`, `from` and `until`",
        )
    };
    found.into_iter().map(fault).collect()
}

/// Warnings about boundaries on walls of cavities, behind which there is no rock.
pub(super) fn in_cavities(deck: &Deck, problem: &Problem, walls: &CellWalls) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    for (index, boundary) in problem.boundaries.list.iter().enumerate() {
        let geometry = at_stage(deck, &problem.stages, deck.boundary[index].from.as_ref());
        // A range may end at the edge of a face.
        let acts = boundary.faces.iter().filter(|(_, [area, _])| *area > 0.0);
        let faces = acts.map(|(face, _)| face);
        let is_wall = |face: &&BlockFace| is_wall(geometry, face) || walls.has(geometry, face);
        let within: Vec<&BlockFace> = faces.filter(is_wall).collect();
        // The parts of a cell have one face together.
        let of_cells: BTreeSet<_> = within.iter().filter_map(|f| cell_face(geometry, f)).collect();
        let of_blocks = within.iter().filter(|face| geometry.part(face.block).is_none()).count();
        if let Some(first) = within.first() {
            let message = format!(
                "it acts on {} in cavities, the first at {}: there is no rock behind them",
                counted(of_cells.len() + of_blocks, "face"),
                shown(geometry, first)
            );
            let at = format!("boundary[{index}].where");
            let help = "limit `where` to the outside of the model, for example by a plane";
            warnings.push(Diagnostic::warning(Code::WallsInBoundary, at, message, help));
        }
    }
    warnings
}

/// Faces with two areas `[m²]`: of the part that a `where` selects, and of the whole face.
pub(super) fn with_areas(
    (selector, everywhere): (&Selector, &Selector),
    geometry: &Geometry,
    surfaces: &[BlockFace],
) -> Vec<(BlockFace, [f64; 2])> {
    let area = |selector: &Selector, face: &BlockFace| {
        selector.areas(geometry, face).iter().map(|(_, area)| area).sum()
    };
    let areas = |face: &BlockFace| [area(selector, face), area(everywhere, face)];
    surfaces.iter().map(|face| (*face, areas(face))).collect()
}
