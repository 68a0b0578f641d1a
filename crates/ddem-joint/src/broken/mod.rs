//! State of broken joints (§5): elements that are left, pairs that are springs, and their history.
//!
//! A joint lattice without failed pairs has no entry here and costs nothing. A [`BrokenLattice`]
//! holds a lattice in which a pair has failed or that consists of springs from the start.

mod failed_springs;
mod failure;
mod points;
mod prefetch;
mod springs;
pub mod strips;

use serde::{Deserialize, Serialize};

use super::point::{JointPoint, ROTATED};
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::NO_JOINT;
use ddem_mesh::assembly::{Assembly, ElementPack, NO_TABLE};
use ddem_mesh::joint_sections::{JointSection, JointSections};
use ddem_mesh::numbering::NodePair;
use ddem_mesh::pack::{Pack, Packs};

pub use failure::{ElementRemoval, LatticeCheck, PairTractions};
pub use points::LatticePoints;
pub use prefetch::prefetch;
pub use springs::{GroundFrame, LatticeMotion, SpringForces};

/// Joint lattice of a pack in which springs have replaced some or all elements.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BrokenLattice {
    /// 1 for each element that is left, 0 for each removed one, by element and lane.
    pub alive: Vec<Lanes>,
    /// True if at least one element is left.
    pub any_alive: bool,
    /// Pairs of a face joint by lane, in the order of
    /// [`ddem_mesh::numbering::BlockNumbering::pairs`].
    pub points: LatticePoints,
    /// Lanes whose joint was released: a contact has taken the place of its springs.
    released: [bool; LANES],
    /// Failed pairs of each lane.
    #[serde(skip)]
    failed: [u32; LANES],
    /// Largest slip and opening of the failed pairs of each lane at the last update of their
    /// springs, so that nobody needs to look at all pairs in every step `[m]`.
    #[serde(skip)]
    moved: [Lanes; 2],
    /// True if a pair of a joint that can fail may still be bonded.
    #[serde(skip)]
    bonded: bool,
    /// Pairs and lanes that failed since strips and corners were last checked.
    newly_failed: Vec<(u32, u8)>,
}

/// The broken joint lattices of a pack by offset.
pub type BrokenLattices = Option<Box<[Option<Box<BrokenLattice>>; 8]>>;

/// The broken joints of all packs.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BrokenJoints {
    /// Broken joints of each pack.
    pub packs: Vec<BrokenLattices>,
}

// Frequent copies reuse the memory of the target.
impl Clone for BrokenJoints {
    fn clone(&self) -> Self {
        Self { packs: self.packs.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.packs.clone_from(&source.packs);
    }
}

impl Clone for BrokenLattice {
    fn clone(&self) -> Self {
        let mut clone = Self::default();
        clone.clone_from(self);
        clone
    }

    fn clone_from(&mut self, source: &Self) {
        let Self { alive, any_alive, points, released, failed, moved, bonded, newly_failed } =
            source;
        (self.any_alive, self.released, self.bonded) = (*any_alive, *released, *bonded);
        (self.failed, self.moved) = (*failed, *moved);
        self.alive.clone_from(alive);
        self.points.clone_from(points);
        self.newly_failed.clone_from(newly_failed);
    }
}

impl BrokenJoints {
    /// Broken joints in which springs replace each joint that `broken` selects; all pairs are
    /// bonded.
    pub fn with(
        packs: &Packs,
        assembly: &Assembly,
        sections: &JointSections,
        broken: &dyn Fn(&JointSection, usize) -> bool,
    ) -> Self {
        let mut broken_joints = Self { packs: vec![None; packs.packs.len()] };
        for (index, pack) in packs.packs.iter().enumerate() {
            for d in 0..3 {
                let Some(section) = sections.get(index, d) else { continue };
                let lanes: [bool; LANES] = std::array::from_fn(|lane| {
                    section.joints[lane] != NO_JOINT && broken(section, lane)
                });
                if lanes == [false; LANES] {
                    continue;
                }
                let mut lattice =
                    BrokenLattice::intact(packs, pack, assembly.pack_tables[index], 1 << d);
                for lane in (0..LANES).filter(|&lane| lanes[lane]) {
                    lattice.alive.iter_mut().for_each(|alive| alive.0[lane] = 0.0);
                }
                lattice.update_areas(&packs.numbering_of(pack).pairs[d], section);
                broken_joints.at(index)[1 << d] = Some(Box::new(lattice));
            }
        }
        broken_joints
    }

    /// Resets the state of joints that no longer exist: face joints without a section, strips and
    /// corners without an element.
    pub fn clear_absent(
        &mut self,
        pack: usize,
        offset: usize,
        section: Option<&JointSection>,
        table: Option<&ElementPack>,
    ) {
        let Some(lattices) = &mut self.packs[pack] else { return };
        let exists = |lane: usize| {
            section.is_some_and(|section| section.joints[lane] != NO_JOINT)
                || table.is_some_and(|table| table.elements[lane].is_some())
        };
        if !(0..LANES).any(exists) {
            lattices[offset] = None;
        }
        let Some(broken) = &mut lattices[offset] else { return };
        for lane in (0..LANES).filter(|&lane| !exists(lane)) {
            broken.alive.iter_mut().for_each(|alive| alive.0[lane] = 1.0);
            for pair in 0..broken.points.len() {
                broken.points.set(pair, lane, &JointPoint::default());
            }
            (broken.released[lane], broken.failed[lane]) = (false, 0);
        }
    }

    /// Counts the failed pairs and finds their largest motion, after a state has been restored.
    pub fn count_failed(&mut self) {
        for broken in self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten()) {
            broken.failed = std::array::from_fn(|lane| {
                broken.lane(lane).filter(|point| point.failure.is_some()).count() as u32
            });
            (0..LANES).for_each(|lane| broken.find_motion(lane));
        }
    }

    /// Marks all lattices for a new failure check after strengths have changed.
    pub fn recheck(&mut self) {
        let lattices = self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten());
        lattices.for_each(|broken| broken.bonded = true);
    }

    /// Gives closed faces that have parted their residual cohesion again, in an equilibrium.
    pub fn regain_cohesion(&mut self) {
        let lattices = self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten());
        lattices.for_each(|broken| broken.points.regain_cohesion());
    }

    /// Stores the present state of all failed pairs as equilibrium if `now`; otherwise clears it.
    pub fn set_equilibrium(&mut self, now: bool) {
        let lattices = self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten());
        lattices.for_each(|broken| broken.points.set_equilibriums(now));
    }

    /// Energy that points have given in excess of what they took `[J]`: sum of the
    /// energy deficits, at most 0.
    pub fn energy_deficit(&self) -> f64 {
        let lattices = self.packs.iter().flatten().flat_map(|pack| pack.iter().flatten());
        let failed = lattices.filter(|broken| broken.has_any_failed());
        let lanes = failed.flat_map(|broken| (0..LANES).flat_map(move |lane| broken.lane(lane)));
        sum(lanes.map(|point| point.energy_deficit()))
    }

    /// Joint lattices of a pack, created if absent.
    pub fn at(&mut self, pack: usize) -> &mut [Option<Box<BrokenLattice>>; 8] {
        self.packs[pack].get_or_insert_with(Box::default)
    }

    /// Broken joint lattice of a pack at an offset, if there is one.
    pub fn get(&self, pack: usize, offset: usize) -> Option<&BrokenLattice> {
        self.packs[pack].as_ref()?[offset].as_deref()
    }

    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        let lattices = self.packs.iter().flatten().flat_map(|pack| pack.iter().flatten());
        let lattices = lattices.map(|lattice| &**lattice);
        let own = |l: &BrokenLattice| size_of_val(l) + size_of_val(&l.alive[..]) + l.points.bytes();
        self.packs.len() * size_of::<BrokenLattices>() + lattices.map(own).sum::<usize>()
    }
}

impl BrokenLattice {
    /// Joint lattice with all its elements.
    pub fn intact(packs: &Packs, pack: &Pack, tables: [u32; 8], offset: usize) -> Self {
        let numbering = packs.numbering_of(pack);
        let elements = numbering.dims(offset).iter().product();
        let exists = tables[offset] != NO_TABLE;
        let pairs = if offset.is_power_of_two() {
            numbering.pairs[offset.trailing_zeros() as usize].len()
        } else {
            0
        };
        Self {
            alive: vec![Lanes([1.0; LANES]); elements],
            any_alive: exists,
            points: LatticePoints::new(pairs),
            released: [false; LANES],
            failed: [0; LANES],
            moved: [Lanes::ZERO; 2],
            bonded: true,
            newly_failed: Vec::new(),
        }
    }

    /// True if the numbers of elements and pairs match and all recorded failures lie within them.
    pub fn is_consistent(&self, elements: usize, pairs: usize) -> bool {
        let known =
            |&(pair, lane): &(u32, u8)| (pair as usize) < pairs && usize::from(lane) < LANES;
        let sizes = [self.alive.len(), self.points.len()];
        sizes == [elements, pairs]
            && self.points.is_consistent()
            && self.newly_failed.iter().all(known)
    }

    /// True if the lattice exerts any force.
    pub fn acts(&self) -> bool {
        self.any_alive || !self.points.is_empty()
    }

    /// Pairs of the joint in one lane.
    pub(super) fn lane(&self, lane: usize) -> impl Iterator<Item = JointPoint> {
        (0..self.points.len()).map(move |pair| self.points.get(pair, lane))
    }

    /// True if the joint in a lane has rotated so far that its bonded pairs must fail.
    fn has_rotated(&self, section: &JointSection, lane: usize) -> bool {
        let [slip, opening] = self.moved(lane);
        self.slides(lane) && slip.max(opening) > ROTATED * section.spacing(lane)
    }

    /// Largest slip and opening of the failed pairs of the joint in a lane `[m]`.
    pub(super) fn moved(&self, lane: usize) -> [f64; 2] {
        self.moved.map(|most| most.0[lane])
    }

    /// Finds the largest slip and opening of the failed pairs in a lane.
    fn find_motion(&mut self, lane: usize) {
        let springs = self.lane(lane).filter(|point| point.failure.is_some() && point.area != 0.0);
        let most = springs.fold([0.0_f64; 2], |[slip, opening], JointPoint { state, .. }| {
            [slip.max(state.slip.norm()), opening.max(state.gap)]
        });
        (0..2).for_each(|k| self.moved[k].0[lane] = most[k]);
    }

    /// True if a pair in any lane has failed.
    pub(super) fn has_any_failed(&self) -> bool {
        self.failed != [0; LANES]
    }

    /// True if a pair of the joint in a lane has failed.
    pub(super) fn has_failed(&self, lane: usize) -> bool {
        self.failed[lane] > 0
    }

    /// True if the joint in a lane still has its springs and at least one failed pair.
    pub fn slides(&self, lane: usize) -> bool {
        !self.released[lane] && self.has_failed(lane)
    }

    /// Removes the springs of the joint in a lane permanently.
    pub fn remove_springs(&mut self, lane: usize) {
        self.released[lane] = true;
        for pair in 0..self.points.len() {
            self.points.change(pair, lane, JointPoint::remove_springs);
        }
    }

    /// Updates the areas of the springs from the elements that are left.
    pub(super) fn update_areas(&mut self, node_pairs: &[NodePair], section: &JointSection) {
        let released = self.released;
        let acts = |lane: &usize| section.joints[*lane] != NO_JOINT && !released[*lane];
        for (springs, node_pair) in self.points.springs.iter_mut().zip(node_pairs) {
            for lane in (0..LANES).filter(acts) {
                let removed = node_pair.elements().filter(|&e| self.alive[e].0[lane] == 0.0);
                springs.area.0[lane] = section.quarter.0[lane] * removed.count() as f64;
            }
        }
        self.any_alive = (0..LANES).any(|lane| {
            section.joints[lane] != NO_JOINT && self.alive.iter().any(|alive| alive.0[lane] != 0.0)
        });
    }
}
