//! Joint faces and pairs: two facing nodes, one on each side of a joint (§1), and their
//! tractions (M1).

use fearless_simd::dispatch;
use nalgebra::Matrix3;

use crate::breaks::{Breaks, Point};
use crate::contact::{Contacts, Release, Seated};
use crate::force::joint::face_forces;
use crate::geometry::{Face, Vec3};
use crate::lanes::Lanes;
use crate::model::Model;
use crate::pass::Workspace;
use crate::seams::NO_JOINT;
use crate::simulation::Simulation;
use crate::state::State;
use crate::step::{Pass, input};

impl Face {
    /// Lattice steps, in block a's lattice, of the pairs in order: the first edge after the
    /// normal's direction, cyclically, runs fastest.
    fn steps(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let (n, d) = (self.divisions as usize, self.direction as usize);
        (0..=n).flat_map(move |k| {
            (0..=n).map(move |i| {
                let mut at = [0; 3];
                at[(d + 1) % 3] = i;
                at[(d + 2) % 3] = k;
                at
            })
        })
    }

    /// Nodes on sides a and b of each pair, in order.
    pub fn pairs<'a>(&self, model: &'a Model) -> impl Iterator<Item = [u32; 2]> + use<'a> {
        let (face, n) = (*self, self.divisions as usize);
        self.steps().map(move |at| {
            let (mut on_a, mut on_b) = (at, at);
            on_a[face.direction as usize] = n;
            on_b[face.direction as usize] = 0;
            [
                model.geometry.node(face.a as usize, on_a) as u32,
                model.geometry.node(face.b as usize, on_b) as u32,
            ]
        })
    }

    /// Pairs at the corners of each joint element, around it.
    pub fn quads(&self) -> impl Iterator<Item = [u32; 4]> + use<> {
        let (n, first) = (u32::from(self.divisions), self.first_pair);
        (0..n).flat_map(move |k| {
            (0..n).map(move |i| {
                let at = |i: u32, k: u32| first + i + (n + 1) * k;
                [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)]
            })
        })
    }

    /// Unit normal, from a to b, in the reference position.
    #[must_use]
    pub fn normal(&self, model: &Model) -> [f64; 3] {
        model.geometry.lattice(self.a as usize).normal(self.direction as usize).into()
    }

    /// Area `A_p` of each pair `[m²]`: a quarter of each joint element that it belongs to.
    pub fn areas(&self, model: &Model) -> impl Iterator<Item = f64> + use<> {
        let (lattice, d) = (model.geometry.lattice(self.a as usize), self.direction as usize);
        let cell = model.geometry.bodies[self.a as usize].cell;
        let quarter = lattice.joint_area(cell.map(|c| c as usize), d) / 4.0;
        let n = self.divisions as usize;
        self.steps().map(move |at| {
            let inner = (0..3).filter(|&e| e != d && at[e] > 0 && at[e] < n).count();
            quarter * f64::from(1u32 << inner)
        })
    }
}

impl Model {
    /// All joints between two blocks of one lattice, whose faces match. Those of faces that do not are
    /// in [`pairs`](Self::pairs) after them.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Number of the properties of each joint between two blocks.
    pub fn joint_numbers(&self) -> impl Iterator<Item = u16> + '_ {
        let abutting = self.geometry.abutments.iter().map(|abutment| abutment.joint);
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
        let last = self.seated.last().map(|joint| joint.first_pair + joint.patch.points.len());
        last.unwrap_or_else(|| self.faces.last().map_or(0, Face::end))
    }

    /// All pairs, in order.
    pub fn pairs(&self) -> impl Iterator<Item = PairAt> + '_ {
        let matching = self.faces.iter().flat_map(move |face| {
            let (normal, joint) = (face.normal(self), face.joint);
            face.pairs(self).map(move |nodes| {
                let [a, b] = nodes.map(|node| self.point(node as usize));
                let point = [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
                PairAt { nodes, point, normal, joint }
            })
        });
        matching.chain(self.seated.iter().flat_map(|joint| self.seats(joint)))
    }

    fn seats<'a>(&'a self, joint: &'a Seated) -> impl Iterator<Item = PairAt> + 'a {
        let patch = &joint.patch;
        let [a, b] = patch.blocks.map(|block| block as usize);
        let number = patch.bond.as_ref().map_or(0, |bond| bond.joint);
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

/// A pair as it is now, in the frame of space.
pub(crate) struct Seen<'a> {
    /// Traction on side a `[Pa]`, (M1).
    pub(crate) traction: Vec3,
    /// The joint's own axes in space, as columns: the normal, from a to b, and two in its plane.
    pub(crate) axes: Matrix3<f64>,
    /// Number of the joint's law.
    pub(crate) law: u16,
    /// If elements around it have become springs.
    pub(crate) point: Option<&'a Point>,
}

impl Simulation {
    /// Traction of every pair `[Pa]`, shape `(n_pairs, 3)`, tension along the normal positive:
    /// `T = (F_a − F_b)/(2 A_p)` of the forces that the joint's elements and springs exert, (M1).
    pub fn tractions(&mut self) -> Vec<[f64; 3]> {
        let mut tractions = vec![[0.0; 3]; self.model.n_pairs()];
        self.see_present(|pair, seen| tractions[pair] = seen.traction.into());
        tractions
    }

    /// Calls `see` with each pair at the present time.
    pub(crate) fn see_present(&mut self, see: impl FnMut(usize, Seen<'_>)) {
        self.measure_once();
        self.see((&self.scratch.trial, &self.scratch.trial_contacts), see);
    }

    /// Calls `see` with each pair around which elements have become springs, and when it failed.
    pub(crate) fn present_points(&mut self, mut see: impl FnMut(usize, &Point, f64)) {
        self.measure_once();
        for ((pack, d), lane, first) in face_places(&self.model) {
            let Some(broken) = self.scratch.trial.get(pack, 1 << d) else { continue };
            for (p, (points, times)) in broken.points.iter().zip(&broken.times).enumerate() {
                see(first + p, &points[lane], times[lane]);
            }
        }
        for joint in &self.model.seated {
            let Some((bond, patch)) = self.scratch.trial_contacts.bond(joint.patch.blocks) else {
                continue;
            };
            for (i, pair) in bond.pairs.iter().enumerate() {
                let point = bond.point(i, patch.map(|patch| &patch.points[i]));
                see(joint.first_pair + i, &point, pair.time);
            }
        }
    }

    /// Largest gap or slip of two blocks that have failed pairs, or are in contact `[m]`, and these blocks.
    pub(crate) fn farthest_apart(&self) -> Option<(f64, [usize; 2])> {
        let State { breaks, contacts, .. } = &self.state;
        let mut farthest: Option<(f64, [usize; 2])> = None;
        let mut look = |distance: f64, blocks: [u32; 2]| {
            if farthest.is_none_or(|(most, _)| distance > most) {
                farthest = Some((distance, blocks.map(|block| block as usize)));
            }
        };
        for (face, ((pack, d), lane, _)) in self.model.faces.iter().zip(face_places(&self.model)) {
            let Some(broken) = breaks.get(pack, 1 << d) else { continue };
            let blocks = [face.a, face.b];
            if contacts.joints[face.a as usize][d] == Release::Done {
                if let Some(distance) = self.parted(blocks, face.pairs(&self.model)) {
                    look(distance, blocks);
                }
                continue;
            }
            for point in broken.points.iter().map(|points| &points[lane]) {
                if point.mode.is_some() {
                    look(point.memory.gap.max(point.memory.slip.norm()), blocks);
                }
            }
        }
        for patch in &contacts.patches {
            for (i, point) in patch.points.iter().enumerate() {
                match &patch.bond {
                    Some(bond) if bond.pairs[i].mode.is_some() => {
                        look(point.gap.max(point.slip.norm()), patch.blocks);
                    }
                    Some(_) => {}
                    None => look(point.slid, patch.blocks),
                }
            }
        }
        let ended =
            |joint: &&Seated| contacts.bond(joint.patch.blocks).is_some_and(|b| b.1.is_none());
        for joint in self.model.seated.iter().filter(ended) {
            let nodes = self.model.seats(joint).map(|pair| pair.nodes);
            if let Some(distance) = self.parted(joint.patch.blocks, nodes) {
                look(distance, joint.patch.blocks);
            }
        }
        farthest
    }

    /// How far the nodes of pairs have come from each other, where a contact has taken the place of their
    /// joint `[m]`; of blocks that are taken out nothing.
    fn parted(&self, blocks: [u32; 2], pairs: impl Iterator<Item = [u32; 2]>) -> Option<f64> {
        if blocks.iter().any(|&block| self.model.geometry.is_gone(block as usize)) {
            return None;
        }
        let at = |node: u32| Vec3::from(self.model.get(&self.state.u, node as usize));
        pairs.map(|[a, b]| (at(b) - at(a)).norm()).max_by(f64::total_cmp)
    }

    /// By what the most loaded pair that is bonded is beyond its strength, for a relaxation.
    pub(crate) fn overload(&self) -> f64 {
        let mut most: f64 = 1.0;
        self.see((&self.state.breaks, &self.state.contacts), |_, seen| {
            let law = self.model.laws[seen.law as usize].as_ref();
            if let Some(law) = law.filter(|_| seen.point.is_none_or(|p| p.mode.is_none())) {
                let own = seen.axes.tr_mul(&seen.traction);
                most = most.max(law.overload(own.x, own.yz().norm()));
            }
        });
        most
    }

    /// Whether a joint has turned about pairs that still hold, so far that it is to let go of them.
    pub(crate) fn hinges(&self) -> bool {
        let model = &self.model;
        let Some(surfaces) = model.searched() else { return false };
        let bonds = |law: u16| {
            let law = model.laws.get(usize::from(law)).and_then(Option::as_ref);
            law.is_some_and(|law| law.bonds())
        };
        let matching = face_places(model).any(|((pack, d), lane, _)| {
            let broken = self.state.breaks.get(pack, 1 << d).zip(model.seams.get(pack, d));
            broken.is_some_and(|(broken, seam)| {
                bonds(seam.laws[lane]) && broken.holds(lane) && broken.turned(seam, lane)
            })
        });
        matching
            || self.state.contacts.patches.iter().any(|patch| {
                patch.bond.as_ref().is_some_and(|bond| bonds(bond.law))
                    && patch.hinges(&surfaces.blocks)
            })
    }

    fn see(&self, (breaks, contacts): (&Breaks, &Contacts), mut see: impl FnMut(usize, Seen<'_>)) {
        let model = &self.model;
        let packs = &model.packs;
        let input = input(
            Pass { linear: false, ..Pass::linear(model, &self.state.u) },
            &self.scratch.frames,
        );
        let first = first_faces(model);
        let (mut forces, mut rotation) = (Vec::new(), [[Lanes::ZERO; 3]; 3]);
        let mut work = Workspace::default();
        for (index, d) in (0..packs.packs.len()).flat_map(|index| [0, 1, 2].map(|d| (index, d))) {
            let Some(seam) = model.seams.get(index, d) else { continue };
            let broken = breaks.get(index, 1 << d);
            let out = (&mut forces, &mut rotation);
            dispatch!(self.scratch.level, simd => {
                face_forces(simd, input, (index, 1 << d), broken, out, &mut work)
            });
            let pack = &packs.packs[index];
            for lane in 0..pack.filled {
                let face = first[pack.bodies[lane] as usize][d];
                let there = seam.joints[lane] != NO_JOINT;
                let Some(face) = model.faces.get(face as usize).filter(|_| there) else { continue };
                let axes = Matrix3::from_fn(|i, k| rotation[i][k].0[lane]) * seam.axes;
                for (p, place) in packs.shape_of(pack).pairs[d].iter().enumerate() {
                    let force = |side: usize| {
                        Vec3::from([0, 1, 2].map(|c| forces[3 * place.sides[side] + c].0[lane]))
                    };
                    let area = seam.quarter.0[lane] * place.elements().len() as f64;
                    let mut traction = (force(0) - force(1)) / (2.0 * area);
                    let point = broken.map(|b| &b.points[p][lane]).filter(|p| p.quarters > 0);
                    if let Some(point) = point {
                        let springs = point.memory.borne();
                        let part = f64::from(point.quarters) * place.share();
                        let own = Vec3::new(springs.normal, springs.shear.x, springs.shear.y);
                        traction += axes * own * part;
                    }
                    let seen = Seen { traction, axes, law: seam.laws[lane], point };
                    see(face.first_pair as usize + p, seen);
                }
            }
        }
        for joint in &model.seated {
            let Some((bond, Some(patch))) = contacts.bond(joint.patch.blocks) else { continue };
            let axes = patch.frame();
            for (i, point) in patch.points.iter().enumerate() {
                let traction = patch.force(point) / point.area;
                let own = bond.point(i, Some(point));
                let seen = Seen { traction, axes, law: bond.law, point: Some(&own) };
                see(joint.first_pair + i, seen);
            }
        }
    }
}

/// Each joint face: pack and direction, lane, number of its first pair.
pub(crate) fn face_places(
    model: &Model,
) -> impl Iterator<Item = ((usize, usize), usize, usize)> + use<'_> {
    model.faces.iter().map(|face| {
        let (pack, lane) = model.packs.slot(face.a as usize);
        ((pack, face.direction as usize), lane, face.first_pair as usize)
    })
}

/// The face at the upper side of each block along each direction.
fn first_faces(model: &Model) -> Vec<[u32; 3]> {
    let mut first = vec![[u32::MAX; 3]; model.n_blocks()];
    for (index, face) in model.faces.iter().enumerate() {
        first[face.a as usize][face.direction as usize] = index as u32;
    }
    first
}
