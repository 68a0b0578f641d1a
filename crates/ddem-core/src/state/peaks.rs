//! Largest velocities and stresses so far, if the deck has `peaks`.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::model::Model;
use ddem_mechanics::math::lanes::Lanes;

/// Least number of nodes per parallel task.
const FEWEST: usize = 2000;

/// Largest values since the start of the run; empty if they are not requested.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Peaks {
    /// Squares of the largest speeds of the nodes `[m²/s²]`, in the layout of the state.
    pub(crate) speeds: Vec<Lanes>,
    /// Largest principal tension and compression of each element of each block, both at least 0
    /// `[Pa]`.
    pub(crate) stresses: Vec<Vec<[f64; 2]>>,
}

impl Peaks {
    /// Peaks at the start of a run.
    pub(super) fn new(model: &Model) -> Self {
        if !model.properties.peaks {
            return Self::default();
        }
        let elements = |block| model.geometry.topology(block).elements();
        Self {
            speeds: vec![Lanes::ZERO; model.packs.nodes],
            stresses: (0..model.n_blocks()).map(|block| vec![[0.0; 2]; elements(block)]).collect(),
        }
    }

    /// Updates the peaks with velocities.
    pub(crate) fn note_velocities(&mut self, v: &[Lanes]) {
        let nodes = self.speeds.par_iter_mut().zip(v.par_chunks_exact(3));
        nodes.with_min_len(FEWEST).for_each(|(most, v)| {
            for (lane, most) in most.0.iter_mut().enumerate() {
                let [x, y, z] = [0, 1, 2].map(|c| v[c].0[lane]);
                *most = most.max(x * x + y * y + z * z);
            }
        });
    }

    /// Updates the peaks with stresses. `note` does this for the elements of each block.
    pub(crate) fn note_stresses(&mut self, note: &(impl Fn(usize, &mut [[f64; 2]]) + Sync)) {
        let blocks = self.stresses.par_iter_mut().enumerate();
        blocks.for_each(|(block, elements)| note(block, elements));
    }

    /// Memory in use `[bytes]`.
    pub(crate) fn bytes(&self) -> usize {
        let elements: usize = self.stresses.iter().map(Vec::len).sum();
        self.speeds.len() * size_of::<Lanes>() + elements * size_of::<[f64; 2]>()
    }
}
