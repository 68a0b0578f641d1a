//! §8: the second pass over a pack of rigid bodies.
//!
//! Their corners have collected forces as nodes do. What these amount to moves the six degrees of
//! freedom, and the corners follow.

use super::{Context, PackContext};
use crate::force::rigid::{Member, at};
use crate::force::support::Supports;
use crate::model::Model;
use crate::step::frames::frame_of;
use crate::step::scratch::{Access, Part};
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::leapfrog::local_damping;
use ddem_mechanics::math::sums::Sums;
use ddem_mechanics::rigid::{Gait, Hold, Pose, Wrench};

/// Poses of the bodies of a pack.
pub(crate) type Poses = [Pose; LANES];

impl<'a> PackContext<'a> {
    fn member(&self, poses: &'a Poses, lane: usize) -> Member<'a> {
        let matter = &self.step.model.assembly.rigid[self.pack.rigid_start][lane];
        Member { matter, pose: &poses[lane], lane }
    }

    fn gait(&self, member: &Member<'_>) -> Gait {
        let motion = self.step.motion;
        let rates = motion.rates(member.matter);
        Gait { interval: motion.interval, rates }
    }

    fn hold(&self, member: &Member<'_>) -> Option<Hold> {
        // A corner goes along the chord of its way: as it lies halfway there it is held.
        let motion = self.step.motion;
        let ahead = if motion.fictitious { 0.0 } else { 0.5 * motion.time_step };
        let pose = member.pose.ahead(member.matter, ahead);
        let Supports { list, velocities, first } = self.supports;
        Member { pose: &pose, ..*member }.hold(list, velocities, first)
    }
}

/// Ways of the corners of the bodies of a pack, whose supports have the velocities for ways `[m]`.
pub(super) fn held_ways(pack: &PackContext<'_>, poses: &Poses, ways: &mut [Lanes]) {
    for lane in 0..pack.pack.filled {
        let member = pack.member(poses, lane);
        if let Some(hold) = pack.hold(&member) {
            member.set_twist(hold.target(), ways);
        }
    }
}

/// Supports answer, and the forces on the corners become those that are equivalent to all.
pub(super) fn react(pack: &PackContext<'_>, part: &mut Part<'_>) {
    let Supports { list, first, .. } = pack.supports;
    let poses = part.bodies.poses.get()[0];
    for lane in 0..pack.pack.filled {
        let member = pack.member(&poses, lane);
        let mut wrench = member.resultant(part.f);
        wrench.angular += at(&*part.torque, 0, lane);
        if let Some(hold) = pack.hold(&member) {
            let gait = pack.gait(&member);
            let free = member.free(&gait, &wrench, pack.step.motion.fictitious);
            let answer = member.react(&hold, &gait, free, list, first, part.reactions);
            wrench.linear += answer.linear;
            wrench.angular += answer.angular;
        }
        member.set_forces(wrench, part.f);
    }
    *part.torque = [Lanes::ZERO; 3];
}

/// One body's step: its pose with the velocities after it, and powers.
#[derive(Default)]
struct Stride {
    next: Pose,
    damping: [f64; 2],
    kinetic: f64,
    /// As in [`Sums`].
    power: f64,
    change: f64,
}

fn stride(pack: &PackContext<'_>, member: &Member<'_>, f: &[Lanes]) -> Stride {
    let Member { matter, pose, .. } = *member;
    let motion = pack.step.motion;
    let gait = pack.gait(member);
    let wrench = member.resultant(f);
    let hold = pack.hold(member);
    let before = pose.twist(matter);
    let free = hold.as_ref().map_or(wrench, |hold| hold.without(wrench));
    let local = local(motion.local, free, before);
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
    if motion.is_damped() {
        for k in 0..3 {
            let mean = 0.5 * (pose.velocity[k] + next.velocity[k]);
            drag.linear[k] += gait.rates[k] * matter.mass * mean;
        }
        drag.angular += (pose.momentum + next.momentum) * (0.5 * gait.rates[3]);
    }
    let power = |twist: Wrench| drag.linear.dot(&twist.linear) + drag.angular.dot(&twist.angular);
    let damping = [power(before), power(after)];
    if motion.before == motion.time_step {
        return Stride { next, damping, kinetic: pose.kinetic(&next, matter), ..Stride::default() };
    }
    let change = pose.further(&next);
    Stride {
        next,
        damping,
        kinetic: pose.kinetic(&pose.towards(&next, motion.behind()), matter),
        power: 2.0 * pose.kinetic(&change, matter),
        change: change.kinetic(&change, matter),
    }
}

/// Local damping of each of the six.
fn local(alpha: f64, wrench: Wrench, twist: Wrench) -> Wrench {
    let each = |force: f64, v: f64| local_damping(alpha, force, v);
    Wrench {
        linear: wrench.linear.zip_map(&twist.linear, each),
        angular: wrench.angular.zip_map(&twist.angular, each),
    }
}

/// Sums of a relaxation, which moves the bodies in another way.
pub(super) fn weigh(pack: &PackContext<'_>, part: &mut Part<'_>) {
    let mut sums = Sums { applied: part.sums.applied, ..Sums::default() };
    let v = part.bodies.v.get();
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

/// Moves the bodies of a pack, and their corners; in a trial leaves their sums alone.
pub(super) fn advance(pack: &PackContext<'_>, part: &mut Part<'_>) {
    let Part { bodies, f, sums: of_pack, reactions, q, loaded, room, .. } = part;
    let before = bodies.poses.get()[0];
    let v = match &mut bodies.v {
        Access::Write(v) => &mut **v,
        Access::Read(v) => {
            room.clear();
            room.extend_from_slice(v);
            &mut room[..]
        }
    };
    let mut sums = Sums { applied: of_pack.applied, ..Sums::default() };
    sums.supports[0] = pack.supports.power(v, reactions);
    let q = if *loaded { &**q } else { &[] };
    let after: Poses = std::array::from_fn(|lane| {
        if lane >= pack.pack.filled {
            return before[lane];
        }
        let member = pack.member(&before, lane);
        let stride = stride(pack, &member, f);
        sums.kinetic += stride.kinetic;
        sums.power += stride.power;
        sums.change += stride.change;
        (0..2).for_each(|side| sums.damping[side] += stride.damping[side]);
        f.iter().for_each(|f| sums.free += f.0[lane] * f.0[lane]);
        q.iter().zip(&*v).for_each(|(q, v)| sums.loads[0] += q.0[lane] * v.0[lane]);
        let (next, way) = stride.next.moved(member.matter, pack.step.motion.time_step);
        for corner in 0..8 {
            let v_new = way.velocity(&(before[lane].turn * member.matter.arm(corner)));
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
        (bodies.u.get_mut(), bodies.poses.get_mut(), bodies.frames.get_mut())
    {
        for lane in 0..pack.pack.filled {
            place_corners(&pack.member(&after, lane), u);
        }
        poses[0] = after;
        frames[0] = frame_of(&after);
    }
    **of_pack = sums;
}

/// Puts the corners of a body where its pose takes them.
fn place_corners(member: &Member<'_>, u: &mut [Lanes]) {
    for corner in 0..8 {
        let value = member.pose.displacement(&member.matter.arm(corner));
        (0..3).for_each(|c| u[3 * corner + c].0[member.lane] = value[c]);
    }
}

/// Poses with the velocities at the present time, between the half steps before and after, under the
/// forces `f` that were last balanced.
pub(crate) fn present(context: Context<'_>, index: usize, poses: &Poses, f: &[Lanes]) -> Poses {
    let pack = PackContext::new(context, index);
    let now = |lane: usize| {
        let Stride { next, .. } = stride(&pack, &pack.member(poses, lane), f);
        poses[lane].towards(&next, 0.5 * context.motion.behind())
    };
    std::array::from_fn(|lane| if lane < pack.pack.filled { now(lane) } else { poses[lane] })
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
pub(super) fn follow(model: &Model, index: usize, poses: &mut Poses, u: &mut [Lanes], v: &[Lanes]) {
    let pack = &model.packs.packs[index];
    for (lane, pose) in poses.iter_mut().enumerate().take(pack.filled) {
        let matter = &model.assembly.rigid[pack.rigid_start][lane];
        let ways = std::array::from_fn(|corner| at(v, corner, lane));
        let (next, _) = pose.moving(matter, &ways).moved(matter, 1.0);
        *pose = next.resting();
        place_corners(&Member { matter, pose, lane }, u);
    }
}
