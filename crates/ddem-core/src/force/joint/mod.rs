//! Joint forces, one joint lattice of a pack at a time: bonded elements, eq. (11), and the springs
//! of broken joints.
//!
//! A joint rotates with the mean rotation of its blocks. Its residual torque is `τ = Σ x_i × g_i`.
//! For elements it is of second order in strain; for springs it is the couple of two forces across
//! the thickness. The blocks take it in equal parts, and for springs in the parts of
//! [`split_torque`](ddem_mechanics::element::corotation::split_torque). They balance it with the
//! same nodal forces as their own torque. The moments of all internal forces, joints included,
//! therefore add up to zero. If supports hold only one of two blocks, that block takes the part due
//! to slip: it is the ground on which the other slides. Once all pairs of such a joint have failed,
//! its springs rotate with the ground alone. The springs are in `springs.rs`.

mod springs;

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use self::springs::{Springs, last_pair_du};
use crate::state::pass::{Input, Output, Workspace, half_work};
use ddem_joint::broken::{BrokenLattice, ElementRemoval, LatticeCheck};
use ddem_joint::kinematics::{
    ForceTarget, NodePositions, give_forces, joint_displacements, joint_rotation,
};
use ddem_joint::losses::Losses;
use ddem_joint::pair_kinematics::{PairFrame, relative_displacements};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::element::lattice::{force, force_left};
use ddem_mechanics::math::lanes::{
    Lanes, Matrix, Vector, add, load, load_at, scale, splat, store_at, sub, times,
    transposed_times, zero,
};
use ddem_mesh::joint_sections::FaceLattice;
use ddem_mesh::pack::JointLattice;

/// Rotation of a joint lattice.
struct JointFrame<S: Simd> {
    /// Rotation of its frame to global axes; `None` for small displacements.
    rotation: Option<Matrix<S>>,
    /// Axes of its pairs, if there are springs.
    pairs: Option<PairFrame<S>>,
}

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
    work.reserve(n);
    let face = input.face(at);
    let has_elements = broken.as_deref().is_none_or(|broken| broken.any_alive);
    let rotation = if has_elements {
        element_forces(simd, input, at, broken.as_deref(), work)
    } else {
        joint_rotation(simd, &input.moved, at)
    };
    let mut frame = JointFrame { rotation, pairs: None };
    if let (Some(face), Some(_)) = (face, &broken) {
        find_relative_displacements(simd, input, at, face, &mut frame, work);
    }
    let just_failed = fail(simd, input, at, &mut frame, broken, out.losses, work);
    let mut torque = zero(simd);
    if has_elements {
        if let Some([_, joints]) = &mut out.energy {
            let stored = half_work(simd, &work.local[..n], &work.g[..n])
                + initial_stress_energy(simd, input, at, broken.as_deref(), &work.local[..n]);
            *joints = Lanes::from(joints.load(simd) + stored);
        }
        torque = give_element_forces(simd, input, at, frame.rotation.as_ref(), out, work);
    }
    let JointFrame { rotation, pairs } = &frame;
    let mut torques = [zero(simd); 2];
    if let (Some(face), Some(broken), Some(pairs)) = (face, broken, pairs) {
        let rotation = rotation.as_ref();
        let springs = Springs {
            at,
            face,
            rotation,
            pairs,
            just_failed,
            has_elements,
            element_torque: torque,
        };
        torques = springs.add_forces(simd, input, broken, out, work);
    } else if let Some(rotation) = rotation {
        let part = splat(simd, 1.0 / f64::from(1u32 << at.offset.count_ones()));
        torques = [scale(times(rotation, torque), part); 2];
    }
    give_torques(simd, input, at, torques, out);
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

/// Finds the relative displacements of the pairs of a face joint, and the axes along which they are.
#[inline(always)]
fn find_relative_displacements<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    face: FaceLattice<'_>,
    frame: &mut JointFrame<S>,
    work: &mut Workspace,
) {
    let pairs = PairFrame::new(simd, face.section, frame.rotation.as_ref());
    let relative = &mut work.relative[..3 * face.node_pairs.len()];
    relative_displacements(simd, &input.moved, at, face, &pairs, relative);
    frame.pairs = Some(pairs);
}

/// Fails the overloaded pairs of a face joint and transfers the forces of removed elements to
/// springs. Returns true if any pair failed.
#[simd]
fn fail<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    frame: &mut JointFrame<S>,
    broken: &mut Option<Box<BrokenLattice>>,
    losses: &mut Losses,
    work: &mut Workspace,
) -> bool {
    let (Some(face), Some(divisors)) = (input.face(at), input.failure_divisors(at)) else {
        return false;
    };
    let packs = input.moved.packs;
    let (n, m) = (3 * at.nodes(packs), 3 * face.node_pairs.len());
    let context = input.pair_context;
    let was_broken = broken.is_some();
    if !was_broken {
        let Workspace { g, tractions, .. } = &mut *work;
        let check = LatticeCheck { face, context, divisors, g: Some(&g[..n]), relative: &[] };
        if !tractions.any_failure(simd, check, None) {
            return false;
        }
        find_relative_displacements(simd, input, at, face, frame, work);
    }
    let lattice = broken.get_or_insert_with(|| {
        let tables = input.assembly.pack_tables[at.pack];
        Box::new(BrokenLattice::intact(packs, &packs.packs[at.pack], tables, at.offset))
    });
    let had_elements = lattice.any_alive;
    let Workspace { local, g, tractions, relative, .. } = &mut *work;
    let before = match had_elements {
        true => initial_stress_energy(simd, input, at, Some(lattice), &local[..n]),
        false => splat(simd, 0.0),
    };
    let g = had_elements.then_some(&g[..n]);
    let check = LatticeCheck { face, context, divisors, g, relative: &relative[..m] };
    let fails = lattice.fail(simd, check, tractions, losses);
    if fails {
        if had_elements {
            work.before[..n].copy_from_slice(&work.g[..n]);
            elements(simd, input, at, Some(lattice), work);
            last_du(simd, input, at, frame.rotation.as_ref(), &mut work.du[..n]);
            let removal = ElementRemoval {
                local: &work.local[..n],
                du: &work.du[..n],
                forces: [&work.before[..n], &work.g[..n]],
            };
            lattice.transfer_to_springs(face, &work.relative[..m], removal, losses);
            let after = initial_stress_energy(simd, input, at, Some(lattice), &work.local[..n]);
            losses.fracture += Lanes::from(before - after).sum();
        }
        lattice.begin_failed(face.section, &work.relative[..m]);
        last_pair_du(simd, input, at, face, frame.pairs.as_ref(), &mut work.pair_du[..m]);
    } else if !was_broken {
        (*broken, frame.pairs) = (None, None);
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
    for node in 0..du.len() / 3 {
        let v = scale(load_at(simd, du, 3 * node), splat(simd, time_step));
        store_at(du, 3 * node, rotation.map_or(v, |r| transposed_times(r, v)));
    }
}

/// Adds the forces of the elements of a joint lattice to its nodes. Returns their torque
/// `Σ ũ × g` in the joint's frame.
#[inline(always)]
fn give_element_forces<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    rotation: Option<&Matrix<S>>,
    out: &mut Output<'_>,
    work: &mut Workspace,
) -> Vector<S> {
    let JointLattice { pack: index, offset } = at;
    let numbering = input.moved.packs.numbering_of(&input.moved.packs.packs[index]);
    let n = numbering.joints[offset].len();
    let mut torque = zero(simd);
    let fields = [&work.local, &work.g].map(|field| field[..3 * n].as_chunks::<3>().0);
    for part in &numbering.parts[offset] {
        let (forces, slots) = match part.offset {
            0 => (&mut *out.f, &part.in_block),
            _ => (&mut *out.neighbour_forces, &part.in_neighbour_forces),
        };
        // The lattice at the offset of a neighbour is the first one that gives it forces.
        let (forces, overwrites) = (forces.as_chunks_mut::<3>().0, part.offset == offset);
        let target = ForceTarget { forces, slots, overwrites };
        torque = add(torque, give_forces(simd, rotation, fields, part, target));
    }
    torque
}

/// Adds the torques of a joint lattice on its own block and on each of the others `[N m]`.
#[inline(always)]
fn give_torques<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    [own, others]: [Vector<S>; 2],
    out: &mut Output<'_>,
) {
    let packs = input.moved.packs;
    let numbering = packs.numbering_of(&packs.packs[at.pack]);
    *out.torque = add(load(simd, out.torque), own).map(Lanes::from);
    for part in &numbering.parts[at.offset][1..] {
        let to = 3 * numbering.torque(part.offset);
        let before = if part.offset == at.offset {
            zero(simd)
        } else {
            load_at(simd, out.neighbour_forces, to)
        };
        store_at(out.neighbour_forces, to, add(before, others));
    }
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
