//! Displacements of the cells of a joint in the joint's frame, which rotates with the adjacent
//! blocks (§3, §4).

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use ddem_mechanics::element::corotation::{Frame, mean_rotation, minus_one};
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, load, load_at, scale, splat, store_at, sub, transposed_times,
};
use ddem_mesh::pack::{JointLattice, Neighbours, NodePair, Pack, Packs};

/// Positions of the nodes.
#[derive(Clone, Copy)]
pub struct NodePositions<'a> {
    /// Packs of the blocks.
    pub packs: &'a Packs,
    /// Displacements `[m]`.
    pub u: &'a [Lanes],
    /// Frames of the packs; `None` for small displacements.
    pub frames: Option<&'a [Frame]>,
}

/// Writes the displacements of the nodes of a joint lattice, in the joint's frame, to `local`.
/// Returns the rotation of the frame; `None` for small displacements. `edges` are the edges of one
/// element.
#[simd]
pub fn joint_displacements<S: Simd>(
    simd: S,
    moved: NodePositions<'_>,
    at: JointLattice,
    edges: &[[Lanes; 3]; 3],
    local: &mut [Lanes],
) -> Option<Matrix<S>> {
    let JointLattice { pack: index, offset } = at;
    let pack = &moved.packs.packs[index];
    let shape = moved.packs.shape_of(pack);
    let nodes = &shape.joints[offset];
    let mut sources = [NeighbourNodes::Own { first: 3 * pack.start }; 8];
    for part in (1..8).filter(|part| part & !offset == 0) {
        sources[part] = NeighbourNodes::new(moved.packs, pack, index, part);
    }
    for (node, local) in nodes.iter().zip(local.as_chunks_mut::<3>().0) {
        *local = sources[node.offset].displacement(moved.u, node.local);
    }
    let frames = moved.frames?;
    let mut sum = frames[index].matrix(simd);
    for part in (1..8).filter(|part| part & !offset == 0) {
        let [x, y, z] = &sources[part].rotation(frames, index);
        let other = [load(simd, x), load(simd, y), load(simd, z)];
        sum = [add(sum[0], other[0]), add(sum[1], other[1]), add(sum[2], other[2])];
    }
    let rotation = mean_rotation(simd, &sum, f64::from(1u32 << offset.count_ones()));
    let mean = load(simd, &frames[index].mean);
    turn(simd, &rotation, mean, edges, shape.dims(offset), local);
    Some(rotation)
}

/// Rotations of the two blocks of a face joint; `None` for small displacements.
#[inline(always)]
pub fn rotations<S: Simd>(
    simd: S,
    moved: NodePositions<'_>,
    at: JointLattice,
) -> Option<[Matrix<S>; 2]> {
    let JointLattice { pack: index, offset } = at;
    let frames = moved.frames?;
    let other = NeighbourNodes::new(moved.packs, &moved.packs.packs[index], index, offset);
    let [x, y, z] = &other.rotation(frames, index);
    Some([frames[index].matrix(simd), [load(simd, x), load(simd, y), load(simd, z)]])
}

/// Converts displacements of a lattice to those in a rotated frame, up to a constant:
/// `ũ = Rᵀ(u − ū) + (Rᵀ − 1) X`.
#[inline(always)]
pub fn turn<S: Simd>(
    simd: S,
    rotation: &Matrix<S>,
    mean: Vector<S>,
    edges: &[[Lanes; 3]; 3],
    dims: [usize; 3],
    local: &mut [Lanes],
) {
    // Change (Rᵀ − 1) h_d of each edge, and half the number of elements along it: line i is i minus
    // that many edges from the centre.
    let change = minus_one(simd, rotation);
    let [x, y, z] = edges;
    let edges = [
        transposed_times(&change, load(simd, x)),
        transposed_times(&change, load(simd, y)),
        transposed_times(&change, load(simd, z)),
    ];
    let (half_x, half_y, half_z) =
        (0.5 * dims[0] as f64, 0.5 * dims[1] as f64, 0.5 * dims[2] as f64);
    let mut at = 0;
    for k in 0..=dims[2] {
        let plane = scale(edges[2], splat(simd, k as f64 - half_z));
        for j in 0..=dims[1] {
            let row = add(plane, scale(edges[1], splat(simd, j as f64 - half_y)));
            for i in 0..=dims[0] {
                let shift = add(row, scale(edges[0], splat(simd, i as f64 - half_x)));
                let u = sub(load_at(simd, local, at), mean);
                store_at(local, at, add(transposed_times(rotation, u), shift));
                at += 3;
            }
        }
    }
}

/// Storage of the neighbours' nodes at one offset.
#[derive(Clone, Copy)]
enum NeighbourNodes {
    /// The pack itself: index of its first displacement.
    Own { first: usize },
    /// Four lanes of one pack, in order: the pack and the index of its first displacement.
    Aligned { pack: usize, first: usize },
    /// Any lanes: pack, index of its first displacement, and lane of each; the own block if there
    /// is no neighbour.
    Scattered { packs: [usize; LANES], first: [usize; LANES], lanes: [usize; LANES] },
}

impl NeighbourNodes {
    fn new(packs: &Packs, pack: &Pack, index: usize, offset: usize) -> Self {
        let neighbours: &Neighbours = &pack.upper[offset];
        if let Some(other) = neighbours.aligned() {
            return Self::Aligned { pack: other, first: 3 * packs.packs[other].start };
        }
        let (mut at, mut first, mut lanes) = ([0; LANES], [0; LANES], [0; LANES]);
        for lane in 0..LANES {
            (at[lane], lanes[lane]) = neighbours.at(lane).unwrap_or((index, lane));
            first[lane] = 3 * packs.packs[at[lane]].start;
        }
        Self::Scattered { packs: at, first, lanes }
    }

    /// Displacement of a node.
    #[inline(always)]
    fn displacement(&self, u: &[Lanes], local: usize) -> [Lanes; 3] {
        match self {
            Self::Own { first } | Self::Aligned { first, .. } => {
                let at = first + 3 * local;
                [u[at], u[at + 1], u[at + 2]]
            }
            Self::Scattered { first, lanes, .. } => {
                let mut out = [Lanes::ZERO; 3];
                for lane in 0..LANES {
                    let from = &u[first[lane] + 3 * local..][..3];
                    for c in 0..3 {
                        out[c].0[lane] = from[c].0[lanes[lane] % LANES];
                    }
                }
                out
            }
        }
    }

    fn rotation(&self, frames: &[Frame], own: usize) -> [[Lanes; 3]; 3] {
        match self {
            Self::Own { .. } => frames[own].rotation,
            Self::Aligned { pack, .. } => frames[*pack].rotation,
            Self::Scattered { packs, lanes, .. } => {
                let mut out = [[Lanes::ZERO; 3]; 3];
                for lane in 0..LANES {
                    let from = &frames[packs[lane]].rotation;
                    for (out, from) in out.iter_mut().flatten().zip(from.iter().flatten()) {
                        out.0[lane] = from.0[lanes[lane] % LANES];
                    }
                }
                out
            }
        }
    }
}

/// Converts displacements of the corners of a face to those at the centres of its quarters. Pairs
/// between rigid blocks lie there (§8, eq. (1)). Forces at these points are converted to the
/// corners by the same weights, 9/16, 3/16, 3/16 and 1/16.
#[simd]
pub fn to_quarters<S: Simd>(simd: S, node_pairs: Option<&[NodePair]>, field: &mut [Lanes]) {
    let Some(node_pairs) = node_pairs else { return };
    for side in 0..2 {
        let corner: [usize; 4] = std::array::from_fn(|p| 3 * node_pairs[p].sides[side]);
        let old = corner.map(|at| load_at(simd, field, at));
        for (p, at) in corner.into_iter().enumerate() {
            let beside = add(old[p ^ 1], old[p ^ 2]);
            let sum = add(scale(old[p], splat(simd, 9.0)), scale(beside, splat(simd, 3.0)));
            store_at(field, at, scale(add(sum, old[p ^ 3]), splat(simd, 1.0 / 16.0)));
        }
    }
}
