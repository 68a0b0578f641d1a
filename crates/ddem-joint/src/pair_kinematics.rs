//! Displacements of the two sides of a face joint relative to each other, pair by pair, along the
//! joint's axes, which rotate with the adjacent blocks (§5). Forces of pairs go the same way back.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use super::kinematics::{NodePositions, NodeSource, Ordered, Scattered};
use ddem_mechanics::element::corotation::minus_one;
use ddem_mechanics::math::lanes::{
    Lanes, Matrix, Vector, add, load, load_at, product, scale, splat, splat_matrix, store_at, sub,
    times, transposed_times, zero,
};
use ddem_mesh::joint_sections::{FaceLattice, JointSection};
use ddem_mesh::numbering::NodePair;
use ddem_mesh::pack::JointLattice;

/// Axes of a face joint in its present rotation.
#[derive(Clone, Copy)]
pub struct PairFrame<S: Simd> {
    /// Axes as columns: the normal from side a to side b, and two tangents.
    pub axes: Matrix<S>,
    /// Displacement of side b relative to side a along the axes that their rotation alone causes, if
    /// the nodes do not move `[m]`.
    shift: Vector<S>,
}

impl<S: Simd> PairFrame<S> {
    /// Frame of a joint whose frame has a rotation to global axes; `None` for small displacements.
    #[inline(always)]
    pub fn new(simd: S, section: &JointSection, rotation: Option<&Matrix<S>>) -> Self {
        let axes = lane_axes(simd, section);
        let Some(rotation) = rotation else { return Self { axes, shift: zero(simd) } };
        let change = transposed_times(&minus_one(simd, rotation), load(simd, section.gap()));
        Self { axes: product(rotation, &axes), shift: transposed_times(&axes, change) }
    }

    /// Vector from side a to side b along the axes `[m]`. It rotates with them.
    #[inline(always)]
    pub fn gap(simd: S, section: &JointSection) -> Vector<S> {
        transposed_times(&lane_axes(simd, section), load(simd, section.gap()))
    }

    /// The same axes for vectors that the rotation of the joint does not change: velocities.
    #[inline(always)]
    pub fn of_rates(self, simd: S) -> Self {
        Self { shift: zero(simd), ..self }
    }
}

/// Axes of a joint at rest in all lanes, as columns.
#[inline(always)]
pub fn lane_axes<S: Simd>(simd: S, section: &JointSection) -> Matrix<S> {
    splat_matrix(simd, &section.axes)
}

/// Writes the displacements of side b relative to side a of the pairs of a face joint, along its
/// axes, to `relative`, three numbers for each pair `[m]`.
#[simd]
pub fn relative_displacements<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    at: JointLattice,
    face: FaceLattice<'_>,
    frame: &PairFrame<S>,
    relative: &mut [Lanes],
) {
    let pack = &moved.packs.packs[at.pack];
    let (own, neighbours) = (moved.nodes(at.pack), &pack.upper[at.offset]);
    let to = relative.as_chunks_mut::<3>().0;
    match neighbours.in_order() {
        None => {
            let upper = Scattered::new(moved, at.pack, neighbours);
            differences(simd, frame, face.node_pairs, own, &upper, to);
        }
        Some(run) => {
            let [low, high] = run.packs().map(|pack| moved.nodes(pack));
            let pairs = face.node_pairs;
            match run.shift {
                0 => differences(simd, frame, pairs, own, &Ordered::<0> { low, high }, to),
                1 => differences(simd, frame, pairs, own, &Ordered::<1> { low, high }, to),
                2 => differences(simd, frame, pairs, own, &Ordered::<2> { low, high }, to),
                _ => differences(simd, frame, pairs, own, &Ordered::<3> { low, high }, to),
            }
        }
    }
    if pack.rigid {
        to_quarters(simd, relative);
    }
}

/// Writes the relative displacements of pairs from those of the nodes on both sides.
#[inline(always)]
fn differences<S: Simd>(
    simd: S,
    frame: &PairFrame<S>,
    node_pairs: &[NodePair],
    own: &[[Lanes; 3]],
    upper: &impl NodeSource<S>,
    relative: &mut [[Lanes; 3]],
) {
    for (node_pair, relative) in node_pairs.iter().zip(relative) {
        let [a, b] = node_pair.in_blocks;
        let difference = sub(upper.displacement(simd, b), load(simd, &own[a]));
        *relative = add(transposed_times(&frame.axes, difference), frame.shift).map(Lanes::from);
    }
}

/// Adds the forces of pairs on side a, along the joint's axes `[N]`, to the nodes of side a, and
/// subtracts them from those of side b; `overwrites` if these have no forces yet.
#[simd]
pub fn give_pair_forces<S: Simd>(
    simd: S,
    axes: &Matrix<S>,
    node_pairs: &[NodePair],
    forces: &[Lanes],
    [own, neighbour_forces]: [&mut [Lanes]; 2],
    overwrites: bool,
) {
    let (own, upper) = (own.as_chunks_mut::<3>().0, neighbour_forces.as_chunks_mut::<3>().0);
    for (node_pair, force) in node_pairs.iter().zip(forces.as_chunks::<3>().0) {
        let force = times(axes, load(simd, force));
        let a = &mut own[node_pair.in_blocks[0]];
        *a = add(load(simd, a), force).map(Lanes::from);
        let b = &mut upper[node_pair.in_neighbour_forces];
        let before = if overwrites { zero(simd) } else { load(simd, b) };
        *b = sub(before, force).map(Lanes::from);
    }
}

/// Converts the displacements of the corners of a face between rigid blocks to those at the centres
/// of its quarters, where the pairs lie (§8, eq. (1)). Forces at these points are converted to the
/// corners by the same weights, 9/16, 3/16, 3/16 and 1/16.
#[simd]
pub fn to_quarters<S: Simd>(simd: S, pairs: &mut [Lanes]) {
    let mut old = [zero(simd); 4];
    for (p, old) in old.iter_mut().enumerate() {
        *old = load_at(simd, pairs, 3 * p);
    }
    for p in 0..4 {
        let beside = add(old[p ^ 1], old[p ^ 2]);
        let sum = add(scale(old[p], splat(simd, 9.0)), scale(beside, splat(simd, 3.0)));
        store_at(pairs, 3 * p, scale(add(sum, old[p ^ 3]), splat(simd, 1.0 / 16.0)));
    }
}
