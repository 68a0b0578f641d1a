//! Elastic forces of the bodies, eq. (8), and of the bonded joint cells, eq. (11), one pack at a
//! time.
//!
//! A joint cell moves with the mean rotation of the bodies that it joins. Its residual torque
//! `τ = Σ ũ_i × g_i`, second order in strain, is given to these bodies in equal parts, who balance
//! it with the same nodal forces as their own: so the moments of all internal forces add up to
//! zero, joints included.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use crate::assembly::{Assembly, ElementPack, NO_TABLE};
use crate::element::corotation::{Frame, mean_rotation, minus_one};
use crate::element::lattice::{Planes, force};
use crate::lanes::{
    LANES, Lanes, Matrix, Vector, add, cross, load, load_at, scale, splat, store_at, sub, times,
    transposed_times, zero,
};
use crate::pack::{Neighbours, Pack, Packs};

/// What the internal forces are computed from.
#[derive(Clone, Copy)]
pub(crate) struct Input<'a> {
    pub(crate) packs: &'a Packs,
    pub(crate) assembly: &'a Assembly,
    /// Displacements `[m]`.
    pub(crate) u: &'a [Lanes],
    /// Frames of the packs; `None` for small displacements.
    pub(crate) frames: Option<&'a [Frame]>,
}

/// Working space of one task.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    planes: Planes,
    /// Local displacements of one lattice.
    local: Vec<Lanes>,
    /// Local forces of one lattice.
    g: Vec<Lanes>,
}

/// Where the forces of one pack go: added with the sign of a force on the nodes, `−K u`.
pub(crate) struct Output<'a> {
    /// Forces on the pack's own nodes `[N]`, overwritten.
    pub(crate) f: &'a mut [Lanes],
    /// Forces on the upper neighbours' nodes `[N]` and torques `[N m]`, overwritten.
    pub(crate) shares: &'a mut [Lanes],
    /// Residual torque on the pack's own bodies `[N m]`, overwritten.
    pub(crate) torque: &'a mut [Lanes; 3],
    /// Strain energy `[J]` of the bodies and of the joint cells, when it is asked for.
    pub(crate) energy: Option<&'a mut [Lanes; 2]>,
}

/// Internal forces of one pack: of its bodies, and of the joint cells that it owns.
#[simd]
pub(crate) fn pack_forces<S: Simd>(
    simd: S,
    input: Input<'_>,
    index: usize,
    mut out: Output<'_>,
    work: &mut Workspace,
) {
    let pack = &input.packs.packs[index];
    let shape = input.packs.shape_of(pack);
    out.shares.fill(Lanes::ZERO);
    body(simd, input, index, &mut out, work);
    for offset in 1..8 {
        let table = input.assembly.pack_tables[index][offset];
        if table != NO_TABLE {
            let table = &input.assembly.tables[table as usize];
            let energy = joint(simd, input, (index, offset), table, &mut out, work);
            if let Some([_, joints]) = &mut out.energy {
                *joints = Lanes::from(joints.load(simd) + energy);
            }
        }
    }
    debug_assert_eq!(out.shares.len(), 3 * shape.shares);
}

#[inline(always)]
fn body<S: Simd>(
    simd: S,
    input: Input<'_>,
    index: usize,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let pack = &input.packs.packs[index];
    let shape = input.packs.shape_of(pack);
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let u = &input.u[3 * pack.start..3 * (pack.start + shape.nodes)];
    let dims = shape.dims(0);
    *out.torque = [Lanes::ZERO; 3];
    let Workspace { planes, local, g } = work;
    reserve(local, 3 * shape.nodes);
    reserve(g, 3 * shape.nodes);
    let (local, g) = (&mut local[..3 * shape.nodes], &mut g[..3 * shape.nodes]);
    let Some(frames) = input.frames else {
        force(simd, dims, &table.table, u, g, planes);
        for (f, g) in out.f.iter_mut().zip(&*g) {
            *f = Lanes::from(-g.load(simd));
        }
        if let Some([bodies, _]) = &mut out.energy {
            *bodies = Lanes::from(half_work(simd, u, g));
        }
        return;
    };
    let frame = &frames[index];
    let rotation = frame.matrix(simd);
    local.copy_from_slice(u);
    turn(simd, &rotation, load(simd, &frame.mean), table, dims, local);
    force(simd, dims, &table.table, local, g, planes);
    let mut torque = zero(simd);
    for node in 0..shape.nodes {
        let (ui, gi) = (load_at(simd, local, 3 * node), load_at(simd, g, 3 * node));
        torque = add(torque, cross(ui, gi));
        store_at(out.f, 3 * node, sub(zero(simd), times(&rotation, gi)));
    }
    let [x, y, z] = times(&rotation, torque);
    *out.torque = [Lanes::from(x), Lanes::from(y), Lanes::from(z)];
    if let Some([bodies, _]) = &mut out.energy {
        *bodies = Lanes::from(half_work(simd, local, g));
    }
}

/// Forces of one joint lattice of a pack; returns its strain energy when energies are asked for.
#[simd]
fn joint<S: Simd>(
    simd: S,
    input: Input<'_>,
    (index, offset): (usize, usize),
    table: &ElementPack,
    out: &mut Output<'_>,
    work: &mut Workspace,
) -> f64x4<S> {
    let pack = &input.packs.packs[index];
    let shape = input.packs.shape_of(pack);
    let nodes = &shape.joints[offset];
    let dims = shape.dims(offset);
    let Workspace { planes, local, g } = work;
    reserve(local, 3 * nodes.len());
    reserve(g, 3 * nodes.len());
    let (local, g) = (&mut local[..3 * nodes.len()], &mut g[..3 * nodes.len()]);
    let rotation = joint_displacements(simd, input, (index, offset), table, local);
    force(simd, dims, &table.table, local, g, planes);
    let energy = match out.energy {
        Some(_) => half_work(simd, local, g),
        None => splat(simd, 0.0),
    };
    let mut torque = zero(simd);
    for (i, node) in nodes.iter().enumerate() {
        let mut gi = load_at(simd, g, 3 * i);
        if let Some(rotation) = &rotation {
            torque = add(torque, cross(load_at(simd, local, 3 * i), gi));
            gi = times(rotation, gi);
        }
        let (target, at) = if node.offset == 0 {
            (&mut *out.f, 3 * node.local)
        } else {
            (&mut *out.shares, 3 * node.share)
        };
        let sum = sub(load_at(simd, target, at), gi);
        store_at(target, at, sum);
    }
    if let Some(rotation) = &rotation {
        let parts = offset.count_ones();
        let part = splat(simd, 1.0 / f64::from(1u32 << parts));
        let torque = scale(times(rotation, torque), part);
        let own = add(load(simd, out.torque), torque);
        *out.torque = [Lanes::from(own[0]), Lanes::from(own[1]), Lanes::from(own[2])];
        for part in (1..8).filter(|part| part & !offset == 0) {
            let at = 3 * shape.torque(part);
            let sum = add(load_at(simd, out.shares, at), torque);
            store_at(out.shares, at, sum);
        }
    }
    energy
}

/// Local displacements of the nodes of a joint lattice, and its rotation if there is one.
#[inline(always)]
fn joint_displacements<S: Simd>(
    simd: S,
    input: Input<'_>,
    (index, offset): (usize, usize),
    table: &ElementPack,
    local: &mut [Lanes],
) -> Option<Matrix<S>> {
    let pack = &input.packs.packs[index];
    let shape = input.packs.shape_of(pack);
    let nodes = &shape.joints[offset];
    let mut sources = [Source::Own { first: 3 * pack.start }; 8];
    for part in (1..8).filter(|part| part & !offset == 0) {
        sources[part] = Source::new(input.packs, pack, index, part);
    }
    for (node, local) in nodes.iter().zip(local.as_chunks_mut::<3>().0) {
        *local = sources[node.offset].displacement(input.u, node.local);
    }
    let frames = input.frames?;
    let mut sum = frames[index].matrix(simd);
    for part in (1..8).filter(|part| part & !offset == 0) {
        let [x, y, z] = &sources[part].rotation(frames, index);
        let other = [load(simd, x), load(simd, y), load(simd, z)];
        sum = [add(sum[0], other[0]), add(sum[1], other[1]), add(sum[2], other[2])];
    }
    let rotation = mean_rotation(simd, &sum, f64::from(1u32 << offset.count_ones()));
    let mean = load(simd, &frames[index].mean);
    turn(simd, &rotation, mean, table, shape.dims(offset), local);
    Some(rotation)
}

/// Forces that the cells of the face joints alone exert on their nodes, for the tractions (M1):
/// those of lattice `offset` of one pack, in the order of its nodes, in the frame of space.
#[simd]
pub(crate) fn face_forces<S: Simd>(
    simd: S,
    input: Input<'_>,
    (index, offset): (usize, usize),
    forces: &mut Vec<Lanes>,
    work: &mut Workspace,
) {
    let shape = input.packs.shape_of(&input.packs.packs[index]);
    let table = input.assembly.pack_tables[index][offset];
    let n = 3 * shape.joints[offset].len();
    forces.clear();
    forces.resize(n, Lanes::ZERO);
    if table == NO_TABLE {
        return;
    }
    let table = &input.assembly.tables[table as usize];
    let Workspace { planes, local, g } = work;
    reserve(local, n);
    reserve(g, n);
    let rotation = joint_displacements(simd, input, (index, offset), table, &mut local[..n]);
    force(simd, shape.dims(offset), &table.table, &local[..n], &mut g[..n], planes);
    for i in 0..n / 3 {
        let g = load_at(simd, g, 3 * i);
        let g = rotation.as_ref().map_or(g, |r| times(r, g));
        store_at(forces, 3 * i, sub(zero(simd), g));
    }
}

/// Turns displacements of a lattice into those seen from a turned frame, up to a constant:
/// `ũ = Rᵀ(u − ū) + (Rᵀ − 1) X`.
#[inline(always)]
fn turn<S: Simd>(
    simd: S,
    rotation: &Matrix<S>,
    mean: Vector<S>,
    table: &ElementPack,
    dims: [usize; 3],
    local: &mut [Lanes],
) {
    // (Rᵀ − 1) h_d, and how many of them lie between the centre and line i.
    let change = minus_one(simd, rotation);
    let [x, y, z] = &table.edges;
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

/// Where the nodes of the neighbours at one offset are.
#[derive(Clone, Copy)]
enum Source {
    /// The pack itself: its first number.
    Own { first: usize },
    /// Four lanes of one pack, in order.
    Aligned { pack: usize, first: usize },
    /// Anywhere: for each lane pack, first number and lane; the owner where there is nobody.
    Scattered { packs: [usize; LANES], first: [usize; LANES], lanes: [usize; LANES] },
}

impl Source {
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

/// `½ Σ u·g`.
#[inline(always)]
fn half_work<S: Simd>(simd: S, u: &[Lanes], g: &[Lanes]) -> f64x4<S> {
    let mut sum = splat(simd, 0.0);
    for (u, g) in u.iter().zip(g) {
        sum += u.load(simd) * g.load(simd);
    }
    sum * 0.5
}

fn reserve(buffer: &mut Vec<Lanes>, n: usize) {
    if buffer.len() < n {
        buffer.resize(n, Lanes::ZERO);
    }
}
