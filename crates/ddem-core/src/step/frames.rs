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
        for u in row {
            moments.add_node(load(simd, u));
        }
        moments.end_row(simd);
    }
    moments.frame(simd, model, index)
}

/// Sum and first moments of the displacements of the nodes of a pack, row by row.
pub(super) struct FirstMoments<S: Simd> {
    divisions: usize,
    /// Steps from the centre to the next node, in its row.
    along: f64x4<S>,
    /// Steps from the centre to the present row, in its plane, and to that plane.
    across: [f64; 2],
    row: Vector<S>,
    plane: Vector<S>,
    sum: Vector<S>,
    moments: [Vector<S>; 3],
}

impl<S: Simd> FirstMoments<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, divisions: usize) -> Self {
        let none = zero(simd);
        let first = -0.5 * divisions as f64;
        Self {
            divisions,
            along: splat(simd, first),
            across: [first; 2],
            row: none,
            plane: none,
            sum: none,
            moments: [none; 3],
        }
    }

    /// Adds the next node of the present row.
    #[inline(always)]
    pub(super) fn add_node(&mut self, u: Vector<S>) {
        self.row = add(self.row, u);
        self.moments[0] = add(self.moments[0], scale(u, self.along));
        self.along += 1.0;
    }

    /// Ends a row, after its last node.
    #[inline(always)]
    pub(super) fn end_row(&mut self, simd: S) {
        let last = 0.5 * self.divisions as f64;
        let [row, plane] = self.across;
        self.plane = add(self.plane, self.row);
        self.moments[1] = add(self.moments[1], scale(self.row, splat(simd, row)));
        (self.row, self.along) = (zero(simd), splat(simd, -last));
        self.across[0] += 1.0;
        if row == last {
            self.sum = add(self.sum, self.plane);
            self.moments[2] = add(self.moments[2], scale(self.plane, splat(simd, plane)));
            self.plane = zero(simd);
            self.across = [-last, plane + 1.0];
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
