//! Second pass over a pack of rigid blocks (§8).
//!
//! Their corners collect forces as nodes do. The resultant moves the six degrees of freedom, and
//! the corners follow.

use super::{Context, PackContext};
use crate::force::rigid::{RigidBlock, at};
use crate::force::support::Supports;
use crate::model::Model;
use crate::step::frames::frame_of;
use crate::step::scratch::{Access, PackFields};
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::leapfrog::local_damping;
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::rigid::{Pose, RigidCoefficients, RigidConstraint, SpatialVector};

/// Poses of the blocks of a pack.
pub(crate) type Poses = [Pose; LANES];

impl<'a> PackContext<'a> {
    fn member(&self, poses: &'a Poses, lane: usize) -> RigidBlock<'a> {
        let mass_properties = &self.step.model.assembly.rigid[self.pack.rigid_start][lane];
        RigidBlock { mass_properties, pose: &poses[lane], lane }
    }

    fn coefficients(&self, member: &RigidBlock<'_>) -> RigidCoefficients {
        let motion = self.step.motion;
        let rates = motion.rates(member.mass_properties);
        RigidCoefficients { interval: motion.interval, rates }
    }

    fn constraint(&self, member: &RigidBlock<'_>) -> Option<RigidConstraint> {
        // A corner moves along the chord of its path. The constraint uses its position halfway
        // there.
        let motion = self.step.motion;
        let ahead = if motion.fictitious { 0.0 } else { 0.5 * motion.time_step };
        let pose = member.pose.turned_on(member.mass_properties, ahead);
        let Supports { list, velocities, first } = self.supports;
        RigidBlock { pose: &pose, ..*member }.constraint(list, velocities, first)
    }
}

/// Sets the displacement increments of the corners of a pack's blocks `[m]`. The velocities of the
/// supports are the increments of the supports.
pub(super) fn held_increments(
    pack: &PackContext<'_>,
    poses: &Poses,
    support_increments: &mut [Lanes],
) {
    for lane in 0..pack.pack.filled {
        let member = pack.member(poses, lane);
        if let Some(constraint) = pack.constraint(&member) {
            member.set_twist(constraint.target(), support_increments);
        }
    }
}

/// Adds the reactions of supports, and replaces the forces on the corners by those equivalent to
/// the total.
pub(super) fn react(pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let Supports { list, first, .. } = pack.supports;
    let poses = part.blocks.poses.get()[0];
    for lane in 0..pack.pack.filled {
        let member = pack.member(&poses, lane);
        let mut wrench = member.resultant(part.f);
        wrench.angular += at(&*part.torque, 0, lane);
        if let Some(constraint) = pack.constraint(&member) {
            let coefficients = pack.coefficients(&member);
            let free = member.free(&coefficients, &wrench, pack.step.motion.fictitious);
            let answer =
                member.react(&constraint, &coefficients, free, list, first, part.reactions);
            wrench.linear += answer.linear;
            wrench.angular += answer.angular;
        }
        member.set_forces(wrench, part.f);
    }
    *part.torque = [Lanes::ZERO; 3];
}

/// Step of one block: its pose with the velocities after the step, powers and energies.
#[derive(Default)]
struct RigidStep {
    next: Pose,
    damping: [f64; 2],
    kinetic: f64,
    /// Contributions to `power` and `change` of [`StepSums`].
    power: f64,
    change: f64,
}

fn rigid_step(pack: &PackContext<'_>, member: &RigidBlock<'_>, f: &[Lanes]) -> RigidStep {
    let RigidBlock { mass_properties, pose, .. } = *member;
    let motion = pack.step.motion;
    let coefficients = pack.coefficients(member);
    let wrench = member.resultant(f);
    let constraint = pack.constraint(member);
    let before = pose.twist(mass_properties);
    let free = constraint.as_ref().map_or(wrench, |constraint| constraint.without(wrench));
    let local = local(motion.local, free, before);
    let left = SpatialVector {
        linear: wrench.linear - local.linear,
        angular: wrench.angular - local.angular,
    };
    let mut next = pose.accelerated(mass_properties, &coefficients, &left);
    if let Some(constraint) = constraint {
        let twist = constraint.enforce(next.twist(mass_properties));
        next.velocity = twist.linear;
        next.momentum = mass_properties.momentum(&pose.turn, twist.angular);
    }
    let after = next.twist(mass_properties);
    let mut damping_force = local;
    if motion.is_damped() {
        for k in 0..3 {
            let mean = 0.5 * (pose.velocity[k] + next.velocity[k]);
            damping_force.linear[k] += coefficients.rates[k] * mass_properties.mass * mean;
        }
        damping_force.angular += (pose.momentum + next.momentum) * (0.5 * coefficients.rates[3]);
    }
    let power = |twist: SpatialVector| {
        damping_force.linear.dot(&twist.linear) + damping_force.angular.dot(&twist.angular)
    };
    let damping = [power(before), power(after)];
    if motion.before == motion.time_step {
        return RigidStep {
            next,
            damping,
            kinetic: pose.kinetic(&next, mass_properties),
            ..RigidStep::default()
        };
    }
    let change = pose.plus_velocities(&next);
    RigidStep {
        next,
        damping,
        kinetic: pose.kinetic(&pose.between(&next, motion.previous_step_ratio()), mass_properties),
        power: 2.0 * pose.kinetic(&change, mass_properties),
        change: change.kinetic(&change, mass_properties),
    }
}

/// Local damping of each of the six degrees of freedom.
fn local(alpha: f64, wrench: SpatialVector, twist: SpatialVector) -> SpatialVector {
    let each = |force: f64, v: f64| local_damping(alpha, force, v);
    SpatialVector {
        linear: wrench.linear.zip_map(&twist.linear, each),
        angular: wrench.angular.zip_map(&twist.angular, each),
    }
}

/// Computes the sums of a relaxation, which moves the blocks by a pass of its own.
pub(super) fn relaxation_sums(pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let mut sums = StepSums { applied: part.sums.applied, ..StepSums::default() };
    let v = part.blocks.v.get();
    for lane in 0..pack.pack.filled {
        for (at, (f, v)) in part.f.iter().zip(v).enumerate() {
            sums.free += f.0[lane] * f.0[lane];
            sums.power += f.0[lane] * v.0[lane];
            if part.loaded {
                sums.loads[0] += part.q[at].0[lane] * v.0[lane];
            }
        }
    }
    sums.loads[1] = sums.loads[0];
    sums.supports[0] = pack.supports.power(v, part.reactions);
    *part.sums = sums;
}

/// Moves the blocks of a pack and their corners. An evaluation computes their sums only.
pub(super) fn advance(pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let PackFields { blocks, f, sums: of_pack, reactions, q, loaded, buffer, .. } = part;
    let before = blocks.poses.get()[0];
    let v = match &mut blocks.v {
        Access::Write(v) => &mut **v,
        Access::Read(v) => {
            buffer.clear();
            buffer.extend_from_slice(v);
            &mut buffer[..]
        }
    };
    let mut sums = StepSums { applied: of_pack.applied, ..StepSums::default() };
    sums.supports[0] = pack.supports.power(v, reactions);
    let q = if *loaded { &**q } else { &[] };
    let after: Poses = std::array::from_fn(|lane| {
        if lane >= pack.pack.filled {
            return before[lane];
        }
        let member = pack.member(&before, lane);
        let rigid_step = rigid_step(pack, &member, f);
        sums.kinetic += rigid_step.kinetic;
        sums.power += rigid_step.power;
        sums.change += rigid_step.change;
        (0..2).for_each(|side| sums.damping[side] += rigid_step.damping[side]);
        f.iter().for_each(|f| sums.free += f.0[lane] * f.0[lane]);
        q.iter().zip(&*v).for_each(|(q, v)| sums.loads[0] += q.0[lane] * v.0[lane]);
        let (next, increment) =
            rigid_step.next.moved(member.mass_properties, pack.step.motion.time_step);
        for corner in 0..8 {
            let v_new =
                increment.velocity(&(before[lane].turn * member.mass_properties.arm(corner)));
            for c in 0..3 {
                v[3 * corner + c].0[lane] = v_new[c];
                sums.fastest.0[lane] = sums.fastest.0[lane].max(v_new[c].abs());
            }
        }
        sums.loads[1] += q.iter().zip(&*v).map(|(q, v)| q.0[lane] * v.0[lane]).sum::<f64>();
        next
    });
    sums.supports[1] = pack.supports.power(v, reactions);
    if let (Some(u), Some(poses), Some(frames)) =
        (blocks.u.get_mut(), blocks.poses.get_mut(), blocks.frames.get_mut())
    {
        for lane in 0..pack.pack.filled {
            place_corners(&pack.member(&after, lane), u);
        }
        poses[0] = after;
        frames[0] = frame_of(&after);
    }
    **of_pack = sums;
}

/// Sets the displacements of the corners of a block from its pose.
fn place_corners(member: &RigidBlock<'_>, u: &mut [Lanes]) {
    for corner in 0..8 {
        let value = member.pose.displacement(&member.mass_properties.arm(corner));
        (0..3).for_each(|c| u[3 * corner + c].0[member.lane] = value[c]);
    }
}

/// Poses with the velocities at the present time, between the half steps before and after, under
/// the last forces `f`.
pub(crate) fn present(context: Context<'_>, index: usize, poses: &Poses, f: &[Lanes]) -> Poses {
    let pack = PackContext::new(context, index);
    let now = |lane: usize| {
        let RigidStep { next, .. } = rigid_step(&pack, &pack.member(poses, lane), f);
        poses[lane].between(&next, 0.5 * context.motion.previous_step_ratio())
    };
    std::array::from_fn(|lane| if lane < pack.pack.filled { now(lane) } else { poses[lane] })
}

/// Sets the velocities of the corners of a pack to those of its blocks.
pub(crate) fn set_corner_velocities(model: &Model, index: usize, poses: &Poses, v: &mut [Lanes]) {
    let pack = &model.packs.packs[index];
    for (lane, pose) in poses.iter().enumerate().take(pack.filled) {
        let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
        RigidBlock { mass_properties, pose, lane }.set_twist(pose.twist(mass_properties), v);
    }
}

/// Moves the blocks of a pack in a relaxation as their corners move. The velocities `v` of the
/// corners are their displacement increments in this step. Then sets the displacements of the
/// corners from the poses.
pub(super) fn follow_corners(
    model: &Model,
    index: usize,
    poses: &mut Poses,
    u: &mut [Lanes],
    v: &[Lanes],
) {
    let pack = &model.packs.packs[index];
    for (lane, pose) in poses.iter_mut().enumerate().take(pack.filled) {
        let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
        let corner_increments = std::array::from_fn(|corner| at(v, corner, lane));
        let (next, _) = pose
            .with_corner_velocities(mass_properties, &corner_increments)
            .moved(mass_properties, 1.0);
        *pose = next.resting();
        place_corners(&RigidBlock { mass_properties, pose, lane }, u);
    }
}
