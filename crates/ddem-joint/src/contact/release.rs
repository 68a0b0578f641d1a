//! Replacement of displaced joints by contacts (§9).
//!
//! Pairs of facing nodes are valid until they have slid by half their spacing, or opened. Then a
//! joint whose pairs have all failed is released. Its springs are removed, and its two blocks
//! become an ordinary contact, which begins with the load of the joint.

use std::borrow::Borrow;

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Configuration, ContactPoint, Contacts, Patch};
use crate::broken::{BrokenJoints, BrokenLattice};
use crate::point::{JointPoint, PairContext, vector};
use ddem_mechanics::law::{JointLaw, Laws, SpringStiffness, Traction};
use ddem_mechanics::math::exact::ExactSum;
use ddem_mesh::NO_JOINT;
use ddem_mesh::joint_sections::{JointSection, JointSections};
use ddem_mesh::pack::{Pack, Packs};
use ddem_mesh::{Geometry, Vec3};

/// Slip or opening beyond which a joint is mobilised, as a fraction of the spacing of its pairs. The
/// blocks around a mobilised joint may meet.
pub(super) const MOBILISED: f64 = 0.01;
/// Slip of a joint at its release, as a fraction of the spacing of its pairs.
pub(super) const SLID: f64 = 0.5;
/// Least number of packs per parallel task.
const PACKS: usize = 256;

/// Status of a joint on its way to a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum JointStatus {
    /// None of its pairs has moved noticeably.
    #[default]
    InPlace,
    /// Some of its pairs have slipped or opened.
    Mobilised,
    /// A contact replaces it in the next step.
    Pending,
    /// A contact has replaced it.
    Released,
}

/// Data for the lookup of joints.
#[derive(Clone, Copy)]
pub struct JointLookup<'a> {
    /// Blocks.
    pub geometry: &'a Geometry,
    /// Packs of the blocks.
    pub packs: &'a Packs,
    /// Areas and stiffnesses of the joints.
    pub sections: &'a JointSections,
}

impl Contacts {
    /// Updates the statuses of the joints from their motion. Blocks of joints whose status has
    /// advanced may meet.
    pub fn update_statuses(
        &mut self,
        at: JointLookup<'_>,
        laws: &Laws,
        broken_joints: &BrokenJoints,
    ) {
        let joints = &self.joints;
        let further = |index: usize| {
            let pack = &at.packs.packs[index];
            let fails = move |d: &usize| {
                broken_joints.get(index, 1 << d).is_some_and(BrokenLattice::has_any_failed)
            };
            let all = (0..3).filter(fails);
            let all = all.flat_map(|d| (0..pack.filled).map(move |lane| (d, lane)));
            all.filter_map(move |(d, lane)| {
                let block = pack.blocks[lane] as usize;
                let known = joints[block][d];
                let (broken, section) = joint(at, broken_joints, index, d, lane)?;
                if known >= JointStatus::Pending || !broken.has_failed(lane) {
                    return None;
                }
                // Without a bond the joint is at least as far on its way.
                let [slip, opening] = broken.moved(lane);
                let most = PairMotion { slip, opening, ..PairMotion::default() };
                if most.status(false, pack.rigid, section.spacing(lane)) <= known {
                    return None;
                }
                let law = laws.get(usize::from(section.laws[lane])).and_then(Option::as_deref);
                let found = status_of(pack, broken, section, law, lane);
                (found > known).then_some((block, d, found))
            })
        };
        let broken = (0..broken_joints.packs.len()).into_par_iter().with_min_len(PACKS);
        let broken = broken.filter(|&index| broken_joints.packs[index].is_some());
        let found: Vec<(usize, usize, JointStatus)> = broken.flat_map_iter(further).collect();
        self.near_is_complete &= found.is_empty();
        found.into_iter().for_each(|(block, d, release)| self.joints[block][d] = release);
    }
}

/// Status of a broken joint of a pack.
fn status_of(
    pack: &Pack,
    broken: &BrokenLattice,
    section: &JointSection,
    law: Option<&dyn JointLaw>,
    lane: usize,
) -> JointStatus {
    let (moved, any_bonded) = PairMotion::of(broken.lane(lane), law);
    // Without bond strength an unfailed pair holds no more than a failed one. Neither do the last
    // two pairs of rigid blocks: they lie at quarter points, but the block rotates about its edge.
    let has_rotated = pack.rigid && moved.open >= 2;
    let bonded = any_bonded && !has_rotated && law.is_none_or(|law| law.is_cohesive());
    moved.status(bonded, pack.rigid, section.spacing(lane))
}

/// Broken lattice and section of a joint.
fn joint<'a>(
    at: JointLookup<'a>,
    broken_joints: &'a BrokenJoints,
    index: usize,
    d: usize,
    lane: usize,
) -> Option<(&'a BrokenLattice, &'a JointSection)> {
    let section = at.sections.get(index, d).filter(|section| section.joints[lane] != NO_JOINT)?;
    Some((broken_joints.get(index, 1 << d)?, section))
}

/// Motion of the failed pairs of a joint.
#[derive(Clone, Copy, Default)]
pub(super) struct PairMotion {
    /// Largest slip `[m]`.
    slip: f64,
    /// Largest opening `[m]`.
    opening: f64,
    /// Number of pairs that are open.
    open: usize,
    /// True if a pair carries tension that softens.
    softens: bool,
}

impl PairMotion {
    /// Motion of the failed pairs, and true if there are unfailed ones.
    pub(super) fn of(
        pairs: impl Iterator<Item = impl Borrow<JointPoint>>,
        law: Option<&dyn JointLaw>,
    ) -> (Self, bool) {
        let softens = law.is_some_and(|law| law.softening().is_some());
        let (mut moved, mut any_bonded) = (Self::default(), false);
        for pair in pairs {
            let JointPoint { failure, state, .. } = pair.borrow();
            if failure.is_none() {
                any_bonded = true;
                continue;
            }
            moved.slip = moved.slip.max(state.slip.norm());
            moved.opening = moved.opening.max(state.gap);
            moved.open += usize::from(state.gap > 0.0);
            moved.softens |= softens && state.damage < 1.0 && state.gap > 0.0;
        }
        (moved, any_bonded)
    }

    /// Adds the motion of other pairs.
    pub(super) fn merge(&mut self, other: Self) {
        self.slip = self.slip.max(other.slip);
        self.opening = self.opening.max(other.opening);
        self.open += other.open;
        self.softens |= other.softens;
    }

    /// True if a contact must replace the joint. Between rigid blocks this happens when one pair
    /// opens, because their pairs are not at the corners about which a block rotates.
    fn is_released(self, rigid: bool, spacing: f64) -> bool {
        let open = match (self.softens, rigid) {
            (true, _) => SLID,
            (_, true) => 0.0,
            _ => MOBILISED,
        };
        self.slip > SLID * spacing || self.opening > open * spacing
    }

    pub(super) fn status(self, bonded: bool, rigid: bool, spacing: f64) -> JointStatus {
        if !bonded && self.is_released(rigid, spacing) {
            JointStatus::Pending
        } else if self.slip.max(self.opening) > MOBILISED * spacing {
            JointStatus::Mobilised
        } else {
            JointStatus::InPlace
        }
    }
}

impl BrokenLattice {
    /// True if all pairs of the joint in a lane have failed but have not moved so far that the
    /// joint is released.
    pub fn has_failed_in_place(
        &self,
        context: PairContext<'_>,
        section: &JointSection,
        lane: usize,
        rigid: bool,
    ) -> bool {
        if !self.has_failed(lane) {
            return false;
        }
        let (moved, any_bonded) = PairMotion::of(self.lane(lane), context.law(section.laws[lane]));
        !any_bonded && !moved.is_released(rigid, section.spacing(lane))
    }
}

/// Load of a joint at its release: force on its lower side, moment about a point, and energy of its
/// springs.
pub(super) struct JointLoad {
    /// Energy of its springs, normal and shear `[J]`.
    pub(super) energy: [f64; 2],
    /// Area of its springs `[m²]`.
    pub(super) area: f64,
    pub(super) force: Vec3,
    pub(super) moment: Vec3,
    pub(super) about: Vec3,
}

/// Releases the pending joints. `make` makes the patch of two blocks, which begins with the load of
/// the joint. Returns the lost energy `[J]` and the number of pairs that were still bonded.
pub(super) fn release(
    at: JointLookup<'_>,
    configuration: &Configuration<'_>,
    context: PairContext<'_>,
    broken_joints: &mut BrokenJoints,
    contacts: &mut Contacts,
    make: &dyn Fn([u32; 2]) -> Option<Patch>,
) -> (f64, u64) {
    let (mut patches, mut any, mut lost) = (Vec::new(), false, ExactSum::default());
    let mut failed = 0;
    for (index, pack) in at.packs.packs.iter().enumerate() {
        for (d, lane) in (0..3).flat_map(|d| (0..pack.filled).map(move |lane| (d, lane))) {
            let block = pack.blocks[lane] as usize;
            if contacts.joints[block][d] != JointStatus::Pending {
                continue;
            }
            contacts.joints[block][d] = JointStatus::Released;
            any = true;
            let Some(other) = at.geometry.above(block, d) else { continue };
            failed += fail_bonded_pairs(at, context, broken_joints, index, d, lane);
            let removed = remove_springs(at, configuration, broken_joints, index, d, lane);
            let Some((load, energy_excess)) = removed else { continue };
            let blocks = [block.min(other) as u32, block.max(other) as u32];
            lost.add(load.energy[0] + load.energy[1] + energy_excess);
            let Some(mut patch) = make(blocks) else { continue };
            let sign = if blocks[0] as usize == block { 1.0 } else { -1.0 };
            patch.preload(configuration, context, &load, sign);
            lost.add(-patch.stored());
            patches.push(patch);
        }
    }
    if any {
        patches.sort_by_key(|patch| patch.blocks);
        let replaced = |old: &Patch| patches.binary_search_by_key(&old.blocks, |new| new.blocks);
        contacts.patches.retain(|old| replaced(old).is_err());
        contacts.renew(patches);
    }
    (lost.value(), failed)
}

/// Marks the bonded pairs of a released joint as failed in shear. Returns their number.
fn fail_bonded_pairs(
    at: JointLookup<'_>,
    context: PairContext<'_>,
    broken_joints: &mut BrokenJoints,
    index: usize,
    d: usize,
    lane: usize,
) -> u64 {
    let law = at.sections.get(index, d).and_then(|section| context.law(section.laws[lane]));
    let Some(broken) = broken_joints.at(index)[1 << d].as_mut() else { return 0 };
    if law.is_none_or(|law| !law.is_cohesive()) {
        return 0;
    }
    broken.fail_bonded(lane, context.time)
}

/// Removes the springs of a joint. Returns their load and their energy excess `[J]`.
fn remove_springs(
    at: JointLookup<'_>,
    configuration: &Configuration<'_>,
    broken_joints: &mut BrokenJoints,
    index: usize,
    d: usize,
    lane: usize,
) -> Option<(JointLoad, f64)> {
    let section = at.sections.get(index, d).filter(|section| section.joints[lane] != NO_JOINT)?;
    let pack = &at.packs.packs[index];
    let block = pack.blocks[lane] as usize;
    let other = at.geometry.above(block, d)?;
    let axes = configuration.between(block, other) * section.axes;
    let about = (configuration.centre(block) + configuration.centre(other)) / 2.0;
    let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
    let (mut energy, mut energy_excess, mut total_area) = ([0.0; 2], 0.0, 0.0);
    let broken = broken_joints.at(index)[1 << d].as_mut()?;
    let n = at.packs.numbering_of(pack).divisions;
    for (p, JointPoint { area, state, .. }) in broken.lane(lane).enumerate() {
        let (traction, total) = (state.traction, state.total_traction());
        let pull = axes * vector(total.normal, total.shear) * area;
        force += pull;
        moment += (configuration.pair(block, pack.rigid, d, p, n) - about).cross(&pull);
        energy[0] += area * 0.5 * traction.normal * state.gap;
        energy[1] += area * 0.5 * traction.shear.norm_squared() / section.stiffness(lane).shear;
        energy_excess += area * state.energy_excess;
        total_area += area;
    }
    broken.remove_springs(lane);
    Some((JointLoad { energy, area: total_area, force, moment, about }, energy_excess))
}

impl Configuration<'_> {
    /// Mean rotation of two blocks, accurate enough for the transfer of loads.
    fn between(&self, a: usize, b: usize) -> Matrix3<f64> {
        let sum = self.rotation(a) + self.rotation(b);
        nalgebra::Rotation3::from_matrix(&(sum * 0.5)).into_inner()
    }

    /// Position of pair `p` of the joint at the upper side of a block along `d` `[m]`.
    fn pair(&self, block: usize, rigid: bool, d: usize, p: usize, n: usize) -> Vec3 {
        let contact_block = &self.blocks[block];
        let mut at = [0; 3];
        at[d] = n;
        let node = |i: usize, k: usize| {
            let mut at = at;
            (at[(d + 1) % 3], at[(d + 2) % 3]) = (i, k);
            contact_block.node(self.u, at)
        };
        let (i, k) = (p % (n + 1), p / (n + 1));
        if !rigid {
            return node(i, k);
        }
        // Centre of a quarter of the face.
        let quarter = [(i, k, 9.0), (1 - i, k, 3.0), (i, 1 - k, 3.0), (1 - i, 1 - k, 1.0)];
        quarter.iter().map(|&(i, k, part)| node(i, k) * (part / 16.0)).sum()
    }
}

impl Patch {
    /// Begins with the load of a released joint. The pressure varies linearly over the area, so
    /// that its force and moments equal those of the joint. Shear is proportional to the pressure,
    /// so friction carries it wherever it carried that of the joint. `sign` is 1 if block a is on
    /// side a of the joint.
    pub(super) fn preload(
        &mut self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
        load: &JointLoad,
        sign: f64,
    ) {
        let axes = self.frame();
        let [normal, s, t] = [0, 1, 2].map(|k| Vec3::from(axes.column(k)));
        let body = self.blocks[0];
        let area = self.area();
        if area <= 0.0 {
            return;
        }
        // Moments about the centroid of the area: there shear in its plane has no tilting moment.
        let position = |p: &ContactPoint| configuration.position(body, &p.points[0]);
        let middle: Vec3 = self.points.iter().map(|p| position(p) * (p.pair.area / area)).sum();
        let positions: Vec<Vec3> = self.points.iter().map(|p| position(p) - middle).collect();
        let force = load.force * sign;
        let moment = load.moment * sign - (middle - load.about).cross(&force);
        // Σ A p (1, y, z) is given, with y and z along the tangents: p = α + β y + γ z.
        let mut matrix = Matrix3::zeros();
        for (pair, x) in self.pairs().zip(&positions) {
            let basis = Vector3::new(1.0, s.dot(x), t.dot(x));
            matrix += basis * basis.transpose() * pair.area;
        }
        // Moment of a traction p n at y s + z t: p (z s − y t), with s × n = −t and t × n = s.
        let given = Vector3::new(normal.dot(&force), -t.dot(&moment), s.dot(&moment));
        // Points on a line carry a uniform pressure.
        let even = Vector3::new(given.x / area, 0.0, 0.0);
        let field = matrix.try_inverse().map_or(even, |inverse| inverse * given);
        let required = |x: &Vec3| field.dot(&Vector3::new(1.0, s.dot(x), t.dot(x))).min(0.0);
        let normal: f64 = self.pairs().zip(&positions).map(|(p, x)| p.area * required(x)).sum();
        let shear = Vector2::new(s.dot(&force), t.dot(&force));
        let SpringStiffness { normal: stiff, shear: soft } = self.surface.stiffness;
        for (point, x) in self.points.iter_mut().zip(&positions) {
            let required = required(x);
            let shear = if normal < 0.0 { shear * (required / normal) } else { Vector2::zeros() };
            // Shifts the offset so that the springs carry the required pressure at the present gap.
            let state = &mut point.pair.state;
            let bare = state.gap + state.dilation;
            state.gap = required / stiff;
            (state.dilation, state.applied_dilation) = (bare - state.gap, bare - state.gap);
            let most = self.surface.friction.strength(context.laws, required);
            let size = shear.norm();
            let carried = if size > most { shear * (most / size) } else { shear };
            state.slip += (state.traction.shear - carried) / soft;
            state.traction = Traction { normal: required, shear: carried };
        }
        // A smaller area may hold more energy under the same force; softer springs may not.
        self.limit_energy(load.energy.map(|energy| energy * (load.area / area).max(1.0)), &[]);
    }
}
