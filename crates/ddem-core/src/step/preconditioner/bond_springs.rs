//! Joints between rigid cells as springs between two bodies, in the search for the largest eigenvalue
//! of a relaxation.

use nalgebra::Matrix6;
use rayon::prelude::*;

use super::rigid::RigidMasses;
use super::springs::{BodyPatch, centre, per_area, point_motion};
use crate::model::Model;
use crate::step::bodies;
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
    /// Number of rigid cells; none without joints.
    cells: usize,
}

/// Joint between two rigid cells.
#[derive(Clone, Debug)]
struct BondSpring {
    /// Cells a and b.
    cells: [u32; 2],
    /// Vectors from the centres of mass to the middle of the joint `[m]`.
    arms: [Vec3; 2],
    /// Stiffness against displacement and rotation of b against a at the middle.
    k: Matrix6<f64>,
}

impl BondSpring {
    fn new(model: &Model, rigid: &RigidMasses, joint: usize, cells: [u32; 2]) -> Self {
        let patch = &model.bonded_patches[joint].patch;
        let blocks = model.contact.as_ref().map_or(&[][..], |contact| &contact.blocks);
        let points = |side: usize| -> Vec<Vec3> {
            let centre = centre(model, rigid.parts(model, cells[side] as usize));
            let arm = |point: &ContactPoint| {
                let on = &point.points[side];
                blocks[on.block(patch.blocks[side])].rest_point(on).0 - centre
            };
            patch.points.iter().map(arm).collect()
        };
        let both = [points(0), points(1)];
        let arms =
            [0, 1].map(|side| both[side].iter().sum::<Vec3>() / both[side].len().max(1) as f64);
        let per_area = per_area(patch);
        let mut k = Matrix6::zeros();
        for (point, at) in patch.points.iter().zip(&both[0]) {
            let moved = point_motion(&(at - arms[0]), 1.0);
            k += moved.transpose() * (per_area * point.pair.area) * moved;
        }
        Self { cells, arms, k }
    }

    /// Wrench on cell a at the middle of the joint; that on cell b is the opposite.
    fn wrench(&self, twists: &[SpatialVector]) -> SpatialVector {
        let [a, b] = [0, 1].map(|side| {
            let SpatialVector { linear, angular } = twists[self.cells[side] as usize];
            let linear = linear + angular.cross(&self.arms[side]);
            SpatialVector { linear, angular }.to_vector()
        });
        SpatialVector::from_vector(&(self.k * (b - a)))
    }
}

impl BondSprings {
    /// Springs of the joints of rigid cells; `patches` gives the joints of each.
    pub(super) fn new(model: &Model, rigid: &RigidMasses, patches: &[Vec<BodyPatch>]) -> Self {
        let mut joints: Vec<(usize, [u32; 2])> = Vec::new();
        for (cell, own) in patches.iter().enumerate() {
            for patch in own.iter().filter(|patch| patch.side == 0) {
                let both = patch.other.map(|other| [cell as u32, other]);
                joints.extend(both.map(|cells| (patch.joint as usize, cells)));
            }
        }
        joints.sort_unstable();
        let spring = |&(joint, cells): &_| BondSpring::new(model, rigid, joint, cells);
        let springs: Vec<BondSpring> = joints.par_iter().map(spring).collect();
        let cells = if springs.is_empty() { 0 } else { patches.len() };
        Self { springs, cells }
    }

    /// Sets displacements of the cells that favour no mode.
    pub(super) fn start(&self, model: &Model, rigid: &RigidMasses, x: &mut [Lanes]) {
        let mut random = XorShift(0x9E37_79B9_7F4A_7C15);
        for cell in 0..self.cells {
            let [linear, angular] = [(); 2].map(|()| Vec3::from([(); 3].map(|()| random.next())));
            let angular = angular / rigid.size(cell);
            bodies::set_twist(model, cell, SpatialVector { linear, angular }, x);
        }
    }

    /// Sets the forces of the joints on the cells at the displacements `x`. They have no others, because
    /// all joints of cells are nonconforming.
    pub(super) fn set_forces(&self, model: &Model, x: &[Lanes], f: &mut [Lanes]) {
        let cells = (0..self.cells).into_par_iter().with_min_len(TOGETHER);
        let twists: Vec<SpatialVector> = cells.map(|cell| bodies::twist(model, cell, x)).collect();
        let wrench = |spring: &BondSpring| spring.wrench(&twists);
        let wrenches: Vec<SpatialVector> =
            self.springs.par_iter().with_min_len(TOGETHER).map(wrench).collect();
        let mut sums = vec![SpatialVector::default(); self.cells];
        for (spring, wrench) in self.springs.iter().zip(wrenches) {
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                let sum = &mut sums[spring.cells[side] as usize];
                let torque = wrench.angular + spring.arms[side].cross(&wrench.linear);
                sum.linear += wrench.linear * sign;
                sum.angular += torque * sign;
            }
        }
        for (cell, sum) in sums.into_iter().enumerate() {
            bodies::set_forces(model, cell, sum, f);
        }
    }
}
