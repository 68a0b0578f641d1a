//! Stresses at the centres of the elements.

use std::ops::Range;

use nalgebra::Matrix3;

use super::Snapshot;
use ddem_mechanics::element::hexahedron::HexahedronTable;
use ddem_mechanics::element::table::ElementTable;
use ddem_mechanics::element::{Elastic, principal};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mesh::in_situ::Stress;
use ddem_mesh::{Topology, Vec3};

/// Data for the stresses of one block.
pub(crate) struct StressSource<'a> {
    u: &'a [Lanes],
    lane: usize,
    topology: Topology,
    elastic: &'a Elastic,
    /// Inverse of the matrix whose columns are the edges of an element.
    inverse: Matrix3<f64>,
    rotation: Matrix3<f64>,
    /// In-situ stress, and centre of the first element.
    in_place: Option<(Stress, Vec3)>,
    edges: [Vec3; 3],
    /// Elements of a part of a cell, and their centres `[m]`.
    part: Option<(&'a [HexahedronTable], Vec<Vec3>)>,
}

pub(super) fn stress(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.fill_stresses(range, out);
}

impl Snapshot<'_> {
    /// Implements [`Simulation::stresses`](crate::Simulation::stresses).
    pub(crate) fn stresses(&self) -> Vec<[f64; 6]> {
        let n = self.model.n_elements();
        let mut stresses = vec![[0.0; 6]; n];
        self.fill_stresses(0..n, stresses.as_flattened_mut());
        stresses
    }

    /// Writes the stresses of a range of elements `[Pa]`.
    fn fill_stresses(&self, range: Range<usize>, out: &mut [f64]) {
        self.model.fill_elements(range, out, |block| {
            let (strained, topology) = (self.strained(block), self.model.geometry.topology(block));
            move |e| {
                let stress = |block: &StressSource<'_>| block.stress(topology.element_steps(e));
                strained.as_ref().map_or([0.0; 6], stress)
            }
        });
    }

    /// Implements [`Simulation::stress`](crate::Simulation::stress).
    pub(crate) fn stress(&self, block: usize, at: [usize; 3]) -> [f64; 6] {
        // This panics if there is no such element.
        let _ = self.model.element(block, at);
        self.strained(block).map_or([0.0; 6], |block| block.stress(at))
    }

    /// Data for the stresses of a block; `None` for a block without stresses.
    pub(crate) fn strained(&self, block: usize) -> Option<StressSource<'_>> {
        let model = self.model;
        let (pack, lane) = model.packs.slot(block);
        if model.packs.packs[pack].rigid {
            return None;
        }
        let table = &model.assembly.tables[model.assembly.pack_tables[pack][0] as usize];
        let element = &model.assembly.elements[table.elements[lane]? as usize];
        let first = &model.packs.packs[pack];
        let nodes = 3 * first.start..3 * (first.start + model.packs.numbering_of(first).nodes);
        Some(StressSource {
            u: &self.state.u[nodes],
            lane,
            topology: model.geometry.topology(block),
            elastic: &element.elastic,
            inverse: Matrix3::from_columns(&element.edges).try_inverse()?,
            rotation: self.rotation(pack, lane),
            in_place: model.in_situ.as_ref().and_then(|in_situ| in_situ.of(block)).map(|stress| {
                let far = model.geometry.position(block, [1; 3]);
                (stress, (model.geometry.position(block, [0; 3]) + far) / 2.0)
            }),
            edges: element.edges,
            part: match &table.table {
                ElementTable::Hexahedra(tables) => Some((tables, self.centres(block))),
                _ => None,
            },
        })
    }

    /// Means of the corners of the elements of a block with an in-situ stress `[m]`; none without.
    fn centres(&self, block: usize) -> Vec<Vec3> {
        let geometry = &self.model.geometry;
        if self.model.in_situ.as_ref().and_then(|in_situ| in_situ.of(block)).is_none() {
            return Vec::new();
        }
        let centre = |element| geometry.element_corners(block, element).iter().sum::<Vec3>() / 8.0;
        (0..geometry.topology(block).elements()).map(centre).collect()
    }

    fn rotation(&self, pack: usize, lane: usize) -> Matrix3<f64> {
        if !self.model.corotational() {
            return Matrix3::identity();
        }
        let rotation = &self.scratch.frames[pack].rotation;
        Matrix3::from_fn(|i, k| rotation[i][k].0[lane])
    }
}

impl StressSource<'_> {
    /// Implements [`Simulation::stress`](crate::Simulation::stress).
    pub(super) fn stress(&self, at: [usize; 3]) -> [f64; 6] {
        let own = self.own(at, &self.gradient(at));
        let turned = self.rotation * own * self.rotation.transpose();
        COMPONENTS.map(|at| turned[at])
    }

    /// Least and largest principal stress of an element `[Pa]`. They do not depend on the rotation
    /// of the block.
    pub(crate) fn range(&self, at: [usize; 3]) -> [f64; 2] {
        let own = self.own(at, &self.gradient(at));
        principal(&COMPONENTS.map(|at| own[at]))
    }

    /// Mean of `∂u/∂X` over an element.
    fn gradient(&self, at: [usize; 3]) -> Matrix3<f64> {
        if let Some((tables, _)) = &self.part {
            let element = self.topology.element(at);
            let u = |node: usize| Vec3::from([0, 1, 2].map(|c| self.u[3 * node + c].0[self.lane]));
            return tables[element].mean_gradient(self.lane, &self.topology.hex(element).map(u));
        }
        // Mean differences along the three edges: ∂u/∂X = Σ_d (Δ_d u) ⊗ (row d of the inverse).
        let first = self.topology.node(at);
        let mut differences = [[0.0; 3]; 3];
        for corner in 0..8 {
            let [i, j, k] = [0, 1, 2].map(|d| corner >> d & 1);
            let node = 3 * (first + self.topology.node([i, j, k]));
            for (c, u) in self.u[node..node + 3].iter().map(|u| u.0[self.lane]).enumerate() {
                differences[0][c] += if i == 1 { u } else { -u };
                differences[1][c] += if j == 1 { u } else { -u };
                differences[2][c] += if k == 1 { u } else { -u };
            }
        }
        Matrix3::from_fn(|i, k| {
            let along = |d: usize| differences[d][i] * self.inverse[(d, k)];
            0.25 * (along(0) + along(1) + along(2))
        })
    }

    /// Stress `σ⁰ + C : sym(Rᵀ F − 1)` from `∂u/∂X`, in the frame of the block `[Pa]`.
    fn own(&self, at: [usize; 3], gradient: &Matrix3<f64>) -> Matrix3<f64> {
        let local = self.rotation.tr_mul(&(Matrix3::identity() + gradient)) - Matrix3::identity();
        let [xx, yy, zz, xy, yz, zx] =
            self.elastic.stress(&[0, 1, 2].map(|i| [0, 1, 2].map(|k| local[(i, k)])));
        let own = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
        self.in_place.map_or(own, |(stress, first)| {
            if let Some((_, centres)) = &self.part {
                return own + stress.at(&centres[self.topology.element(at)]);
            }
            let steps = self.edges.iter().zip(at).map(|(edge, steps)| edge * steps as f64);
            own + stress.at(&(first + steps.sum::<Vec3>()))
        })
    }
}

/// Indices of xx yy zz xy yz zx in a matrix.
const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];
