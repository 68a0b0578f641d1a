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
    let Workspace { planes, local, g, way, before, .. } = work;
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
        let velocities = (&*way, &mut before[..v.len()]);
        slow_down(simd, input, (index, viscous.mass(index)), velocities, g);
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
/// momentum and moment of momentum. `arms` is working space.
#[inline(always)]
fn slow_down<S: Simd>(
    simd: S,
    input: Input<'_>,
    (index, alpha): (usize, Lanes),
    (velocities, arms): (&[Lanes], &mut [Lanes]),
    g: &mut [Lanes],
) {
    let mass = &input.assembly.inertia[input.assembly.pack_inertia[index] as usize].mass;
    places(simd, input, index, arms);
    let (mut whole, mut middle, mut mean) = (splat(simd, 0.0), zero(simd), zero(simd));
    for (node, m) in mass.iter().enumerate() {
        let m = m.load(simd);
        whole += m;
        middle = add(middle, scale(load_at(simd, arms, 3 * node), m));
        mean = add(mean, scale(load_at(simd, velocities, 3 * node), m));
    }
    // Lanes without a body, or with one that is taken out, have no mass.
    let empty = Lanes(Lanes::from(whole).0.map(|mass| if mass > 0.0 { 0.0 } else { 1.0 }));
    let per_mass = splat(simd, 1.0) / (whole + empty.load(simd));
    (middle, mean) = (scale(middle, per_mass), scale(mean, per_mass));
    let mut spread = [splat(simd, 0.0); 6];
    let mut momentum = zero(simd);
    for (node, m) in mass.iter().enumerate() {
        let x = sub(load_at(simd, arms, 3 * node), middle);
        let w = sub(load_at(simd, velocities, 3 * node), mean);
        let y = scale(x, m.load(simd));
        let squares = dot(x, y);
        (0..3).for_each(|k| spread[k] += squares - x[k] * y[k]);
        (0..3).for_each(|k| spread[3 + k] -= x[k] * y[(k + 1) % 3]);
        momentum = add(momentum, cross(y, w));
    }
    (0..3).for_each(|k| spread[k] += empty.load(simd));
    let spin = symmetric_times(inverse_symmetric(simd, spread), momentum);
    let alpha = alpha.load(simd);
    for (node, m) in mass.iter().enumerate() {
        let rigid = add(mean, cross(spin, sub(load_at(simd, arms, 3 * node), middle)));
        let deforms = sub(load_at(simd, velocities, 3 * node), rigid);
        let force = scale(deforms, alpha * m.load(simd));
        store_at(g, 3 * node, add(load_at(simd, g, 3 * node), force));
    }
}

/// Places of the nodes of four bodies at rest, from their centres `[m]`.
#[inline(always)]
fn places<S: Simd>(simd: S, input: Input<'_>, index: usize, places: &mut [Lanes]) {
    let dims = input.moved.packs.shape_of(&input.moved.packs.packs[index]).dims(0);
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let [x, y, z] = table.edges.each_ref().map(|edge| load(simd, edge));
    let along = |d: usize, i: usize| splat(simd, i as f64 - 0.5 * dims[d] as f64);
    let mut at = 0;
    for k in 0..=dims[2] {
        let plane = scale(z, along(2, k));
        for j in 0..=dims[1] {
            let row = add(plane, scale(y, along(1, j)));
            for i in 0..=dims[0] {
                store_at(places, at, add(row, scale(x, along(0, i))));
                at += 3;
            }
        }
    }
}

/// Energy of the elements of a lattice `[J]`.
#[inline(always)]
fn energy<S: Simd>(simd: S, borne: Option<Borne<'_>>, u: &[Lanes], g: &[Lanes]) -> f64x4<S> {
    let work = half_work(simd, u, g);
    borne.map_or(work, |borne| work + borne.energy(simd, None, u))
}
