//! §5: what has become of the joints: which elements are left, which pairs are springs, and what
//! these remember.
//!
//! An unbroken joint lattice has no entry here and costs nothing. One in which something has
//! failed, or that is springs from the start, is a [`Broken`].

mod springs;
pub mod strips;

use serde::{Deserialize, Serialize};

use super::point::{JointPoint, turned};
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::NO_JOINT;
use ddem_mesh::assembly::{Assembly, ElementPack, NO_TABLE};
use ddem_mesh::pack::{Pack, Packs, PairPlace};
use ddem_mesh::seams::{Seam, Seams};

pub use springs::{Ground, Pull, Sides};

/// A joint lattice of a pack that is not all elements.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Broken {
    /// 1 where an element is left, 0 where not, by element and lane.
    pub alive: Vec<Lanes>,
    /// Whether any element is left.
    pub any_alive: bool,
    /// Pairs of a face joint by lane, in the order of [`ddem_mesh::pack::Shape::pairs`].
    pub points: Vec<[JointPoint; LANES]>,
    /// Lanes whose joint was released: a contact has taken the place of its springs.
    released: [bool; LANES],
    /// Whether any pair of a joint that can fail may still be bonded.
    #[serde(skip)]
    bonded: bool,
    /// Pairs and lanes that failed since the strips were last looked at.
    fresh: Vec<(u32, u8)>,
}

/// The broken joint lattices of a pack by offset.
pub type PackBreaks = Option<Box<[Option<Broken>; 8]>>;

/// The broken joints of all packs.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Breaks {
    /// Of each pack.
    pub packs: Vec<PackBreaks>,
}

// Measurements copy the broken joints again and again: into the memory that they have.
impl Clone for Breaks {
    fn clone(&self) -> Self {
        Self { packs: self.packs.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.packs.clone_from(&source.packs);
    }
}

impl Clone for Broken {
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

impl Breaks {
    /// With every joint that `broken` selects turned to springs, all its pairs bonded.
    pub fn with(
        packs: &Packs,
        assembly: &Assembly,
        seams: &Seams,
        broken: &dyn Fn(&Seam, usize) -> bool,
    ) -> Self {
        let mut breaks = Self { packs: vec![None; packs.packs.len()] };
        for (index, pack) in packs.packs.iter().enumerate() {
            for d in 0..3 {
                let Some(seam) = seams.get(index, d) else { continue };
                let lanes: [bool; LANES] =
                    std::array::from_fn(|lane| seam.joints[lane] != NO_JOINT && broken(seam, lane));
                if lanes == [false; LANES] {
                    continue;
                }
                let mut lattice = Broken::intact(packs, pack, assembly.pack_tables[index], 1 << d);
                for lane in (0..LANES).filter(|&lane| lanes[lane]) {
                    lattice.alive.iter_mut().for_each(|alive| alive.0[lane] = 0.0);
                }
                lattice.count(&packs.shape_of(pack).pairs[d], seam);
                breaks.at(index)[1 << d] = Some(lattice);
            }
        }
        breaks
    }

    /// Forgets the joints of a lattice that are no longer there: those without a seam, and strips and
    /// corners without an element.
    pub fn keep(
        &mut self,
        pack: usize,
        offset: usize,
        seam: Option<&Seam>,
        table: Option<&ElementPack>,
    ) {
        let Some(lattices) = &mut self.packs[pack] else { return };
        let there = |lane: usize| {
            seam.is_some_and(|seam| seam.joints[lane] != NO_JOINT)
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
    pub fn look_again(&mut self) {
        let lattices = self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten());
        lattices.for_each(|broken| broken.bonded = true);
    }

    /// Takes the present state of all failed pairs for an equilibrium, or forgets the last one.
    pub fn settle(&mut self, now: bool) {
        let lattices = self.packs.iter_mut().flatten().flat_map(|pack| pack.iter_mut().flatten());
        let points = lattices.flat_map(|broken| broken.points.iter_mut().flatten());
        for point in points.filter(|point| point.failure.is_some()) {
            point.memory.settled = None;
            if now {
                point.settle();
            }
        }
    }

    /// Energy that points have given and not taken: the accounts below nothing `[J]`.
    pub fn debt(&self) -> f64 {
        let lattices = self.packs.iter().flatten().flat_map(|pack| pack.iter().flatten());
        sum(lattices.flat_map(|broken| broken.points.iter().flatten()).map(JointPoint::debt))
    }

    /// The joint lattices of a pack.
    pub fn at(&mut self, pack: usize) -> &mut [Option<Broken>; 8] {
        self.packs[pack].get_or_insert_with(Box::default)
    }

    /// A broken joint lattice.
    pub fn get(&self, pack: usize, offset: usize) -> Option<&Broken> {
        self.packs[pack].as_ref()?[offset].as_ref()
    }

    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        let lattices = self.packs.iter().flatten().flat_map(|pack| pack.iter().flatten());
        let own = |l: &Broken| {
            l.alive.len() * size_of::<Lanes>() + l.points.len() * size_of::<[JointPoint; LANES]>()
        };
        self.packs.len() * size_of::<PackBreaks>() + lattices.map(own).sum::<usize>()
    }
}

impl Broken {
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

    /// Whether the lattice exerts any force.
    pub fn acts(&self) -> bool {
        self.any_alive || !self.points.is_empty()
    }

    /// Pairs of a lane's joint.
    pub(super) fn lane(&self, lane: usize) -> impl Iterator<Item = &JointPoint> {
        self.points.iter().map(move |points| &points[lane])
    }

    /// True where a lane's joint has turned so far that it lets go of the pairs that are still bonded.
    fn turned(&self, seam: &Seam, lane: usize) -> bool {
        !self.released[lane] && turned(self.lane(lane), seam.spacing(lane))
    }

    /// True where a pair of a lane's joint has failed and its springs are there.
    pub fn slides(&self, lane: usize) -> bool {
        !self.released[lane] && self.lane(lane).any(|point| point.failure.is_some())
    }

    /// Takes the springs of a lane's joint out, for good.
    pub fn let_go(&mut self, lane: usize) {
        self.released[lane] = true;
        self.points.iter_mut().for_each(|points| points[lane].let_go());
    }

    /// Counts which pairs are springs, and by how much, from the elements that are left.
    pub(super) fn count(&mut self, places: &[PairPlace], seam: &Seam) {
        let released = self.released;
        let acts = |lane: &usize| seam.joints[*lane] != NO_JOINT && !released[*lane];
        for (points, place) in self.points.iter_mut().zip(places) {
            for lane in (0..LANES).filter(acts) {
                let gone = place.elements().filter(|&e| self.alive[e].0[lane] == 0.0);
                points[lane].area = seam.quarter.0[lane] * gone.count() as f64;
            }
        }
        self.any_alive = (0..LANES).any(|lane| {
            seam.joints[lane] != NO_JOINT && self.alive.iter().any(|alive| alive.0[lane] != 0.0)
        });
    }
}
