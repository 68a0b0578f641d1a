//! Elastic forces of the bodies, eq. (8), one pack at a time.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use crate::element::lattice::force;
use crate::in_situ::Borne;
use crate::kinematics::turn;
use crate::lanes::{
    Lanes, add, cross, dot, inverse_symmetric, load, load_at, scale, splat, store_at, sub,
    symmetric_times, times, transposed_times, zero,
};
use crate::pass::{Input, Output, Workspace, half_work};

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

/// §6: `f −= R (β K w + α M (w − w̄))` with `w = Rᵀ v` and its rigid part w̄, where the bodies are viscous. Whole
/// motions of a block have no part in it, up to the turning of its strain. `work` holds the local displacements, whose arms the torque has.
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
    if viscous.stiffness > 0.0 {
        force(simd, shape.dims(0), &table.table, way, g, planes);
        let beta = splat(simd, viscous.stiffness);
        g.iter_mut().for_each(|g| *g = Lanes::from(g.load(simd) * beta));
    } else {
        g.fill(Lanes::ZERO);
    }
    if viscous.mass(index) != Lanes::ZERO {
        slow_down(simd, input, (index, viscous.mass(index)), way, g);
    }
    let mut torque = zero(simd);
    for node in 0..shape.nodes {
        let mut force = load_at(simd, g, 3 * node);
        if let Some(rotation) = &rotation {
            torque = add(torque, cross(load_at(simd, local, 3 * node), force));
            force = times(rotation, force);
        }
        store_at(drag, 3 * node, force);
        store_at(out.f, 3 * node, sub(load_at(simd, out.f, 3 * node), force));
    }
    if let Some(rotation) = &rotation {
        let [x, y, z] = add(load(simd, out.torque), times(rotation, torque));
        *out.torque = [Lanes::from(x), Lanes::from(y), Lanes::from(z)];
    }
}

/// Adds `α M (w − w̄)` of four bodies to `g`: the velocities w without the translation and the spin that have their
/// momentum and moment of momentum.
#[inline(always)]
fn slow_down<S: Simd>(
    simd: S,
    input: Input<'_>,
    (index, alpha): (usize, Lanes),
    velocities: &[Lanes],
    g: &mut [Lanes],
) {
    let pack = &input.moved.packs.packs[index];
    let dims = input.moved.packs.shape_of(pack).dims(0);
    let mass = &input.assembly.inertia[input.assembly.pack_inertia[index] as usize].mass;
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let edges = table.edges.each_ref().map(|edge| load(simd, edge));
    let place = |node: usize| {
        let n = [dims[0] + 1, dims[1] + 1];
        let at = [node % n[0], node / n[0] % n[1], node / (n[0] * n[1])];
        let along = |d: usize| scale(edges[d], splat(simd, at[d] as f64 - 0.5 * dims[d] as f64));
        add(add(along(0), along(1)), along(2))
    };
    let nodes = velocities.len() / 3;
    let (mut whole, mut middle, mut mean) = (splat(simd, 0.0), zero(simd), zero(simd));
    for node in 0..nodes {
        let m = mass[node].load(simd);
        whole += m;
        middle = add(middle, scale(place(node), m));
        mean = add(mean, scale(load_at(simd, velocities, 3 * node), m));
    }
    // Lanes without a body, or with one that is taken out, have no mass.
    let empty = Lanes(Lanes::from(whole).0.map(|mass| if mass > 0.0 { 0.0 } else { 1.0 }));
    let per_mass = splat(simd, 1.0) / (whole + empty.load(simd));
    (middle, mean) = (scale(middle, per_mass), scale(mean, per_mass));
    let mut spread = [splat(simd, 0.0); 6];
    let mut momentum = zero(simd);
    for node in 0..nodes {
        let m = mass[node].load(simd);
        let (x, w) = (sub(place(node), middle), sub(load_at(simd, velocities, 3 * node), mean));
        let y = scale(x, m);
        let squares = dot(x, y);
        let more = [
            squares - x[0] * y[0],
            squares - x[1] * y[1],
            squares - x[2] * y[2],
            splat(simd, 0.0) - x[0] * y[1],
            splat(simd, 0.0) - x[1] * y[2],
            splat(simd, 0.0) - x[2] * y[0],
        ];
        (0..6).for_each(|k| spread[k] += more[k]);
        momentum = add(momentum, cross(y, w));
    }
    (0..3).for_each(|k| spread[k] += empty.load(simd));
    let spin = symmetric_times(inverse_symmetric(simd, spread), momentum);
    let alpha = alpha.load(simd);
    for node in 0..nodes {
        let rigid = add(mean, cross(spin, sub(place(node), middle)));
        let deforms = sub(load_at(simd, velocities, 3 * node), rigid);
        let force = scale(deforms, alpha * mass[node].load(simd));
        store_at(g, 3 * node, add(load_at(simd, g, 3 * node), force));
    }
}

/// Energy of the elements of a lattice `[J]`.
#[inline(always)]
fn energy<S: Simd>(simd: S, borne: Option<Borne<'_>>, u: &[Lanes], g: &[Lanes]) -> f64x4<S> {
    let work = half_work(simd, u, g);
    borne.map_or(work, |borne| work + borne.energy(simd, None, u))
}
