//! Second pass over a pack of rigid blocks (§8).
//!
//! Their corners collect forces as nodes do; contacts add a wrench. The resultant moves the six
//! degrees of freedom, and the corners follow.

use fearless_simd::{Simd, SimdBase};

use super::bodies::{self, BodyStep};
use super::{Context, PackContext};
use crate::force::rigid::{RigidBlock, at};
use crate::force::support::Supports;
use crate::model::Model;
use crate::state::motion::Motion;
use crate::step::frames::frame_of;
use crate::step::scratch::{Access, PackFields};
use ddem_mechanics::math::lanes::{LANES, Lanes, add, load, splat};
use ddem_mechanics::math::leapfrog::local_damping;
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::rigid::{
    CornerArms, LinearField, MassProperties, Pose, RigidCoefficients, RigidConstraint,
    SpatialLanes, SpatialVector, resultants, set_at_corners,
};
use ddem_mesh::pack::Pack;
use ddem_mesh::parallel::node_start;

/// Poses of the blocks of a pack.
pub(crate) type Poses = [Pose; LANES];

impl<'a> PackContext<'a> {
    fn member(&self, poses: &'a Poses, lane: usize) -> RigidBlock<'a> {
        let mass_properties = &self.step.model.assembly.rigid[self.pack.rigid_start][lane];
        RigidBlock { mass_properties, pose: &poses[lane], lane }
    }

    /// Body of several blocks that the block in a lane is a part of.
    fn body(&self, lane: usize) -> Option<usize> {
        self.step.model.assembly.bodies.body(self.index, lane)
    }

    /// Arms of the corners of its rigid blocks.
    fn arms(&self) -> &'a CornerArms {
        &self.step.model.assembly.arms[self.pack.rigid_start]
    }

    fn constraint(&self, member: &RigidBlock<'_>) -> Option<RigidConstraint> {
        let pose = halfway(self.step.motion, member);
        let ahead = RigidBlock { pose: &pose, ..*member };
        let Supports { list, velocities, first } = self.supports;
        let supported = ahead.supported(list, velocities, first);
        RigidConstraint::new(member.mass_properties.size(), supported)
    }
}

/// Pose in the middle of a step, at which supports act: a corner moves along the chord of its path.
pub(super) fn halfway(motion: &Motion, member: &RigidBlock<'_>) -> Pose {
    let ahead = if motion.fictitious { 0.0 } else { 0.5 * motion.time_step };
    member.pose.turned_on(member.mass_properties, ahead)
}

/// Sets the displacement increments of the corners of a pack's blocks `[m]`. The velocities of the
/// supports are the increments of the supports.
pub(super) fn held_increments(
    pack: &PackContext<'_>,
    poses: &Poses,
    support_increments: &mut [Lanes],
) {
    for lane in (0..pack.pack.filled).filter(|&lane| pack.body(lane).is_none()) {
        let member = pack.member(poses, lane);
        if let Some(constraint) = pack.constraint(&member) {
            member.set_twist(constraint.target(), support_increments);
        }
    }
}

/// Sums the forces on the corners of a pack's blocks.
#[inline(always)]
pub(super) fn sum_forces<S: Simd>(simd: S, pack: &PackContext<'_>, part: &mut PackFields<'_>) {
    let rotation = part.blocks.frames.get()[0].matrix(simd);
    let SpatialLanes { linear, angular } = resultants(simd, pack.arms(), &rotation, part.f);
    let torque = add(load(simd, &part.wrench.angular), load(simd, &angular));
    *part.wrench = SpatialLanes { linear, angular: torque.map(Lanes::from) };
}

/// Adds the reactions of supports, and replaces the forces on the corners by those equivalent to
/// the total. Returns the total wrenches on blocks that are no parts of bodies.
#[inline(always)]
pub(super) fn react<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    part: &mut PackFields<'_>,
    bodies: &[BodyStep],
) -> [SpatialVector; LANES] {
    let Supports { list, first, .. } = pack.supports;
    let poses = part.blocks.poses.get()[0];
    let mut forces = [LinearField::default(); LANES];
    let mut wrenches = [SpatialVector::default(); LANES];
    for lane in 0..pack.pack.filled {
        let member = pack.member(&poses, lane);
        if let Some(body) = pack.body(lane) {
            forces[lane] = bodies[body].corner_forces;
            continue;
        }
        let mut wrench = part.wrench.of(lane);
        if let Some(constraint) = pack.constraint(&member) {
            let answer = reaction(pack.step.motion, &member, &constraint, &wrench);
            member.set_reactions(&constraint, answer, list, first, part.reactions);
            wrench.linear += answer.linear;
            wrench.angular += answer.angular;
        }
        (forces[lane], wrenches[lane]) = (member.corner_forces(wrench), wrench);
    }
    set_at_corners(simd, pack.arms(), &forces, part.f);
    *part.wrench = SpatialLanes::default();
    wrenches
}

/// Wrench with which supports correct the velocities after a step under another wrench. A relaxation
/// starts from zero velocities.
pub(super) fn reaction(
    motion: &Motion,
    member: &RigidBlock<'_>,
    constraint: &RigidConstraint,
    wrench: &SpatialVector,
) -> SpatialVector {
    let RigidBlock { mass_properties, pose, .. } = *member;
    let coefficients = coefficients(motion, mass_properties);
    let rest = Pose { turn: pose.turn, ..Pose::default() };
    let start = if motion.fictitious { rest } else { *pose };
    let free = start.accelerated(mass_properties, &coefficients, wrench).twist(mass_properties);
    constraint.reaction_wrench(mass_properties, &coefficients, &pose.turn, free)
}

fn coefficients(motion: &Motion, mass_properties: &MassProperties) -> RigidCoefficients {
    RigidCoefficients { interval: motion.interval, rates: motion.rates(mass_properties) }
}

/// Step of one block: its pose with the velocities after the step, powers and energies.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RigidStep {
    pub(super) next: Pose,
    damping: [f64; 2],
    kinetic: f64,
    /// Contributions to `power` and `change` of [`StepSums`].
    power: f64,
    change: f64,
}

/// Step of a block under the wrench of all forces on it, those of supports included.
pub(super) fn rigid_step(
    motion: &Motion,
    member: &RigidBlock<'_>,
    wrench: SpatialVector,
    constraint: Option<&RigidConstraint>,
) -> RigidStep {
    let RigidBlock { mass_properties, pose, .. } = *member;
    let coefficients = coefficients(motion, mass_properties);
    let before = pose.twist(mass_properties);
    let free = constraint.map_or(wrench, |constraint| constraint.without(wrench));
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

/// Step of a block that is no part of a body, under the wrench of all forces on it.
fn step_of(pack: &PackContext<'_>, member: &RigidBlock<'_>, wrench: SpatialVector) -> RigidStep {
    let constraint = pack.constraint(member);
    rigid_step(pack.step.motion, member, wrench, constraint.as_ref())
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

/// Moves the blocks of a pack and their corners. An evaluation computes their sums only. The first
/// part of a body has the energies of all of it.
#[inline(always)]
pub(super) fn advance<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    part: &mut PackFields<'_>,
    bodies: &[BodyStep],
    wrenches: &[SpatialVector; LANES],
) {
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
    let mut velocities = [LinearField::default(); LANES];
    let after: Poses = std::array::from_fn(|lane| {
        if lane >= pack.pack.filled {
            return before[lane];
        }
        let member = pack.member(&before, lane);
        let rigid_step = match pack.body(lane) {
            Some(body) => bodies[body].step,
            None => step_of(pack, &member, wrenches[lane]),
        };
        if pack.step.model.assembly.bodies.counts(pack.index, lane) {
            sums.kinetic += rigid_step.kinetic;
            sums.power += rigid_step.power;
            sums.change += rigid_step.change;
            (0..2).for_each(|side| sums.damping[side] += rigid_step.damping[side]);
        }
        f.iter().for_each(|f| sums.free += f.0[lane] * f.0[lane]);
        q.iter().zip(&*v).for_each(|(q, v)| sums.loads[0] += q.0[lane] * v.0[lane]);
        let (next, increment) =
            rigid_step.next.moved(member.mass_properties, pack.step.motion.time_step);
        velocities[lane] = increment.velocities(&before[lane].turn);
        next
    });
    set_at_corners(simd, pack.arms(), &velocities, v);
    sums.fastest = largest(simd, v);
    for lane in 0..pack.pack.filled {
        sums.loads[1] += q.iter().zip(&*v).map(|(q, v)| q.0[lane] * v.0[lane]).sum::<f64>();
    }
    sums.supports[1] = pack.supports.power(v, reactions);
    if let (Some(u), Some(poses), Some(frames)) =
        (blocks.u.get_mut(), blocks.poses.get_mut(), blocks.frames.get_mut())
    {
        place_corners(simd, pack.step.model, pack.index, &after, u);
        poses[0] = after;
        frames[0] = frame_of(&after);
    }
    **of_pack = sums;
}

/// Largest size of the values of a field.
#[inline(always)]
fn largest<S: Simd>(simd: S, field: &[Lanes]) -> Lanes {
    Lanes::from(field.iter().fold(splat(simd, 0.0), |most, x| most.max(x.load(simd).abs())))
}

/// Sets the displacements of the corners of a pack's blocks from their poses.
#[inline(always)]
fn place_corners<S: Simd>(simd: S, model: &Model, index: usize, poses: &Poses, u: &mut [Lanes]) {
    let Pack { rigid_start, filled, .. } = model.packs.packs[index];
    let field = |lane| match lane < filled {
        true => LinearField::of_pose(&poses[lane]),
        false => LinearField::default(),
    };
    let fields = std::array::from_fn(field);
    set_at_corners(simd, &model.assembly.arms[rigid_start], &fields, u);
}

/// Poses with the velocities at the present time, between the half steps before and after, under
/// the last forces `f` on all nodes. `all` are the poses of all rigid packs.
pub(crate) fn present(context: Context<'_>, index: usize, all: &[Poses], f: &[Lanes]) -> Poses {
    let pack = PackContext::new(context, index);
    let poses = &all[pack.pack.rigid_start];
    let own = &f[node_start(&context.model.packs, index)..];
    let now = |lane: usize| {
        let member = pack.member(poses, lane);
        let step = match pack.body(lane) {
            Some(body) => bodies::step_under(context, body, all, f),
            None => step_of(&pack, &member, member.resultant(own)),
        };
        poses[lane].between(&step.next, 0.5 * context.motion.previous_step_ratio())
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

/// Moves the parts of bodies in a pack to the poses `next` of the bodies, and their corners.
#[inline(always)]
pub(super) fn follow_bodies<S: Simd>(
    simd: S,
    model: &Model,
    index: usize,
    poses: &mut Poses,
    u: &mut [Lanes],
    next: &[Pose],
) {
    let pack = &model.packs.packs[index];
    let mut moved = false;
    for (lane, pose) in poses.iter_mut().enumerate().take(pack.filled) {
        let Some(body) = model.assembly.bodies.body(index, lane) else { continue };
        (*pose, moved) = (next[body], true);
    }
    if moved {
        place_corners(simd, model, index, poses, u);
    }
}

/// Moves the blocks of a pack in a relaxation as their corners move, but not parts of bodies. The
/// velocities `v` of the corners are their displacement increments in this step. Then sets the
/// displacements of the corners from the poses.
#[inline(always)]
pub(super) fn follow_corners<S: Simd>(
    simd: S,
    model: &Model,
    index: usize,
    poses: &mut Poses,
    u: &mut [Lanes],
    v: &[Lanes],
) {
    let pack = &model.packs.packs[index];
    let mut moved = false;
    for (lane, pose) in poses.iter_mut().enumerate().take(pack.filled) {
        if model.assembly.bodies.body(index, lane).is_some() {
            continue;
        }
        let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
        let corner_increments = std::array::from_fn(|corner| at(v, corner, lane));
        let (next, _) = pose
            .with_corner_velocities(mass_properties, &corner_increments)
            .moved(mass_properties, 1.0);
        (*pose, moved) = (next.resting(), true);
    }
    if moved {
        place_corners(simd, model, index, poses, u);
    }
}
