//! Masses that rotate with the blocks of their clusters.
//!
//! If blocks have rotated far, the stiffness from which the masses follow has rotated with them. A
//! mass is then `R M Rᵀ` with the mean rotation R of the cluster. R is the same for all members of
//! the cluster, so that the mass stays symmetric. Tied nodes of the parts of a cell need one mass, but
//! the parts have their own rotations: there all components get the largest mass instead.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use super::{InverseMassRows, Preconditioner, SmoothMotions};
use crate::model::Model;
use ddem_mechanics::element::corotation::{Frame, mean_rotation};
use ddem_mechanics::law::SpringStiffness;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, add, load, load_at, scale, splat, store_at, times, transposed_times, zero,
};
use ddem_mesh::pack::Neighbours;
use ddem_mesh::properties::JointProperties;

/// Relative change of a stiffness by the rotation of blocks from which masses rotate with them. The
/// limit of stability is a stiffness 1.1 times as large.
const ROTATED: f64 = 0.05;
/// Assumed ratio of the normal to the shear stiffness of layers, accurate enough for masses.
const LAYER: f64 = 4.0;

impl InverseMassRows {
    /// Sets the weights of the rotations of the blocks in the mean of each cluster. They are zero
    /// if a member is held along some axes, because these do not rotate.
    pub(super) fn share_rotations(&mut self) {
        let (mut rotation_weights, mut rows) = (vec![Lanes::ZERO; self.partner.len()], Vec::new());
        for node in self.start.windows(2) {
            rows.clear();
            rows.extend(node[0] as usize..node[1] as usize);
            for lane in 0..LANES {
                let free =
                    |row: usize| (0..3).filter(|c| self.rows[3 * row + c].0[lane] != 0.0).count();
                let members = rows.iter().filter(|&&row| free(row) == 3);
                let count = members.clone().count();
                if rows.iter().all(|&row| [0, 3].contains(&free(row))) {
                    members.for_each(|&row| rotation_weights[row].0[lane] = 1.0 / count as f64);
                }
            }
        }
        self.rotation_weights = rotation_weights;
    }
}

impl Preconditioner {
    /// Turns the masses with the blocks, whose frames are given.
    pub(crate) fn turn(&mut self, model: &Model, frames: &Vec<Frame>) {
        if self.frames.is_empty() && model.has_cells() {
            self.nodes.equalize_cells(model);
        }
        self.frames.clone_from(frames);
        self.smooth.iter_mut().for_each(SmoothMotions::turn);
    }
}

/// Computes `R M⁻¹ Rᵀ F` at the nodes of a pack of deformable blocks; `frames` are the frames of
/// all packs.
#[simd]
pub(super) fn accelerations<S: Simd>(
    simd: S,
    model: &Model,
    frames: &[Frame],
    preconditioner: &Preconditioner,
    index: usize,
    f: &[Lanes],
    out: &mut [Lanes],
) {
    let packs = &model.packs;
    let class = preconditioner.nodes.of(index);
    for node in 0..out.len() / 3 {
        let rows = class.start[node] as usize..class.start[node + 1] as usize;
        let mut mean = zero_matrix(simd);
        let mut rest = splat(simd, 1.0);
        for row in rows.clone() {
            let blocks = &preconditioner.beside[index][class.partner[row].beside];
            let share = class.rotation_weights[row].load(simd);
            let rotation = rotation(frames, blocks);
            for (sum, row) in mean.iter_mut().zip(&rotation) {
                *sum = add(*sum, scale(load(simd, row), share));
            }
            rest -= share;
        }
        // Without weights the mean is the identity.
        (0..3).for_each(|c| mean[c][c] += rest);
        let mean = mean_rotation(simd, &mean, 1.0);
        let mut sum = zero(simd);
        for row in rows {
            let partner = &class.partner[row];
            let force = preconditioner.forces_on(simd, packs, index, node, partner, f);
            let force = transposed_times(&mean, force);
            let inverse = load_at(simd, &class.rows, 3 * row);
            for c in 0..3 {
                sum[c] += inverse[c] * force[c];
            }
        }
        store_at(out, 3 * node, times(&mean, sum));
    }
}

#[inline(always)]
fn zero_matrix<S: Simd>(simd: S) -> ddem_mechanics::math::lanes::Matrix<S> {
    [zero(simd), zero(simd), zero(simd)]
}

/// Rotations of four blocks; zero for absent ones.
#[inline(always)]
fn rotation(frames: &[Frame], blocks: &Neighbours) -> [[Lanes; 3]; 3] {
    let mut rotation = [[Lanes::ZERO; 3]; 3];
    for lane in 0..LANES {
        let Some((pack, from)) = blocks.at(lane) else { continue };
        for (row, other) in rotation.iter_mut().zip(&frames[pack].rotation) {
            (0..3).for_each(|c| row[c].0[lane] = other[c].0[from]);
        }
    }
    rotation
}

/// True if deformable blocks have rotated so far that the stiffness at their nodes has changed.
pub(crate) fn has_rotated(model: &Model, frames: &[Frame]) -> bool {
    if !model.corotational() {
        return false;
    }
    let ratio = |joint: &JointProperties| {
        let SpringStiffness { normal, shear } = joint.stiffness();
        (normal / shear).max(shear / normal)
    };
    let most = model.properties.joints.iter().map(ratio).fold(LAYER, f64::max);
    // This is sin²θ (k_n/k_s − 1) of a rotation by θ, whose trace is 1 + 2 cos θ.
    let far = |cosine: f64| (1.0 - cosine * cosine) * (most - 1.0) > ROTATED || cosine < 0.0;
    model.packs.packs.iter().zip(frames).filter(|(pack, _)| !pack.rigid).any(|(pack, frame)| {
        let [[x, ..], [_, y, _], [.., z]] = &frame.rotation;
        (0..pack.filled).any(|lane| far(0.5 * (x.0[lane] + y.0[lane] + z.0[lane] - 1.0)))
    })
}
