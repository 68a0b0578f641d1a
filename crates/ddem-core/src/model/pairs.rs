//! Joint faces and pairs: two facing nodes, one on each side of a joint (§1).

use std::ops::Range;

use crate::model::Model;
use ddem_joint::contact::Seated;
use ddem_mesh::Face;

impl Model {
    /// All joints between two blocks of one lattice, whose faces match. Those of faces that do not are
    /// in [`pairs`](Self::pairs) after them.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Number of the properties of each joint between two blocks.
    pub fn joint_numbers(&self) -> impl Iterator<Item = u16> + '_ {
        let abutting = self.geometry.joined().map(|abutment| abutment.joint);
        self.faces.iter().map(|face| face.joint).chain(abutting)
    }

    /// Numbers of joints and of pairs that can fail in some stage.
    #[must_use]
    pub fn n_breakable(&self) -> [usize; 2] {
        let breaks = |joint: Option<u16>| joint.is_some_and(|at| self.laws[at as usize].is_some());
        let matching = self.faces.iter().map(|face| {
            (self.stages.any(|at| breaks(Some(face.at(at)))), (face.divisions as usize + 1).pow(2))
        });
        let others = self.seated.iter().map(|Seated { patch, .. }| {
            (self.stages.any(|at| breaks(at.joint_of(patch.blocks))), patch.points.len())
        });
        let breakable = matching.chain(others).filter(|(breaks, _)| *breaks);
        breakable.fold([0, 0], |[joints, pairs], (_, more)| [joints + 1, pairs + more])
    }

    /// Number of joints between two blocks.
    #[must_use]
    pub fn n_joints(&self) -> usize {
        self.faces.len() + self.seated.len()
    }

    /// Number of pairs: of facing nodes, and of a node and a point of a face where faces do not match.
    #[must_use]
    pub fn n_pairs(&self) -> usize {
        self.seated.last().map_or_else(|| self.faces.last().map_or(0, Face::end), Seated::end)
    }

    /// Numbers of the pairs of a joint; those between faces that do not match come last.
    pub(crate) fn pairs_of(&self, joint: usize) -> Range<usize> {
        match self.joint(joint) {
            Joint::Matching(face) => face.first_pair as usize..face.end(),
            Joint::Seated(joint) => joint.first_pair..joint.end(),
        }
    }

    /// The joint that has a pair; where there is no such pair, the number of joints.
    pub(crate) fn joint_of(&self, pair: usize) -> usize {
        let matching = self.faces.partition_point(|face| face.end() <= pair);
        matching + self.seated.partition_point(|joint| joint.end() <= pair)
    }

    /// A joint by its number.
    pub(crate) fn joint(&self, joint: usize) -> Joint<'_> {
        let matching = self.faces.get(joint).map(Joint::Matching);
        matching.unwrap_or_else(|| Joint::Seated(&self.seated[joint - self.faces.len()]))
    }

    /// All pairs, in order.
    pub fn pairs(&self) -> impl Iterator<Item = PairAt> + '_ {
        let matching = self.faces.iter().flat_map(move |face| {
            let (normal, joint) = (face.normal(&self.geometry), face.joint);
            face.pairs(&self.geometry).map(move |nodes| {
                let [a, b] = nodes.map(|node| self.point(node as usize));
                let point = [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
                PairAt { nodes, point, normal, joint }
            })
        });
        matching.chain(self.seated.iter().flat_map(|joint| self.seats(joint)))
    }

    /// Pairs of a joint between faces that do not match.
    pub(super) fn seats<'a>(&'a self, joint: &'a Seated) -> impl Iterator<Item = PairAt> + 'a {
        let (patch, number) = (&joint.patch, Joint::Seated(joint).number());
        let [a, b] = patch.blocks.map(|block| block as usize);
        let placed = self.contact.as_ref().map(|surfaces| &surfaces.blocks[..]).unwrap_or_default();
        patch.points.iter().map(move |point| {
            let side = |block: usize, side: usize| {
                placed[block].seat(patch.faces()[side], &point.spots[side])
            };
            let [(x, on_a), (y, on_b)] = [side(a, 0), side(b, 1)];
            let first = [a, b].map(|block| self.geometry.bodies[block].first_node);
            PairAt {
                nodes: [first[0] + on_a as u32, first[1] + on_b as u32],
                point: ((x + y) / 2.0).into(),
                normal: patch.now[0].into(),
                joint: number,
            }
        })
    }

    /// Pairs at the corners of each part of all joints, around it; the last two of a triangle are one.
    pub fn quads(&self) -> impl Iterator<Item = [u32; 4]> + '_ {
        let seats = self.seated.iter().flat_map(|joint| {
            joint.quads.iter().map(|quad| quad.map(|at| at + joint.first_pair as u32))
        });
        self.faces.iter().flat_map(Face::quads).chain(seats)
    }
}

/// A joint between two blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Joint<'a> {
    /// Of one lattice, whose faces match.
    Matching(&'a Face),
    /// Whose faces do not.
    Seated(&'a Seated),
}

impl Joint<'_> {
    /// The two blocks.
    pub(crate) fn blocks(&self) -> [usize; 2] {
        match self {
            Self::Matching(face) => [face.a, face.b],
            Self::Seated(joint) => joint.patch.blocks,
        }
        .map(|block| block as usize)
    }

    /// Number of its properties.
    pub(crate) fn number(&self) -> u16 {
        match self {
            Self::Matching(face) => face.joint,
            Self::Seated(joint) => joint.patch.bond.as_ref().map_or(0, |bond| bond.joint),
        }
    }

    /// Nodes on both sides of its pairs.
    pub(crate) fn nodes(&self, model: &Model) -> Vec<[u32; 2]> {
        match self {
            Self::Matching(face) => face.pairs(&model.geometry).collect(),
            Self::Seated(joint) => model.seats(joint).map(|pair| pair.nodes).collect(),
        }
    }
}

/// A pair of a joint at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairAt {
    /// The nodes on sides a and b; where faces do not match, on one side the nearest one.
    pub nodes: [u32; 2],
    /// Between the two sides `[m]`.
    pub point: [f64; 3],
    /// Unit normal, from a to b.
    pub normal: [f64; 3],
    /// Number of the joint's properties, in sorted order of the names.
    pub joint: u16,
}
