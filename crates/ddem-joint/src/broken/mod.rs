//! §5: what has become of the joints: which elements are left, which pairs are springs, and what
//! these remember.
//!
//! An unbroken joint lattice has no entry here and costs nothing. One in which something has
//! failed, or that is springs from the start, is a [`BrokenLattice`].

mod springs;
pub mod strips;

use serde::{Deserialize, Serialize};

use super::point::{JointPoint, turned};
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::NO_JOINT;
use ddem_mesh::assembly::{Assembly, ElementPack, NO_TABLE};
use ddem_mesh::joint_sections::{JointSection, JointSections};
use ddem_mesh::pack::{NodePair, Pack, Packs};

pub use springs::{GroundFrame, SideDisplacements, SpringForces};

/// A joint lattice of a pack that is not all elements.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BrokenLattice {
    /// 1 where an element is left, 0 where not, by element and lane.
    pub alive: Vec<Lanes>,
    /// True if any element is left.
    pub any_alive: bool,
    /// Pairs of a face joint by lane, in the order of [`ddem_mesh::pack::BlockNumbering::pairs`].
    pub points: Vec<[JointPoint; LANES]>,
    /// Lanes whose joint was released: a contact has taken the place of its springs.
    released: [bool; LANES],
    /// True if a pair of a joint that can fail may still be bonded.
    #[serde(skip)]
    bonded: bool,
    /// Pairs and lanes that failed since the strips were last looked at.
    fresh: Vec<(u32, u8)>,
}

/// The broken joint lattices of a pack by offset.
pub type PackBreaks = Option<Box<[Option<BrokenLattice>; 8]>>;

/// The broken joints of all packs.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BrokenJoints {
    /// Of each pack.
    pub packs: Vec<PackBreaks>,
}

// Measurements copy the broken joints again and again: into the memory that they have.
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
        let Self { alive, any_alive, points, released, bonded, fresh } = source;
        (self.any_alive, self.released, self.bonded) = (*any_alive, *released, *bonded);
        self.alive.clone_from(alive);
        self.points.clone_from(points);
        self.fresh.clone_from(fresh);
    }
}

impl BrokenJoints {
    /// With every joint that `broken` selects turned to springs, all its pairs bonded.
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
                lattice.update_areas(&packs.shape_of(pack).pairs[d], section);
                broken_joints.at(index)[1 << d] = Some(lattice);
            }
        }
        broken_joints
    }

    /// Forgets the joints of a lattice that are no longer there: those without a seam, and strips and
    /// corners without an element.
    pub fn forget_absent(
        &mut self,
        pack: usize,
        offset: usize,
        section: Option<&JointSection>,
        table: Option<&ElementPack>,
    ) {
        let Some(lattices) = &mut self.packs[pack] else { return };
        let there = |lane: usize| {
            section.is_some_and(|section| section.joints[lane] != NO_JOINT)
                || table.is_some_and(|table| table.elements[lane].is_some())
        };
        if !(0..LANES).any(there) {
            lattices[offset] = None;
        }
        let Some(broken) = &mut lattices[offset] else { return };
        for lane in (0..LANES).filter(|&lane| !there(lane)) {
            broken.alive.iter_mut().for_each(|alive| alive.0[lane] = 1.0);
            broken.points.iter_mut().for_each(|points| points[lane] = JointPoint::default());
            broken.released[lane] = false;
        }
    }

    /// Strengths have changed: pairs that are bonded may fail where none could.
    pub fn recheck(&mut self) {
        let lattices = self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten());
        lattices.for_each(|broken| broken.bonded = true);
    }

    /// Takes the present state of all failed pairs for an equilibrium, or forgets the last one.
    pub fn set_equilibrium(&mut self, now: bool) {
        let lattices = self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten());
        let points = lattices.flat_map(|broken| broken.points.iter_mut().flatten());
        for point in points.filter(|point| point.failure.is_some()) {
            point.state.equilibrium = None;
            if now {
                point.set_equilibrium();
            }
        }
    }

    /// Energy that points have given and not taken: the accounts below nothing `[J]`.
    pub fn debt(&self) -> f64 {
        let lattices = self.packs.iter().flatten().flat_map(|pack| pack.iter().flatten());
        sum(lattices.flat_map(|broken| broken.points.iter().flatten()).map(JointPoint::debt))
    }

    /// The joint lattices of a pack.
    pub fn at(&mut self, pack: usize) -> &mut [Option<BrokenLattice>; 8] {
        self.packs[pack].get_or_insert_with(Box::default)
    }

    /// A broken joint lattice.
    pub fn get(&self, pack: usize, offset: usize) -> Option<&BrokenLattice> {
        self.packs[pack].as_ref()?[offset].as_ref()
    }

    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        let lattices = self.packs.iter().flatten().flat_map(|pack| pack.iter().flatten());
        let own = |l: &BrokenLattice| {
            l.alive.len() * size_of::<Lanes>() + l.points.len() * size_of::<[JointPoint; LANES]>()
        };
        self.packs.len() * size_of::<PackBreaks>() + lattices.map(own).sum::<usize>()
    }
}

impl BrokenLattice {
    /// A joint lattice all of whose elements are left.
    pub fn intact(packs: &Packs, pack: &Pack, tables: [u32; 8], offset: usize) -> Self {
        let shape = packs.shape_of(pack);
        let elements = shape.dims(offset).iter().product();
        let is_there = tables[offset] != NO_TABLE;
        let pairs = if offset.is_power_of_two() {
            shape.pairs[offset.trailing_zeros() as usize].len()
        } else {
            0
        };
        Self {
            alive: vec![Lanes([1.0; LANES]); elements],
            any_alive: is_there,
            points: vec![[JointPoint::default(); LANES]; pairs],
            released: [false; LANES],
            bonded: true,
            fresh: Vec::new(),
        }
    }

    /// True where it has so many elements and pairs, and knows of no others.
    pub fn fits(&self, elements: usize, pairs: usize) -> bool {
        let known =
            |&(pair, lane): &(u32, u8)| (pair as usize) < pairs && usize::from(lane) < LANES;
        let sizes = [self.alive.len(), self.points.len()];
        sizes == [elements, pairs] && self.fresh.iter().all(known)
    }

    /// True if the lattice exerts any force.
    pub fn acts(&self) -> bool {
        self.any_alive || !self.points.is_empty()
    }

    /// Pairs of a lane's joint.
    pub(super) fn lane(&self, lane: usize) -> impl Iterator<Item = &JointPoint> {
        self.points.iter().map(move |points| &points[lane])
    }

    /// True where a lane's joint has turned so far that it lets go of the pairs that are still bonded.
    fn turned(&self, section: &JointSection, lane: usize) -> bool {
        !self.released[lane] && turned(self.lane(lane), section.spacing(lane))
    }

    /// True where a pair of a lane's joint has failed and its springs are there.
    pub fn slides(&self, lane: usize) -> bool {
        !self.released[lane] && self.lane(lane).any(|point| point.failure.is_some())
    }

    /// Takes the springs of a lane's joint out, for good.
    pub fn remove_springs(&mut self, lane: usize) {
        self.released[lane] = true;
        self.points.iter_mut().for_each(|points| points[lane].remove_springs());
    }

    /// Counts which pairs are springs, and by how much, from the elements that are left.
    pub(super) fn update_areas(&mut self, node_pairs: &[NodePair], section: &JointSection) {
        let released = self.released;
        let acts = |lane: &usize| section.joints[*lane] != NO_JOINT && !released[*lane];
        for (points, node_pair) in self.points.iter_mut().zip(node_pairs) {
            for lane in (0..LANES).filter(acts) {
                let gone = node_pair.elements().filter(|&e| self.alive[e].0[lane] == 0.0);
                points[lane].area = section.quarter.0[lane] * gone.count() as f64;
            }
        }
        self.any_alive = (0..LANES).any(|lane| {
            section.joints[lane] != NO_JOINT && self.alive.iter().any(|alive| alive.0[lane] != 0.0)
        });
    }
}
