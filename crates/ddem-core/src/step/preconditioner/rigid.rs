//! Fictitious masses of rigid bodies: the stiffness of their joints against their six motions.

use std::collections::HashMap;

use fearless_simd::Simd;
use nalgebra::{Matrix6, SymmetricEigen, UnitQuaternion, Vector6};
use rayon::prelude::*;

use super::MassContext;
use super::springs::{BodyPatch, SpringSum};
use crate::model::Model;
use crate::step::{BodyStep, Poses, bodies};
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{
    LinearField, MassProperties, Pose, RigidConstraint, SpatialVector, set_at_corners,
};
use ddem_mesh::pack::Pack;
use ddem_mesh::{BodyPart, Vec3};

/// Fraction of the trace of the stiffness below which a motion is free.
const NOTHING: f64 = 1e-10;
/// Number of bodies that one thread takes at a time.
const TOGETHER: usize = 64;
/// Marker for a lane without a body.
const NO_BODY: u32 = u32::MAX;

/// Rigid bodies of a model, their masses and motions.
#[derive(Clone, Debug, Default)]
pub(super) struct RigidMasses {
    /// Blocks that are bodies of their own. They follow the bodies of several blocks.
    blocks: Vec<BodyPart>,
    /// Masses of all bodies.
    masses: Vec<BodyMass>,
    /// Body of each lane of the rigid packs.
    of_lane: Vec<[u32; LANES]>,
    /// Motions of the bodies, in their axes at rest.
    motions: Vec<SpatialVector>,
}

/// Fictitious mass of a rigid body. Its rotations are multiplied by its size.
#[derive(Clone, Debug)]
struct BodyMass {
    /// Size of the body `[m]`.
    size: f64,
    /// Inverse stiffness `K⁻¹` against its six motions.
    inverse: Matrix6<f64>,
    /// Projection to the motions that its supports leave free, if it has any.
    free: Option<Box<Matrix6<f64>>>,
}

impl RigidMasses {
    /// Masses of all bodies, and the springs around each. `patches` gives the joints of each body of
    /// several blocks, a cell.
    pub(super) fn new(
        around: MassContext<'_>,
        patches: &[Vec<BodyPatch>],
    ) -> (Self, Vec<SpringSum>) {
        let model = around.model;
        let several = &model.assembly.bodies;
        let mut masses =
            Self { of_lane: vec![[NO_BODY; LANES]; model.packs.rigid], ..Self::default() };
        for (number, pack) in model.packs.packs.iter().enumerate().filter(|(_, pack)| pack.rigid) {
            for lane in 0..pack.filled {
                let block = pack.blocks[lane] as usize;
                if model.geometry.is_removed(block) {
                    continue;
                }
                let body = several.body(number, lane).unwrap_or_else(|| {
                    masses.blocks.push(BodyPart { block, pack: number, lane });
                    several.len() + masses.blocks.len() - 1
                });
                masses.of_lane[pack.rigid_start][lane] = body as u32;
            }
        }
        let all = several.len() + masses.blocks.len();
        let of_body = |body: usize| {
            let parts = masses.parts(model, body);
            match patches.get(body) {
                Some(patches) => BodyMass::of_cell(around, parts, patches),
                None => {
                    let springs = SpringSum::of_block(around, &parts[0]);
                    (BodyMass::new(around, parts, &springs.stiffness), springs)
                }
            }
        };
        let (of_bodies, springs) = (0..all).into_par_iter().map(of_body).unzip();
        masses.masses = of_bodies;
        (masses, springs)
    }

    /// Renews the mass of a cell and multiplies it by a factor. Returns the springs around the cell.
    pub(super) fn renew(
        &mut self,
        around: MassContext<'_>,
        body: usize,
        patches: &[BodyPatch],
        factor: f64,
    ) -> SpringSum {
        let parts = self.parts(around.model, body);
        let (mut mass, springs) = BodyMass::of_cell(around, parts, patches);
        mass.inverse *= factor;
        self.masses[body] = mass;
        springs
    }

    /// Number of bodies.
    pub(super) fn len(&self) -> usize {
        self.masses.len()
    }

    /// Parts of a body.
    pub(super) fn parts<'a>(&'a self, model: &'a Model, body: usize) -> &'a [BodyPart] {
        let several = &model.assembly.bodies;
        match body.checked_sub(several.len()) {
            Some(block) => std::slice::from_ref(&self.blocks[block]),
            None => several.parts(body),
        }
    }

    /// Size of a body, by which rotations are multiplied `[m]`.
    pub(super) fn size(&self, body: usize) -> f64 {
        self.masses[body].size
    }

    /// Parts of the translations of a body along each axis that its supports leave free.
    pub(super) fn free_axes(&self, body: usize) -> Vec3 {
        let free = self.masses[body].free.as_ref();
        free.map_or(Vec3::repeat(1.0), |free| Vec3::from([0, 1, 2].map(|c| free[(c, c)])))
    }

    pub(super) fn scale(&mut self, factor: f64) {
        self.masses.iter_mut().for_each(|mass| mass.inverse *= factor);
    }

    /// Computes the motions `M⁻¹ F` of all bodies under the forces `f` on all nodes. `steps` has the
    /// wrenches on bodies of several blocks, or is empty; then `f` gives them. Returns the wrenches on
    /// the bodies, without those against supports.
    pub(super) fn respond(
        &mut self,
        model: &Model,
        poses: &[Poses],
        f: &[Lanes],
        steps: &[BodyStep],
    ) -> Vec<SpatialVector> {
        let this = &*self;
        let of_body = |body: usize| {
            let mass = &this.masses[body];
            let parts = this.parts(model, body);
            let turn = pose(model, poses, &parts[0]).turn;
            let known = steps.get(body).map(|step| step.wrench);
            let wrench = known.unwrap_or_else(|| bodies::wrench(model, parts, poses, f));
            let own = mass.at_rest(&turn, wrench);
            let motion = mass.motion(&(mass.inverse * own));
            let Some(free) = &mass.free else { return (motion, wrench) };
            let SpatialVector { linear, angular } = SpatialVector::from_vector(&(**free * own));
            (motion, SpatialVector { linear: turn * linear, angular: turn * angular * mass.size })
        };
        let both = self.each(of_body);
        let (motions, wrenches) = both.into_iter().unzip();
        self.motions = motions;
        wrenches
    }

    /// Adds the motions of all bodies in space as far as supports leave them free.
    pub(super) fn add(&mut self, model: &Model, poses: &[Poses], more: &[SpatialVector]) {
        let this = &*self;
        let of_body = |body: usize| {
            let mass = &this.masses[body];
            let turn = pose(model, poses, &this.parts(model, body)[0]).turn.inverse();
            let SpatialVector { linear, angular } = more[body];
            let own = SpatialVector { linear: turn * linear, angular: turn * angular * mass.size };
            let own = mass.free.as_ref().map_or(own.to_vector(), |free| **free * own.to_vector());
            let (own, before) = (mass.motion(&own), this.motions[body]);
            SpatialVector {
                linear: before.linear + own.linear,
                angular: before.angular + own.angular,
            }
        };
        self.motions = self.each(of_body);
    }

    fn each<T: Send>(&self, of_body: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
        (0..self.len()).into_par_iter().with_min_len(TOGETHER).map(of_body).collect()
    }
}

impl BodyMass {
    /// Mass of a cell, and the springs around it.
    fn of_cell(
        around: MassContext<'_>,
        parts: &[BodyPart],
        patches: &[BodyPatch],
    ) -> (Self, SpringSum) {
        let springs = SpringSum::of_cell(around, parts, patches);
        (Self::new(around, parts, &springs.stiffness), springs)
    }

    fn new(around: MassContext<'_>, parts: &[BodyPart], stiffness: &Matrix6<f64>) -> Self {
        let MassContext { model, held, .. } = around;
        let size = part_properties(model, &parts[0]).size();
        let supports = parts.iter().flat_map(|part| {
            let first = model.geometry.blocks[part.block].first_node;
            supported(held, first, part_properties(model, part))
        });
        let free = RigidConstraint::new(size, supports).map(|constraint| constraint.free());
        let all = free.unwrap_or_else(Matrix6::identity);
        let inverse = pseudo_inverse(all * stiffness * all, stiffness.trace());
        // A body that cannot move stays exactly where it is.
        let free = if inverse == Matrix6::zeros() { Some(Matrix6::zeros()) } else { free };
        Self { size, inverse, free: free.map(Box::new) }
    }

    /// Wrench in the axes at rest; torques are divided by the size.
    fn at_rest(&self, turn: &UnitQuaternion<f64>, wrench: SpatialVector) -> Vector6<f64> {
        let back = turn.inverse();
        let SpatialVector { linear, angular } = wrench;
        SpatialVector { linear: back * linear, angular: back * angular / self.size }.to_vector()
    }

    /// Displacement of the centre of mass and rotation.
    fn motion(&self, moved: &Vector6<f64>) -> SpatialVector {
        let SpatialVector { linear, angular } = SpatialVector::from_vector(moved);
        SpatialVector { linear, angular: angular / self.size }
    }
}

/// Mass properties of a part of a body.
pub(super) fn part_properties<'a>(model: &'a Model, part: &BodyPart) -> &'a MassProperties {
    &model.assembly.rigid[model.packs.packs[part.pack].rigid_start][part.lane]
}

fn pose<'a>(model: &Model, poses: &'a [Poses], part: &BodyPart) -> &'a Pose {
    &poses[model.packs.packs[part.pack].rigid_start][part.lane]
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

/// Inverse of a stiffness against the motions that are not free. Those are free whose stiffness is
/// nothing beside a trace.
pub(super) fn pseudo_inverse(matrix: Matrix6<f64>, trace: f64) -> Matrix6<f64> {
    let least = NOTHING * trace;
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
/// blocks. [`RigidMasses::respond`] comes before.
#[inline(always)]
pub(super) fn accelerations<S: Simd>(
    simd: S,
    model: &Model,
    poses: Option<&Poses>,
    masses: &RigidMasses,
    index: usize,
    out: &mut [Lanes],
) {
    let Pack { filled, rigid_start, .. } = model.packs.packs[index];
    // Lanes without a body do not move.
    let mut fields = [LinearField::default(); LANES];
    let rest = Pose::default();
    for lane in 0..filled {
        let body = masses.of_lane[rigid_start][lane];
        if body == NO_BODY {
            continue;
        }
        let turn = poses.map_or(&rest, |poses| &poses[lane]).turn;
        let SpatialVector { linear, angular } = masses.motions[body as usize];
        let twist = SpatialVector { linear: turn * linear, angular: turn * angular };
        fields[lane] = LinearField::of_twist(twist, &turn);
    }
    set_at_corners(simd, &model.assembly.arms[rigid_start], &fields, out);
}
