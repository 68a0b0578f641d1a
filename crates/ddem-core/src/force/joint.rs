//! Joint forces, one joint lattice of a pack at a time: bonded elements, eq. (11), and the springs
//! of broken joints.
//!
//! A joint rotates with the mean rotation of its blocks. Its residual torque is `τ = Σ x_i × g_i`.
//! For elements it is of second order in strain; for springs it is the couple of two forces across
//! the thickness. The blocks take it in equal parts, and for springs in the parts of
//! [`split_torque`]. They balance it with the same nodal forces as their own torque. The moments of
//! all internal forces, joints included, therefore add up to zero. If supports hold only one of two
//! blocks, that block takes the part due to slip: it is the ground on which the other slides. Once
//! all pairs of such a joint have failed, its springs rotate with the ground alone.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use crate::state::pass::{Input, Output, Workspace, half_work};
use ddem_joint::broken::{BrokenLattice, LatticeCheck, SideDisplacements, SpringForces};
use ddem_joint::kinematics::{
    ForceTarget, NodePositions, give_forces, joint_displacements, rotations, to_quarters,
};
use ddem_joint::losses::Losses;
use ddem_mechanics::element::corotation::{Frame, split_torque};
use ddem_mechanics::element::lattice::{force, force_left};
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, cross, load, load_at, scale, splat, store_at, sub, times,
    transposed_times, zero,
};
use ddem_mesh::joint_sections::JointSection;
use ddem_mesh::pack::JointLattice;

/// Checks the pairs of one joint lattice of a pack for failure and adds its forces: those of its
/// elements, and of its springs if it is broken.
#[simd]
pub(crate) fn joint<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    broken: &mut Option<Box<BrokenLattice>>,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let n = 3 * at.nodes(input.moved.packs);
    let face = input.face(at);
    let rotation = element_forces(simd, input, at, broken.as_deref(), work);
    let fails = fail(simd, input, at, rotation.as_ref(), broken, out.losses, work);
    if let Some([_, joints]) = &mut out.energy {
        let stored = half_work(simd, &work.local[..n], &work.g[..n])
            + initial_stress_energy(simd, input, at, broken.as_deref(), &work.local[..n]);
        *joints = Lanes::from(joints.load(simd) + stored);
    }
    let mut pull = None;
    if let (Some(face), Some(broken)) = (face, broken) {
        let du = fails.then_some(&work.du[..n]);
        let blocks = rotations(simd, &input.moved, at);
        let grounds = match (&rotation, &blocks) {
            (Some(mean), Some(blocks)) => input.grounds(simd, at, mean, blocks, broken),
            _ => [None; LANES],
        };
        let sides = SideDisplacements { local: &work.local[..n], du, grounds: &grounds };
        let (context, g) = (input.pair_context, &mut work.g[..n]);
        let springs = broken.add_spring_forces(simd, face, context, sides, g, out.losses);
        if let Some([_, joints]) = &mut out.energy {
            *joints = Lanes::from(joints.load(simd) + springs.stored.load(simd));
        }
        pull = Some((face.section, springs, blocks));
    }
    scatter_forces(simd, input, at, rotation, pull, out, work);
}

/// Computes the forces `K u` of the remaining elements of a joint lattice, in-situ stress included.
#[simd]
fn elements<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    broken: Option<&BrokenLattice>,
    work: &mut Workspace,
) {
    let JointLattice { pack: index, offset } = at;
    let numbering = input.moved.packs.numbering_of(&input.moved.packs.packs[index]);
    let n = 3 * numbering.joints[offset].len();
    let dims = numbering.dims(offset);
    let Workspace { local, g, .. } = work;
    let (local, g) = (&local[..n], &mut g[..n]);
    let table = input.assembly.pack_tables[index][offset];
    let table = input.assembly.tables.get(table as usize).map(|table| &table.table);
    match (table, broken) {
        (Some(table), None) => force(simd, dims, table, local, g),
        (Some(table), Some(broken)) if broken.any_alive => {
            force_left(simd, dims, table, &broken.alive, local, g);
        }
        _ => g.fill(Lanes::ZERO),
    }
    if let Some(initial_stress) = input.initial_stress(at) {
        initial_stress.add(simd, broken.map(|broken| &broken.alive[..]), g);
    }
}

/// Energy of the remaining elements due to the in-situ stress, in excess of half the work of their
/// forces `[J]`.
#[inline(always)]
fn initial_stress_energy<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    broken: Option<&BrokenLattice>,
    local: &[Lanes],
) -> f64x4<S> {
    let alive = broken.map(|broken| &broken.alive[..]);
    input
        .initial_stress(at)
        .map_or(splat(simd, 0.0), |initial_stress| initial_stress.energy(simd, alive, local))
}

/// Fails the overloaded pairs of a face joint and transfers the forces of removed elements to
/// springs. Returns true if any pair failed.
#[simd]
fn fail<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    rotation: Option<&Matrix<S>>,
    broken: &mut Option<Box<BrokenLattice>>,
    losses: &mut Losses,
    work: &mut Workspace,
) -> bool {
    let (Some(face), Some(divisors)) = (input.face(at), input.failure_divisors(at)) else {
        return false;
    };
    let packs = input.moved.packs;
    let n = 3 * at.nodes(packs);
    let check = LatticeCheck { face, context: input.pair_context, divisors };
    let Workspace { local, g, tractions, .. } = &mut *work;
    let fields = [&local[..n], &g[..n]];
    if broken.is_none() && !tractions.any_failure(simd, check, None, fields) {
        return false;
    }
    let was_broken = broken.is_some();
    let lattice = broken.get_or_insert_with(|| {
        let tables = input.assembly.pack_tables[at.pack];
        Box::new(BrokenLattice::intact(packs, &packs.packs[at.pack], tables, at.offset))
    });
    let before = initial_stress_energy(simd, input, at, Some(lattice), fields[0]);
    let fails = lattice.fail(simd, check, fields, tractions, losses);
    if fails {
        work.before[..n].copy_from_slice(&work.g[..n]);
        elements(simd, input, at, Some(lattice), work);
        last_du(simd, input, at, rotation, &mut work.du[..n]);
        let forces = [&work.before[..n], &work.g[..n]];
        lattice.transfer_to_springs(face, &work.local[..n], &work.du[..n], forces, losses);
        let after = initial_stress_energy(simd, input, at, Some(lattice), &work.local[..n]);
        losses.fracture += Lanes::from(before - after).sum();
    } else if !was_broken {
        *broken = None;
    }
    fails
}

/// Computes the displacement increments of the nodes of a joint lattice in the last step, in the
/// joint's frame `[m]`.
#[simd]
fn last_du<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    rotation: Option<&Matrix<S>>,
    du: &mut [Lanes],
) {
    let Some((v, time_step)) = input.last else { return du.fill(Lanes::ZERO) };
    let moved = NodePositions { u: v, frames: None, ..input.moved };
    joint_displacements(simd, &moved, at, input.edges(at), du);
    if input.moved.packs.packs[at.pack].rigid {
        to_quarters(simd, input.face(at).map(|face| face.node_pairs), du);
    }
    for node in 0..du.len() / 3 {
        let v = scale(load_at(simd, du, 3 * node), splat(simd, time_step));
        store_at(du, 3 * node, rotation.map_or(v, |r| transposed_times(r, v)));
    }
}

/// Section of a broken joint, forces of its springs, and rotations of its two blocks.
type BrokenJointForces<'a, S> = (&'a JointSection, SpringForces, Option<[Matrix<S>; 2]>);

/// Adds the forces of a joint lattice to its nodes and its torque to its blocks.
#[inline(always)]
fn scatter_forces<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    rotation: Option<Matrix<S>>,
    pull: Option<BrokenJointForces<'_, S>>,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let JointLattice { pack: index, offset } = at;
    let pack = &input.moved.packs.packs[index];
    let numbering = input.moved.packs.numbering_of(pack);
    let n = numbering.joints[offset].len();
    let mut torque = zero(simd);
    if pack.rigid {
        if rotation.is_some() {
            torque = moment(simd, &work.local[..3 * n], &work.g[..3 * n]);
        }
        to_quarters(simd, input.face(at).map(|face| face.node_pairs), &mut work.g);
    }
    let fields = [&work.local, &work.g].map(|field| field[..3 * n].as_chunks::<3>().0);
    for part in &numbering.parts[offset] {
        let (forces, slots) = match part.offset {
            0 => (&mut *out.f, &part.in_block),
            _ => (&mut *out.neighbour_forces, &part.in_neighbour_forces),
        };
        // The lattice at the offset of a neighbour is the first one that gives it forces.
        let (forces, overwrites) = (forces.as_chunks_mut::<3>().0, part.offset == offset);
        let target = ForceTarget { forces, slots, overwrites };
        let more = give_forces(simd, rotation.as_ref(), fields, part, target);
        if !pack.rigid {
            torque = add(torque, more);
        }
    }
    let [own, others] = match (rotation, pull) {
        (None, _) => [zero(simd); 2],
        (Some(rotation), Some(pull)) => part_torque(simd, input, at, &rotation, torque, pull),
        (Some(rotation), None) => {
            let part = splat(simd, 1.0 / f64::from(1u32 << offset.count_ones()));
            [scale(times(&rotation, torque), part); 2]
        }
    };
    let own = add(load(simd, out.torque), own);
    *out.torque = [Lanes::from(own[0]), Lanes::from(own[1]), Lanes::from(own[2])];
    for part in &numbering.parts[offset][1..] {
        let at = 3 * numbering.torque(part.offset);
        let before = if part.offset == offset {
            zero(simd)
        } else {
            load_at(simd, out.neighbour_forces, at)
        };
        store_at(out.neighbour_forces, at, add(before, others));
    }
}

/// Torque `Σ ũ × g` of forces on the nodes of a lattice.
#[inline(always)]
fn moment<S: Simd>(simd: S, local: &[Lanes], g: &[Lanes]) -> Vector<S> {
    let mut torque = zero(simd);
    for node in 0..g.len() / 3 {
        let (u, g) = (load_at(simd, local, 3 * node), load_at(simd, g, 3 * node));
        torque = add(torque, cross(u, g));
    }
    torque
}

/// Torques of a broken joint on its own block and on the other `[N m]`. `torque` is that of its
/// elements, in the joint's frame.
#[inline(always)]
fn part_torque<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    rotation: &Matrix<S>,
    torque: Vector<S>,
    (section, pull, blocks): BrokenJointForces<'_, S>,
) -> [Vector<S>; 2] {
    let (mut own, mut others) = (zero(simd), zero(simd));
    let torque = add(torque, cross(load(simd, section.gap()), load(simd, &pull.force)));
    let whole = times(rotation, torque);
    if let Some(blocks) = blocks.filter(|_| pull.grounded.0 != [1.0; LANES]) {
        [own, others] = split_torque(simd, blocks, rotation, whole);
    }
    // A held block takes the couple due to slip, and the whole torque if the springs rotate with
    // it.
    let couple = times(rotation, load(simd, &pull.couple));
    let upper = input.moved.packs.packs[at.pack].upper[at.offset];
    let part = input.own_part(upper, at.pack).load(simd);
    let more = scale(couple, part - 0.5);
    let grounded = [(own, part), (others, part * -1.0 + 1.0)]
        .map(|(on, part)| scale(sub(scale(whole, part), on), pull.grounded.load(simd)));
    own = add(own, add(more, grounded[0]));
    others = add(others, sub(grounded[1], more));
    [own, others]
}

/// Computes the local forces of the elements of a joint lattice into the working space. Returns the
/// rotation from the joint's frame to global axes, if there is one.
#[simd]
fn element_forces<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    broken: Option<&BrokenLattice>,
    work: &mut Workspace,
) -> Option<Matrix<S>> {
    let n = 3 * at.nodes(input.moved.packs);
    work.reserve(n);
    let edges = input.edges(at);
    let rotation = joint_displacements(simd, &input.moved, at, edges, &mut work.local[..n]);
    if input.moved.packs.packs[at.pack].rigid {
        to_quarters(simd, input.face(at).map(|face| face.node_pairs), &mut work.local[..n]);
    }
    elements(simd, input, at, broken, work);
    rotation
}

/// Computes the forces of the elements of a face joint on its nodes, for the tractions (M1): in the
/// order of the lattice's nodes and in global axes. Also computes the rotation of the joint's
/// frame.
#[simd]
pub(crate) fn face_forces<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    broken: Option<&BrokenLattice>,
    forces: &mut Vec<Lanes>,
    rotation: &mut [[Lanes; 3]; 3],
    work: &mut Workspace,
) {
    let n = at.nodes(input.moved.packs);
    forces.resize(3 * n, Lanes::ZERO);
    let rotated = element_forces(simd, input, at, broken, work);
    for i in 0..n {
        let g = load_at(simd, &work.g, 3 * i);
        let g = rotated.as_ref().map_or(g, |r| times(r, g));
        store_at(forces, 3 * i, sub(zero(simd), g));
    }
    *rotation = match rotated {
        Some(r) => r.map(|row| row.map(Lanes::from)),
        None => Frame::REST.rotation,
    };
}

/// Strain energy of the remaining elements of a joint lattice `[J]`.
#[simd]
pub(crate) fn cell_energy<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    broken: Option<&BrokenLattice>,
    work: &mut Workspace,
) -> f64 {
    let n = 3 * at.nodes(input.moved.packs);
    element_forces(simd, input, at, broken, work);
    let energy = initial_stress_energy(simd, input, at, broken, &work.local[..n]);
    Lanes::from(half_work(simd, &work.local[..n], &work.g[..n]) + energy).sum()
}
