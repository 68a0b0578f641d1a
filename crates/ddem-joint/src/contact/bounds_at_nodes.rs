//! Upper bounds of the stiffness that joints and contacts add to the nodes of parts of cells.

use super::{BondedPatch, CombinedSurface, ContactBlock, ContactSurfaces};
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::law::SpringStiffness;
use ddem_mesh::{BlockFace, Geometry, quad_points};

/// Upper bounds of the stiffness `[N/m]` and coefficients of the dashpots `[N s/m]` that nonconforming
/// joints and, with the surfaces of `contacts`, contacts of the blocks that `meet` others add to the nodes
/// of the `wanted` blocks, by node. A contact replaces a joint, so that the larger ones count. Other nodes
/// may have any value.
pub fn bounds_at_nodes(
    bonded: &[BondedPatch],
    contacts: Option<&ContactSurfaces>,
    blocks: &[ContactBlock],
    geometry: &Geometry,
    wanted: &dyn Fn(usize) -> bool,
    meet: &dyn Fn(usize) -> bool,
) -> Vec<[f64; 2]> {
    let mut at_nodes = vec![[0.0; 2]; geometry.n_nodes];
    for joint in bonded {
        let patch = &joint.patch;
        let both = patch.blocks.map(|block| block as usize);
        if !both.into_iter().any(wanted) || both.iter().any(|&at| geometry.is_removed(at)) {
            continue;
        }
        let CombinedSurface { stiffness: SpringStiffness { normal, shear }, dashpot, .. } =
            patch.surface;
        for (node, area) in joint.node_areas(blocks, geometry) {
            add(&mut at_nodes[node], [normal.max(shear) * area, dashpot * area]);
        }
    }
    if let Some(surfaces) = contacts {
        let at_faces = at_faces(surfaces, blocks, geometry, &|block| wanted(block) && meet(block));
        for (most, of_contacts) in at_nodes.iter_mut().zip(at_faces) {
            (0..2).for_each(|k| most[k] = most[k].max(of_contacts[k]));
        }
    }
    at_nodes
}

fn add(sum: &mut [f64; 2], more: [f64; 2]) {
    (0..2).for_each(|k| sum[k] += more[k]);
}

/// Contacts on all faces of cells that no joined cell covers.
fn at_faces(
    surfaces: &ContactSurfaces,
    blocks: &[ContactBlock],
    geometry: &Geometry,
    wanted: &dyn Fn(usize) -> bool,
) -> Vec<[f64; 2]> {
    let mut at_nodes = vec![[0.0; 2]; geometry.n_nodes];
    let parts = (0..blocks.len()).filter(|&block| geometry.part(block).is_some() && wanted(block));
    for block in parts.filter(|&block| !geometry.is_removed(block)) {
        let first = geometry.blocks[block].first_node as usize;
        let n = geometry.topology(block).divisions();
        for face in outer_faces(geometry, block) {
            let [stiffness, dashpot] = surfaces.largest_at(block as u32, face);
            for element in (0..n).flat_map(|k| (0..n).map(move |i| [i, k])) {
                let nodes = geometry.topology(block).quad(face, element);
                let corners = blocks[block].part_quad(face, element).map(|(_, x)| x);
                for (shape, area) in quad_points(&corners) {
                    for (node, weight) in nodes.into_iter().zip(shape) {
                        let area = weight * area;
                        add(&mut at_nodes[first + node], [stiffness * area, dashpot * area]);
                    }
                }
            }
        }
    }
    at_nodes
}

/// Faces of a part that lie on the surface of its cell, and on no joined cell.
pub(super) fn outer_faces(geometry: &Geometry, block: usize) -> impl Iterator<Item = FaceId> + '_ {
    let lower = (0..3).map(|direction| FaceId { direction, upper: false });
    lower.filter(move |&face| {
        let outer = geometry.part(block).and_then(|part| part.faces[face.direction]);
        outer.is_some() && !is_covered(geometry, BlockFace { block, face })
    })
}

/// True if a face of a part lies on a joined cell: the node in the middle of the face of its cell is
/// tied to one of another cell.
fn is_covered(geometry: &Geometry, BlockFace { block, face }: BlockFace) -> bool {
    let topology = geometry.topology(block);
    let n = topology.divisions();
    let node = geometry.node(block, topology.on_face(face, [n, n])) as u32;
    let cell = |block: usize| geometry.part(block).map(|part| part.cell);
    let beyond = |&other: &u32| {
        let other = geometry.block_of(other as usize);
        cell(other) != cell(block) && !geometry.is_removed(other)
    };
    geometry.ties.with(node).iter().any(beyond)
}
