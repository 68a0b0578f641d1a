//! Fictitious masses of rigid blocks: the stiffness of all joints of a block against its six
//! motions.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen, UnitQuaternion, Vector3, Vector6};

use super::MassContext;
use crate::model::Model;
use ddem_joint::contact::ContactSurfaces;
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{Pose, RigidConstraint};
use ddem_mesh::Vec3;
use ddem_mesh::pack::Pack;

/// Fraction of the trace of the stiffness below which a motion is free.
const NOTHING: f64 = 1e-10;

/// Inverse stiffness `K⁻¹` of the six motions of the blocks of a pack. Rotations are multiplied by
/// the size of the block.
pub(super) type Inverses = [Matrix6<f64>; LANES];

pub(super) fn inverses(around: MassContext<'_>, index: usize) -> Inverses {
    let MassContext { model, held, .. } = around;
    let pack = &model.packs.packs[index];
    std::array::from_fn(|lane| {
        if lane >= pack.filled {
            return Matrix6::zeros();
        }
        let block = pack.blocks[lane] as usize;
        let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
        let first = model.geometry.blocks[block].first_node;
        let supports = (0..8).flat_map(|corner| {
            let axes = held.get(&(first + corner)).copied().unwrap_or_default();
            let arm = mass_properties.arm(corner as usize);
            (0..3).filter(move |&axis| axes[axis]).map(move |axis| (arm, axis, 0.0))
        });
        let constraint = RigidConstraint::new(mass_properties.size(), supports);
        let free = constraint.map_or_else(Matrix6::identity, |constraint| constraint.free());
        let stiffness = stiffness(around, block, mass_properties.size());
        pseudo_inverse(free * stiffness * free, NOTHING * stiffness.trace())
    })
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

/// Computes `M⁻¹ F` at the corners of the rigid blocks of a pack. The masses rotate with the
/// blocks.
pub(super) fn accelerations(
    model: &Model,
    poses: Option<&[Pose; LANES]>,
    inverses: &Inverses,
    index: usize,
    f: &[Lanes],
    out: &mut [Lanes],
) {
    let Pack { start, filled, rigid_start, .. } = model.packs.packs[index];
    // Lanes without a block do not move.
    out.fill(Lanes::ZERO);
    for lane in 0..filled {
        let mass_properties = &model.assembly.rigid[rigid_start][lane];
        let turn = poses.map_or_else(UnitQuaternion::identity, |poses| poses[lane].turn);
        let size = mass_properties.size();
        let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
        for corner in 0..8 {
            let on = Vec3::from([0, 1, 2].map(|c| f[3 * (start + corner) + c].0[lane]));
            force += on;
            torque += (turn * mass_properties.arm(corner)).cross(&on);
        }
        let (force, torque) = (turn.inverse() * force, turn.inverse() * torque / size);
        let both = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        let moved = inverses[lane] * both;
        let shift: Vector3<f64> = moved.fixed_rows::<3>(0).into();
        let spin: Vector3<f64> = moved.fixed_rows::<3>(3) / size;
        for corner in 0..8 {
            let value = turn * (shift + spin.cross(&mass_properties.arm(corner)));
            (0..3).for_each(|c| out[3 * corner + c].0[lane] = value[c]);
        }
    }
}
