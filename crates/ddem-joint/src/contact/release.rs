//! §9: from a joint that has moved to a contact.
//!
//! Facing nodes are the right pairs until they have slid by half their spacing, or opened. Then a
//! joint all of whose pairs have failed is released: its springs are gone, and the two blocks are a
//! contact like any other, which begins with the force that the joint bore.

use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Configuration, ContactPoint, Contacts, Patch};
use crate::broken::{BrokenJoints, BrokenLattice};
use crate::point::{JointPoint, PairContext, PairFailure, joined};
use ddem_mechanics::law::{FailureMode, JointLaw, Laws, SpringStiffness, Traction};
use ddem_mechanics::math::exact::ExactSum;
use ddem_mesh::NO_JOINT;
use ddem_mesh::joint_sections::{JointSection, JointSections};
use ddem_mesh::pack::{Pack, Packs};
use ddem_mesh::{Geometry, Vec3};

/// Part of the spacing of its pairs by which a joint has moved when the blocks around are no longer
/// held in place by it.
pub(super) const LOOSE: f64 = 0.01;
/// Part of the spacing of its pairs by which a joint that is released has slid.
pub(super) const SLID: f64 = 0.5;
/// Packs that one task looks at, or more.
const PACKS: usize = 256;

/// Status of a joint on its way to a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum JointStatus {
    /// Its blocks are where they were.
    #[default]
    InPlace,
    /// Some of its pairs have moved.
    Mobilised,
    /// From the next step on a contact takes its place.
    Pending,
    /// A contact has taken its place.
    Released,
}

/// Lookup of joints.
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
    /// Looks how far the joints have moved: blocks of those that have come further may meet.
    pub fn update_statuses(
        &mut self,
        at: JointLookup<'_>,
        laws: &Laws,
        broken_joints: &BrokenJoints,
    ) {
        let joints = &self.joints;
        let further = |index: usize| {
            let pack = &at.packs.packs[index];
            let all = (0..3).flat_map(|d| (0..pack.filled).map(move |lane| (d, lane)));
            all.filter_map(move |(d, lane)| {
                let block = pack.blocks[lane] as usize;
                let known = joints[block][d];
                let (broken, section) = joint(at, broken_joints, index, d, lane)?;
                if known >= JointStatus::Pending {
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
        self.known &= found.is_empty();
        found.into_iter().for_each(|(block, d, release)| self.joints[block][d] = release);
    }
}

/// Stage of its release that a broken joint of a pack has come to.
fn status_of(
    pack: &Pack,
    broken: &BrokenLattice,
    section: &JointSection,
    law: Option<&dyn JointLaw>,
    lane: usize,
) -> JointStatus {
    let (moved, whole) = PairMotion::of(broken.lane(lane), law);
    // Without any strength a pair that has not failed is no better than one that has. Nor are the last two
    // of rigid blocks: they are at the quarters of a face, and the block turns about its edge.
    let hinges = pack.rigid && moved.open >= 2;
    let bonded = whole && !hinges && law.is_none_or(|law| law.bonds());
    moved.release(bonded, pack.rigid, section.spacing(lane))
}

/// A broken joint and its seam.
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
    slid: f64,
    /// Largest opening `[m]`.
    opened: f64,
    /// Number of pairs that are open.
    open: usize,
    /// True where a pair bears tension that softens.
    softens: bool,
}

impl PairMotion {
    /// Of the failed ones of some pairs, and whether there are others.
    pub(super) fn of<'a>(
        pairs: impl Iterator<Item = &'a JointPoint>,
        law: Option<&dyn JointLaw>,
    ) -> (Self, bool) {
        let softens = law.is_some_and(|law| law.softening().is_some());
        let (mut moved, mut whole) = (Self::default(), false);
        for JointPoint { failure, state, .. } in pairs {
            if failure.is_none() {
                whole = true;
                continue;
            }
            moved.slid = moved.slid.max(state.slip.norm());
            moved.opened = moved.opened.max(state.gap);
            moved.open += usize::from(state.gap > 0.0);
            moved.softens |= softens && state.damage < 1.0 && state.gap > 0.0;
        }
        (moved, whole)
    }

    /// True where a contact must take the place of the joint. Pairs of rigid blocks are not at the corners on which
    /// a block turns, so that the contact comes when one opens.
    fn is_released(self, rigid: bool, spacing: f64) -> bool {
        let open = match (self.softens, rigid) {
            (true, _) => SLID,
            (_, true) => 0.0,
            _ => LOOSE,
        };
        self.slid > SLID * spacing || self.opened > open * spacing
    }

    pub(super) fn release(self, bonded: bool, rigid: bool, spacing: f64) -> JointStatus {
        if !bonded && self.is_released(rigid, spacing) {
            JointStatus::Pending
        } else if self.slid.max(self.opened) > LOOSE * spacing {
            JointStatus::Mobilised
        } else {
            JointStatus::InPlace
        }
    }
}

impl BrokenLattice {
    /// True where all pairs of a lane's joint have failed, and none has slid or opened so far that the joint is
    /// released.
    pub fn slides_in_place(
        &self,
        context: PairContext<'_>,
        section: &JointSection,
        lane: usize,
        rigid: bool,
    ) -> bool {
        let (moved, whole) = PairMotion::of(self.lane(lane), context.law(section.laws[lane]));
        !whole && !moved.is_released(rigid, section.spacing(lane))
    }
}

/// Load of a joint at its release: force on its lower side, moment about a point, and the energy in its springs.
pub(super) struct JointLoad {
    /// Along the normal and in the plane `[J]`.
    pub(super) energy: [f64; 2],
    /// Area of its springs `[m²]`.
    pub(super) area: f64,
    pub(super) force: Vec3,
    pub(super) moment: Vec3,
    pub(super) about: Vec3,
}

/// Lets go the joints that are due. `make` makes the patch of two blocks, which begins with what the
/// joint bore. Returns the energy that is lost on the way `[J]`, and how many pairs were still bonded.
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
            let gone = remove_springs(at, configuration, broken_joints, index, d, lane);
            let Some((load, account)) = gone else { continue };
            let blocks = [block.min(other) as u32, block.max(other) as u32];
            lost.add(load.energy[0] + load.energy[1] + account);
            let Some(mut patch) = make(blocks) else { continue };
            let sign = if blocks[0] as usize == block { 1.0 } else { -1.0 };
            patch.preload(configuration, context, &load, sign);
            lost.add(-patch.stored());
            patches.push(patch);
        }
    }
    if any {
        patches.sort_by_key(|patch| patch.blocks);
        let taken = |old: &Patch| patches.binary_search_by_key(&old.blocks, |new| new.blocks);
        contacts.patches.retain(|old| taken(old).is_err());
        contacts.renew(patches);
    }
    (lost.value(), failed)
}

/// Pairs of a joint that is released, and that are bonded, fail with the others. Returns how many.
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
    if law.is_none_or(|law| !law.bonds()) {
        return 0;
    }
    let mut failed = 0;
    let bonded = broken.points.iter_mut().filter(|points| points[lane].failure.is_none());
    bonded.for_each(|points| {
        points[lane].failure = Some(PairFailure { mode: FailureMode::Shear, time: context.time });
        failed += 1;
    });
    failed
}

/// Takes the springs of a joint out and returns what they bore, and what was on their accounts `[J]`.
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
    let (mut energy, mut account, mut whole) = ([0.0; 2], 0.0, 0.0);
    let broken = broken_joints.at(index)[1 << d].as_mut()?;
    let n = at.packs.shape_of(pack).divisions;
    for (p, &JointPoint { area, state, .. }) in broken.lane(lane).enumerate() {
        let (traction, borne) = (state.traction, state.total_traction());
        let pull = axes * joined(borne.normal, borne.shear) * area;
        force += pull;
        moment += (configuration.pair(block, pack.rigid, d, p, n) - about).cross(&pull);
        energy[0] += area * 0.5 * traction.normal * state.gap;
        energy[1] += area * 0.5 * traction.shear.norm_squared() / section.stiffness(lane).shear;
        account += area * state.account;
        whole += area;
    }
    broken.remove_springs(lane);
    Some((JointLoad { energy, area: whole, force, moment, about }, account))
}

impl Configuration<'_> {
    /// Mean rotation of two blocks, near enough for what they hand over.
    fn between(&self, a: usize, b: usize) -> Matrix3<f64> {
        let sum = self.rotation(a) + self.rotation(b);
        nalgebra::Rotation3::from_matrix(&(sum * 0.5)).into_inner()
    }

    /// Position of pair `p` of the joint at the upper side of a block along d.
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
        // At the centre of its quarter.
        let quarter = [(i, k, 9.0), (1 - i, k, 3.0), (i, 1 - k, 3.0), (1 - i, 1 - k, 1.0)];
        quarter.iter().map(|&(i, k, part)| node(i, k) * (part / 16.0)).sum()
    }
}

impl Patch {
    /// Begins with a load: a pressure that goes linearly over the area so that force and moments
    /// are those of the joint, and a shear in proportion, which friction bears wherever it bore the joint's. `sign` is 1 where block a was on the joint's side a.
    pub(super) fn preload(
        &mut self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
        load: &JointLoad,
        sign: f64,
    ) {
        let axes = self.frame();
        let [normal, s, t] = [0, 1, 2].map(|k| Vec3::from(axes.column(k)));
        let (block, face) = (self.blocks[0] as usize, self.faces()[0]);
        let area = self.area();
        if area <= 0.0 {
            return;
        }
        // About the middle of the area, so that shear in its plane has no moment that tilts.
        let position = |p: &ContactPoint| configuration.position(block, face, &p.spots[0]);
        let middle: Vec3 = self.points.iter().map(|p| position(p) * (p.pair.area / area)).sum();
        let positions: Vec<Vec3> = self.points.iter().map(|p| position(p) - middle).collect();
        let force = load.force * sign;
        let moment = load.moment * sign - (middle - load.about).cross(&force);
        // Σ A p (1, y, z) is given, y and z along the tangents: p = α + β y + γ z.
        let mut matrix = Matrix3::zeros();
        for (pair, x) in self.pairs().zip(&positions) {
            let basis = Vector3::new(1.0, s.dot(x), t.dot(x));
            matrix += basis * basis.transpose() * pair.area;
        }
        // Moment of a traction p n at y s + z t: p (z s − y t), with s × n = −t and t × n = s.
        let given = Vector3::new(normal.dot(&force), -t.dot(&moment), s.dot(&moment));
        // Points on a line bear an even pressure.
        let even = Vector3::new(given.x / area, 0.0, 0.0);
        let field = matrix.try_inverse().map_or(even, |inverse| inverse * given);
        let wanted = |x: &Vec3| field.dot(&Vector3::new(1.0, s.dot(x), t.dot(x))).min(0.0);
        let normal: f64 = self.pairs().zip(&positions).map(|(p, x)| p.area * wanted(x)).sum();
        let shear = Vector2::new(s.dot(&force), t.dot(&force));
        let SpringStiffness { normal: stiff, shear: soft } = self.both.stiffness;
        for (point, x) in self.points.iter_mut().zip(&positions) {
            let wanted = wanted(x);
            let shear = if normal < 0.0 { shear * (wanted / normal) } else { Vector2::zeros() };
            // The gap as it was is where the springs bear what is wanted.
            let state = &mut point.pair.state;
            let bare = state.gap + state.dilation;
            state.gap = wanted / stiff;
            (state.dilation, state.lifted) = (bare - state.gap, bare - state.gap);
            let most = self.both.friction.strength(context.laws, wanted);
            let size = shear.norm();
            let bears = if size > most { shear * (most / size) } else { shear };
            state.slip += (state.traction.shear - bears) / soft;
            state.traction = Traction { normal: wanted, shear: bears };
        }
        // The same force on a smaller area holds more energy; softer springs do not.
        self.limit_energy(load.energy.map(|energy| energy * (load.area / area).max(1.0)), &[]);
    }
}
