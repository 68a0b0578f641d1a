//! §1, §5: joints between faces that do not match.
//!
//! A patch whose points are held by the law of a joint: they are springs from the start, the pairs of points stay where
//! they are, and they fail as the pairs of any joint do. When all of them have failed and one has moved, the patch is a
//! contact like any other, which begins with the force that the joint bore.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fit::Fitting;
use super::release::{Load, Moved, Release};
use super::{Both, ContactPoint, Patch, Placed, Placing, Surfaces};
use crate::point::{JointPoint, Look, turned};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::law::{Mode, Stiffness};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::in_situ::{Stress, between};
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::{JointProperties, Properties};
use ddem_mesh::{Abutment, Geometry, Vec3};

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
    /// How far the joint has come.
    pub release: Release,
}

/// A joint between faces that do not match once a contact has taken its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// Its blocks, the lower number first.
    pub blocks: [u32; 2],
    /// Numbers of the joint.
    pub bond: Bond,
    /// Its pairs as they were last.
    pub pairs: Box<[JointPoint]>,
}

impl Fitting<'_> {
    /// The joint of two faces that lie on each other, at rest; its first pair is given.
    fn bond(&self, abutment: &Abutment, stiffness: Stiffness, both: [Option<Stress>; 2]) -> Seated {
        let (mut quads, mut summed) = (Vec::new(), Vec::new());
        let mut patch = self.abutting(abutment, &mut |corners, inside| {
            quads.extend(quads_of(corners));
            if inside.is_empty() {
                summed.extend(quads_of(corners));
            }
        });
        let [x, y] = patch.faces();
        let skins = [(patch.blocks[0], x), (patch.blocks[1], y)];
        let skins = skins.map(|(block, face)| self.skins.of(block, face));
        let Stiffness { normal, shear } = stiffness;
        let dashpot = self.skins.dashpot_of_joint(skins, normal);
        patch.both = Both { stiffness, dashpot, ..Both::default() };
        // There are no strips beside it: it reaches to the middle of the gaps around.
        let own = patch.area();
        let part = if own > 0.0 { abutment.area / own } else { 1.0 };
        patch.points.iter_mut().for_each(|point| point.pair.area *= part);
        let axes = patch.frame();
        let (blocks, faces) = (patch.blocks, patch.faces());
        for ContactPoint { spots, pair, .. } in &mut patch.points {
            pair.origin = axes.tr_mul(&self.placing.apart(blocks, faces, spots));
        }
        // It bears the stress that is there at the start.
        let middle = |point: &ContactPoint| {
            let at = |side: usize| {
                self.placing.position(blocks[side] as usize, faces[side], &point.spots[side])
            };
            (at(0) + at(1)) / 2.0
        };
        let points: Vec<Vec3> = patch.points.iter().map(middle).collect();
        let tractions = between(both, &patch.now[0], &points, &summed).unwrap_or_default();
        for (point, traction) in patch.points.iter_mut().zip(tractions) {
            let own = axes.tr_mul(&traction);
            point.pair.origin -= Vec3::new(own.x / normal, own.y / shear, own.z / shear);
        }
        let joint = abutment.joint;
        patch.bond = Some(Bond { joint, law: joint, release: Release::Holds });
        Seated { patch, quads, first_pair: 0, gap: abutment.gap }
    }
}

/// A joint between faces that do not match, at rest.
#[derive(Clone, Debug)]
pub struct Seated {
    /// Its points.
    pub patch: Patch,
    /// Its pairs around each part of it.
    pub quads: Vec<[u32; 4]>,
    /// Number of its first pair.
    pub first_pair: usize,
    /// Distance of the two faces `[m]`.
    gap: f64,
}

impl Seated {
    /// One more than the number of its last pair.
    pub fn end(&self) -> usize {
        self.first_pair + self.patch.points.len()
    }
}

/// All joints between faces that do not match; their pairs come after `first` others.
pub fn seated(
    surfaces: &Surfaces,
    properties: &Properties,
    geometry: &Geometry,
    packs: &Packs,
    first: usize,
    stresses: &[Option<Stress>],
) -> Vec<Seated> {
    let joints: Vec<Stiffness> = properties.joints.iter().map(JointProperties::stiffness).collect();
    let still = vec![Lanes::ZERO; 3 * packs.nodes];
    let placing = Placing {
        blocks: &surfaces.blocks,
        u: &still,
        frames: &vec![Frame::REST; packs.packs.len()],
        small: true,
        last: (&still, 0.0),
        start: true,
    };
    let fitting = Fitting { placing, skins: &surfaces.skins, look: Look::default(), held: &[] };
    let bond = |abutment: &Abutment| {
        let of = |block: u32| stresses.get(block as usize).copied().flatten();
        let [a, b] = abutment.blocks.map(of);
        // A rigid block has no stress, and bears that of the other.
        let [rigid_a, rigid_b] = abutment.blocks.map(|block| geometry.is_rigid(block as usize));
        let both = [if rigid_a { b } else { a }, if rigid_b { a } else { b }];
        fitting.bond(abutment, joints[usize::from(abutment.joint)], both)
    };
    let mut seated: Vec<Seated> = geometry.abutments.par_iter().map(bond).collect();
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
    seated: &[Seated],
    blocks: &[Placed],
    geometry: &Geometry,
    layers: &[[f64; 2]],
) -> Vec<(usize, [f64; 4])> {
    let mut at_nodes = Vec::new();
    for Seated { patch, gap, .. } in seated {
        let Some(bond) = &patch.bond else { continue };
        if patch.blocks.iter().any(|&block| geometry.is_gone(block as usize)) {
            continue;
        }
        let [thickness, density] = layers[usize::from(bond.joint)];
        let layer = 0.5 * density * gap.clamp(0.0, thickness);
        let Stiffness { normal, shear } = patch.both.stiffness;
        let stiffness = patch.axes[0].map(|n| normal * n * n + shear * (1.0 - n * n));
        for (side, face) in patch.faces().into_iter().enumerate() {
            let block = patch.blocks[side] as usize;
            let first = geometry.bodies[block].first_node as usize;
            for point in &patch.points {
                for (node, weight) in blocks[block].shares(face, &point.spots[side]) {
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
    pub(super) fn settle(&mut self) {
        let is_contact = self.bond.is_none();
        let pairs = self.points.iter_mut().map(|point| &mut point.pair);
        let loose = pairs.filter(|pair| is_contact || pair.failure.is_some());
        loose.for_each(JointPoint::settle);
    }

    /// The joint that it is no longer, if it was one.
    pub fn ended(&mut self) -> Option<Ended> {
        let bond = Bond { release: Release::Done, ..self.bond.take()? };
        let mut pairs: Box<[JointPoint]> = self.pairs().copied().collect();
        pairs.iter_mut().for_each(JointPoint::let_go);
        Some(Ended { blocks: self.blocks, bond, pairs })
    }

    /// True where it is a joint that has turned so far that it lets go of the pairs that are still bonded.
    pub(super) fn turned(&self, placing: &Placing<'_>) -> bool {
        self.bond.is_some() && turned(self.pairs(), self.spacing(placing))
    }

    /// How many pairs would fail now, in shear and in tension.
    pub(super) fn failing(&self, placing: &Placing<'_>, look: Look<'_>) -> [u64; 2] {
        let mut failing = [0; 2];
        let Some(law) = self.bond.and_then(|bond| look.law(bond.law)) else { return failing };
        let axes = self.present_frame(placing);
        let turned = look.turning && self.turned(placing);
        for point in &self.points {
            let own = axes.tr_mul(&placing.apart(self.blocks, self.faces(), &point.spots));
            let elastic = point.pair.elastic(self.both.stiffness, own);
            if let Some(mode) = point.pair.fails(law, look, elastic, turned) {
                failing[usize::from(mode == Mode::Tension)] += 1;
            }
        }
        failing
    }

    /// Once all pairs have failed the axes turn with the larger face: the ground on which the other slides,
    /// however that tilts as it sinks into a soft joint. No opening jumps when the axes change.
    pub(super) fn turn_with_larger(&mut self, placing: &Placing<'_>) {
        let area = |side: usize| {
            let placed = &placing.blocks[self.blocks[side] as usize];
            placed.element_area(self.faces()[side]) * (placed.topology.divisions() as f64).powi(2)
        };
        let own = usize::from(self.reference);
        if area(1 - own) <= LARGER * area(own) {
            return;
        }
        let before = self.present_frame(placing);
        // At rest the axes are the same in both blocks.
        self.reference = 1 - self.reference;
        let after = self.present_frame(placing);
        let (blocks, faces) = (self.blocks, self.faces());
        for ContactPoint { spots, pair, .. } in &mut self.points {
            let apart = placing.apart(blocks, faces, spots);
            let [before, after] = [before, after].map(|axes| axes.tr_mul(&apart) - pair.origin);
            pair.origin += after - before;
        }
    }

    /// How far the joint has come.
    pub(super) fn moved(&self, placing: &Placing<'_>, look: Look<'_>) -> Option<Release> {
        let law = look.law(self.bond?.law);
        let (moved, whole) = Moved::of(self.pairs(), law);
        let bonded = whole && law.is_none_or(|law| law.bonds());
        let rigid = self.blocks.iter().any(|&block| placing.blocks[block as usize].rigid);
        Some(moved.release(bonded, rigid, self.spacing(placing)))
    }

    /// What the joint bears, on block a.
    pub(super) fn load(&self, placing: &Placing<'_>) -> Load {
        let [a, b] = self.blocks.map(|block| block as usize);
        let about = (placing.centre(a) + placing.centre(b)) / 2.0;
        let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
        for point in &self.points {
            let pull = self.force(point);
            force += pull;
            let x = placing.position(a, self.faces()[0], &point.spots[0]);
            moment += (x - about).cross(&pull);
        }
        Load { energy: self.held(&[]), area: self.area(), force, moment, about }
    }
}
