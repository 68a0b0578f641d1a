//! Joint faces and pairs: two facing nodes, one on each side of a joint (§1), and their
//! tractions (M1).

use fearless_simd::dispatch;

use crate::force::internal::{Input, Workspace, face_forces};
use crate::geometry::{Face, Vec3};
use crate::model::Model;
use crate::simulation::Simulation;

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
        let edge = |d: usize| lattice.axes[d] * lattice.spacing(d, cell[d] as usize);
        let quarter = edge((d + 1) % 3).cross(&edge((d + 2) % 3)).norm() / 4.0;
        let n = self.divisions as usize;
        self.steps().map(move |at| {
            let inner = (0..3).filter(|&e| e != d && at[e] > 0 && at[e] < n).count();
            quarter * f64::from(1u32 << inner)
        })
    }
}

impl Model {
    /// All joints between two blocks.
    #[must_use]
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Number of pairs of facing nodes.
    #[must_use]
    pub fn n_pairs(&self) -> usize {
        self.faces
            .last()
            .map_or(0, |face| face.first_pair as usize + (face.divisions as usize + 1).pow(2))
    }
}

impl Simulation {
    /// Pairs that have failed, in shear and in tension.
    #[must_use]
    pub fn failed_pairs(&self) -> [u64; 2] {
        [0; 2]
    }

    /// Traction of every pair `[Pa]`, shape `(n_pairs, 3)`, tension along the normal positive:
    /// `T = (F_a − F_b)/(2 A_p)` of the forces that the elements of the joint exert, (M1).
    #[must_use]
    pub fn tractions(&self) -> Vec<[f64; 3]> {
        let model = &self.model;
        let frames = model.corotational().then_some(&self.scratch.frames[..]);
        let (packs, assembly) = (&model.packs, &model.assembly);
        let input = Input { packs, assembly, u: &self.state.u, frames };
        let mut first = vec![[u32::MAX; 3]; model.n_blocks()];
        for (index, face) in model.faces.iter().enumerate() {
            first[face.a as usize][face.direction as usize] = index as u32;
        }
        let mut tractions = vec![[0.0; 3]; model.n_pairs()];
        let (mut forces, mut work) = (Vec::new(), Workspace::default());
        for index in 0..packs.packs.len() {
            let pack = &packs.packs[index];
            for d in 0..3 {
                let at = (index, 1 << d);
                dispatch!(self.scratch.level, simd => {
                    face_forces(simd, input, at, &mut forces, &mut work)
                });
                for lane in 0..pack.filled {
                    let index = first[pack.bodies[lane] as usize][d];
                    let Some(face) = model.faces.get(index as usize) else { continue };
                    let dims = packs.shape_of(pack).dims(1 << d).map(|n| n + 1);
                    let place = |at: [usize; 3]| 3 * (at[0] + dims[0] * (at[1] + dims[1] * at[2]));
                    let force = |at: [usize; 3]| {
                        let place = place(at);
                        Vec3::from([0, 1, 2].map(|c| forces[place + c].0[lane]))
                    };
                    let out = &mut tractions[face.first_pair as usize..];
                    for ((on_a, area), traction) in face.steps().zip(face.areas(model)).zip(out) {
                        let mut on_b = on_a;
                        on_b[d] = 1;
                        *traction = ((force(on_a) - force(on_b)) / (2.0 * area)).into();
                    }
                }
            }
        }
        tractions
    }
}
