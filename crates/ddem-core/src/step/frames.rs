//! Frames of the blocks of a pack, from the displacements of its nodes (§3).

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use crate::model::Model;
use ddem_mechanics::element::corotation::{Frame, fit};
use ddem_mechanics::math::lanes::{LANES, Lanes, add, load_at, scale, splat, zero};
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
    let n = model.packs.shape_of(&model.packs.packs[index]).divisions;
    let edges = &model.assembly.tables[model.assembly.pack_tables[index][0] as usize].edges;
    let half = 0.5 * n as f64;
    let (mut sum, mut moments) = (zero(simd), [zero(simd); 3]);
    let mut node = 0;
    for k in 0..=n {
        let mut plane = zero(simd);
        for j in 0..=n {
            let mut row = zero(simd);
            for i in 0..=n {
                let u = load_at(simd, u, node);
                row = add(row, u);
                moments[0] = add(moments[0], scale(u, splat(simd, i as f64 - half)));
                node += 3;
            }
            plane = add(plane, row);
            moments[1] = add(moments[1], scale(row, splat(simd, j as f64 - half)));
        }
        sum = add(sum, plane);
        moments[2] = add(moments[2], scale(plane, splat(simd, k as f64 - half)));
    }
    let weight = splat(simd, 1.0 / (n as f64 + 1.0).powi(3));
    let [x, y, z] = moments;
    let moments = [scale(x, weight), scale(y, weight), scale(z, weight)];
    fit(simd, n, edges, scale(sum, weight), moments)
}
