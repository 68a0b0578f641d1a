//! Faces that two cells have in common: which are joints, and which are left out by `[[join]]`.

use std::collections::BTreeSet;

use ddem_core::ModelError;
use ddem_cut::{CommonFace, PlaneSource};

use super::CutRock;
use crate::build::geometry::{Selector, nearest_joint, nothing};
use crate::schema::{Join, RockCut, SmallKind};

/// Cells on both sides of a common face, and its numbers in them.
pub(super) type FaceSides = ([u32; 2], [u32; 2]);

fn sides(face: &CommonFace) -> FaceSides {
    (face.cells, face.faces)
}

impl CutRock {
    /// True if a common face is a joint, at least in part.
    #[must_use]
    pub fn is_joint(&self, face: &CommonFace) -> bool {
        let plane = &self.complex.planes()[face.plane as usize];
        (plane.source != PlaneSource::Region || self.region_joint(face).is_some())
            && !self.is_joined(face)
    }

    /// Name of the joint between two cells of a file, or of two regions that both have one: that of
    /// the later region.
    pub(crate) fn region_joint(&self, face: &CommonFace) -> Option<&String> {
        let plane = &self.complex.planes()[face.plane as usize];
        let regions = face.cells.map(|cell| self.region_number(cell as usize));
        let [own, other] = regions.map(|region| self.deck.region[region].joint.as_ref());
        let later = if regions[0] > regions[1] { own } else { other };
        let both = own.is_some() && other.is_some();
        later.filter(|_| plane.source == PlaneSource::Region && !plane.joined && both)
    }

    /// True if the cells on both sides of a common face are one block: there is no joint, or a bridge of
    /// whole rock covers all of it.
    pub(crate) fn is_joined(&self, face: &CommonFace) -> bool {
        let plane = &self.complex.planes()[face.plane as usize];
        if plane.joined || self.is_left_out(face) {
            return true;
        }
        let PlaneSource::Cut(cut) = plane.source else { return false };
        self.complex.fracture(face.plane).is_some()
            && self.deck.cut.get(cut as usize).and_then(RockCut::bridge_joint).is_none()
            && !self.complex.is_covered(face)
    }

    /// True if `[[join]]` leaves the joint in a common face out.
    pub(super) fn is_left_out(&self, face: &CommonFace) -> bool {
        self.left_out.iter().any(|chosen| chosen.contains(&sides(face)))
    }

    /// Numbers of joints that the entries of `[[join]]` leave out.
    #[must_use]
    pub fn left_out_joints(&self) -> Vec<usize> {
        self.left_out.iter().map(BTreeSet::len).collect()
    }

    /// Joints that the entries of the deck leave out. No cells have been joined by them yet, and blocks have no
    /// numbers.
    ///
    /// # Errors
    ///
    /// An entry selects no joint.
    pub(super) fn find_left_out(&self) -> Result<Vec<BTreeSet<FaceSides>>, ModelError> {
        let sets = self.selectable();
        let (mut left_out, mut faults) = (Vec::new(), Vec::new());
        for (number, entry) in self.deck.join.iter().enumerate() {
            let selector = Selector::new(&entry.r#where, &sets);
            let chosen = self.inner_joints().filter(|face| self.takes(entry, &selector, face));
            let chosen: BTreeSet<FaceSides> = chosen.map(sides).collect();
            if chosen.is_empty() {
                let fault = nothing(format!("join[{number}].where"), "no joint of a region");
                let centres = self.inner_joints().map(|face| self.complex.common_middle(face));
                faults.push(nearest_joint(fault, &selector, centres));
            }
            left_out.push(chosen);
        }
        if faults.is_empty() { Ok(left_out) } else { Err(ModelError { faults }) }
    }

    /// Joints between cells of one region that become blocks.
    fn inner_joints(&self) -> impl Iterator<Item = &CommonFace> {
        let exists =
            |cell: usize| !self.is_thin(cell) || self.region(cell).small.is != SmallKind::Removed;
        let is_inner = move |face: &&CommonFace| {
            let [a, b] = face.cells.map(|cell| cell as usize);
            self.region_number(a) == self.region_number(b)
                && exists(a)
                && exists(b)
                && self.is_joint(face)
        };
        self.common.iter().filter(is_inner)
    }

    fn takes(&self, entry: &Join, selector: &Selector, face: &CommonFace) -> bool {
        let plane = &self.complex.planes()[face.plane as usize];
        let of_cut = entry.r#where.cut.as_ref().is_none_or(|name| match plane.source {
            PlaneSource::Region => false,
            PlaneSource::Cut(cut) | PlaneSource::Bridge(cut) => {
                self.deck.cut[cut as usize].name.as_ref() == Some(name)
            }
        });
        of_cut
            && selector.has_set(self.region_number(face.cells[0] as usize))
            && selector.contains_face(&self.complex.common_middle(face), &plane.normal)
    }
}
