//! §1, §5: joints between faces that do not match.
//!
//! A patch whose points are held by the law of a joint: they are springs from the start, the pairs of points stay where
//! they are, and they fail as the pairs of any joint do. When all of them have failed and one has moved, the patch is a
//! contact like any other, which begins with the force that the joint bore.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::patch_builder::PatchBuilder;
use super::release::{JointLoad, JointStatus, PairMotion};
use super::{CombinedSurface, Configuration, ContactBlock, ContactModel, ContactPoint, Patch};
use crate::point::{JointPoint, PairContext, turned};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::law::{FailureMode, SpringStiffness};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::in_situ::{Stress, between};
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::{JointProperties, Properties};
use ddem_mesh::{Geometry, NonconformingJoint, Vec3};

/// Ratio of the areas of two faces above which one is the ground of the other.
const LARGER: f64 = 1.01;

/// The joint whose pairs the points of a patch are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bond {
    /// Number of the joint's properties.
    pub joint: u16,
    /// Number of its law: that of the joint, but while its strengths change by parts.
    #[serde(skip)]
    pub law: u16,
    /// Status of the joint.
    pub release: JointStatus,
}

/// A joint between faces that do not match once a contact has taken its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReleasedJoint {
    /// Its blocks, the lower number first.
    pub blocks: [u32; 2],
    /// Numbers of the joint.
    pub bond: Bond,
    /// Its pairs as they were last.
    pub pairs: Box<[JointPoint]>,
}

impl PatchBuilder<'_> {
    /// The joint of two faces that lie on each other, at rest; its first pair is given.
    fn bond(
        &self,
        joint_pair: &NonconformingJoint,
        stiffness: SpringStiffness,
        both: [Option<Stress>; 2],
    ) -> BondedPatch {
        let (mut quads, mut summed) = (Vec::new(), Vec::new());
        let mut patch = self.by_face(joint_pair, &mut |corners, inside| {
            quads.extend(quads_of(corners));
            if inside.is_empty() {
                summed.extend(quads_of(corners));
            }
        });
        let [x, y] = patch.faces();
        let surfaces = [(patch.blocks[0], x), (patch.blocks[1], y)];
        let surfaces = surfaces.map(|(block, face)| self.surfaces.of(block, face));
        let SpringStiffness { normal, shear } = stiffness;
        let dashpot = self.surfaces.dashpot_of_joint(surfaces, normal);
        patch.both = CombinedSurface { stiffness, dashpot, ..CombinedSurface::default() };
        // There are no strips beside it: it reaches to the middle of the gaps around.
        let own = patch.area();
        let part = if own > 0.0 { joint_pair.area / own } else { 1.0 };
        patch.points.iter_mut().for_each(|point| point.pair.area *= part);
        let axes = patch.frame();
        let (blocks, faces) = (patch.blocks, patch.faces());
        for ContactPoint { spots, pair, .. } in &mut patch.points {
            pair.origin = axes.tr_mul(&self.configuration.apart(blocks, faces, spots));
        }
        // It bears the stress that is there at the start.
        let middle = |point: &ContactPoint| {
            let at = |side: usize| {
                self.configuration.position(blocks[side] as usize, faces[side], &point.spots[side])
            };
            (at(0) + at(1)) / 2.0
        };
        let points: Vec<Vec3> = patch.points.iter().map(middle).collect();
        let tractions = between(both, &patch.now[0], &points, &summed).unwrap_or_default();
        for (point, traction) in patch.points.iter_mut().zip(tractions) {
            let own = axes.tr_mul(&traction);
            point.pair.origin -= Vec3::new(own.x / normal, own.y / shear, own.z / shear);
        }
        let joint = joint_pair.joint;
        patch.bond = Some(Bond { joint, law: joint, release: JointStatus::InPlace });
        BondedPatch { patch, quads, first_pair: 0, gap: joint_pair.gap }
    }
}

/// A joint between faces that do not match, at rest.
#[derive(Clone, Debug)]
pub struct BondedPatch {
    /// Its points.
    pub patch: Patch,
    /// Its pairs around each part of it.
    pub quads: Vec<[u32; 4]>,
    /// Number of its first pair.
    pub first_pair: usize,
    /// Distance of the two faces `[m]`.
    gap: f64,
}

impl BondedPatch {
    /// One more than the number of its last pair.
    pub fn end(&self) -> usize {
        self.first_pair + self.patch.points.len()
    }
}

/// All joints between faces that do not match; their pairs come after `first` others.
pub fn bonded_patches(
    contact_model: &ContactModel,
    properties: &Properties,
    geometry: &Geometry,
    packs: &Packs,
    first: usize,
    stresses: &[Option<Stress>],
) -> Vec<BondedPatch> {
    let joints: Vec<SpringStiffness> =
        properties.joints.iter().map(JointProperties::stiffness).collect();
    let still = vec![Lanes::ZERO; 3 * packs.nodes];
    let configuration = Configuration {
        blocks: &contact_model.blocks,
        u: &still,
        frames: &vec![Frame::REST; packs.packs.len()],
        small: true,
        last: (&still, 0.0),
        start: true,
    };
    let builder = PatchBuilder {
        configuration,
        surfaces: &contact_model.surfaces,
        context: PairContext::default(),
        held: &[],
    };
    let bond = |joint_pair: &NonconformingJoint| {
        let of = |block: u32| stresses.get(block as usize).copied().flatten();
        let [a, b] = joint_pair.blocks.map(of);
        // A rigid block has no stress, and bears that of the other.
        let [rigid_a, rigid_b] = joint_pair.blocks.map(|block| geometry.is_rigid(block as usize));
        let both = [if rigid_a { b } else { a }, if rigid_b { a } else { b }];
        builder.bond(joint_pair, joints[usize::from(joint_pair.joint)], both)
    };
    let mut seated: Vec<BondedPatch> = geometry.nonconforming_joints.par_iter().map(bond).collect();
    let mut next = first;
    for joint in &mut seated {
        joint.first_pair = next;
        next += joint.patch.points.len();
    }
    seated
}

/// Mass `[kg]` and diagonal of the stiffness `[N/m]` that joints have at nodes. `layers` are the thickness `[m]` and
/// the density `[kg/m³]` of each joint: half of what there is room for goes to each side.
pub fn at_nodes(
    seated: &[BondedPatch],
    blocks: &[ContactBlock],
    geometry: &Geometry,
    layers: &[[f64; 2]],
) -> Vec<(usize, [f64; 4])> {
    let mut at_nodes = Vec::new();
    for BondedPatch { patch, gap, .. } in seated {
        let Some(bond) = &patch.bond else { continue };
        if patch.blocks.iter().any(|&block| geometry.is_removed(block as usize)) {
            continue;
        }
        let [thickness, density] = layers[usize::from(bond.joint)];
        let layer = 0.5 * density * gap.clamp(0.0, thickness);
        let SpringStiffness { normal, shear } = patch.both.stiffness;
        let stiffness = patch.axes[0].map(|n| normal * n * n + shear * (1.0 - n * n));
        for (side, face) in patch.faces().into_iter().enumerate() {
            let block = patch.blocks[side] as usize;
            let first = geometry.blocks[block].first_node as usize;
            for point in &patch.points {
                for (node, weight) in blocks[block].weights(face, &point.spots[side]) {
                    let part = weight * point.pair.area;
                    let [x, y, z] = <[f64; 3]>::from(stiffness * (weight * part));
                    at_nodes.push((first + node, [layer * part, x, y, z]));
                }
            }
        }
    }
    at_nodes
}

/// A polygon as quadrilaterals from its first corner; the last one may have two corners in one.
fn quads_of(corners: &[u32]) -> impl Iterator<Item = [u32; 4]> {
    let fan = (1..corners.len().saturating_sub(1)).step_by(2);
    fan.map(|i| [corners[0], corners[i], corners[i + 1], corners[(i + 2).min(corners.len() - 1)]])
}

impl Patch {
    /// True where its points can slide: it is a contact that bears anything, or a joint with a failed pair.
    pub fn slides(&self) -> bool {
        match &self.bond {
            Some(_) => self.pairs().any(|pair| pair.failure.is_some()),
            None => self.points.iter().any(|point| self.acts(point)),
        }
    }

    /// Points that know no equilibrium take the present state for one.
    pub(super) fn set_equilibrium(&mut self) {
        let is_contact = self.bond.is_none();
        let pairs = self.points.iter_mut().map(|point| &mut point.pair);
        let loose = pairs.filter(|pair| is_contact || pair.failure.is_some());
        loose.for_each(JointPoint::set_equilibrium);
    }

    /// The joint that it is no longer, if it was one.
    pub fn ended(&mut self) -> Option<ReleasedJoint> {
        let bond = Bond { release: JointStatus::Released, ..self.bond.take()? };
        let mut pairs: Box<[JointPoint]> = self.pairs().copied().collect();
        pairs.iter_mut().for_each(JointPoint::remove_springs);
        Some(ReleasedJoint { blocks: self.blocks, bond, pairs })
    }

    /// True where it is a joint that has turned so far that it lets go of the pairs that are still bonded.
    pub(super) fn turned(&self, configuration: &Configuration<'_>) -> bool {
        self.bond.is_some() && turned(self.pairs(), self.spacing(configuration))
    }

    /// Numbers of pairs that would fail now, in shear and in tension.
    pub(super) fn failing(
        &self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
    ) -> [u64; 2] {
        let mut failing = [0; 2];
        let Some(law) = self.bond.and_then(|bond| context.law(bond.law)) else { return failing };
        let axes = self.present_frame(configuration);
        let turned = context.turning && self.turned(configuration);
        for point in &self.points {
            let own = axes.tr_mul(&configuration.apart(self.blocks, self.faces(), &point.spots));
            let elastic = point.pair.elastic(self.both.stiffness, own);
            if let Some(mode) = point.pair.fails(law, context, elastic, turned) {
                failing[usize::from(mode == FailureMode::Tension)] += 1;
            }
        }
        failing
    }

    /// Once all pairs have failed the axes turn with the larger face: the ground on which the other slides,
    /// however that tilts as it sinks into a soft joint. No opening jumps when the axes change.
    pub(super) fn turn_with_larger(&mut self, configuration: &Configuration<'_>) {
        let area = |side: usize| {
            let contact_block = &configuration.blocks[self.blocks[side] as usize];
            contact_block.element_area(self.faces()[side])
                * (contact_block.topology.divisions() as f64).powi(2)
        };
        let own = usize::from(self.reference);
        if area(1 - own) <= LARGER * area(own) {
            return;
        }
        let before = self.present_frame(configuration);
        // At rest the axes are the same in both blocks.
        self.reference = 1 - self.reference;
        let after = self.present_frame(configuration);
        let (blocks, faces) = (self.blocks, self.faces());
        for ContactPoint { spots, pair, .. } in &mut self.points {
            let apart = configuration.apart(blocks, faces, spots);
            let [before, after] = [before, after].map(|axes| axes.tr_mul(&apart) - pair.origin);
            pair.origin += after - before;
        }
    }

    /// Status of the joint from its pairs' motion.
    pub(super) fn moved(
        &self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
    ) -> Option<JointStatus> {
        let law = context.law(self.bond?.law);
        let (moved, whole) = PairMotion::of(self.pairs(), law);
        let bonded = whole && law.is_none_or(|law| law.bonds());
        let rigid = self.blocks.iter().any(|&block| configuration.blocks[block as usize].rigid);
        Some(moved.release(bonded, rigid, self.spacing(configuration)))
    }

    /// Load of the joint on block a.
    pub(super) fn load(&self, configuration: &Configuration<'_>) -> JointLoad {
        let [a, b] = self.blocks.map(|block| block as usize);
        let about = (configuration.centre(a) + configuration.centre(b)) / 2.0;
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for point in &self.points {
            let pull = self.force(point);
            force += pull;
            let x = configuration.position(a, self.faces()[0], &point.spots[0]);
            moment += (x - about).cross(&pull);
        }
        JointLoad { energy: self.held(&[]), area: self.area(), force, moment, about }
    }
}
