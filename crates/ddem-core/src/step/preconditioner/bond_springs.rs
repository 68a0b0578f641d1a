//! Joints between rigid cells as springs between two bodies, in the search for the largest eigenvalue
//! of a relaxation.

use nalgebra::{Matrix3, Matrix3x6, Matrix6};
use rayon::prelude::*;

use super::rigid::{RigidMasses, halves, joined, part_properties};
use super::springs::{BodyPatch, centre, per_area};
use crate::model::Model;
use crate::step::timestep::XorShift;
use ddem_joint::contact::ContactPoint;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::SpatialVector;
use ddem_mesh::Vec3;

/// Number of bodies or joints that one thread takes at a time.
const TOGETHER: usize = 64;

/// Joints between rigid cells.
#[derive(Clone, Debug, Default)]
pub(super) struct BondSprings {
    springs: Vec<BondSpring>,
    /// Corners of the first part of each body.
    corners: Vec<BodyCorners>,
}

/// Joint between two rigid bodies.
#[derive(Clone, Debug)]
struct BondSpring {
    bodies: [u32; 2],
    /// Vectors from the centres of mass to the middle of the joint `[m]`.
    arms: [Vec3; 2],
    /// Stiffness against displacement and rotation of b against a at the middle.
    k: Matrix6<f64>,
}

impl BondSpring {
    /// Wrench on body a; that on body b is the opposite, about its own centre.
    fn wrench(&self, twists: &[SpatialVector]) -> SpatialVector {
        let at = |side: usize| {
            let SpatialVector { linear, angular } = twists[self.bodies[side] as usize];
            [linear + angular.cross(&self.arms[side]), angular]
        };
        let ([linear_a, angular_a], [linear_b, angular_b]) = (at(0), at(1));
        let apart = joined(&(linear_b - linear_a), &(angular_b - angular_a));
        let (linear, angular) = halves(&(self.k * apart));
        SpatialVector { linear, angular }
    }
}

/// Corners of the first part of a body: node numbers and arms about their mean.
#[derive(Clone, Debug)]
struct BodyCorners {
    first_node: usize,
    /// Vector from the centre of mass to the mean of the corners `[m]`.
    mean: Vec3,
    arms: [Vec3; 8],
    /// Inverse of `Σ |r|² 1 − r rᵀ`.
    inverse: Matrix3<f64>,
}

impl BodyCorners {
    fn new(model: &Model, rigid: &RigidMasses, body: usize) -> Self {
        let part = &rigid.parts(model, body)[0];
        let properties = part_properties(model, part);
        let arms: [Vec3; 8] = std::array::from_fn(|corner| properties.arm(corner));
        let mean = arms.iter().sum::<Vec3>() / 8.0;
        let arms = arms.map(|arm| arm - mean);
        let spread: Matrix3<f64> = arms.iter().map(|arm| arm * arm.transpose()).sum();
        let inertia = Matrix3::identity() * spread.trace() - spread;
        Self {
            first_node: model.geometry.blocks[part.block].first_node as usize,
            mean,
            arms,
            inverse: inertia.try_inverse().unwrap_or_else(Matrix3::zeros),
        }
    }

    /// Rigid motion of the corners.
    fn twist(&self, model: &Model, x: &[Lanes]) -> SpatialVector {
        let at: [Vec3; 8] =
            std::array::from_fn(|corner| model.get(x, self.first_node + corner).into());
        let moment = self.arms.iter().zip(&at).map(|(arm, x)| arm.cross(x)).sum::<Vec3>();
        let angular = self.inverse * moment;
        SpatialVector { linear: at.iter().sum::<Vec3>() / 8.0 - angular.cross(&self.mean), angular }
    }

    /// Adds forces on the corners that are equivalent to a wrench about the centre of mass.
    fn add(&self, model: &Model, wrench: SpatialVector, f: &mut [Lanes]) {
        let turn = self.inverse * (wrench.angular - self.mean.cross(&wrench.linear));
        for (corner, arm) in self.arms.iter().enumerate() {
            let node = self.first_node + corner;
            let force = wrench.linear / 8.0 + turn.cross(arm) + Vec3::from(model.get(f, node));
            model.set(f, node, force.into());
        }
    }
}

impl BondSprings {
    /// Springs of the joints of rigid cells, which `patches` gives for each body.
    pub(super) fn new(model: &Model, rigid: &RigidMasses, patches: &[Vec<BodyPatch>]) -> Self {
        let mut bodies: Vec<[Option<u32>; 2]> = vec![[None; 2]; model.bonded_patches.len()];
        for (body, own) in patches.iter().enumerate() {
            own.iter().for_each(|patch| {
                bodies[patch.joint as usize][usize::from(patch.side)] = Some(body as u32);
            });
        }
        let of_joint = |(number, bodies): (usize, &[Option<u32>; 2])| {
            let [Some(a), Some(b)] = *bodies else { return None };
            Some(Self::spring(model, rigid, number, [a, b]))
        };
        let springs: Vec<_> = bodies.par_iter().enumerate().filter_map(of_joint).collect();
        let all = if springs.is_empty() { 0 } else { patches.len() };
        let corners = (0..all).map(|body| BodyCorners::new(model, rigid, body)).collect();
        Self { springs, corners }
    }

    /// True if all nonconforming joints of a model are between rigid cells.
    pub(super) fn are_all(&self, model: &Model) -> bool {
        let exists = |&block: &u32| !model.geometry.is_removed(block as usize);
        let joints = model.bonded_patches.iter();
        joints.filter(|joint| joint.patch.blocks.iter().all(exists)).count() == self.springs.len()
    }

    fn spring(model: &Model, rigid: &RigidMasses, joint: usize, bodies: [u32; 2]) -> BondSpring {
        let patch = &model.bonded_patches[joint].patch;
        let blocks = model.contact.as_ref().map_or(&[][..], |contact| &contact.blocks);
        let at = |side: usize| -> Vec<Vec3> {
            let centre = centre(model, rigid.parts(model, bodies[side] as usize));
            let arm = |point: &ContactPoint| {
                let on = &point.points[side];
                blocks[on.block(patch.blocks[side])].rest_point(on).0 - centre
            };
            patch.points.iter().map(arm).collect()
        };
        let (on_a, on_b) = (at(0), at(1));
        let mean = |points: &[Vec3]| points.iter().sum::<Vec3>() / points.len().max(1) as f64;
        let arms = [mean(&on_a), mean(&on_b)];
        let per_area = per_area(patch);
        let mut k = Matrix6::zeros();
        for (point, at) in patch.points.iter().zip(&on_a) {
            let mut moved = Matrix3x6::zeros();
            moved.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
            moved.fixed_view_mut::<3, 3>(0, 3).copy_from(&-(at - arms[0]).cross_matrix());
            k += moved.transpose() * (per_area * point.pair.area) * moved;
        }
        BondSpring { bodies, arms, k }
    }

    /// Sets displacements of the corners that favour no mode.
    pub(super) fn start(&self, model: &Model, x: &mut [Lanes]) {
        let mut random = XorShift(0x9E37_79B9_7F4A_7C15);
        for corner in
            self.corners.iter().flat_map(|corners| corners.first_node..corners.first_node + 8)
        {
            model.set(x, corner, [(); 3].map(|()| random.next()));
        }
    }

    /// Adds the forces of the joints at the displacements `x` to the forces `f` on all nodes.
    pub(super) fn add_forces(&self, model: &Model, x: &[Lanes], f: &mut [Lanes]) {
        let twists: Vec<SpatialVector> = self
            .corners
            .par_iter()
            .with_min_len(TOGETHER)
            .map(|corners| corners.twist(model, x))
            .collect();
        let wrench = |spring: &BondSpring| spring.wrench(&twists);
        let wrenches: Vec<SpatialVector> =
            self.springs.par_iter().with_min_len(TOGETHER).map(wrench).collect();
        let mut sums = vec![SpatialVector::default(); self.corners.len()];
        for (spring, wrench) in self.springs.iter().zip(wrenches) {
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                let sum = &mut sums[spring.bodies[side] as usize];
                let torque = wrench.angular + spring.arms[side].cross(&wrench.linear);
                sum.linear += wrench.linear * sign;
                sum.angular += torque * sign;
            }
        }
        for (corners, sum) in self.corners.iter().zip(sums) {
            corners.add(model, sum, f);
        }
    }
}
