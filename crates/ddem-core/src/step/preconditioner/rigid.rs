//! Fictitious masses of rigid blocks: the stiffness of all joints of a block, or of a body of several
//! blocks, against its six motions.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen, UnitQuaternion, Vector3, Vector6};

use std::collections::HashMap;

use rayon::prelude::*;

use super::MassContext;
use crate::force::rigid::RigidBlock;
use crate::model::Model;
use crate::step::{Poses, bodies};
use ddem_joint::contact::ContactSurfaces;
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{MassProperties, Pose, RigidConstraint, SpatialVector};
use ddem_mesh::pack::Pack;
use ddem_mesh::{BodyPart, Vec3};

/// Fraction of the trace of the stiffness below which a motion is free.
const NOTHING: f64 = 1e-10;

/// Inverse stiffness `K⁻¹` of the six motions of the blocks of a pack. Rotations are multiplied by
/// the size of the block.
pub(super) type Inverses = [Matrix6<f64>; LANES];

pub(super) fn inverses(around: MassContext<'_>, index: usize) -> Inverses {
    let MassContext { model, held, .. } = around;
    let pack = &model.packs.packs[index];
    std::array::from_fn(|lane| {
        // A part of a body has none of its own.
        if lane >= pack.filled || model.assembly.bodies.body(pack.rigid_start, lane).is_some() {
            return Matrix6::zeros();
        }
        let block = pack.blocks[lane] as usize;
        let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
        let supports = supported(held, model.geometry.blocks[block].first_node, mass_properties);
        let stiffness = stiffness(around, block, mass_properties.size());
        inverse(supports, mass_properties.size(), &stiffness)
    })
}

/// Inverse stiffness `K⁻¹` of the six motions of each body of several blocks.
pub(super) fn inverses_of_bodies(around: MassContext<'_>) -> Vec<Matrix6<f64>> {
    let MassContext { model, held, bonds, .. } = around;
    let bodies = &model.assembly.bodies;
    let of_body = |body: usize| {
        let of = |part: &BodyPart| {
            let mass_properties = part_properties(model, part);
            (mass_properties, model.geometry.blocks[part.block].first_node)
        };
        let parts = bodies.parts(body);
        let size = part_properties(model, &parts[0]).size();
        let mut stiffness = Matrix6::zeros();
        for (mass_properties, first) in parts.iter().map(of) {
            for corner in 0..8 {
                let bound = bonds.get(first as usize + corner).copied().unwrap_or(0.0);
                let turn = mass_properties.arm(corner).cross_matrix() / -size;
                add_point(&mut stiffness, &(Matrix3::identity() * bound), &turn);
            }
        }
        let supports = parts.iter().map(of).flat_map(|(own, first)| supported(held, first, own));
        inverse(supports, size, &stiffness)
    };
    (0..bodies.len()).into_par_iter().map(of_body).collect()
}

fn part_properties<'a>(model: &'a Model, part: &BodyPart) -> &'a MassProperties {
    &model.assembly.rigid[model.packs.packs[part.pack].rigid_start][part.lane]
}

/// Arms and axes of the held corners of a block.
fn supported<'a>(
    held: &'a HashMap<u32, [bool; 3]>,
    first: u32,
    mass_properties: &'a MassProperties,
) -> impl Iterator<Item = (Vec3, usize, f64)> + 'a {
    (0..8).flat_map(move |corner| {
        let axes = held.get(&(first + corner)).copied().unwrap_or_default();
        let arm = mass_properties.arm(corner as usize);
        (0..3).filter(move |&axis| axes[axis]).map(move |axis| (arm, axis, 0.0))
    })
}

/// Inverse of a stiffness against the motions that supports leave free.
fn inverse(
    supports: impl Iterator<Item = (Vec3, usize, f64)>,
    size: f64,
    stiffness: &Matrix6<f64>,
) -> Matrix6<f64> {
    let constraint = RigidConstraint::new(size, supports);
    let free = constraint.map_or_else(Matrix6::identity, |constraint| constraint.free());
    pseudo_inverse(free * stiffness * free, NOTHING * stiffness.trace())
}

/// Stiffness of the joints and contacts of a block, with its neighbours at rest.
fn stiffness(around: MassContext<'_>, block: usize, size: f64) -> Matrix6<f64> {
    let model = around.model;
    let half = model.geometry.element_edges(block).map(|edge| edge * 0.5);
    let mut sum = Matrix6::zeros();
    for face in FaceId::all() {
        let (d, side) = (face.direction, face.side());
        let Some(other) = model.geometry.beyond(block, face) else { continue };
        let owner = if face.upper { block } else { other };
        let (pack, lane) = model.packs.slot(owner);
        let Some(section) = model.sections.get(pack, d) else { continue };
        let k = section.matrix(lane);
        for (e, f) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
            let arm = half[d] * f64::from(side) + half[(d + 1) % 3] * e + half[(d + 2) % 3] * f;
            let turn = arm.cross_matrix() / -size;
            add_point(&mut sum, &k, &turn);
        }
    }
    if let Some(contact_model) = around.contact_model {
        add_contacts(
            &mut sum,
            &contact_model.surfaces,
            around.contact_masses.released,
            block,
            &half,
            size,
        );
    }
    sum
}

/// Adds contacts at the corners of faces. Contacts in place of joints resist rotation more than the
/// joints did, whose points are at the quarters.
fn add_contacts(
    sum: &mut Matrix6<f64>,
    surfaces: &ContactSurfaces,
    released: bool,
    block: usize,
    half: &[Vec3; 3],
    size: f64,
) {
    for face in FaceId::all() {
        let d = face.direction;
        let (e, f) = (half[(d + 1) % 3], half[(d + 2) % 3]);
        let area = e.cross(&f);
        let normal = area.try_normalize(0.0).unwrap_or_default();
        let [stiff, shear] = super::contact_masses::of_contacts(surfaces, block, face, released);
        let across = normal * normal.transpose();
        let k = (Matrix3::identity() * shear + across * (stiff - shear)) * area.norm();
        let side = half[d] * if face.upper { 1.0 } else { -1.0 };
        for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            add_point(sum, &k, &((side + e * i + f * j).cross_matrix() / -size));
        }
    }
}

/// Adds the stiffness of a spring at a point that moves with `v + turn ω`.
fn add_point(sum: &mut Matrix6<f64>, k: &Matrix3<f64>, turn: &Matrix3<f64>) {
    let mut jacobian = nalgebra::Matrix3x6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(turn);
    *sum += jacobian.transpose() * k * jacobian;
}

fn pseudo_inverse(matrix: Matrix6<f64>, least: f64) -> Matrix6<f64> {
    let SymmetricEigen { eigenvalues, eigenvectors } = matrix.symmetric_eigen();
    let mut inverse = Matrix6::zeros();
    for (value, vector) in eigenvalues.iter().zip(eigenvectors.column_iter()) {
        if *value > least {
            inverse += vector * vector.transpose() / *value;
        }
    }
    inverse
}

/// Motion of a rigid block or body under a wrench, with inverse masses that rotate with it. Returns the
/// displacement of the centre of mass and the rotation.
fn moved(
    inverse: &Matrix6<f64>,
    turn: &UnitQuaternion<f64>,
    size: f64,
    wrench: SpatialVector,
) -> SpatialVector {
    let force = turn.inverse() * wrench.linear;
    let torque = turn.inverse() * wrench.angular / size;
    let both = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
    let moved = inverse * both;
    let shift: Vector3<f64> = moved.fixed_rows::<3>(0).into();
    let spin: Vector3<f64> = moved.fixed_rows::<3>(3) / size;
    SpatialVector { linear: shift, angular: spin }
}

/// Motions `M⁻¹ F` of the bodies of several blocks under the forces `f` on all nodes, in the axes of
/// the bodies at rest.
pub(super) fn motions_of_bodies(
    model: &Model,
    poses: &[Poses],
    inverses: &[Matrix6<f64>],
    f: &[Lanes],
    out: &mut Vec<SpatialVector>,
) {
    let of_body = |body: usize| {
        let part = model.assembly.bodies.parts(body)[0];
        let pose = &poses[model.packs.packs[part.pack].rigid_start][part.lane];
        let size = part_properties(model, &part).size();
        moved(&inverses[body], &pose.turn, size, bodies::wrench(model, body, poses, f))
    };
    (0..inverses.len()).into_par_iter().map(of_body).collect_into_vec(out);
}

/// Computes `M⁻¹ F` at the corners of the rigid blocks of a pack. The masses rotate with the
/// blocks. `of_bodies` are the motions of the bodies of several blocks.
pub(super) fn accelerations(
    model: &Model,
    poses: Option<&Poses>,
    inverses: &Inverses,
    of_bodies: &[SpatialVector],
    index: usize,
    f: &[Lanes],
    out: &mut [Lanes],
) {
    let Pack { start, filled, rigid_start, .. } = model.packs.packs[index];
    // Lanes without a block do not move.
    out.fill(Lanes::ZERO);
    let rest = Pose::default();
    for lane in 0..filled {
        let mass_properties = &model.assembly.rigid[rigid_start][lane];
        let pose = poses.map_or(&rest, |poses| &poses[lane]);
        let member = RigidBlock { mass_properties, pose, lane };
        let motion = match model.assembly.bodies.body(rigid_start, lane) {
            Some(body) => of_bodies[body],
            None => {
                let wrench = member.resultant(&f[3 * start..]);
                moved(&inverses[lane], &pose.turn, mass_properties.size(), wrench)
            }
        };
        for corner in 0..8 {
            let arm = mass_properties.arm(corner);
            let value = pose.turn * (motion.linear + motion.angular.cross(&arm));
            (0..3).for_each(|c| out[3 * corner + c].0[lane] = value[c]);
        }
    }
}
