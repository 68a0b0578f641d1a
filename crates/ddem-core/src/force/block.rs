//! Elastic forces of the blocks, eq. (8), one pack at a time.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use crate::state::pass::{Input, Output, Viscous, Workspace, half_work};
use ddem_joint::kinematics::{
    ForceTarget, LocalFrame, NodePositions, give_forces, ordered_displacements,
};
use ddem_mechanics::element::corotation::minus_one;
use ddem_mechanics::element::lattice::force;
use ddem_mechanics::math::lanes::{
    Lanes, Matrix, Vector, add, cross, load, load_at, over_nodes, scale, splat, store_at, times,
    transposed_times, zero,
};
use ddem_mesh::in_situ::InSituLattice;
use ddem_mesh::pack::{JointLattice, LaneRun};

/// Computes the elastic and viscous forces of the blocks of one pack, and their residual torque.
#[simd]
pub(crate) fn block<S: Simd>(
    simd: S,
    input: &Input<'_>,
    index: usize,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let pack = &input.moved.packs.packs[index];
    let numbering = input.moved.packs.numbering_of(pack);
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let u = input.moved.nodes(index).as_flattened();
    let dims = numbering.dims(0);
    *out.torque = [Lanes::ZERO; 3];
    if pack.rigid {
        out.f.fill(Lanes::ZERO);
        return;
    }
    work.reserve(3 * numbering.nodes);
    let Workspace { local, g, .. } = work;
    let (local, g) = (&mut local[..3 * numbering.nodes], &mut g[..3 * numbering.nodes]);
    let initial_stress = input.initial_stress(JointLattice { pack: index, offset: 0 });
    let Some(frame) = input.moved.frame(index) else {
        force(simd, dims, &table.table, u, g);
        if let Some(initial_stress) = initial_stress {
            initial_stress.add(simd, None, g);
        }
        for (f, g) in out.f.iter_mut().zip(&*g) {
            *f = Lanes::from(-g.load(simd));
        }
        if let Some([blocks, _]) = &mut out.energy {
            *blocks = Lanes::from(energy(simd, initial_stress, u, g));
        }
        return add_stiffness_damping(simd, input, index, out, work);
    };
    let rotation = frame.matrix(simd);
    let (part, run) = (&numbering.parts[0][0], LaneRun::of(index));
    let local_frame = LocalFrame::new(simd, rotation, &frame.mean, &table.edges);
    let nodes = local.as_chunks_mut::<3>().0;
    ordered_displacements(simd, &input.moved, Some(&local_frame), &run, part, nodes);
    if !table.warp.is_empty() {
        add_warp(simd, &rotation, &table.warp, nodes);
    }
    force(simd, dims, &table.table, local, g);
    if let Some(initial_stress) = initial_stress {
        initial_stress.add(simd, None, g);
    }
    let (nodes, forces) = (local.as_chunks::<3>().0, g.as_chunks::<3>().0);
    let target = ForceTarget {
        forces: out.f.as_chunks_mut::<3>().0,
        slots: &part.in_block,
        overwrites: true,
    };
    let torque = give_forces(simd, Some(&rotation), [nodes, forces], part, target);
    let [x, y, z] = times(&rotation, torque);
    *out.torque = [Lanes::from(x), Lanes::from(y), Lanes::from(z)];
    if let Some([blocks, _]) = &mut out.energy {
        *blocks = Lanes::from(energy(simd, initial_stress, local, g));
    }
    add_stiffness_damping(simd, input, index, out, work);
}

/// Adds the local displacements `(Rᵀ − 1) W` of nodes that deviate by W from the parallelepipeds.
#[simd]
fn add_warp<S: Simd>(simd: S, rotation: &Matrix<S>, warp: &[[Lanes; 3]], local: &mut [[Lanes; 3]]) {
    let change = minus_one(simd, rotation);
    for (local, warp) in local.iter_mut().zip(warp) {
        let more = transposed_times(&change, load(simd, warp));
        *local = add(load(simd, local), more).map(Lanes::from);
    }
}

/// Subtracts the stiffness damping `R β K w` with `w = Rᵀ v` from the forces (§6), if it is in use.
/// It does not resist a rigid motion, except by rotating the strain of a block. `work` holds the
/// local displacements, which are the arms of the torque.
#[simd]
fn add_stiffness_damping<S: Simd>(
    simd: S,
    input: &Input<'_>,
    index: usize,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let (Some(viscous), Some(damping_force)) = (input.viscous, out.viscous.as_deref_mut()) else {
        return;
    };
    let torque = stiffness_damping(simd, input, index, viscous, damping_force, work);
    for (f, damping_force) in out.f.iter_mut().zip(&*damping_force) {
        *f = Lanes::from(f.load(simd) - damping_force.load(simd));
    }
    if input.moved.frames.is_some() {
        let [x, y, z] = add(load(simd, out.torque), torque);
        *out.torque = [Lanes::from(x), Lanes::from(y), Lanes::from(z)];
    }
}

/// Computes the damping forces `R β K w` of four blocks `[N]`; returns their torque `[N m]`.
#[inline(always)]
fn stiffness_damping<S: Simd>(
    simd: S,
    input: &Input<'_>,
    index: usize,
    viscous: Viscous<'_>,
    damping_force: &mut [Lanes],
    work: &mut Workspace,
) -> Vector<S> {
    let pack = &input.moved.packs.packs[index];
    let numbering = input.moved.packs.numbering_of(pack);
    let table = &input.assembly.tables[input.assembly.pack_tables[index][0] as usize];
    let velocities = NodePositions { u: viscous.v, ..input.moved };
    let v = velocities.nodes(index).as_flattened();
    let Workspace { local, g, du, .. } = work;
    let (g, du) = (&mut g[..v.len()], &mut du[..v.len()]);
    let rotation = input.moved.frame(index).map(|frame| frame.matrix(simd));
    for node in 0..numbering.nodes {
        let v = load_at(simd, v, 3 * node);
        store_at(du, 3 * node, rotation.map_or(v, |r| transposed_times(&r, v)));
    }
    force(simd, numbering.dims(0), &table.table, du, g);
    let beta = splat(simd, viscous.stiffness);
    let torque = over_nodes(simd, numbering.divisions, |node| {
        let force = scale(load_at(simd, g, 3 * node), beta);
        let Some(rotation) = &rotation else {
            store_at(damping_force, 3 * node, force);
            return zero(simd);
        };
        store_at(damping_force, 3 * node, times(rotation, force));
        cross(load_at(simd, local, 3 * node), force)
    });
    rotation.map_or(torque, |r| times(&r, torque))
}

/// Strain energy of the elements of a lattice, in-situ stress included `[J]`.
#[inline(always)]
fn energy<S: Simd>(
    simd: S,
    initial_stress: Option<InSituLattice<'_>>,
    u: &[Lanes],
    g: &[Lanes],
) -> f64x4<S> {
    let work = half_work(simd, u, g);
    initial_stress.map_or(work, |initial_stress| work + initial_stress.energy(simd, None, u))
}
