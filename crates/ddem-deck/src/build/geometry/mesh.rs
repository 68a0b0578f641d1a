//! Sets of blocks that are given as hexahedra.

use std::collections::HashMap;
use std::sync::Arc;

use ddem_core::problem::{Geometry, HexMesh, Lattice, MeshBlock, MeshFaces};
use ddem_core::{ErrorCode, Fault};

use super::Names;
use crate::schema::{BlockMesh, Body, Deck, JointChoice};

/// Blocks of a mesh, in the order of their numbers.
fn blocks(index: usize, mesh: &BlockMesh) -> Result<Vec<MeshBlock>, Fault> {
    let BlockMesh { nodes, hexes, blocks, .. } = mesh.clone();
    let found = HexMesh { nodes, hexes, blocks }.parallelepipeds();
    found.map_err(|error| {
        Fault::new(ErrorCode::InvalidMesh, format!("blocks[{index}].mesh"), error.to_string())
    })
}

/// Lattices of a set given as a mesh: a lattice of one cell for each block.
pub(super) fn lattices(
    (deck, index): (&Deck, usize),
    mesh: &BlockMesh,
    names: &Names,
) -> Result<Vec<Arc<Lattice>>, Vec<Fault>> {
    let (set, number) = (&deck.blocks[index], deck.set_number(index));
    let material = names.material_of(&set.material);
    let joint = match &set.joint {
        Some(JointChoice::All(name)) => Some(names.joint_of(name)),
        _ => None,
    };
    let lattice = |block: &MeshBlock| {
        let mut lattice = block.lattice(number, material, set.body == Body::Rigid);
        if let Some(joint) = joint {
            lattice.joint = [0; 3].map(|_| vec![joint].into());
            lattice.own_joint = [joint; 3];
        }
        Arc::new(lattice)
    };
    let blocks = blocks(index, mesh).map_err(|fault| vec![fault])?;
    Ok(blocks.iter().map(lattice).collect())
}

/// Joints given for pairs of blocks, each with its place in the deck.
pub(super) type Given = HashMap<[u32; 2], (u16, String)>;

/// Joints given for single pairs of faces, by their blocks.
pub(super) fn joints(geometry: &Geometry, deck: &Deck, names: &Names) -> Result<Given, Vec<Fault>> {
    let (mut joints, mut faults) = (HashMap::new(), Vec::new());
    for (index, set) in deck.blocks.iter().enumerate() {
        let Some(mesh) = set.mesh.as_ref().filter(|mesh| !mesh.joints.is_empty()) else { continue };
        let found = blocks(index, mesh).map_err(|fault| vec![fault])?;
        let faces = MeshFaces::new(&found);
        // Refined blocks are in lattices of their own, after all others.
        let number = deck.set_number(index);
        let first = geometry.lattices.iter().position(|lattice| lattice.set == number).unwrap_or(0);
        for (k, entry) in mesh.joints.iter().enumerate() {
            let place = format!("blocks[{index}].mesh.joints[{k}]");
            let [Some((a, _)), Some((b, _))] = entry.faces.map(|quad| faces.of(quad)) else {
                let message = "four of the nodes are not on one face of a block";
                faults.push(Fault::new(ErrorCode::InvalidMesh, format!("{place}.faces"), message));
                continue;
            };
            let block = |block: usize| geometry.lattices[first + block].block[0];
            let mut pair = [block(a), block(b)];
            pair.sort_unstable();
            if let Some(joint) = names.joint(&entry.joint) {
                joints.insert(pair, (joint, place));
            }
        }
    }
    if faults.is_empty() { Ok(joints) } else { Err(faults) }
}

/// Faults of joints between single pairs of faces that join nothing although both blocks exist.
pub(super) fn unmatched_joints(geometry: &Geometry, given: Given) -> Vec<Fault> {
    let exists = |block: &u32| (*block as usize) < geometry.blocks.len();
    let alone = given
        .into_iter()
        .filter(|(blocks, _)| blocks.iter().all(exists) && geometry.joint_of(*blocks).is_none());
    let mut places: Vec<String> = alone.map(|(_, (_, place))| place).collect();
    places.sort();
    let fault = |place: String| {
        let message = "the two faces do not face each other";
        let help = "they must face each other and touch, or be as far apart as the joint is thick";
        Fault::new(ErrorCode::InvalidMesh, format!("{place}.faces"), message).help(help)
    };
    places.into_iter().map(fault).collect()
}
