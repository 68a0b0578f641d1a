//! Displacements of the cells of a joint in the joint's frame, which rotates with the adjacent
//! blocks (§3, §4).

use fearless_simd::{Select, Simd};
use fearless_simd_macros::simd;

use ddem_mechanics::element::corotation::{Frame, mean_rotation, minus_one};
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, cross, load, scale, shifted, splat, sub, times,
    transposed_times, zero,
};
use ddem_mesh::numbering::{BlockPart, Slots};
use ddem_mesh::pack::{JointLattice, LaneRun, Neighbours, Packs};
use ddem_mesh::parallel::node_start;

/// Positions of the nodes.
#[derive(Clone, Copy)]
pub struct NodePositions<'a> {
    /// Packs of the blocks.
    pub packs: &'a Packs,
    /// Pack with which `u` and `frames` begin.
    pub first: usize,
    /// Displacements `[m]`.
    pub u: &'a [Lanes],
    /// Frames of the packs; `None` for small displacements.
    pub frames: Option<&'a [Frame]>,
}

impl<'a> NodePositions<'a> {
    /// Displacements of the nodes of a pack.
    #[inline(always)]
    pub fn nodes(&self, pack: usize) -> &'a [[Lanes; 3]] {
        let at = |pack| node_start(self.packs, pack) - node_start(self.packs, self.first);
        self.u[at(pack)..at(pack + 1)].as_chunks::<3>().0
    }

    /// Frame of a pack; `None` for small displacements.
    #[inline(always)]
    pub fn frame(&self, pack: usize) -> Option<&'a Frame> {
        self.frames.map(|frames| &frames[pack - self.first])
    }
}

/// Frame of a lattice, in which its displacements are small: `ũ = Rᵀ(u − ū) + (Rᵀ − 1) X`.
#[derive(Clone, Copy)]
pub struct LocalFrame<S: Simd> {
    /// Rotation R from the frame to global axes.
    rotation: Matrix<S>,
    /// Mean displacement ū; any constant will do for the forces.
    mean: Vector<S>,
    /// Change `(Rᵀ − 1) h_d` of the edge of an element along each direction.
    edges: [Vector<S>; 3],
}

impl<S: Simd> LocalFrame<S> {
    /// Frame of a lattice of elements with some edges.
    #[inline(always)]
    pub fn new(simd: S, rotation: Matrix<S>, mean: &[Lanes; 3], edges: &[[Lanes; 3]; 3]) -> Self {
        let change = minus_one(simd, &rotation);
        let [x, y, z] = edges;
        let edges = [
            transposed_times(&change, load(simd, x)),
            transposed_times(&change, load(simd, y)),
            transposed_times(&change, load(simd, z)),
        ];
        Self { rotation, mean: load(simd, mean), edges }
    }
}

/// Displacements of the nodes of blocks, one block in each lane.
pub(super) trait NodeSource<S: Simd> {
    /// Displacement of a node, by its number in the block `[m]`.
    fn displacement(&self, simd: S, node: usize) -> Vector<S>;
}

/// Blocks in four lanes in order, of one pack or of two.
pub(super) struct Ordered<'a, const SHIFT: usize> {
    pub(super) low: &'a [[Lanes; 3]],
    pub(super) high: &'a [[Lanes; 3]],
}

/// Blocks in any lanes.
pub(super) struct Scattered<'a> {
    blocks: [&'a [[Lanes; 3]]; LANES],
    lanes: [usize; LANES],
}

impl<'a> Scattered<'a> {
    /// Neighbours of a pack; a lane without a neighbour takes its own block.
    pub(super) fn new(moved: &NodePositions<'a>, index: usize, neighbours: &Neighbours) -> Self {
        let (mut blocks, mut lanes) = ([moved.nodes(index); LANES], [0, 1, 2, 3]);
        for lane in 0..LANES {
            if let Some((pack, there)) = neighbours.at(lane) {
                (blocks[lane], lanes[lane]) = (moved.nodes(pack), there);
            }
        }
        Self { blocks, lanes }
    }
}

impl<S: Simd, const SHIFT: usize> NodeSource<S> for Ordered<'_, SHIFT> {
    #[inline(always)]
    fn displacement(&self, simd: S, node: usize) -> Vector<S> {
        let low = load(simd, &self.low[node]);
        if SHIFT == 0 { low } else { shifted::<S, SHIFT>(low, load(simd, &self.high[node])) }
    }
}

impl<S: Simd> NodeSource<S> for Scattered<'_> {
    #[inline(always)]
    fn displacement(&self, simd: S, node: usize) -> Vector<S> {
        let mut out = [Lanes::ZERO; 3];
        for lane in 0..LANES {
            let from = &self.blocks[lane][node];
            for c in 0..3 {
                out[c].0[lane] = from[c].0[self.lanes[lane] % LANES];
            }
        }
        load(simd, &out)
    }
}

/// Writes the displacements of the nodes of a joint lattice, in the joint's frame, to `local`.
/// Returns the rotation of the frame; `None` for small displacements. `edges` are the edges of one
/// element.
#[simd]
pub fn joint_displacements<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    at: JointLattice,
    edges: &[[Lanes; 3]; 3],
    local: &mut [Lanes],
) -> Option<Matrix<S>> {
    let (Some(frame), Some(rotation)) = (moved.frame(at.pack), joint_rotation(simd, moved, at))
    else {
        displacements_in(simd, moved, at, None, local);
        return None;
    };
    let frame = LocalFrame::new(simd, rotation, &frame.mean, edges);
    displacements_in(simd, moved, at, Some(&frame), local);
    Some(rotation)
}

/// Rotation of the frame of a joint lattice to global axes, the mean of those of its blocks; `None`
/// for small displacements.
#[inline(always)]
pub fn joint_rotation<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    at: JointLattice,
) -> Option<Matrix<S>> {
    let frame = moved.frame(at.pack)?;
    let pack = &moved.packs.packs[at.pack];
    let parts = &moved.packs.numbering_of(pack).parts[at.offset];
    let mut sum = frame.matrix(simd);
    for part in &parts[1..] {
        let other = rotation(simd, moved, frame, &pack.upper[part.offset]);
        sum = [add(sum[0], other[0]), add(sum[1], other[1]), add(sum[2], other[2])];
    }
    Some(mean_rotation(simd, &sum, parts.len() as f64))
}

/// Writes the displacements of the nodes of a joint lattice, in a frame, to `local`.
#[inline(always)]
fn displacements_in<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    at: JointLattice,
    frame: Option<&LocalFrame<S>>,
    local: &mut [Lanes],
) {
    let JointLattice { pack: index, offset } = at;
    let pack = &moved.packs.packs[index];
    let local = local.as_chunks_mut::<3>().0;
    let own = LaneRun::of(index);
    for part in &moved.packs.numbering_of(pack).parts[offset] {
        let neighbours = &pack.upper[part.offset];
        let run = if part.offset == 0 { Some(&own) } else { neighbours.in_order() };
        match run {
            Some(run) => ordered_displacements(simd, moved, frame, run, part, local),
            None => scattered_displacements(simd, moved, frame, index, neighbours, part, local),
        }
    }
}

/// Writes the displacements of the nodes of four blocks, in a frame, to `local`; see
/// [`joint_displacements`].
#[simd]
pub fn ordered_displacements<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    frame: Option<&LocalFrame<S>>,
    run: &LaneRun,
    part: &BlockPart,
    local: &mut [[Lanes; 3]],
) {
    let [low, high] = run.packs().map(|pack| moved.nodes(pack));
    match run.shift {
        0 => transform(simd, frame, &Ordered::<0> { low, high }, part, local),
        1 => transform(simd, frame, &Ordered::<1> { low, high }, part, local),
        2 => transform(simd, frame, &Ordered::<2> { low, high }, part, local),
        _ => transform(simd, frame, &Ordered::<3> { low, high }, part, local),
    }
}

/// Writes the displacements of the nodes of the neighbours of a pack in any lanes, in a frame, to
/// `local`.
#[simd]
fn scattered_displacements<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    frame: Option<&LocalFrame<S>>,
    index: usize,
    neighbours: &Neighbours,
    part: &BlockPart,
    local: &mut [[Lanes; 3]],
) {
    let source = Scattered::new(moved, index, neighbours);
    transform(simd, frame, &source, part, local);
}

/// Converts displacements to those in a frame.
#[inline(always)]
fn transform<S: Simd>(
    simd: S,
    frame: Option<&LocalFrame<S>>,
    source: &impl NodeSource<S>,
    part: &BlockPart,
    local: &mut [[Lanes; 3]],
) {
    let [from, to] = [part.in_block, part.in_lattice].map(|slots| slots.step[0]);
    let Some(LocalFrame { rotation, mean, edges }) = frame else {
        for [j, k] in part.rows() {
            let (first, slot) = (part.in_block.row(j, k), part.in_lattice.row(j, k));
            for i in 0..part.count[0] {
                let u = source.displacement(simd, first + i * from);
                local[slot + i * to] = u.map(Lanes::from);
            }
        }
        return;
    };
    let [along, beside, above] = part.axes.map(|axis| edges[axis]);
    let mut start = zero(simd);
    for (edge, steps) in edges.iter().zip(part.start) {
        start = add(start, scale(*edge, splat(simd, steps)));
    }
    for [j, k] in part.rows() {
        let (first, slot) = (part.in_block.row(j, k), part.in_lattice.row(j, k));
        let row = add(scale(beside, splat(simd, j as f64)), scale(above, splat(simd, k as f64)));
        let mut shift = add(start, row);
        for i in 0..part.count[0] {
            let u = sub(source.displacement(simd, first + i * from), *mean);
            local[slot + i * to] = add(transposed_times(rotation, u), shift).map(Lanes::from);
            shift = add(shift, along);
        }
    }
}

/// Nodal forces that take those of a lattice.
pub struct ForceTarget<'a> {
    /// Forces on the nodes `[N]`.
    pub forces: &'a mut [[Lanes; 3]],
    /// Slots of the nodes in `forces`.
    pub slots: &'a Slots,
    /// True if the forces are overwritten.
    pub overwrites: bool,
}

/// Adds the forces `g` on the nodes of a lattice, in its frame, to those of a block as `−R g`.
/// Returns the torque `Σ ũ × g` in the frame; zero without one.
#[inline(always)]
pub fn give_forces<S: Simd>(
    simd: S,
    rotation: Option<&Matrix<S>>,
    [local, g]: [&[[Lanes; 3]]; 2],
    part: &BlockPart,
    target: ForceTarget<'_>,
) -> Vector<S> {
    let ForceTarget { forces, slots, overwrites } = target;
    let [from, to] = [part.in_lattice.step[0], slots.step[0]];
    let mut torque = zero(simd);
    for [j, k] in part.rows() {
        let (first, slot) = (part.in_lattice.row(j, k), slots.row(j, k));
        let mut along = zero(simd);
        for i in 0..part.count[0] {
            let mut force = load(simd, &g[first + i * from]);
            if let Some(rotation) = rotation {
                along = add(along, cross(load(simd, &local[first + i * from]), force));
                force = times(rotation, force);
            }
            let sum = &mut forces[slot + i * to];
            let before = if overwrites { zero(simd) } else { load(simd, sum) };
            *sum = sub(before, force).map(Lanes::from);
        }
        torque = add(torque, along);
    }
    torque
}

/// Rotations of the two blocks of a face joint; `None` for small displacements.
#[inline(always)]
pub fn rotations<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    at: JointLattice,
) -> Option<[Matrix<S>; 2]> {
    let JointLattice { pack: index, offset } = at;
    let frame = moved.frame(index)?;
    let other = rotation(simd, moved, frame, &moved.packs.packs[index].upper[offset]);
    Some([frame.matrix(simd), other])
}

/// Rotations of the neighbours of a pack; a lane without a neighbour has its own.
#[inline(always)]
fn rotation<S: Simd>(
    simd: S,
    moved: &NodePositions<'_>,
    own: &Frame,
    neighbours: &Neighbours,
) -> Matrix<S> {
    let frame = |pack: usize| moved.frame(pack).unwrap_or(own);
    let Some(run) = neighbours.in_order() else {
        let mut out = own.rotation;
        for lane in 0..LANES {
            let Some((pack, there)) = neighbours.at(lane) else { continue };
            let from = &frame(pack).rotation;
            for (out, from) in out.iter_mut().flatten().zip(from.iter().flatten()) {
                out.0[lane] = from.0[there % LANES];
            }
        }
        return [load(simd, &out[0]), load(simd, &out[1]), load(simd, &out[2])];
    };
    let [low, high] = run.packs().map(frame);
    let mut out = low.matrix(simd);
    // Without a shift the second pack need not be loaded.
    if run.shift != 0 {
        for (row, high) in out.iter_mut().zip(&high.matrix(simd)) {
            *row = run.vectors(*row, *high);
        }
    }
    if run.present != [true; LANES] {
        let present = run.mask(simd);
        for (row, own) in out.iter_mut().zip(&own.matrix(simd)) {
            for (x, own) in row.iter_mut().zip(own) {
                *x = present.select(*x, *own);
            }
        }
    }
    out
}
