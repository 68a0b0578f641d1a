//! Frames of the blocks of a pack, from the displacements of its nodes (§3).

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use crate::model::Model;
use ddem_mechanics::element::corotation::{Frame, fit};
use ddem_mechanics::math::lanes::{LANES, Lanes, Vector, add, load, scale, splat, zero};
use ddem_mechanics::rigid::Pose;

/// Frame of a pack's rigid blocks in their poses.
pub(super) fn frame_of(poses: &[Pose; LANES]) -> Frame {
    let turns = poses.map(|pose| pose.turn.to_rotation_matrix());
    let mut frame = Frame::REST;
    for (i, row) in frame.rotation.iter_mut().enumerate() {
        for (k, lanes) in row.iter_mut().enumerate() {
            *lanes = Lanes(std::array::from_fn(|lane| turns[lane][(i, k)]));
        }
    }
    frame.mean = [0, 1, 2].map(|c| Lanes(poses.map(|pose| pose.shift[c])));
    frame
}

/// Frame of a pack's blocks at displacements `u`.
#[simd]
pub(super) fn fit_pack<S: Simd>(simd: S, model: &Model, index: usize, u: &[Lanes]) -> Frame {
    let divisions = model.packs.numbering_of(&model.packs.packs[index]).divisions;
    let mut moments = FirstMoments::new(simd, divisions);
    for row in u.as_chunks::<3>().0.chunks_exact(divisions + 1) {
        for (i, u) in row.iter().enumerate() {
            moments.add_node(simd, i, load(simd, u));
        }
        moments.end_row(simd);
    }
    moments.frame(simd, model, index)
}

/// Sum and first moments of the displacements of the nodes of a pack, row by row.
pub(super) struct FirstMoments<S: Simd> {
    divisions: usize,
    /// Rows so far, of the plane and planes.
    done: [usize; 2],
    row: Vector<S>,
    plane: Vector<S>,
    sum: Vector<S>,
    moments: [Vector<S>; 3],
}

impl<S: Simd> FirstMoments<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, divisions: usize) -> Self {
        let none = zero(simd);
        let (row, plane, sum, moments) = (none, none, none, [none; 3]);
        Self { divisions, done: [0; 2], row, plane, sum, moments }
    }

    /// Steps of a node from the centre, from its number along a direction.
    #[inline(always)]
    fn steps(&self, simd: S, number: usize) -> f64x4<S> {
        splat(simd, number as f64 - 0.5 * self.divisions as f64)
    }

    /// Adds node `i` of the present row.
    #[inline(always)]
    pub(super) fn add_node(&mut self, simd: S, i: usize, u: Vector<S>) {
        self.row = add(self.row, u);
        self.moments[0] = add(self.moments[0], scale(u, self.steps(simd, i)));
    }

    /// Ends a row, after its last node.
    #[inline(always)]
    pub(super) fn end_row(&mut self, simd: S) {
        let [row, plane] = self.done;
        self.plane = add(self.plane, self.row);
        self.moments[1] = add(self.moments[1], scale(self.row, self.steps(simd, row)));
        self.row = zero(simd);
        self.done[0] += 1;
        if row == self.divisions {
            self.sum = add(self.sum, self.plane);
            self.moments[2] = add(self.moments[2], scale(self.plane, self.steps(simd, plane)));
            self.plane = zero(simd);
            self.done = [0, plane + 1];
        }
    }

    /// Frame of the blocks of the pack, after its last node.
    #[inline(always)]
    pub(super) fn frame(&self, simd: S, model: &Model, index: usize) -> Frame {
        let edges = &model.assembly.tables[model.assembly.pack_tables[index][0] as usize].edges;
        let weight = splat(simd, 1.0 / (self.divisions as f64 + 1.0).powi(3));
        let [x, y, z] = self.moments;
        let moments = [scale(x, weight), scale(y, weight), scale(z, weight)];
        fit(simd, self.divisions, edges, scale(self.sum, weight), moments)
    }
}
