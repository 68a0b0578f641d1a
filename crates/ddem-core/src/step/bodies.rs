//! Rigid bodies of several blocks in the second pass (§8): the wrench on a body is the sum of those on
//! its parts, in their order, and all parts take one step.

use rayon::prelude::*;

use super::Context;
use super::rigid::{Poses, RigidStep, halfway, reaction, rigid_step};
use crate::force::rigid::{RigidBlock, at};
use crate::force::support::Supports;
use crate::model::Model;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::{LinearField, Pose, RigidConstraint, SpatialLanes, SpatialVector};
use ddem_mesh::BodyPart;
use ddem_mesh::parallel::node_start;

/// Bodies that one task computes.
const TOGETHER: usize = 64;

/// Wrench on a body with the reactions of its supports, and its step.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyStep {
    pub(crate) wrench: SpatialVector,
    /// Forces on the corners of all parts that are equivalent to it.
    pub(super) corner_forces: LinearField,
    pub(super) step: RigidStep,
    /// Constraint and wrench of its supports, if it has any.
    supports: Option<Box<(RigidConstraint, SpatialVector)>>,
}

/// Part of a body as a block of its pack.
fn member<'a>(model: &'a Model, poses: &'a [Poses], part: &BodyPart) -> RigidBlock<'a> {
    let (rigid, lane) = (model.packs.packs[part.pack].rigid_start, part.lane);
    let mass_properties = &model.assembly.rigid[rigid][lane];
    RigidBlock { mass_properties, pose: &poses[rigid][lane], lane }
}

/// Wrench of the forces `f` on the corners of all parts of a body.
pub(super) fn wrench(
    model: &Model,
    parts: &[BodyPart],
    poses: &[Poses],
    f: &[Lanes],
) -> SpatialVector {
    let mut sum = SpatialVector::default();
    for part in parts {
        let own = member(model, poses, part).resultant(&f[node_start(&model.packs, part.pack)..]);
        sum.linear += own.linear;
        sum.angular += own.angular;
    }
    sum
}

/// Sum of spatial vectors over the parts of a body.
fn sum_of(parts: &[BodyPart], vectors: &[SpatialLanes]) -> SpatialVector {
    parts.iter().fold(SpatialVector::default(), |sum, &BodyPart { pack, lane, .. }| {
        let own = vectors[pack].of(lane);
        let (linear, angular) = (sum.linear + own.linear, sum.angular + own.angular);
        SpatialVector { linear, angular }
    })
}

/// Rigid motion of a body at rest, from a field at the corners of its first part.
pub(super) fn twist(model: &Model, body: usize, field: &[Lanes]) -> SpatialVector {
    let BodyPart { pack, lane, .. } = model.assembly.bodies.parts(body)[0];
    let mass_properties = &model.assembly.rigid[model.packs.packs[pack].rigid_start][lane];
    let own = &field[node_start(&model.packs, pack)..];
    let corners = std::array::from_fn(|corner| at(own, corner, lane));
    Pose::default().with_corner_velocities(mass_properties, &corners).twist(mass_properties)
}

/// Sets a field at the corners of all parts of a body at rest to that of a rigid motion.
pub(super) fn set_twist(model: &Model, body: usize, twist: SpatialVector, field: &mut [Lanes]) {
    at_rest(model, body, field, &|part, own| part.set_twist(twist, own));
}

/// Sets the forces at the corners of all parts of a body at rest to those equivalent to a wrench.
pub(super) fn set_forces(model: &Model, body: usize, wrench: SpatialVector, f: &mut [Lanes]) {
    at_rest(model, body, f, &|part, own| part.set_forces(wrench, own));
}

/// Calls `set` for each part of a body at rest, with the field from its first node on.
fn at_rest(
    model: &Model,
    body: usize,
    field: &mut [Lanes],
    set: &dyn Fn(RigidBlock<'_>, &mut [Lanes]),
) {
    let pose = &Pose::default();
    for &BodyPart { pack, lane, .. } in model.assembly.bodies.parts(body) {
        let mass_properties = &model.assembly.rigid[model.packs.packs[pack].rigid_start][lane];
        let own = &mut field[node_start(&model.packs, pack)..];
        set(RigidBlock { mass_properties, pose, lane }, own);
    }
}

/// Constraint of a body by the supports of all its parts; `None` without supports.
fn constraint(context: Context<'_>, body: usize, poses: &[Poses]) -> Option<RigidConstraint> {
    let model = context.model;
    let parts = model.assembly.bodies.parts(body);
    if parts.iter().all(|part| context.supports(part.pack).list.is_empty()) {
        return None;
    }
    let first = member(model, poses, &parts[0]);
    let pose = halfway(context.motion, &first);
    let supported = parts.iter().flat_map(|part| {
        let Supports { list, velocities, first } = context.supports(part.pack);
        let own = RigidBlock { pose: &pose, ..member(model, poses, part) };
        own.supported(list, velocities, first)
    });
    RigidConstraint::new(first.mass_properties.size(), supported)
}

/// Step of a body under complete forces `f` on all nodes, those of supports included.
pub(super) fn step_under(
    context: Context<'_>,
    body: usize,
    poses: &[Poses],
    f: &[Lanes],
) -> RigidStep {
    let parts = context.model.assembly.bodies.parts(body);
    let first = member(context.model, poses, &parts[0]);
    let constraint = constraint(context, body, poses);
    let wrench = wrench(context.model, parts, poses, f);
    rigid_step(context.motion, &first, wrench, constraint.as_ref())
}

/// Computes the steps of all bodies under the wrenches on the blocks of all packs,
/// and the reactions of their supports.
pub(super) fn advance(
    context: Context<'_>,
    poses: &[Poses],
    wrenches: &[SpatialLanes],
    reactions: &mut [f64],
    steps: &mut Vec<BodyStep>,
) {
    let model = context.model;
    let bodies = &model.assembly.bodies;
    let of_body = |body: usize| {
        let parts = bodies.parts(body);
        let mut wrench = sum_of(parts, wrenches);
        let first = member(model, poses, &parts[0]);
        let constraint = constraint(context, body, poses);
        let supports = constraint.map(|constraint| {
            let answer = reaction(context.motion, &first, &constraint, &wrench);
            wrench.linear += answer.linear;
            wrench.angular += answer.angular;
            Box::new((constraint, answer))
        });
        let held = supports.as_deref().map(|(constraint, _)| constraint);
        let step = rigid_step(context.motion, &first, wrench, held);
        BodyStep { wrench, corner_forces: first.corner_forces(wrench), step, supports }
    };
    let all = (0..bodies.len()).into_par_iter().with_min_len(TOGETHER);
    all.map(of_body).collect_into_vec(steps);
    for (body, step) in steps.iter().enumerate() {
        let Some((constraint, answer)) = step.supports.as_deref() else { continue };
        for part in bodies.parts(body) {
            let Supports { list, first, .. } = context.supports(part.pack);
            let own = &mut reactions[context.view.conditions.supports_of(part.pack)];
            member(model, poses, part).set_reactions(constraint, *answer, list, first, own);
        }
    }
}

/// Sets the displacement increments of the corners of all bodies `[m]`. The velocities of the supports
/// are the increments of the supports.
pub(super) fn held_increments(context: Context<'_>, poses: &[Poses], increments: &mut [Lanes]) {
    let model = context.model;
    for body in 0..model.assembly.bodies.len() {
        let Some(constraint) = constraint(context, body, poses) else { continue };
        for part in model.assembly.bodies.parts(body) {
            let own = &mut increments[node_start(&model.packs, part.pack)..];
            member(model, poses, part).set_twist(constraint.target(), own);
        }
    }
}

/// Poses of all bodies moved as near as possible to displacement increments v of the corners of all
/// their parts, of which `sums` has `Σ v` and `Σ R r × v` for each block.
pub(super) fn followed(model: &Model, poses: &[Poses], sums: &[SpatialLanes]) -> Vec<Pose> {
    let bodies = &model.assembly.bodies;
    let of_body = |body: usize| {
        let parts = bodies.parts(body);
        let first = member(model, poses, &parts[0]);
        let moving = first.pose.with_velocity_sums(first.mass_properties, sum_of(parts, sums));
        moving.moved(first.mass_properties, 1.0).0.resting()
    };
    (0..bodies.len()).into_par_iter().with_min_len(TOGETHER).map(of_body).collect()
}
