//! Touching faces of blocks of two lattices, and the joints between them.
//!
//! At refined blocks the joint of the finer side applies. Two sets of blocks are joined if both
//! have a joint across the face. Their joint is that of the later set, or the one that is assigned
//! there. Joints join faces that touch, or whose gap is as wide as the joint is thick. Other faces
//! are apart.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::assign::in_force;
use super::{Names, Selector};
use crate::schema::{Assign, Deck, Joint};
use ddem_core::problem::{
    BlockFace, FaceOverlap, Geometry, Lattice, MISSES, NonconformingJoint, RestFace, SLIVER, Sets,
    bounds_of, overlapping_pairs,
};

/// Two sorted lists for a stage: the joined faces of blocks of different lattices, and the faces of
/// different sets that are closer than the thickness of their joint but are not joined by it.
pub(super) fn nonconforming_joints(
    geometry: &Geometry,
    (deck, names, stage): (&Deck, &Names, usize),
    sets: &Sets,
    pairs: &HashMap<[u32; 2], u16>,
) -> [Vec<NonconformingJoint>; 2] {
    let touching = TouchingFaces(geometry);
    if !touching.any() {
        return [Vec::new(), Vec::new()];
    }
    // Thickness `[m]` and normal stiffness `[Pa/m]`.
    let of = |joint: &Joint| {
        [joint.thickness, joint.stiffness(&deck.materials).map_or(0.0, |[normal, _]| normal)]
    };
    let joints: Vec<[f64; 2]> = deck.joints.values().map(of).collect();
    let thickest = joints.iter().map(|joint| joint[0]).fold(0.0, f64::max);
    let without_cut = |(_, entry): &(usize, &Assign)| entry.r#where.cut.is_none();
    let assigned = in_force(deck, stage).filter(without_cut).filter_map(|(_, entry)| {
        let joint = names.joint(entry.joint.as_ref()?)?;
        Some((Selector::new(&entry.r#where, sets), joint))
    });
    let assigned: Vec<(Selector, u16)> = assigned.collect();
    let other = |&[a, b]: &[u32; 2]| {
        geometry.blocks[a as usize].lattice != geometry.blocks[b as usize].lattice
            && !touching.in_one_region([a, b])
    };
    let rules = JointRules { joints, assigned, pairs };
    let abut = |blocks: [u32; 2]| {
        let mut faces = BlockFace::pairs(geometry, blocks.map(|block| block as usize));
        faces.find_map(|faces| touching.abut(faces, &rules))
    };
    let near = touching.near(thickest).into_iter().filter(other).filter_map(abut);
    let (joined, unjoined): (Vec<_>, Vec<_>) = near.partition(|(_, joined)| *joined);
    [joined, unjoined].map(|all| all.into_iter().map(|(joint_pair, _)| joint_pair).collect())
}

/// Rules that give faces of two lattices their joints.
struct JointRules<'a> {
    /// Thickness `[m]` and normal stiffness `[Pa/m]` of each joint.
    joints: Vec<[f64; 2]>,
    /// Joints that are assigned to parts of the model; later ones take precedence.
    assigned: Vec<(Selector, u16)>,
    /// Joints given for pairs of blocks.
    pairs: &'a HashMap<[u32; 2], u16>,
}

/// Faces of the blocks of a geometry, for tests which of them touch.
pub(in crate::build) struct TouchingFaces<'a>(pub(in crate::build) &'a Geometry);

impl TouchingFaces<'_> {
    /// True if faces of different lattices, except those of one region, may touch.
    pub(super) fn any(&self) -> bool {
        let lattices = &self.0.lattices;
        let is_other =
            |lattice: &Arc<Lattice>| lattice.part.is_none() || lattice.set != lattices[0].set;
        lattices.len() > 1 && lattices.iter().any(is_other)
    }

    /// True if both blocks are parts of cells of one region, which has the joints of its cuts.
    pub(super) fn in_one_region(&self, blocks: [u32; 2]) -> bool {
        let [a, b] = blocks.map(|block| block as usize);
        self.0.set(a) == self.0.set(b) && [a, b].iter().all(|&block| self.0.part(block).is_some())
    }

    /// Pairs of lattices of different sets with faces that touch, a region of rock among them.
    pub(super) fn beside_regions(&self) -> Vec<(usize, usize)> {
        if !self.any() || self.0.lattices.iter().all(|lattice| lattice.part.is_none()) {
            return Vec::new();
        }
        let joined = self.0.joined().map(|joint_pair| joint_pair.blocks);
        let of_region = |blocks: &[u32; 2]| {
            !self.in_one_region(*blocks)
                && blocks.iter().any(|&block| self.0.part(block as usize).is_some())
        };
        let lattice = |block: u32| self.0.blocks[block as usize].lattice as usize;
        let pairs = joined.chain(self.unjoined()).filter(of_region);
        let pairs: BTreeSet<_> = pairs.map(|[a, b]| (lattice(a), lattice(b))).collect();
        pairs.into_iter().collect()
    }

    /// Number of nonconforming joints between lattices with the centre of one face in a selector.
    pub(in crate::build) fn joins_at(&self, selector: &Selector) -> usize {
        let inside = |joint_pair: &&NonconformingJoint| {
            let rest_faces = joint_pair.sides().map(|face| face.at_rest(self.0));
            rest_faces
                .iter()
                .any(|rest_face| selector.contains_face(&rest_face.centre(), &rest_face.normal))
        };
        let between = |joint_pair: &&NonconformingJoint| !self.in_one_region(joint_pair.blocks);
        self.0.joined().filter(between).filter(inside).count()
    }

    /// Areas on which other blocks abut, by block and number of the face `[m²]`.
    pub(super) fn covered(&self) -> HashMap<(u32, u8), f64> {
        let mut covered = HashMap::new();
        for joint_pair in self.0.joined() {
            for side in 0..2 {
                let face = (joint_pair.blocks[side], joint_pair.faces[side].number());
                *covered.entry(face).or_insert(0.0) += joint_pair.area;
            }
        }
        covered
    }

    /// True if other blocks cover only a part of a face.
    pub(super) fn is_covered_in_part(
        &self,
        face: &BlockFace,
        covered: &HashMap<(u32, u8), f64>,
    ) -> bool {
        let key = (face.block as u32, face.face.number());
        let Some(&covered) = covered.get(&key) else { return false };
        let [a, b, _, d] = face.at_rest(self.0).whole;
        covered < (1.0 - SLIVER) * (b - a).cross(&(d - a)).norm()
    }

    /// Joint between two faces that touch or nearly touch, and true if it joins them.
    fn abut(
        &self,
        faces: [BlockFace; 2],
        rules: &JointRules<'_>,
    ) -> Option<(NonconformingJoint, bool)> {
        let rest_faces = self.0.opposed(faces)?;
        let indices = faces.map(|face| face.block);
        let blocks = indices.map(|block| block as u32);
        let fine = usize::from(rest_faces[1].area <= rest_faces[0].area);
        let given = rules.pairs.get(&blocks).copied();
        let joint = given
            .or_else(|| self.joint_between(faces, fine, (&rest_faces[fine], &rules.assigned)))?;
        let [thickness, stiffness] = rules.joints[joint as usize];
        let FaceOverlap { gap, area } =
            self.0.face_overlap(indices, &rest_faces, [-thickness, thickness])?;
        let joined = self.joins(indices, &rest_faces, (gap, thickness));
        let faces = faces.map(|face| face.face);
        Some((NonconformingJoint { blocks, faces, joint, area, gap, stiffness, cut: None }, joined))
    }

    /// Pairs of blocks whose boxes are at most `reach` apart, with a tolerance for rounding.
    fn near(&self, reach: f64) -> Vec<[u32; 2]> {
        let boxes: Vec<_> = (0..self.0.blocks.len())
            .map(|block| {
                let margin = reach + MISSES * self.0.shortest_edge(block);
                let [low, high] = bounds_of(&self.0.corners(block));
                [low.add_scalar(-margin), high.add_scalar(margin)]
            })
            .collect();
        overlapping_pairs(&boxes)
    }

    /// Pairs of blocks of two sets whose faces touch without a joint between them.
    pub(in crate::build) fn unjoined(&self) -> Vec<[u32; 2]> {
        let faces = self.unjoined_faces().into_iter();
        faces.map(|faces| faces.map(|face| face.block as u32)).collect()
    }

    /// Faces of two sets that touch without a joint between their blocks, one pair for each two
    /// blocks.
    pub(in crate::build) fn unjoined_faces(&self) -> Vec<[BlockFace; 2]> {
        let joined: BTreeSet<[u32; 2]> =
            self.0.joined().map(|joint_pair| joint_pair.blocks).collect();
        let alone = |blocks: [u32; 2]| {
            let indices = blocks.map(|block| block as usize);
            let touch = |faces: &[BlockFace; 2]| {
                let overlap = |rest_faces| self.0.face_overlap(indices, &rest_faces, [0.0; 2]);
                self.0.opposed(*faces).and_then(overlap).is_some()
            };
            let other = self.0.set(indices[0]) != self.0.set(indices[1]);
            (other && !joined.contains(&blocks)).then_some(())?;
            BlockFace::pairs(self.0, indices).find(touch)
        };
        if !self.any() {
            return Vec::new();
        }
        self.near(0.0).into_iter().filter_map(alone).collect()
    }

    /// Pairs of blocks of two sets whose faces are opposite each other across a gap, and the gap
    /// `[m]`. The gap is at most a fraction of their shortest edges.
    pub(in crate::build) fn across_gaps(&self, part: f64) -> Vec<([u32; 2], f64)> {
        let edges = (0..self.0.blocks.len()).map(|block| self.0.shortest_edge(block));
        let reach = part * edges.fold(0.0, f64::max);
        let across = |blocks: [u32; 2]| {
            let indices = blocks.map(|block| block as usize);
            let most = part * self.0.misses(indices) / MISSES;
            let gap = |faces: [BlockFace; 2]| {
                let rest_faces = self.0.opposed(faces)?;
                Some(self.0.face_overlap(indices, &rest_faces, [0.0, most])?.gap)
            };
            let gaps = BlockFace::pairs(self.0, indices).filter_map(gap).filter(|gap| *gap <= most);
            Some((blocks, gaps.reduce(f64::min)?))
        };
        let other = |&[a, b]: &[u32; 2]| self.0.set(a as usize) != self.0.set(b as usize);
        self.near(reach).into_iter().filter(other).filter_map(across).collect()
    }

    /// True if a joint joins two faces with this gap; within one set it always does. The cell faces
    /// of two sets also coincide where one set replaces removed blocks of the other, across half of
    /// a joint.
    fn joins(
        &self,
        blocks: [usize; 2],
        rest_faces: &[RestFace; 2],
        (gap, thickness): (f64, f64),
    ) -> bool {
        let misses = self.0.misses(blocks);
        let cells = (rest_faces[1].whole[0] - rest_faces[0].whole[0]).dot(&rest_faces[0].normal);
        let [a, b] = blocks.map(|block| self.0.set(block));
        gap >= -misses && (a == b || cells.abs() <= misses || (gap - thickness).abs() <= misses)
    }

    fn joint_between(
        &self,
        faces: [BlockFace; 2],
        fine: usize,
        (rest_face, assigned): (&RestFace, &[(Selector, u16)]),
    ) -> Option<u16> {
        let centre = rest_face.centre();
        let sets = faces.map(|face| self.0.set(face.block));
        let here = |(selector, _): &&(Selector, u16)| {
            selector.contains_face(&centre, &rest_face.normal)
                && sets.iter().any(|&set| selector.has_set(set))
        };
        if let Some((_, joint)) = assigned.iter().rev().find(here) {
            return Some(*joint);
        }
        let joints = faces.map(|face| self.0.joint_at(face.block, face.face));
        let [Some(_), Some(_)] = joints else { return None };
        joints[if sets[0] == sets[1] { fine } else { usize::from(sets[1] > sets[0]) }]
    }
}
