//! §1, §5: joints between faces that do not match.
//!
//! A patch whose points are held by the law of a joint: they are springs from the start, the pairs of points stay where
//! they are, and they fail as the pairs of any joint do. When all of them have failed and one has moved, the patch is a
//! contact like any other, which begins with the force that the joint bore.

use std::iter::zip;

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fit::Fitting;
use super::release::{Load, Moved, Release};
use super::{Both, Patch, Placed, Placing, Point, Surfaces};
use crate::element::corotation::Frame;
use crate::joint::breaks::{self, Look, Losses};
use crate::law::bearing::Bearing;
use crate::law::{JointLaw, Memory, Mode, Opening, Stiffness, Traction};
use crate::math::lanes::Lanes;
use crate::mesh::in_situ::{Stress, between};
use crate::mesh::pack::Packs;
use crate::mesh::properties::{JointProperties, Properties};
use crate::mesh::{Abutment, Geometry, Vec3};

/// Ratio of the areas of two faces above which one is the ground of the other.
const LARGER: f64 = 1.01;

/// What holds the points of a patch together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Bond {
    /// Number of the joint's properties.
    pub(crate) joint: u16,
    /// Number of its law: that of the joint, but while its strengths change by parts.
    #[serde(skip)]
    pub(crate) law: u16,
    pub(crate) release: Release,
    /// Of each point of the patch.
    pub(crate) pairs: Box<[Pair]>,
}

/// A pair of points that is, or was, held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pair {
    /// From the point on a to that on b where nothing acts, along the patch's axes `[m]`.
    pub(super) origin: Vector3<f64>,
    /// How it failed; `None` while it is bonded.
    pub(crate) mode: Option<Mode>,
    /// When `[s]`; of no meaning while bonded.
    pub(crate) time: f64,
    pub(super) damage: f64,
}

impl Fitting<'_> {
    /// The joint of two faces that lie on each other, at rest; its first pair is given.
    fn bond(
        &self,
        abutment: &Abutment,
        Stiffness { normal, shear }: Stiffness,
        both: [Option<Stress>; 2],
    ) -> Seated {
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
        let dashpot = self.skins.dashpot_of_joint(skins, normal);
        patch.both = Both { stiffness: [normal, shear], dashpot, ..Both::default() };
        // There are no strips beside it: it reaches to the middle of the gaps around.
        let own: f64 = patch.points.iter().map(|point| point.area).sum();
        let part = if own > 0.0 { abutment.area / own } else { 1.0 };
        patch.points.iter_mut().for_each(|point| point.area *= part);
        let axes = patch.frame();
        let [a, b] = patch.blocks.map(|block| block as usize);
        let [face_a, face_b] = patch.faces();
        let pair = |point: &Point| {
            let [x, y] = point.spots;
            let apart = self.placing.position(b, face_b, &y) - self.placing.position(a, face_a, &x);
            Pair { origin: axes.tr_mul(&apart), ..Pair::default() }
        };
        let mut pairs: Box<[Pair]> = patch.points.iter().map(pair).collect();
        // It bears the stress that is there at the start.
        let middle = |point: &Point| {
            let [x, y] = &point.spots;
            (self.placing.position(a, face_a, x) + self.placing.position(b, face_b, y)) / 2.0
        };
        let points: Vec<Vec3> = patch.points.iter().map(middle).collect();
        let tractions = between(both, &patch.now[0], (&points, &summed)).unwrap_or_default();
        for (pair, traction) in pairs.iter_mut().zip(tractions) {
            let own = axes.tr_mul(&traction);
            pair.origin -= Vec3::new(own.x / normal, own.y / shear, own.z / shear);
        }
        let bond =
            Bond { joint: abutment.joint, law: abutment.joint, release: Release::Holds, pairs };
        patch.bond = Some(Box::new(bond));
        Seated { patch, quads, first_pair: 0, gap: abutment.gap }
    }
}

/// A joint between faces that do not match, at rest.
#[derive(Clone, Debug)]
pub(crate) struct Seated {
    pub(crate) patch: Patch,
    /// Its pairs around each part of it.
    pub(crate) quads: Vec<[u32; 4]>,
    /// Number of its first pair.
    pub(crate) first_pair: usize,
    /// Distance of the two faces `[m]`.
    gap: f64,
}

impl Seated {
    /// One more than the number of its last pair.
    pub(crate) fn end(&self) -> usize {
        self.first_pair + self.patch.points.len()
    }
}

/// All joints between faces that do not match; their pairs come after `first` others.
pub(crate) fn seated(
    surfaces: &Surfaces,
    (properties, geometry, packs): (&Properties, &Geometry, &Packs),
    (first, stresses): (usize, &[Option<Stress>]),
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
        undamped: true,
    };
    let fitting = Fitting { placing, skins: &surfaces.skins, laws: &[], held: &[] };
    let bond = |abutment: &Abutment| {
        let of = |block: u32| stresses.get(block as usize).copied().flatten();
        let [a, b] = abutment.blocks.map(of);
        // A rigid block has no stress, and bears that of the other.
        let [rigid_a, rigid_b] =
            abutment.blocks.map(|block| geometry.lattice(block as usize).rigid);
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
pub(crate) fn at_nodes(
    seated: &[Seated],
    (blocks, geometry): (&[Placed], &Geometry),
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
        let [normal, shear] = patch.both.stiffness;
        let stiffness = patch.axes[0].map(|n| normal * n * n + shear * (1.0 - n * n));
        for (side, face) in patch.faces().into_iter().enumerate() {
            let block = patch.blocks[side] as usize;
            let first = geometry.bodies[block].first_node as usize;
            for point in &patch.points {
                for (node, weight) in blocks[block].shares(face, &point.spots[side]) {
                    let part = weight * point.area;
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

impl Bond {
    fn law<'a>(&self, look: Look<'a>) -> Option<&'a dyn JointLaw> {
        look.laws[self.law as usize].as_deref()
    }

    /// A pair as those of other joints are; `point` is its points' as long as it holds them.
    pub(crate) fn point(&self, i: usize, point: Option<&Point>) -> breaks::Point {
        let Pair { origin, mode, damage, .. } = self.pairs[i];
        let memory = point.map(Point::memory).unwrap_or_default();
        breaks::Point { origin, quarters: 4, mode, memory: Memory { damage, ..memory } }
    }

    pub(crate) fn failed(&self) -> bool {
        self.pairs.iter().all(|pair| pair.mode.is_some())
    }
}

impl Patch {
    /// True where its points can slide: it is a contact that bears anything, or a joint with a failed pair.
    pub(crate) fn slides(&self) -> bool {
        match &self.bond {
            Some(bond) => bond.pairs.iter().any(|pair| pair.mode.is_some()),
            None => self.points.iter().any(|point| self.acts(point)),
        }
    }

    /// Points that know no equilibrium take the present state for one.
    pub(super) fn settle(&mut self) {
        let Self { points, bond, .. } = self;
        for (i, point) in points.iter_mut().enumerate().filter(|(_, p)| p.settled.is_none()) {
            let pair = bond.as_ref().map(|bond| &bond.pairs[i]);
            if pair.is_none_or(|pair| pair.mode.is_some()) {
                let damage = pair.map_or(1.0, |pair| pair.damage);
                let mut memory = Memory { damage, ..point.memory() };
                memory.settle();
                point.settled = memory.settled;
            }
        }
    }

    fn opening(&self, placing: &Placing<'_>, i: usize, pair: &Pair) -> (Vec3, Vector3<f64>) {
        let [a, b] = self.blocks.map(|block| block as usize);
        let [face_a, face_b] = self.faces();
        let [x, y] = &self.points[i].spots;
        let apart = placing.position(b, face_b, y) - placing.position(a, face_a, x);
        let rotation = placing.rotation(self.order()[0]);
        let [normal, along] = self.axes.map(|axis| rotation * axis);
        let own =
            Vec3::new(normal.dot(&apart), along.dot(&apart), normal.cross(&along).dot(&apart));
        (apart, own - pair.origin)
    }

    /// Whether the joint has turned so far that it lets go of the pairs that are still bonded.
    fn turned(&self, spacing: f64, bond: &Bond) -> bool {
        let points = bond.pairs.iter().enumerate().zip(&self.points);
        let mut failed = points.filter(|((_, pair), _)| pair.mode.is_some());
        failed.any(|((i, _), point)| bond.point(i, Some(point)).turned(spacing))
    }

    /// Whether it is a joint that has turned so far and still has pairs that are bonded; the blocks are given.
    pub(crate) fn hinges(&self, blocks: &[Placed]) -> bool {
        let [a, b] = self.blocks.map(|block| blocks[block as usize].spacing);
        self.bond.as_ref().is_some_and(|bond| !bond.failed() && self.turned(a.min(b), bond))
    }

    /// How many pairs would fail now, in shear and in tension.
    pub(super) fn failing(&self, placing: &Placing<'_>, look: Look<'_>) -> [u64; 2] {
        let mut failing = [0; 2];
        let Some(bond) = self.bond.as_deref() else { return failing };
        let (Some(law), Some(factor)) = (bond.law(look), look.failing) else { return failing };
        let [normal, shear] = self.both.stiffness;
        let turned = look.turning && law.bonds() && self.turned(self.spacing(placing), bond);
        let turned = turned.then_some(Mode::Shear);
        for (i, pair) in bond.pairs.iter().enumerate().filter(|(_, pair)| pair.mode.is_none()) {
            let (_, own) = self.opening(placing, i, pair);
            let mode = law.failure(normal * own.x / factor, shear * own.yz().norm() / factor);
            if let Some(mode) = mode.or(turned) {
                failing[usize::from(mode == Mode::Tension)] += 1;
            }
        }
        failing
    }

    /// What a joint exerts at the present positions, and what is lost on the way there.
    pub(super) fn bear_as_joint(&mut self, placing: &Placing<'_>, look: Look<'_>) -> Losses {
        let Some(mut bond) = self.bond.take() else { return Losses::default() };
        if bond.failed() {
            self.turn_with_larger(placing, &mut bond.pairs);
        }
        self.turn(placing);
        let law = bond.law(look);
        let [normal, shear] = self.both.stiffness;
        let stiffness = Stiffness { normal, shear };
        let dashpot = if look.undamped { 0.0 } else { self.both.dashpot };
        let time_step = look.time_step;
        let bearing = Bearing { stiffness, dashpot, time_step };
        let (mut losses, mut couple) = (Losses::default(), Vec3::zeros());
        let turns = look.turning && law.is_some_and(|law| law.bonds());
        let turned = turns && self.turned(self.spacing(placing), &bond);
        for (i, pair) in bond.pairs.iter_mut().enumerate() {
            let (apart, own) = self.opening(placing, i, pair);
            let elastic = Traction { normal: normal * own.x, shear: own.yz() * shear };
            let mut fresh = None;
            if let (None, Some(law), Some(factor)) = (pair.mode, law, look.failing) {
                let size = elastic.shear.norm();
                let failure = law.failure(elastic.normal / factor, size / factor);
                pair.mode = failure.or(turned.then_some(Mode::Shear));
                if let Some(mode) = pair.mode {
                    (pair.time, fresh) = (look.time, Some(elastic));
                    losses.failed[usize::from(mode == Mode::Tension)] += 1;
                }
            }
            let way = fresh.map(|_| self.way(placing, i));
            let point = &mut self.points[i];
            if let Some(traction) = fresh {
                let begins = Memory { traction, gap: own.x, ..Memory::default() };
                point.set(&begins);
            }
            match law.filter(|_| pair.mode.is_some()) {
                Some(law) => {
                    let mut memory = Memory { damage: pair.damage, ..point.memory() };
                    let opening = Opening { normal: own.x, shear: own.yz() };
                    let mut loss = bearing.act(law, opening, &mut memory);
                    if let Some(fresh) = fresh.zip(way) {
                        bearing.break_off(fresh, &mut loss, &mut memory);
                    }
                    losses.add_point(point.area, loss);
                    pair.damage = memory.damage;
                    point.set(&memory);
                }
                None => (point.traction, point.gap) = (elastic, own.x),
            }
            couple += apart.cross(&self.force(&self.points[i]));
        }
        self.couple = couple;
        self.bond = Some(bond);
        losses
    }

    /// Once all pairs have failed the axes turn with the larger face: the ground on which the other slides,
    /// however that tilts as it sinks into a soft joint. No opening jumps when the axes change.
    fn turn_with_larger(&mut self, placing: &Placing<'_>, pairs: &mut [Pair]) {
        let area = |side: usize| {
            let placed = &placing.blocks[self.blocks[side] as usize];
            placed.element_area(self.faces()[side]) * (placed.divisions as f64).powi(2)
        };
        let own = usize::from(self.reference);
        if area(1 - own) <= LARGER * area(own) {
            return;
        }
        let openings = |patch: &Self, pairs: &[Pair]| -> Vec<Vec3> {
            pairs.iter().enumerate().map(|(i, pair)| patch.opening(placing, i, pair).1).collect()
        };
        let before = openings(self, pairs);
        // At rest the axes are the same in both blocks.
        self.reference = 1 - self.reference;
        let after = openings(self, pairs);
        zip(pairs, zip(before, after))
            .for_each(|(pair, (before, after))| pair.origin += after - before);
    }

    /// Way of b against a in the last step, along the patch's axes `[m]`.
    fn way(&self, placing: &Placing<'_>, i: usize) -> Vec3 {
        let [a, b] = self.blocks.map(|block| block as usize);
        let [face_a, face_b] = self.faces();
        let [x, y] = &self.points[i].spots;
        self.frame().tr_mul(&(placing.way(b, face_b, y) - placing.way(a, face_a, x)))
    }

    /// How far the joint has come.
    pub(super) fn moved(&self, placing: &Placing<'_>, look: Look<'_>) -> Option<Release> {
        let bond = self.bond.as_deref()?;
        let law = bond.law(look);
        let softens = law.is_some_and(|law| law.softening().is_some());
        let mut moved = Moved::default();
        for (point, pair) in zip(&self.points, &bond.pairs).filter(|(_, pair)| pair.mode.is_some())
        {
            moved.add(point.slip.norm(), point.gap, softens && pair.damage < 1.0);
        }
        let bonded = !bond.failed() && law.is_none_or(|law| law.bonds());
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
        let area = self.points.iter().map(|point| point.area).sum();
        Load { energy: self.held(&[]), area, force, moment, about }
    }
}
