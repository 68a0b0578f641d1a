//! Forces of the springs of a broken joint lattice on its nodes, and their torque on its blocks.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use crate::state::pass::{Input, Output, Workspace};
use ddem_joint::broken::{BrokenLattice, LatticeMotion};
use ddem_joint::kinematics::{NodePositions, rotations};
use ddem_joint::pair_kinematics::{
    PairFrame, give_pair_forces, relative_displacements, to_quarters,
};
use ddem_mechanics::element::corotation::split_torque;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, cross, load, scale, sub, times, zero,
};
use ddem_mesh::joint_sections::FaceLattice;
use ddem_mesh::pack::JointLattice;

/// Springs of a face joint at the relative displacements in the working space.
pub(super) struct Springs<'a, S: Simd> {
    pub(super) at: JointLattice,
    pub(super) face: FaceLattice<'a>,
    /// Rotation of the joint's frame to global axes; `None` for small displacements.
    pub(super) rotation: Option<&'a Matrix<S>>,
    /// Axes of the pairs.
    pub(super) pairs: &'a PairFrame<S>,
    /// True if a pair has failed in this step.
    pub(super) just_failed: bool,
    /// True if elements of the joint have given forces to the neighbours.
    pub(super) has_elements: bool,
    /// Torque of these elements in the joint's frame `[N m]`.
    pub(super) element_torque: Vector<S>,
}

impl<S: Simd> Springs<'_, S> {
    /// Adds the forces of the springs to the nodes. Returns the torques of the whole joint on its
    /// own block and on the other `[N m]`.
    #[inline(always)]
    pub(super) fn add_forces(
        &self,
        simd: S,
        input: &Input<'_>,
        broken: &mut BrokenLattice,
        out: &mut Output<'_>,
        work: &mut Workspace,
    ) -> [Vector<S>; 2] {
        let FaceLattice { node_pairs, section } = self.face;
        let blocks = rotations(simd, &input.moved, self.at);
        let grounds = match (self.rotation, &blocks) {
            (Some(mean), Some(blocks)) => input.grounds(simd, self.at, mean, blocks, broken),
            _ => [None; LANES],
        };
        let n = 3 * node_pairs.len();
        let du = self.just_failed.then_some(&work.pair_du[..n]);
        let motion = LatticeMotion { relative: &work.relative[..n], du, grounds: &grounds };
        let (context, forces) = (input.pair_context, &mut work.pair_forces[..n]);
        let sums = broken.spring_forces(simd, section, context, motion, forces, out.losses);
        if let Some([_, joints]) = &mut out.energy {
            *joints = Lanes::from(joints.load(simd) + sums.stored.load(simd));
        }
        if input.moved.packs.packs[self.at.pack].rigid {
            to_quarters(simd, forces);
        }
        let targets = [&mut *out.f, &mut *out.neighbour_forces];
        let axes = &self.pairs.axes;
        give_pair_forces(simd, axes, node_pairs, forces, targets, !self.has_elements);
        let (Some(rotation), Some(blocks)) = (self.rotation, &blocks) else {
            return [zero(simd); 2];
        };
        let across = cross(PairFrame::gap(simd, section), load(simd, &sums.force));
        let torque = times(axes, add(load(simd, &sums.torque), across));
        let whole = add(times(rotation, self.element_torque), torque);
        let mut parts = [zero(simd); 2];
        if sums.grounded.0 != [1.0; LANES] {
            parts = split_torque(simd, blocks, rotation, whole);
        }
        let couple = times(axes, load(simd, &sums.couple));
        self.held_parts(simd, input, parts, [whole, couple], sums.grounded)
    }

    /// Corrects the parts of the torque `whole` for held blocks: such a block takes the couple due to
    /// slip, and the whole torque where the springs rotate with it (`grounded`).
    #[inline(always)]
    fn held_parts(
        &self,
        simd: S,
        input: &Input<'_>,
        [own, others]: [Vector<S>; 2],
        [whole, couple]: [Vector<S>; 2],
        grounded: Lanes,
    ) -> [Vector<S>; 2] {
        let JointLattice { pack, offset } = self.at;
        let part = input.own_part(input.moved.packs.packs[pack].upper[offset], pack).load(simd);
        let (more, grounded) = (scale(couple, part - 0.5), grounded.load(simd));
        let own_change = scale(sub(scale(whole, part), own), grounded);
        let others_change = scale(sub(scale(whole, part * -1.0 + 1.0), others), grounded);
        [add(own, add(more, own_change)), add(others, sub(others_change, more))]
    }
}

/// Computes the increments of the relative displacements of pairs in the last step, along the
/// joint's axes `[m]`.
#[simd]
pub(super) fn last_pair_du<S: Simd>(
    simd: S,
    input: &Input<'_>,
    at: JointLattice,
    face: FaceLattice<'_>,
    frame: Option<&PairFrame<S>>,
    du: &mut [Lanes],
) {
    let (Some((v, time_step)), Some(frame)) = (input.last, frame) else {
        return du.fill(Lanes::ZERO);
    };
    let moved = NodePositions { u: v, frames: None, ..input.moved };
    relative_displacements(simd, &moved, at, face, &frame.of_rates(simd), du);
    for du in du {
        *du = Lanes::from(du.load(simd) * time_step);
    }
}
