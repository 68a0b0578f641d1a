//! Elastic forces of the bodies, eq. (8), one pack at a time.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use crate::element::lattice::force;
use crate::in_situ::Borne;
use crate::inertia::Moments;
use crate::kinematics::turn;
use crate::lanes::{
    Lanes, Vector, add, cross, dot, inverse_symmetric, load, load_at, scale, splat, store_at, sub,
    symmetric_times, times, transposed_times, zero,
};
use crate::pass::{Input, Output, Viscous, Workspace, half_work};

/// Forces of the bodies of one pack.
#[simd]
pub(crate) fn body<S: Simd>(
    simd: S,
    input: Input<'_>,
    index: usize,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let pack = &input.moved.packs.packs[index];
    let shape = input.moved.packs.shape_of(pack);
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let u = &input.moved.u[3 * pack.start..3 * (pack.start + shape.nodes)];
    let dims = shape.dims(0);
    *out.torque = [Lanes::ZERO; 3];
    if pack.rigid {
        out.f.fill(Lanes::ZERO);
        return;
    }
    work.reserve(3 * shape.nodes);
    let Workspace { planes, local, g, .. } = work;
    let (local, g) = (&mut local[..3 * shape.nodes], &mut g[..3 * shape.nodes]);
    let borne = input.borne((index, 0));
    let Some(frames) = input.moved.frames else {
        force(simd, dims, &table.table, u, g, planes);
        if let Some(borne) = borne {
            borne.add(simd, None, g);
        }
        for (f, g) in out.f.iter_mut().zip(&*g) {
            *f = Lanes::from(-g.load(simd));
        }
        if let Some([bodies, _]) = &mut out.energy {
            *bodies = Lanes::from(energy(simd, borne, u, g));
        }
        return resist(simd, input, index, out, work);
    };
    let frame = &frames[index];
    let rotation = frame.matrix(simd);
    local.copy_from_slice(u);
    turn(simd, &rotation, load(simd, &frame.mean), &table.edges, dims, local);
    force(simd, dims, &table.table, local, g, planes);
    if let Some(borne) = borne {
        borne.add(simd, None, g);
    }
    let mut torque = zero(simd);
    for node in 0..shape.nodes {
        let (ui, gi) = (load_at(simd, local, 3 * node), load_at(simd, g, 3 * node));
        torque = add(torque, cross(ui, gi));
        store_at(out.f, 3 * node, sub(zero(simd), times(&rotation, gi)));
    }
    let [x, y, z] = times(&rotation, torque);
    *out.torque = [Lanes::from(x), Lanes::from(y), Lanes::from(z)];
    if let Some([bodies, _]) = &mut out.energy {
        *bodies = Lanes::from(energy(simd, borne, local, g));
    }
    resist(simd, input, index, out, work);
}

/// §6: `f −= R β K w + α M (v − v̄)` with `w = Rᵀ v` and the rigid part v̄ of v, where the bodies are viscous.
/// Whole motions of a block have no part in it, up to the turning of its strain. `work` holds the local
/// displacements, whose arms the torque has.
#[simd]
fn resist<S: Simd>(
    simd: S,
    input: Input<'_>,
    index: usize,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let (Some(viscous), Some(drag)) = (input.viscous, out.viscous.as_deref_mut()) else { return };
    if !viscous.acts(index) {
        return;
    }
    let mut torque = zero(simd);
    if viscous.stiffness > 0.0 {
        torque = stiffness_damping(simd, input, (index, viscous), drag, work);
    } else {
        drag.fill(Lanes::ZERO);
    }
    if viscous.mass(index) != Lanes::ZERO {
        torque = add(torque, mass_damping(simd, input, (index, viscous), drag));
    }
    for (f, drag) in out.f.iter_mut().zip(&*drag) {
        *f = Lanes::from(f.load(simd) - drag.load(simd));
    }
    if input.moved.frames.is_some() {
        let [x, y, z] = add(load(simd, out.torque), torque);
        *out.torque = [Lanes::from(x), Lanes::from(y), Lanes::from(z)];
    }
}

/// `R β K w` of four bodies, and its torque.
#[inline(always)]
fn stiffness_damping<S: Simd>(
    simd: S,
    input: Input<'_>,
    (index, viscous): (usize, Viscous<'_>),
    drag: &mut [Lanes],
    work: &mut Workspace,
) -> Vector<S> {
    let pack = &input.moved.packs.packs[index];
    let shape = input.moved.packs.shape_of(pack);
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let v = &viscous.v[3 * pack.start..3 * (pack.start + shape.nodes)];
    let Workspace { planes, local, g, way, .. } = work;
    let (g, way) = (&mut g[..v.len()], &mut way[..v.len()]);
    let rotation = input.moved.frames.map(|frames| frames[index].matrix(simd));
    for node in 0..shape.nodes {
        let v = load_at(simd, v, 3 * node);
        store_at(way, 3 * node, rotation.map_or(v, |r| transposed_times(&r, v)));
    }
    force(simd, shape.dims(0), &table.table, way, g, planes);
    let beta = splat(simd, viscous.stiffness);
    let mut torque = zero(simd);
    for node in 0..shape.nodes {
        let mut force = scale(load_at(simd, g, 3 * node), beta);
        if let Some(rotation) = &rotation {
            torque = add(torque, cross(load_at(simd, local, 3 * node), force));
            force = times(rotation, force);
        }
        store_at(drag, 3 * node, force);
    }
    rotation.map_or(torque, |r| times(&r, torque))
}

/// Adds `α M (v − v̄)` of four bodies to `drag`: the velocities without the translation and the spin that have
/// their momentum and moment of momentum. Its torque is about the nodes where they are.
#[inline(always)]
fn mass_damping<S: Simd>(
    simd: S,
    input: Input<'_>,
    (index, viscous): (usize, Viscous<'_>),
    drag: &mut [Lanes],
) -> Vector<S> {
    let pack = &input.moved.packs.packs[index];
    let shape = input.moved.packs.shape_of(pack);
    let nodes = 3 * pack.start..3 * (pack.start + shape.nodes);
    let (v, u) = (&viscous.v[nodes.clone()], &input.moved.u[nodes]);
    let inertia = &input.assembly.inertia[input.assembly.pack_inertia[index] as usize];
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let at_rest = table.edges.each_ref().map(|edge| load(simd, edge));
    let frame = input.moved.frames.map(|frames| &frames[index]);
    let edges = frame.map_or(at_rest, |frame| at_rest.map(|edge| times(&frame.matrix(simd), edge)));
    let [momentum, first @ ..] = lattice_moments(simd, shape.divisions, |node, _| {
        scale(load_at(simd, v, 3 * node), inertia.mass[node].load(simd))
    });
    let (base, slopes) = rigid_motion(simd, &inertia.moments, &edges, momentum, first);
    let alpha = viscous.mass(index).load(simd);
    let mean = frame.map_or(zero(simd), |frame| load(simd, &frame.mean));
    let mut torque = zero(simd);
    let [_, first @ ..] = lattice_moments(simd, shape.divisions, |node, [x, y, z]| {
        let row = add(add(base, scale(slopes[2], z)), scale(slopes[1], y));
        let deforms = sub(load_at(simd, v, 3 * node), add(row, scale(slopes[0], x)));
        let force = scale(deforms, alpha * inertia.mass[node].load(simd));
        torque = add(torque, cross(sub(load_at(simd, u, 3 * node), mean), force));
        store_at(drag, 3 * node, add(load_at(simd, drag, 3 * node), force));
        force
    });
    (0..3).fold(torque, |torque, d| add(torque, cross(at_rest[d], first[d])))
}

/// Sum over the nodes of four bodies of a vector, and its first moments with the numbers of elements from the
/// centre as coordinates, which `of` is given with the node.
#[inline(always)]
fn lattice_moments<S: Simd>(
    simd: S,
    divisions: usize,
    mut of: impl FnMut(usize, Vector<S>) -> Vector<S>,
) -> [Vector<S>; 4] {
    let [mut sum, mut along_x, mut along_y, mut along_z] = [zero(simd); 4];
    let from_centre = |i: usize| splat(simd, i as f64 - 0.5 * divisions as f64);
    let mut node = 0;
    for z in (0..=divisions).map(from_centre) {
        let mut plane = zero(simd);
        for y in (0..=divisions).map(from_centre) {
            let mut row = zero(simd);
            for x in (0..=divisions).map(from_centre) {
                let vector = of(node, [x, y, z]);
                row = add(row, vector);
                along_x = add(along_x, scale(vector, x));
                node += 1;
            }
            plane = add(plane, row);
            along_y = add(along_y, scale(row, y));
        }
        sum = add(sum, plane);
        along_z = add(along_z, scale(plane, z));
    }
    [sum, along_x, along_y, along_z]
}

/// Velocity at the centre of the lattices of four bodies, and its change from element to element, of the rigid
/// motion that has a momentum and its first moments. `edges` are those of an element where it is.
#[inline(always)]
fn rigid_motion<S: Simd>(
    simd: S,
    moments: &Moments,
    edges: &[Vector<S>; 3],
    momentum: Vector<S>,
    first: [Vector<S>; 3],
) -> (Vector<S>, [Vector<S>; 3]) {
    let centre = load(simd, &moments.centre);
    // Σ m (x² 1 − x xᵀ) and Σ m x × v with x = Σ ι_d h_d, ι_d from the centre of mass.
    let mut spread = [splat(simd, 0.0); 6];
    (0..3).for_each(|k| spread[k] = moments.empty.load(simd));
    let mut spin = zero(simd);
    for d in 0..3 {
        for e in 0..3 {
            let at = if d == e {
                d
            } else if (d + 1) % 3 == e {
                3 + d
            } else {
                3 + e
            };
            let moved = scale(edges[e], moments.second[at].load(simd));
            let squares = dot(edges[d], moved);
            (0..3).for_each(|k| spread[k] += squares - edges[d][k] * moved[k]);
            (0..3).for_each(|k| spread[3 + k] -= edges[d][k] * moved[(k + 1) % 3]);
        }
        spin = add(spin, cross(edges[d], sub(first[d], scale(momentum, centre[d]))));
    }
    let spin = symmetric_times(inverse_symmetric(simd, spread), spin);
    let slopes = edges.map(|edge| cross(spin, edge));
    let mean = scale(momentum, moments.per_mass.load(simd));
    let base = (0..3).fold(mean, |base, d| sub(base, scale(slopes[d], centre[d])));
    (base, slopes)
}

/// Energy of the elements of a lattice `[J]`.
#[inline(always)]
fn energy<S: Simd>(simd: S, borne: Option<Borne<'_>>, u: &[Lanes], g: &[Lanes]) -> f64x4<S> {
    let work = half_work(simd, u, g);
    borne.map_or(work, |borne| work + borne.energy(simd, None, u))
}
