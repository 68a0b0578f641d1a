//! §8: the second pass over a pack of rigid bodies.
//!
//! Their corners have collected forces as nodes do. What these amount to moves the six degrees of
//! freedom, and the corners follow.

use super::Context;
use crate::force::rigid::{Member, at};
use crate::lanes::{LANES, Lanes};
use crate::model::Model;
use crate::rigid::{Gait, Hold, Pose, Wrench};
use crate::scratch::Part;
use crate::sums::Sums;

/// Poses of the bodies of a pack.
pub(crate) type Poses = [Pose; LANES];

impl<'a> Context<'a> {
    fn member(self, index: usize, poses: &'a Poses, lane: usize) -> Member<'a> {
        let rigid = self.model.packs.packs[index].rigid_start;
        Member { matter: &self.model.assembly.rigid[rigid][lane], pose: &poses[lane], lane }
    }

    fn gait(self, member: &Member<'_>) -> Gait {
        let Self { motion, .. } = self;
        let rates = motion.rates(member.matter);
        Gait { time_step: motion.time_step, rates, start: motion.start }
    }

    fn hold(self, index: usize, member: &Member<'_>) -> Option<Hold> {
        let supports = &self.active.supports[self.active.supports_of(index)];
        let first = 3 * self.model.packs.packs[index].start;
        // A corner goes along the chord of its way: as it lies halfway there it is held.
        let ahead = if self.motion.fictitious { 0.0 } else { 0.5 * self.motion.time_step };
        let pose = member.pose.ahead(member.matter, ahead);
        Member { pose: &pose, ..*member }.hold(supports, self.velocities, first)
    }
}

impl Context<'_> {
    /// Ways of the corners of the bodies of a pack, whose supports have the velocities for ways `[m]`.
    pub(super) fn held_ways(self, index: usize, poses: &Poses, ways: &mut [Lanes]) {
        for lane in 0..self.model.packs.packs[index].filled {
            let member = self.member(index, poses, lane);
            if let Some(hold) = self.hold(index, &member) {
                member.set_twist(hold.target(), ways);
            }
        }
    }
}

/// Supports answer, and the forces on the corners become those that are equivalent to all.
pub(super) fn react(context: Context<'_>, index: usize, poses: &Poses, part: &mut Part<'_>) {
    let pack = &context.model.packs.packs[index];
    let supports = &context.active.supports[context.active.supports_of(index)];
    for lane in 0..pack.filled {
        let member = context.member(index, poses, lane);
        let mut wrench = member.resultant(part.f);
        wrench.angular += at(&*part.torque, 0, lane);
        if let Some(hold) = context.hold(index, &member) {
            let how = (&hold, &context.gait(&member), context.motion.fictitious);
            wrench = member.react(how, wrench, (supports, 3 * pack.start), part.reactions);
        }
        member.set_forces(wrench, part.f);
    }
    *part.torque = [Lanes::ZERO; 3];
}

/// What one body's step does: its pose after it, and powers.
struct Stride {
    next: Pose,
    damping: [f64; 2],
    kinetic: f64,
    /// As in [`Sums`].
    ahead: f64,
}

fn stride(context: Context<'_>, index: usize, member: &Member<'_>, f: &[Lanes]) -> Stride {
    let Member { matter, pose, .. } = *member;
    let gait = context.gait(member);
    let wrench = member.resultant(f);
    let hold = context.hold(index, member);
    let before = pose.twist(matter);
    let free = hold.as_ref().map_or(wrench, |hold| hold.without(wrench));
    let local = local_damping(context.motion.local, free, before);
    let left =
        Wrench { linear: wrench.linear - local.linear, angular: wrench.angular - local.angular };
    let mut next = pose.pushed(matter, &gait, &left);
    if let Some(hold) = hold {
        let twist = hold.enforced(next.twist(matter));
        next.velocity = twist.linear;
        next.momentum = matter.momentum(&pose.turn, twist.angular);
    }
    let after = next.twist(matter);
    let mut drag = local;
    if context.motion.damped {
        // The first half step of a stage is damped by the velocity at its start.
        let then = if gait.start { pose } else { &next };
        for k in 0..3 {
            let mean = 0.5 * (pose.velocity[k] + then.velocity[k]);
            drag.linear[k] += gait.rates[k] * matter.mass * mean;
        }
        drag.angular += (pose.momentum + then.momentum) * (0.5 * gait.rates[3]);
    }
    let power = |twist: Wrench| drag.linear.dot(&twist.linear) + drag.angular.dot(&twist.angular);
    let [kinetic, ahead] = if gait.start {
        [pose.kinetic(pose, matter), pose.further(&next).kinetic(&pose.further(&next), matter)]
    } else {
        [pose.kinetic(&next, matter), 0.0]
    };
    Stride { next, damping: [power(before), power(after)], kinetic, ahead }
}

/// Cundall's local damping of each of the six, against the motion.
fn local_damping(alpha: f64, wrench: Wrench, twist: Wrench) -> Wrench {
    let each = |force: f64, v: f64| if v == 0.0 { 0.0 } else { alpha * force.abs() * v.signum() };
    Wrench {
        linear: wrench.linear.zip_map(&twist.linear, each),
        angular: wrench.angular.zip_map(&twist.angular, each),
    }
}

/// Sums of a pack that does not move.
pub(super) fn weigh(
    context: Context<'_>,
    index: usize,
    (v, poses): (&[Lanes], &Poses),
    part: &mut Part<'_>,
) {
    let mut sums = Sums { applied: part.sums.applied, ..Sums::default() };
    for lane in 0..context.model.packs.packs[index].filled {
        let member = context.member(index, poses, lane);
        for (f, v) in part.f.iter().zip(v) {
            sums.free += f.0[lane] * f.0[lane];
            if context.motion.fictitious {
                sums.power += f.0[lane] * v.0[lane];
            }
        }
        let mut after = v;
        let moved;
        if !context.motion.fictitious {
            let stride = stride(context, index, &member, part.f);
            sums.kinetic += stride.kinetic;
            sums.ahead += stride.ahead;
            (0..2).for_each(|side| sums.damping[side] += stride.damping[side]);
            if part.loaded {
                moved = moved_corners(&member, &stride.next);
                after = &moved;
            }
        }
        add_loads(part, lane, (v, after), &mut sums);
    }
    *part.sums = sums;
}

/// Velocities of the corners in a pose.
fn moved_corners(member: &Member<'_>, next: &Pose) -> [Lanes; 24] {
    let mut v = [Lanes::ZERO; 24];
    member.set_twist(next.twist(member.matter), &mut v);
    v
}

fn add_loads(part: &Part<'_>, lane: usize, (v, after): (&[Lanes], &[Lanes]), sums: &mut Sums) {
    if part.loaded {
        for ((q, v), after) in part.q.iter().zip(v).zip(after) {
            sums.loads[0] += q.0[lane] * v.0[lane];
            sums.loads[1] += q.0[lane] * after.0[lane];
        }
    }
}

/// Moves the bodies of a pack, and their corners.
pub(super) fn advance(
    context: Context<'_>,
    index: usize,
    part: &mut Part<'_>,
    (poses, u, v): (&mut Poses, &mut [Lanes], &mut [Lanes]),
) {
    let mut sums = Sums { applied: part.sums.applied, ..Sums::default() };
    for lane in 0..context.model.packs.packs[index].filled {
        let member = context.member(index, poses, lane);
        let stride = stride(context, index, &member, part.f);
        (0..2).for_each(|side| sums.damping[side] += stride.damping[side]);
        for (at, f) in part.f.iter().enumerate() {
            sums.free += f.0[lane] * f.0[lane];
            if part.loaded {
                sums.loads[0] += part.q[at].0[lane] * v[at].0[lane];
            }
        }
        let (next, way) = stride.next.moved(member.matter, context.motion.time_step);
        for corner in 0..8 {
            let arm = member.matter.arm(corner);
            let (u_new, v_new) = (next.displacement(&arm), way.velocity(&(poses[lane].turn * arm)));
            for c in 0..3 {
                u[3 * corner + c].0[lane] = u_new[c];
                v[3 * corner + c].0[lane] = v_new[c];
                sums.fastest.0[lane] = sums.fastest.0[lane].max(v_new[c].abs());
            }
        }
        poses[lane] = next;
        if part.loaded {
            let power = part.q.iter().zip(&*v).map(|(q, v)| q.0[lane] * v.0[lane]);
            sums.loads[1] += power.sum::<f64>();
        }
    }
    *part.sums = sums;
}

/// Poses with the velocities at the present time, the mean of the half steps before and after,
/// under the forces `f` that were last balanced.
pub(crate) fn present(context: Context<'_>, index: usize, poses: &Poses, f: &[Lanes]) -> Poses {
    let mut now = *poses;
    for lane in 0..context.model.packs.packs[index].filled {
        let member = context.member(index, poses, lane);
        let Stride { next, .. } = stride(context, index, &member, f);
        now[lane].velocity = (poses[lane].velocity + next.velocity) * 0.5;
        now[lane].momentum = (poses[lane].momentum + next.momentum) * 0.5;
    }
    now
}

/// Poses with the velocities half a step before the present time, at which they have those given:
/// the inverse of [`present`].
pub(crate) fn before(context: Context<'_>, index: usize, poses: &Poses, f: &[Lanes]) -> Poses {
    let mut old = *poses;
    for lane in 0..context.model.packs.packs[index].filled {
        let member = context.member(index, poses, lane);
        let gait = Gait { start: false, ..context.gait(&member) };
        let wrench = member.resultant(f);
        let twist = poses[lane].twist(member.matter);
        let local = local_damping(context.motion.local, wrench, twist);
        for k in 0..3 {
            let [keep, push] = gait.numbers(gait.rates[k]);
            let added = push / member.matter.mass * (wrench.linear[k] - local.linear[k]);
            old[lane].velocity[k] = (2.0 * poses[lane].velocity[k] - added) / (1.0 + keep);
        }
        let [keep, push] = gait.numbers(gait.rates[3]);
        let added = (wrench.angular - local.angular) * push;
        old[lane].momentum = (poses[lane].momentum * 2.0 - added) / (1.0 + keep);
    }
    old
}

/// Sets the velocities of the corners of a pack to those of its bodies.
pub(crate) fn carry(model: &Model, index: usize, poses: &Poses, v: &mut [Lanes]) {
    let pack = &model.packs.packs[index];
    for (lane, pose) in poses.iter().enumerate().take(pack.filled) {
        let matter = &model.assembly.rigid[pack.rigid_start][lane];
        Member { matter, pose, lane }.set_twist(pose.twist(matter), v);
    }
}

/// In relaxation the bodies of a pack go as their corners do, whose velocities `v` are the ways of
/// this step; the corners are put where that takes them.
pub(super) fn follow(
    model: &Model,
    index: usize,
    poses: &mut Poses,
    (u, v): (&mut [Lanes], &[Lanes]),
) {
    let pack = &model.packs.packs[index];
    for (lane, pose) in poses.iter_mut().enumerate().take(pack.filled) {
        let matter = &model.assembly.rigid[pack.rigid_start][lane];
        let ways = std::array::from_fn(|corner| at(v, corner, lane));
        let (next, _) = pose.moving(matter, &ways).moved(matter, 1.0);
        *pose = next.resting();
        for corner in 0..8 {
            let value = next.displacement(&matter.arm(corner));
            (0..3).for_each(|c| u[3 * corner + c].0[lane] = value[c]);
        }
    }
}
