//! Torques of broken joints on their two blocks, and the blocks with which their springs rotate.

use fearless_simd::{Select, Simd, SimdBase};
use nalgebra::Matrix3;

use crate::state::pass::Input;
use ddem_joint::broken::{BrokenLattice, GroundFrame, SpringForces};
use ddem_mechanics::element::corotation::split_torque;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, cross, load, scale, splat, sub, times, transposed_product,
    zero,
};
use ddem_mesh::joint_sections::{FaceLattice, JointSection};
use ddem_mesh::pack::JointLattice;

/// Frames of the ground blocks with which the springs of each lane rotate. The ground is the only
/// held block of a joint once all pairs have failed, until a contact replaces the joint. `mean` is
/// the rotation of the joint's frame.
#[inline(always)]
pub(super) fn grounds<S: Simd>(
    simd: S,
    input: Input<'_>,
    at: JointLattice,
    mean: &Matrix<S>,
    blocks: &[Matrix<S>; 2],
    broken: &BrokenLattice,
) -> [Option<GroundFrame>; LANES] {
    let Some(FaceLattice { section, .. }) = input.face(at) else { return [None; LANES] };
    let pack = &input.moved.packs.packs[at.pack];
    let part = input.own_part(pack.upper[at.offset], at.pack);
    let context = input.pair_context;
    let stands: [bool; LANES] = std::array::from_fn(|lane| {
        part.0[lane] != 0.5 && broken.has_failed_in_place(context, section, lane, pack.rigid)
    });
    if !context.turning || stands == [false; LANES] {
        return [None; LANES];
    }
    let own = part.load(simd).simd_gt(splat(simd, 0.5));
    let [a, b] = blocks;
    let ground = [0, 1, 2].map(|i| [0, 1, 2].map(|j| own.select(a[i][j], b[i][j])));
    let rows = transposed_product(mean, &ground).map(|row| row.map(Lanes::from));
    std::array::from_fn(|lane| {
        let turned = || Matrix3::from_fn(|i, j| rows[i][j].0[lane]);
        stands[lane].then(|| GroundFrame::new(&turned(), section, lane))
    })
}

/// Section of a broken joint, forces of its springs, and rotations of its two blocks.
pub(super) type BrokenJointForces<'a, S> = (&'a JointSection, SpringForces, Option<[Matrix<S>; 2]>);

/// Torques of a broken joint on its own block and on the other `[N m]`. `torque` is that of its
/// elements, in the joint's frame.
#[inline(always)]
pub(super) fn part_torque<S: Simd>(
    simd: S,
    input: Input<'_>,
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
