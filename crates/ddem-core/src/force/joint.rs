//! Forces of the joints: bonded cells, eq. (11), and the springs of broken ones, one joint lattice
//! of a pack at a time.
//!
//! A joint moves with the mean rotation of the bodies that it joins. Its residual torque
//! `τ = Σ x_i × g_i` (second order in strain for cells; for springs the couple of two forces across
//! the thickness) is given to these bodies in equal parts, who balance it with the same nodal
//! forces as their own: so the moments of all internal forces add up to zero, joints included.
//! The part that comes of slip goes to the body that is held, if one is: the ground on which the
//! other slides. Once all pairs of such a joint have failed its springs turn with the ground alone.

use fearless_simd::{Select, Simd, SimdBase, f64x4};
use fearless_simd_macros::simd;
use nalgebra::Matrix3;

use crate::state::pass::{Input, Output, Workspace, half_work};
use ddem_joint::breaks::{Broken, Ground, Pull, Sides};
use ddem_joint::kinematics::{Moved, joint_displacements, rotations, to_quarters};
use ddem_joint::losses::Losses;
use ddem_mechanics::element::corotation::{Frame, split_torque};
use ddem_mechanics::element::lattice::{force, force_left};
use ddem_mechanics::law::JointLaw;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, cross, dot, load, load_at, scale, splat, store_at, sub,
    times, transposed_product, transposed_times, zero,
};
use ddem_mesh::NO_JOINT;
use ddem_mesh::pack::JointLattice;
use ddem_mesh::seams::{FaceLattice, Seam};

/// Forces of one joint lattice of a pack: of its elements, and of the springs where it is broken.
#[simd]
pub(crate) fn joint<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    broken: &mut Option<Broken>,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let n = 3 * at.nodes(input.moved.packs);
    let face = input.face(at);
    let rotation = alone(simd, input, at, broken.as_ref(), work);
    let fails = fail(simd, input, at, rotation.as_ref(), broken, out.losses, work);
    if let Some([_, joints]) = &mut out.energy {
        let stored = half_work(simd, &work.local[..n], &work.g[..n])
            + in_place(simd, input, at, broken.as_ref(), &work.local[..n]);
        *joints = Lanes::from(joints.load(simd) + stored);
    }
    let mut pull = None;
    if let (Some(face), Some(broken)) = (face, broken) {
        let way = fails.then_some(&work.way[..n]);
        let bodies = rotations(simd, input.moved, at);
        let grounds = match (&rotation, &bodies) {
            (Some(mean), Some(bodies)) => grounds(simd, input, at, mean, bodies, broken),
            _ => [None; LANES],
        };
        let sides = Sides { local: &work.local[..n], way, grounds: &grounds };
        let springs = broken.pull(face, input.look, sides, &mut work.g[..n], out.losses);
        if let Some([_, joints]) = &mut out.energy {
            *joints = Lanes::from(joints.load(simd) + springs.stored.load(simd));
        }
        pull = Some((face.seam, springs, bodies));
    }
    give(simd, input, at, rotation, pull, out, work);
}

/// Forces `K u` of the elements of a joint lattice that are left.
#[simd]
fn elements<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    broken: Option<&Broken>,
    work: &mut Workspace,
) {
    let JointLattice { pack: index, offset } = at;
    let shape = input.moved.packs.shape_of(&input.moved.packs.packs[index]);
    let n = 3 * shape.joints[offset].len();
    let dims = shape.dims(offset);
    let Workspace { planes, local, g, .. } = work;
    let (local, g) = (&local[..n], &mut g[..n]);
    let table = input.assembly.pack_tables[index][offset];
    let table = input.assembly.tables.get(table as usize).map(|table| &table.table);
    match (table, broken) {
        (Some(table), None) => force(simd, dims, table, local, g, planes),
        (Some(table), Some(broken)) if broken.any_alive => {
            force_left(simd, dims, table, &broken.alive, local, g, planes);
        }
        _ => g.fill(Lanes::ZERO),
    }
    if let Some(borne) = input.borne(at) {
        borne.add(simd, broken.map(|broken| &broken.alive[..]), g);
    }
}

/// Energy of the elements that are left, beyond half the work of their forces, that is there
/// because of the stress at the start.
#[inline(always)]
fn in_place<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    broken: Option<&Broken>,
    local: &[Lanes],
) -> f64x4<S> {
    let alive = broken.map(|broken| &broken.alive[..]);
    input.borne(at).map_or(splat(simd, 0.0), |borne| borne.energy(simd, alive, local))
}

/// Lets pairs of a face joint fail, and hands the forces of elements that go over to springs.
/// Returns whether any pair failed.
#[simd]
fn fail<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    rotation: Option<&Matrix<S>>,
    broken: &mut Option<Broken>,
    losses: &mut Losses,
    work: &mut Workspace,
) -> bool {
    let Some(face) = input.face(at) else { return false };
    if input.look.failing.is_none() || (broken.is_none() && !any_fails(simd, input, face, work)) {
        return false;
    }
    let packs = input.moved.packs;
    let was_broken = broken.is_some();
    let lattice = broken.get_or_insert_with(|| {
        let tables = input.assembly.pack_tables[at.pack];
        Broken::intact(packs, &packs.packs[at.pack], tables, at.offset)
    });
    let n = 3 * at.nodes(packs);
    let before = in_place(simd, input, at, Some(lattice), &work.local[..n]);
    let fails = lattice.fail(face, input.look, &work.local[..n], &work.g[..n], losses);
    if fails {
        work.before[..n].copy_from_slice(&work.g[..n]);
        elements(simd, input, at, Some(lattice), work);
        last_way(simd, input, at, rotation, &mut work.way[..n]);
        let forces = [&work.before[..n], &work.g[..n]];
        lattice.take_over(face, &work.local[..n], &work.way[..n], forces, losses);
        let after = in_place(simd, input, at, Some(lattice), &work.local[..n]);
        losses.fracture += Lanes::from(before - after).sum();
    } else if !was_broken {
        *broken = None;
    }
    fails
}

/// The way that the nodes of a joint lattice went in the last step, in the joint's frame.
#[simd]
fn last_way<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    rotation: Option<&Matrix<S>>,
    way: &mut [Lanes],
) {
    let Some((v, time_step)) = input.last else { return way.fill(Lanes::ZERO) };
    let moved = Moved { u: v, frames: None, ..input.moved };
    joint_displacements(simd, moved, at, input.edges(at), way);
    if input.moved.packs.packs[at.pack].rigid {
        to_quarters(simd, input.face(at).map(|face| face.places), way);
    }
    for node in 0..way.len() / 3 {
        let v = scale(load_at(simd, way, 3 * node), splat(simd, time_step));
        store_at(way, 3 * node, rotation.map_or(v, |r| transposed_times(r, v)));
    }
}

/// Whether any pair of an unbroken face joint fails: all its pairs at a glance.
#[inline(always)]
fn any_fails<S: Simd>(
    simd: S,
    input: Input<'_>,
    FaceLattice { places, seam }: FaceLattice<'_>,
    work: &mut Workspace,
) -> bool {
    let law = |lane: usize| input.look.law(seam.laws[lane]);
    if (0..LANES).all(|lane| law(lane).is_none()) {
        return false;
    }
    let Workspace { g, tractions: [normals, shears], .. } = work;
    let n = LANES * places.len();
    normals.resize(n.max(normals.len()), 0.0);
    shears.resize(n.max(shears.len()), 0.0);
    let direction = [0, 1, 2].map(|c| splat(simd, seam.axes[(c, 0)]));
    let half = splat(simd, 0.5 / input.look.failing.unwrap_or(1.0));
    let per_quarter = seam.per_quarter.load(simd) * half;
    let targets =
        normals.as_chunks_mut::<LANES>().0.iter_mut().zip(shears.as_chunks_mut::<LANES>().0);
    for (place, (normal, shear)) in places.iter().zip(targets) {
        let [a, b] = place.sides;
        let difference = sub(load_at(simd, g, 3 * b), load_at(simd, g, 3 * a));
        let traction = scale(difference, per_quarter * place.share());
        let along = dot(traction, direction);
        let across = sub(traction, scale(direction, along));
        *normal = Lanes::from(along).0;
        *shear = Lanes::from(dot(across, across)).0;
    }
    let (normals, shears) = (&normals[..n], &shears[..n]);
    // Lanes mostly have one joint: then one law looks at all of them.
    let first = seam.laws.iter().position(|&law| law != NO_JOINT).unwrap_or(0);
    if seam.laws.iter().all(|law| [seam.laws[first], NO_JOINT].contains(law)) {
        return law(first).is_some_and(|law| law.any_failure(normals, shears));
    }
    let fails =
        |law: &dyn JointLaw, at: usize| law.any_failure(&normals[at..=at], &shears[at..=at]);
    let points = |lane: usize| (lane..n).step_by(LANES);
    (0..LANES).any(|lane| law(lane).is_some_and(|law| points(lane).any(|at| fails(law, at))))
}

/// The ground that the springs of each lane turn with: the body that alone is held, once all pairs have
/// failed, until a contact takes over. `mean` is the rotation of the joint's frame.
#[inline(always)]
fn grounds<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    mean: &Matrix<S>,
    bodies: &[Matrix<S>; 2],
    broken: &Broken,
) -> [Option<Ground>; LANES] {
    let Some(FaceLattice { seam, .. }) = input.face(at) else { return [None; LANES] };
    let pack = &input.moved.packs.packs[at.pack];
    let part = input.own_part(pack.upper[at.offset], at.pack);
    let stands =
        |lane: usize| part.0[lane] != 0.5 && broken.rubs(input.look, seam, lane, pack.rigid);
    let stands: [bool; LANES] = std::array::from_fn(stands);
    if !input.look.turning || stands == [false; LANES] {
        return [None; LANES];
    }
    let own = part.load(simd).simd_gt(splat(simd, 0.5));
    let [a, b] = bodies;
    let body = [0, 1, 2].map(|i| [0, 1, 2].map(|j| own.select(a[i][j], b[i][j])));
    let rows = transposed_product(mean, &body).map(|row| row.map(Lanes::from));
    std::array::from_fn(|lane| {
        let turned = || Matrix3::from_fn(|i, j| rows[i][j].0[lane]);
        stands[lane].then(|| Ground::new(&turned(), seam, lane))
    })
}

/// Seam of a broken joint, forces of its springs, and rotations of its two bodies.
type Pulled<'a, S> = (&'a Seam, Pull, Option<[Matrix<S>; 2]>);

/// Gives the forces of a joint lattice to its nodes and its torque to its bodies.
#[inline(always)]
fn give<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    rotation: Option<Matrix<S>>,
    pull: Option<Pulled<'_, S>>,
    out: &mut Output<'_>,
    work: &mut Workspace,
) {
    let JointLattice { pack: index, offset } = at;
    let pack = &input.moved.packs.packs[index];
    let shape = input.moved.packs.shape_of(pack);
    let mut torque = zero(simd);
    if rotation.is_some() {
        for i in 0..shape.joints[offset].len() {
            let (u, g) = (load_at(simd, &work.local, 3 * i), load_at(simd, &work.g, 3 * i));
            torque = add(torque, cross(u, g));
        }
    }
    if pack.rigid {
        to_quarters(simd, input.face(at).map(|face| face.places), &mut work.g);
    }
    for (i, node) in shape.joints[offset].iter().enumerate() {
        let mut gi = load_at(simd, &work.g, 3 * i);
        if let Some(rotation) = &rotation {
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
    let Some(rotation) = rotation else { return };
    let [own, others] = match pull {
        Some(pull) => part_torque(simd, input, at, &rotation, torque, pull),
        None => {
            let part = splat(simd, 1.0 / f64::from(1u32 << offset.count_ones()));
            [scale(times(&rotation, torque), part); 2]
        }
    };
    let own = add(load(simd, out.torque), own);
    *out.torque = [Lanes::from(own[0]), Lanes::from(own[1]), Lanes::from(own[2])];
    for part in (1..8).filter(|part| part & !offset == 0) {
        let at = 3 * shape.torque(part);
        let sum = add(load_at(simd, out.shares, at), others);
        store_at(out.shares, at, sum);
    }
}

/// Torques of a broken joint on its own body and the other: `torque` is that of its elements, in its frame.
#[inline(always)]
fn part_torque<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    rotation: &Matrix<S>,
    torque: Vector<S>,
    (seam, pull, bodies): Pulled<'_, S>,
) -> [Vector<S>; 2] {
    let (mut own, mut others) = (zero(simd), zero(simd));
    let torque = add(torque, cross(load(simd, seam.gap()), load(simd, &pull.force)));
    let whole = times(rotation, torque);
    if let Some(bodies) = bodies.filter(|_| pull.grounded.0 != [1.0; LANES]) {
        [own, others] = split_torque(simd, bodies, rotation, whole);
    }
    // The couple of slip goes to the body that is held, if one is; the whole torque if the springs turn with it.
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

/// Elements of a joint lattice alone: their local forces are left in the working space, and
/// turned by the rotation that is returned they are those in space.
#[simd]
fn alone<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    broken: Option<&Broken>,
    work: &mut Workspace,
) -> Option<Matrix<S>> {
    let n = 3 * at.nodes(input.moved.packs);
    work.reserve(n);
    let edges = input.edges(at);
    let rotation = joint_displacements(simd, input.moved, at, edges, &mut work.local[..n]);
    if input.moved.packs.packs[at.pack].rigid {
        to_quarters(simd, input.face(at).map(|face| face.places), &mut work.local[..n]);
    }
    elements(simd, input, at, broken, work);
    rotation
}

/// Forces that the elements of a face joint alone exert on its nodes, for the tractions (M1): in
/// the order of the lattice's nodes, in the frame of space; and the rotation of its frame.
#[simd]
pub(crate) fn face_forces<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    broken: Option<&Broken>,
    forces: &mut Vec<Lanes>,
    rotation: &mut [[Lanes; 3]; 3],
    work: &mut Workspace,
) {
    let n = at.nodes(input.moved.packs);
    forces.resize(3 * n, Lanes::ZERO);
    let turned = alone(simd, input, at, broken, work);
    for i in 0..n {
        let g = load_at(simd, &work.g, 3 * i);
        let g = turned.as_ref().map_or(g, |r| times(r, g));
        store_at(forces, 3 * i, sub(zero(simd), g));
    }
    *rotation = match turned {
        Some(r) => r.map(|row| row.map(Lanes::from)),
        None => Frame::REST.rotation,
    };
}

/// Energy of the elements of a joint lattice that are left `[J]`.
#[simd]
pub(crate) fn cell_energy<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    broken: Option<&Broken>,
    work: &mut Workspace,
) -> f64 {
    let n = 3 * at.nodes(input.moved.packs);
    alone(simd, input, at, broken, work);
    let in_place = in_place(simd, input, at, broken, &work.local[..n]);
    Lanes::from(half_work(simd, &work.local[..n], &work.g[..n]) + in_place).sum()
}
