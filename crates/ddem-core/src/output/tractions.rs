//! Tractions of bonded and failed pairs (M1).

use std::ops::Range;

use fearless_simd::dispatch;
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::Snapshot;
use crate::force::joint::face_forces;
use crate::model::joint_state::JointState;
use crate::model::pairs::BlockJoint;
use crate::state::State;
use crate::state::pass::Workspace;
use crate::step::{FirstPass, input};
use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::{BondedPatch, Contacts};
use ddem_joint::point::{JointPoint, vector};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::NO_JOINT;
use ddem_mesh::Vec3;
use ddem_mesh::pack::JointLattice;

/// Present state of a pair, in global axes.
pub(super) struct PairView {
    /// Traction on side a `[Pa]`, (M1).
    pub(super) traction: Vec3,
    /// Axes of the joint in global axes, as columns: the normal from a to b, and two in its plane.
    pub(super) axes: Matrix3<f64>,
    /// Number of the joint's law.
    pub(super) law: u16,
    /// Springs of the pair, if elements around it have failed.
    pub(super) point: Option<JointPoint>,
}

/// Conforming joint: pack and lane of its block a, its direction and its number.
struct JointLane {
    pack: u32,
    d: u8,
    lane: u8,
    at: u32,
}

/// Forces of the joints at one face of a pack, and the rotation of their axes.
#[derive(Default)]
struct FaceForces {
    forces: Vec<Lanes>,
    rotation: [[Lanes; 3]; 3],
    work: Workspace,
}

/// Overloaded bonded pairs of a relaxation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Overloads {
    /// Joint of each pair that sheds load when it fails, and the divisor of the tractions at which it
    /// would just hold.
    pub(crate) shedding: Vec<(usize, f64)>,
    /// True if there are pairs that shed no load.
    pub(crate) keeping: bool,
}

impl Snapshot<'_> {
    /// Implements [`Simulation::tractions`](crate::Simulation::tractions), (M1).
    pub(crate) fn tractions(&self) -> Vec<[f64; 3]> {
        let mut tractions = vec![[0.0; 3]; self.model.n_pairs()];
        self.visit_pairs(0..tractions.len(), |pair, view| tractions[pair] = view.traction.into());
        tractions
    }

    /// Calls `visit` with the pairs in a range, in any order, in the last measured state.
    pub(super) fn visit_pairs(&self, pairs: Range<usize>, visit: impl FnMut(usize, PairView)) {
        self.visit(&self.scratch.measured_joints, &self.scratch.measured_contacts, pairs, visit);
    }

    /// State of a joint in the last measured state.
    pub(super) fn joint_state(&self, joint: usize) -> JointState<'_> {
        self.model.joint_state(
            joint,
            &self.scratch.measured_joints,
            &self.scratch.measured_contacts,
        )
    }

    /// Overloaded bonded pairs, for a relaxation.
    pub(crate) fn overloads(&self) -> Overloads {
        let n = self.model.n_pairs();
        let parts = 4 * rayon::current_num_threads();
        let ranges = (0..parts).into_par_iter().map(|i| i * n / parts..(i + 1) * n / parts);
        let overloads: Vec<_> = ranges
            .filter(|pairs| !pairs.is_empty())
            .map(|pairs| self.overloads_of(pairs))
            .collect();
        overloads.into_iter().fold(Overloads::default(), |sum, more| Overloads {
            shedding: [sum.shedding, more.shedding].concat(),
            keeping: sum.keeping || more.keeping,
        })
    }

    /// Overloaded bonded pairs in a range.
    fn overloads_of(&self, pairs: Range<usize>) -> Overloads {
        let (model, state) = (self.model, self.state);
        let mut overloads = Overloads::default();
        self.visit(&state.broken_joints, &state.contacts, pairs, |pair, view| {
            let law = model.laws[view.law as usize].as_ref();
            if let Some(law) = law.filter(|_| view.point.is_none_or(|p| p.failure.is_none())) {
                let own = view.axes.tr_mul(&view.traction);
                let overload = law.overload(own.x, own.yz().norm());
                if overload > 1.0 && law.sheds_load() {
                    overloads.shedding.push((model.joint_of(pair), overload));
                }
                overloads.keeping |= overload > 1.0 && !law.sheds_load();
            }
        });
        overloads
    }

    /// True if a joint has rotated about bonded pairs so far that they must fail.
    pub(crate) fn has_rotated_joints(&self) -> bool {
        let State { broken_joints, contacts, .. } = self.state;
        self.model.searched().is_some()
            && self.model.joint_states(broken_joints, contacts).any(|joint| joint.has_rotated())
    }

    fn visit(
        &self,
        broken_joints: &BrokenJoints,
        contacts: &Contacts,
        pairs: Range<usize>,
        mut visit: impl FnMut(usize, PairView),
    ) {
        let model = self.model;
        let mut visit = |pair: usize, view: PairView| {
            if pairs.contains(&pair) {
                visit(pair, view);
            }
        };
        let mut faces = Vec::new();
        let joints = model.joint_of(pairs.start)..model.joints().end;
        for at in joints.take_while(|&at| model.pairs_of(at).start < pairs.end) {
            match model.joint(at) {
                BlockJoint::Matching(face) => {
                    let (pack, lane) = model.packs.slot(face.a as usize);
                    faces.push(JointLane {
                        pack: pack as u32,
                        d: face.direction,
                        lane: lane as u8,
                        at: at as u32,
                    });
                }
                BlockJoint::Nonconforming(joint) => {
                    visit_nonconforming(joint, contacts, &mut visit)
                }
            }
        }
        // The lanes of a pack are processed together.
        faces.sort_unstable_by_key(|face| (face.pack, face.d));
        let mut forces = FaceForces::default();
        for faces in faces.chunk_by(|a, b| (a.pack, a.d) == (b.pack, b.d)) {
            self.visit_lanes(broken_joints, faces, &mut forces, &mut visit);
        }
    }

    /// Calls `visit` with the pairs of joints that are lanes of one face of a pack.
    fn visit_lanes(
        &self,
        broken_joints: &BrokenJoints,
        faces: &[JointLane],
        FaceForces { forces, rotation, work }: &mut FaceForces,
        visit: &mut impl FnMut(usize, PairView),
    ) {
        let model = self.model;
        let (pack, d) = (faces[0].pack as usize, usize::from(faces[0].d));
        let Some(section) = model.sections.get(pack, d) else { return };
        let pass = FirstPass { linear: false, ..FirstPass::linear(model, &self.state.u) };
        let input = input(pass, &self.scratch.frames);
        let at = JointLattice { pack, offset: 1 << d };
        let broken = broken_joints.get(pack, at.offset);
        dispatch!(self.scratch.level, simd => {
            face_forces(simd, &input, at, broken, forces, rotation, work)
        });
        let node_pairs = &model.packs.numbering_of(&model.packs.packs[pack]).pairs[d];
        for &JointLane { lane, at, .. } in faces {
            let lane = usize::from(lane);
            if section.joints[lane] == NO_JOINT {
                continue;
            }
            let axes = Matrix3::from_fn(|i, k| rotation[i][k].0[lane]) * section.axes;
            for (pair, (p, node_pair)) in
                model.pairs_of(at as usize).zip(node_pairs.iter().enumerate())
            {
                let force = |side: usize| {
                    Vec3::from([0, 1, 2].map(|c| forces[3 * node_pair.sides[side] + c].0[lane]))
                };
                let area = section.quarter.0[lane] * node_pair.elements().len() as f64;
                let mut traction = (force(0) - force(1)) / (2.0 * area);
                let point = broken.map(|b| b.points.get(p, lane)).filter(|p| p.area > 0.0);
                if let Some(point) = point {
                    let springs = point.state.total_traction();
                    // Fraction of the pair's elements that are springs; each has a quarter of its
                    // area here.
                    let fraction =
                        (point.area / section.quarter.0[lane]).round() * node_pair.inverse_count();
                    traction += axes * vector(springs.normal, springs.shear) * fraction;
                }
                visit(pair, PairView { traction, axes, law: section.laws[lane], point });
            }
        }
    }
}

/// Calls `visit` with the pairs of a nonconforming joint.
fn visit_nonconforming(
    joint: &BondedPatch,
    contacts: &Contacts,
    visit: &mut impl FnMut(usize, PairView),
) {
    let Some((patch, bond)) = contacts.bonded_patch(joint.patch.blocks) else { return };
    let axes = patch.frame();
    for (number, point) in joint.pairs().zip(&patch.points) {
        let pair = &point.pair;
        let traction = patch.force(point) / pair.area;
        visit(number, PairView { traction, axes, law: bond.law, point: Some(*pair) });
    }
}
