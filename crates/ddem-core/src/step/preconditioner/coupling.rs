//! Stiffness that couples a node with its partners across the gaps, and its inverse.

use nalgebra::SMatrix;

use super::MassContext;
use super::contact_masses::contact_diagonal;
use crate::error::RunError;
use crate::model::Model;
use ddem_mechanics::collide::FaceId;
use ddem_mesh::assembly::NO_TABLE;

/// Lattice steps of the partner across the directions of `part`.
pub(super) fn across(at: [usize; 3], part: usize, n: usize) -> [usize; 3] {
    [0, 1, 2].map(|d| if part & (1 << d) == 0 { at[d] } else { n - at[d] })
}

/// Block and lattice steps of a node's partner, if the node lies at these gaps and the partner
/// exists.
fn partner(
    model: &Model,
    block: usize,
    at: [usize; 3],
    part: usize,
) -> Option<(usize, [usize; 3])> {
    let n = model.geometry.topology(block).divisions();
    let mut offset = [0; 3];
    for d in (0..3).filter(|d| part & (1 << d) != 0) {
        offset[d] = match at[d] {
            0 => -1,
            i if i == n => 1,
            _ => return None,
        };
    }
    Some((model.geometry.neighbour(block, offset)?, across(at, part, n)))
}

/// Smallest number of a node and its partners across the gaps.
pub(super) fn first_member(model: &Model, block: usize, at: [usize; 3]) -> usize {
    let members = (0..8).filter_map(|part| partner(model, block, at, part));
    let numbers = members.map(|(block, at)| model.geometry.node(block, at));
    numbers.min().unwrap_or_else(|| model.geometry.node(block, at))
}

/// Row of a node in the inverse of its cluster's stiffness, by partner and component.
pub(super) fn inverse_row(
    around: MassContext<'_>,
    block: usize,
    at: [usize; 3],
) -> Result<[[f64; 3]; 8], RunError> {
    let MassContext { model, held, .. } = around;
    if model.geometry.part(block).is_some() {
        return Ok(row_of_part(around, block, at));
    }
    let members: [Option<(usize, [usize; 3])>; 8] =
        std::array::from_fn(|part| partner(model, block, at, part));
    let submatrices: [[[f64; 3]; 8]; 8] = std::array::from_fn(|part| match members[part] {
        Some((block, at)) => node_coupling(around, block, at),
        None => [[0.0; 3]; 8],
    });
    let is_held = |part: usize, c: usize| {
        members[part].is_none_or(|(block, at)| {
            held.get(&(model.geometry.node(block, at) as u32)).is_some_and(|axes| axes[c])
        })
    };
    let mut row = [[0.0; 3]; 8];
    for c in 0..3 {
        if is_held(0, c) {
            continue;
        }
        let free: [bool; 8] = std::array::from_fn(|part| !is_held(part, c));
        let matrix = SMatrix::<f64, 8, 8>::from_fn(|p, q| match (free[p] && free[q], p == q) {
            (true, _) => 0.5 * (submatrices[p][p ^ q][c] + submatrices[q][p ^ q][c]),
            (false, same) => f64::from(u8::from(same)),
        });
        let unit = SMatrix::<f64, 8, 1>::from_fn(|p, _| f64::from(u8::from(p == 0)));
        // Nodes of removed blocks have neither stiffness nor mass.
        if matrix[(0, 0)] == 0.0 {
            continue;
        }
        // A principal submatrix of a positive definite stiffness is positive definite, unless
        // rounding has cancelled the difference.
        let Some(solution) = matrix.cholesky().map(|factors| factors.solve(&unit)) else {
            let node = model.geometry.node(block, at);
            return Err(RunError::NoRelaxationMass { block, node });
        };
        (0..8).filter(|&p| free[p]).for_each(|p| row[p][c] = solution[p]);
    }
    Ok(row)
}

/// Row of a node of a part of a cell: the inverse of the stiffness diagonal of all nodes tied to it,
/// joints included.
fn row_of_part(around: MassContext<'_>, block: usize, at: [usize; 3]) -> [[f64; 3]; 8] {
    let MassContext { model, held, bonds, .. } = around;
    let mut row = [[0.0; 3]; 8];
    let node = model.geometry.node(block, at);
    let axes = held.get(&(node as u32)).copied().unwrap_or_default();
    let slot = model.node_slot(node);
    let inertia = &model.assembly.inertia[model.assembly.pack_inertia[slot.pack] as usize];
    let diagonal = inertia.moved_diagonal();
    for c in (0..3).filter(|&c| !axes[c]) {
        let own = diagonal[3 * slot.local(&model.packs) + c].0[slot.lane()];
        let stiffness = own + bonds.get(node).copied().unwrap_or_default();
        if stiffness > 0.0 {
            row[0][c] = 1.0 / stiffness;
        }
    }
    row
}

/// Diagonal of the stiffness at a node (r = 0) and its coupling with the partners.
fn node_coupling(around: MassContext<'_>, block: usize, at: [usize; 3]) -> [[f64; 3]; 8] {
    let MassContext { model, couplings, .. } = around;
    let n = model.geometry.topology(block).divisions();
    let mut sum = [[0.0; 3]; 8];
    // Element in each octant; a bit is set on the upper side of the node.
    for octant in 0..8 {
        let (mut offset, mut owner) = (0, [0; 3]);
        for d in 0..3 {
            let upper = octant & (1 << d) != 0;
            if upper && at[d] == n {
                offset |= 1 << d;
            } else if !upper && at[d] == 0 {
                offset |= 1 << d;
                owner[d] = -1;
            }
        }
        let Some(owner) = model.geometry.neighbour(block, owner) else { continue };
        let (pack, lane) = model.packs.slot(owner);
        let table = model.assembly.pack_tables[pack][offset];
        if table == NO_TABLE {
            continue;
        }
        let Some(element) = model.assembly.tables[table as usize].elements[lane] else { continue };
        // A node on the lower side of the element in its octant is the element's lower corner.
        let corner = 7 ^ octant;
        let coupling = &couplings[element as usize][corner];
        for part in (0..8).filter(|part| part & !offset == 0) {
            (0..3).for_each(|c| sum[part][c] += coupling[part][c]);
        }
    }
    spring_coupling(model, block, at, &mut sum);
    if let Some(contact_model) = around.contact_model {
        contact_diagonal(&around, contact_model, block, at, &mut sum[0]);
    }
    sum
}

/// Adds the stiffness of joints that are springs from the start.
fn spring_coupling(model: &Model, block: usize, at: [usize; 3], sum: &mut [[f64; 3]; 8]) {
    let topology = model.geometry.topology(block);
    for face in FaceId::all().filter(|&face| topology.is_on(face, at)) {
        let below = if face.upper { Some(block) } else { model.geometry.beyond(block, face) };
        let (d, Some(owner)) = (face.direction, below) else { continue };
        let (pack, lane) = model.packs.slot(owner);
        let Some(section) = model.sections.get(pack, d).filter(|section| section.springs[lane])
        else {
            continue;
        };
        let quarters = topology.quads_at(face, at) as f64;
        for (c, k) in section.diagonal(lane).into_iter().enumerate() {
            sum[0][c] += quarters * k;
            sum[1 << d][c] -= quarters * k;
        }
    }
}
