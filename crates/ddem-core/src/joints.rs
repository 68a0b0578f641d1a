//! Tractions of pairs (M1), failed or not.

use fearless_simd::dispatch;
use nalgebra::Matrix3;

use crate::breaks::{Breaks, Point};
use crate::contact::Contacts;
use crate::force::joint::face_forces;
use crate::geometry::NO_JOINT;
use crate::geometry::Vec3;
use crate::lanes::Lanes;
use crate::model::Model;
use crate::pairs::face_places;
use crate::pass::Workspace;
use crate::simulation::Simulation;
use crate::step::{Pass, input};

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
    /// Traction of every pair on its first node's side `[Pa]`, shape `(n_pairs, 3)`, in global axes: `T = (F_a −
    /// F_b)/(2 A_p)` of the forces that the joint's elements and springs exert, (M1). Its product with the normal
    /// from a to b is positive in tension. 0 where a contact has taken the place of the joint.
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

/// The face at the upper side of each block along each direction.
fn first_faces(model: &Model) -> Vec<[u32; 3]> {
    let mut first = vec![[u32::MAX; 3]; model.n_blocks()];
    for (index, face) in model.faces.iter().enumerate() {
        first[face.a as usize][face.direction as usize] = index as u32;
    }
    first
}
