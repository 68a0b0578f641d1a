//! Nonconforming joints (§1, §5).
//!
//! The law of a joint governs the points of a bonded patch. The joint consists of springs from the
//! start, and its pairs keep their positions. They fail like the pairs of any joint. Once all of
//! them have failed and one has moved, the patch becomes an ordinary contact, which begins with the
//! load of the joint.

use std::ops::Range;

use fearless_simd::Level;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::patch_builder::PatchBuilder;
use super::release::{JointLoad, JointStatus};
use super::{CombinedSurface, Configuration, ContactBlock, ContactModel, ContactPoint, Patch};
use crate::point::{JointCheck, JointPoint, PairContext, has_rotated};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::law::{FailureMode, JointLaw, SpringStiffness};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::in_situ::{Stress, between, over_quads};
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::{JointProperties, Properties};
use ddem_mesh::{Geometry, NonconformingJoint, Vec3};

/// Ratio of face areas above which the larger face is the ground of the other.
const LARGER: f64 = 1.01;

/// Joint that a patch represents.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bond {
    /// Number of the joint's properties.
    pub joint: u16,
    /// Number of its law; differs from `joint` only while strengths change in increments.
    #[serde(skip)]
    pub law: u16,
    /// Status of the joint.
    pub status: JointStatus,
}

/// Nonconforming joint that a contact has replaced.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReleasedJoint {
    /// Numbers of the blocks, the lower one first.
    pub blocks: [u32; 2],
    /// Joint, law and status.
    pub bond: Bond,
    /// Pairs of points in their last state.
    pub pairs: Box<[JointPoint]>,
}

impl PatchBuilder<'_> {
    /// Bonded patch of a nonconforming joint at rest. `both` are the in-situ stresses of its
    /// blocks; the caller sets `first_pair`.
    fn bond(
        &self,
        joint_pair: &NonconformingJoint,
        properties: &JointProperties,
        both: [Option<Stress>; 2],
    ) -> BondedPatch {
        let (mut quads, mut summed) = (Vec::new(), Vec::new());
        let matched = self.matched(joint_pair);
        let (mut patch, on) = match &matched {
            Some(matched) => {
                quads.clone_from(&matched.quads);
                self.by_nodes(joint_pair, matched)
            }
            None => self.by_face(joint_pair, &mut |corners, inside| {
                quads.extend(quads_of(corners));
                if inside.is_empty() {
                    summed.extend(quads_of(corners));
                }
            }),
        };
        let NonconformingJoint { blocks, faces, joint, area, cut, gap, .. } = *joint_pair;
        let surfaces = [0, 1].map(|side| self.surfaces.of(blocks[side], faces[side]));
        let stiffness @ SpringStiffness { normal, shear } = properties.stiffness();
        let dashpot = self.surfaces.dashpot_of_joint(surfaces, normal);
        patch.surface = CombinedSurface { stiffness, dashpot, ..CombinedSurface::default() };
        // No strips lie beside the joint: its area extends to the middle of the surrounding gaps. Parts
        // of cells have none.
        let is_part = |&block: &u32| self.configuration.blocks[block as usize].is_part();
        let own = if blocks.iter().all(is_part) { 0.0 } else { patch.area() };
        let part = if own > 0.0 { area / own } else { 1.0 };
        patch.points.iter_mut().for_each(|point| point.pair.area *= part);
        let axes = patch.frame();
        patch.fix_at(self.configuration.blocks, &on);
        patch.ground = patch.larger_face(self.configuration.blocks);
        let relative_positions = patch.relative_positions(&self.configuration);
        for (point, relative_position) in patch.points.iter_mut().zip(relative_positions) {
            point.pair.origin = axes.tr_mul(&relative_position);
        }
        // The springs carry the in-situ stress.
        let middle = |point: &ContactPoint| {
            let at = |side: usize| self.configuration.position(blocks[side], &point.points[side]);
            (at(0) + at(1)) / 2.0
        };
        let points: Vec<Vec3> = patch.points.iter().map(middle).collect();
        let normal_now = &patch.axes_now[0];
        let tractions = match &matched {
            Some(matched) => over_quads(both, normal_now, points.len(), &matched.integrals),
            None => between(both, normal_now, &points, &summed),
        };
        let tractions = tractions.unwrap_or_default();
        for (point, traction) in patch.points.iter_mut().zip(tractions) {
            let own = axes.tr_mul(&traction);
            point.pair.origin -= Vec3::new(own.x / normal, own.y / shear, own.z / shear);
        }
        patch.bond = Some(Bond { joint, law: joint, status: JointStatus::InPlace });
        let is_whole_rock = properties.is_whole_rock();
        BondedPatch { patch, quads, first_pair: 0, cut, is_whole_rock, gap }
    }
}

/// Nonconforming joint at rest.
#[derive(Clone, Debug)]
pub struct BondedPatch {
    /// Patch that holds its points.
    pub patch: Patch,
    /// Corner points of each part of its area.
    pub quads: Vec<[u32; 4]>,
    /// Number of its first pair.
    pub first_pair: usize,
    /// Number of the cut that made its faces, if one did.
    pub cut: Option<u32>,
    /// True if it holds whole rock together: its points are not among the numbered pairs.
    pub is_whole_rock: bool,
    /// Distance between the two faces `[m]`.
    gap: f64,
}

impl BondedPatch {
    /// Numbers of its pairs; none in whole rock.
    pub fn pairs(&self) -> Range<usize> {
        let n = if self.is_whole_rock { 0 } else { self.patch.points.len() };
        self.first_pair..self.first_pair + n
    }

    /// Nodes of both sides with their shape functions and the areas `[m²]` of the points, a node
    /// several times.
    fn weights<'a>(
        &'a self,
        blocks: &'a [ContactBlock],
        geometry: &'a Geometry,
    ) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
        let Patch { blocks: sides, points, .. } = &self.patch;
        (0..2).flat_map(move |side| {
            let block = sides[side] as usize;
            let first = geometry.blocks[block].first_node as usize;
            points.iter().flat_map(move |point| {
                let weights = blocks[block].weights(&point.points[side]).into_iter();
                weights.map(move |(node, weight)| (first + node, weight, point.pair.area))
            })
        })
    }

    /// Nodes of both sides with their parts of the area `[m²]`, a node several times.
    pub fn node_areas<'a>(
        &'a self,
        blocks: &'a [ContactBlock],
        geometry: &'a Geometry,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        self.weights(blocks, geometry).map(|(node, weight, area)| (node, weight * area))
    }
}

/// All nonconforming joints; the numbers of their pairs start at `first`.
pub fn bonded_patches(
    contact_model: &ContactModel,
    properties: &Properties,
    geometry: &Geometry,
    packs: &Packs,
    first: usize,
    stresses: &[Option<Stress>],
) -> Vec<BondedPatch> {
    let still = vec![Lanes::ZERO; 3 * packs.nodes];
    let configuration = Configuration {
        blocks: &contact_model.blocks,
        u: &still,
        frames: &vec![Frame::REST; packs.packs.len()],
        small: true,
        last: (&still, 0.0),
        start: true,
        poses: &[],
    };
    let builder = PatchBuilder {
        configuration,
        surfaces: &contact_model.surfaces,
        context: PairContext::default(),
        // Joints are made without stepping their springs.
        level: Level::baseline(),
        held: &[],
    };
    let bond = |joint_pair: &NonconformingJoint| {
        let of = |block: u32| stresses.get(block as usize).copied().flatten();
        let [a, b] = joint_pair.blocks.map(of);
        // A rigid block for which no stress is given takes that of the other block.
        let [rigid_a, rigid_b] = joint_pair.blocks.map(|block| geometry.is_rigid(block as usize));
        let both = [a.or(b.filter(|_| rigid_a)), b.or(a.filter(|_| rigid_b))];
        builder.bond(joint_pair, &properties.joints[usize::from(joint_pair.joint)], both)
    };
    let mut bonded: Vec<BondedPatch> = geometry.nonconforming_joints.par_iter().map(bond).collect();
    let mut next = first;
    for joint in &mut bonded {
        joint.first_pair = next;
        next = joint.pairs().end;
    }
    bonded
}

/// Nodal masses `[kg]` and stiffness diagonals `[N/m]` of nonconforming joints, by node. `layers` are the
/// thickness `[m]` and density `[kg/m³]` of each joint. Each side gets half the mass of the layer,
/// whose thickness is limited to the gap.
pub fn at_nodes(
    bonded: &[BondedPatch],
    blocks: &[ContactBlock],
    geometry: &Geometry,
    layers: &[[f64; 2]],
) -> Vec<[f64; 4]> {
    let mut at_nodes = vec![[0.0; 4]; geometry.n_nodes];
    for joint in bonded {
        let BondedPatch { patch, gap, .. } = joint;
        let Some(bond) = &patch.bond else { continue };
        if patch.blocks.iter().any(|&block| geometry.is_removed(block as usize)) {
            continue;
        }
        let [thickness, density] = layers[usize::from(bond.joint)];
        let layer = 0.5 * density * gap.clamp(0.0, thickness);
        let SpringStiffness { normal, shear } = patch.surface.stiffness;
        let stiffness = patch.axes[0].map(|n| normal * n * n + shear * (1.0 - n * n));
        for (node, weight, area) in joint.weights(blocks, geometry) {
            let part = weight * area;
            let [x, y, z] = <[f64; 3]>::from(stiffness * (weight * part));
            let more = [layer * part, x, y, z];
            (0..4).for_each(|k| at_nodes[node][k] += more[k]);
        }
    }
    at_nodes
}

/// Quadrilaterals that fan out from the first corner of a polygon; the last may repeat a corner.
fn quads_of(corners: &[u32]) -> impl Iterator<Item = [u32; 4]> {
    let fan = (1..corners.len().saturating_sub(1)).step_by(2);
    fan.map(|i| [corners[0], corners[i], corners[i + 1], corners[(i + 2).min(corners.len() - 1)]])
}

impl Patch {
    /// True if its points can slide: a contact that exerts force, or a joint with a failed pair.
    pub fn slides(&self) -> bool {
        match &self.bond {
            // No pair of a joint that holds has failed.
            Some(_) => !self.holds && self.pairs().any(|pair| pair.failure.is_some()),
            None => self.points.iter().any(|point| self.may_carry_force(point)),
        }
    }

    /// Stores the present state as equilibrium in all sliding points that have none.
    pub(super) fn set_equilibrium(&mut self) {
        let is_contact = self.bond.is_none();
        let pairs = self.points.iter_mut().map(|point| &mut point.pair);
        let loose = pairs.filter(|pair| is_contact || pair.failure.is_some());
        loose.for_each(JointPoint::set_equilibrium);
    }

    /// Ends the joint of the patch, if there is one, and returns its last state.
    pub fn ended(&mut self) -> Option<ReleasedJoint> {
        let bond = Bond { status: JointStatus::Released, ..self.bond.take()? };
        let mut pairs: Box<[JointPoint]> = self.pairs().copied().collect();
        pairs.iter_mut().for_each(JointPoint::remove_springs);
        Some(ReleasedJoint { blocks: self.blocks, bond, pairs })
    }

    /// True if the joint has rotated so far that its bonded pairs must fail.
    pub(super) fn has_rotated(&self, configuration: &Configuration<'_>) -> bool {
        self.bond.is_some() && has_rotated(self.pairs(), self.spacing(configuration))
    }

    /// Check of its bonded pairs for failure.
    pub(super) fn check(
        &self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
    ) -> JointCheck {
        let has_rotated = context.releases_rotated_joints && self.has_rotated(configuration);
        JointCheck { divisor: self.divisor(configuration, context), has_rotated }
    }

    /// Law of the joint; `None` for contacts, and for joints that never fail.
    pub(super) fn law<'a>(&self, context: PairContext<'a>) -> Option<&'a dyn JointLaw> {
        context.law(self.bond?.law)
    }

    /// Divisor of the tractions in the check of the joint for failure; `None`: no pair fails.
    pub(super) fn divisor(
        &self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
    ) -> Option<f64> {
        let blocks = self.blocks.map(|block| {
            let ContactBlock { pack, lane, .. } = configuration.blocks[block as usize];
            (pack, lane)
        });
        context.failure_check.divisor(self.law(context), blocks)
    }

    /// Numbers of pairs that would fail now, in shear and in tension.
    pub(super) fn failing(
        &self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
    ) -> [u64; 2] {
        let mut failing = [0; 2];
        let Some(law) = self.law(context) else { return failing };
        let axes = self.present_frame(configuration);
        let check = self.check(configuration, context);
        let relative_positions = self.relative_positions(configuration);
        for (point, relative_position) in self.points.iter().zip(relative_positions) {
            let own = axes.tr_mul(&relative_position);
            let elastic = point.pair.elastic(self.surface.stiffness, own);
            if let Some(mode) = point.pair.fails(law, check, elastic) {
                failing[usize::from(mode == FailureMode::Tension)] += 1;
            }
        }
        failing
    }

    /// Side with the larger face; `None` if the faces are about equally large.
    fn larger_face(&self, blocks: &[ContactBlock]) -> Option<u8> {
        let ContactPoint { points, .. } = self.points.first()?;
        let [a, b] = [0, 1].map(|side| {
            let contact_block = &blocks[points[side].block(self.blocks[side])];
            let elements = contact_block.topology.divisions().pow(2) as f64;
            contact_block.element_area(points[side].face()) * elements
        });
        let is_larger = |own: f64, other: f64| own > LARGER * other;
        if is_larger(a, b) {
            return Some(0);
        }
        is_larger(b, a).then_some(1)
    }

    /// Makes the axes rotate with the block of the larger face, once all pairs have failed. That
    /// block is the ground on which the other slides, even if the other tilts on a soft joint.
    /// Openings do not jump when the axes change.
    pub(super) fn rotate_with_larger(&mut self, configuration: &Configuration<'_>) {
        let turns = self.ground.is_some_and(|ground| ground != self.reference);
        if !turns || self.pairs().any(|pair| pair.failure.is_none()) {
            return;
        }
        let before = self.present_frame(configuration);
        // At rest the axes have the same components in the frames of both blocks.
        self.reference = 1 - self.reference;
        let after = self.present_frame(configuration);
        let relative_positions = self.relative_positions(configuration);
        for (point, relative_position) in self.points.iter_mut().zip(relative_positions) {
            let origin = &mut point.pair.origin;
            let [before, after] =
                [before, after].map(|axes| axes.tr_mul(&relative_position) - *origin);
            *origin += after - before;
        }
    }

    /// Load of the joint on block a.
    pub(super) fn load(&self, configuration: &Configuration<'_>) -> JointLoad {
        let [a, b] = self.blocks.map(|block| block as usize);
        let about = (configuration.centre(a) + configuration.centre(b)) / 2.0;
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for point in &self.points {
            let pull = self.force(point);
            force += pull;
            let x = configuration.position(self.blocks[0], &point.points[0]);
            moment += (x - about).cross(&pull);
        }
        JointLoad { energy: self.spring_energies(&[]), area: self.area(), force, moment, about }
    }
}
