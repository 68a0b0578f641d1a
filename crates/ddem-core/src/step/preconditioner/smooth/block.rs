//! Smooth motions inside blocks: trilinear between the corners.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use crate::step::preconditioner::InverseMassRows;
use ddem_mechanics::math::lanes::{Lanes, add, load, load_at, scale, splat, store_at, sub, zero};

/// Number of corners of a block.
pub(super) const CORNERS: usize = 8;

/// Vectors at the corners of the blocks of a pack, numbered by bits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CornerVectors(pub(super) [[Lanes; 3]; CORNERS]);

/// Forces on the corners of blocks of `n` divisions that do the same work as the forces `f` on
/// their nodes, tied ones by their shares. Held degrees of freedom and absent nodes, which have no
/// inverse mass, do not take part.
#[simd]
pub(super) fn corner_forces<S: Simd>(
    simd: S,
    class: &InverseMassRows,
    n: usize,
    f: &[Lanes],
    shares: Option<&[Lanes]>,
    out: &mut CornerVectors,
) {
    let mut corners = [zero(simd); CORNERS];
    let step = 1.0 / n as f64;
    let side = n + 1;
    for row in 0..side * side {
        let (mut all, mut upper) = (zero(simd), zero(simd));
        for i in 0..side {
            let node = row * side + i;
            let mut force = class.free(simd, node, load_at(simd, f, 3 * node));
            if let Some(shares) = shares {
                force = scale(force, shares[node].load(simd));
            }
            all = add(all, force);
            upper = add(upper, scale(force, splat(simd, i as f64 * step)));
        }
        let ends = [sub(all, upper), upper];
        let (y, z) = ((row % side) as f64 * step, (row / side) as f64 * step);
        for (pair, weight) in weights(y, z).into_iter().enumerate() {
            let weight = splat(simd, weight);
            corners[2 * pair] = add(corners[2 * pair], scale(ends[0], weight));
            corners[2 * pair + 1] = add(corners[2 * pair + 1], scale(ends[1], weight));
        }
    }
    for (out, corner) in out.0.iter_mut().zip(corners) {
        store_at(out, 0, corner);
    }
}

/// Adds the motion of the corners to that of the free nodes of blocks of `n` divisions. If these are
/// tied, n is 1.
#[simd]
pub(super) fn add_motion<S: Simd>(
    simd: S,
    class: &InverseMassRows,
    n: usize,
    is_tied: bool,
    corners: &CornerVectors,
    out: &mut [Lanes],
) {
    let step = 1.0 / n as f64;
    let side = n + 1;
    for row in 0..side * side {
        let mut ends = [zero(simd); 2];
        let (y, z) = ((row % side) as f64 * step, (row / side) as f64 * step);
        for (pair, weight) in weights(y, z).into_iter().enumerate() {
            let weight = splat(simd, weight);
            for (end, corner) in ends.iter_mut().zip(&corners.0[2 * pair..]) {
                *end = add(*end, scale(load(simd, corner), weight));
            }
        }
        let across = sub(ends[1], ends[0]);
        for i in 0..side {
            let node = row * side + i;
            // Tied nodes move alike, to the bit.
            let moved = if is_tied && i == n {
                ends[1]
            } else {
                add(ends[0], scale(across, splat(simd, i as f64 * step)))
            };
            let moved = class.free(simd, node, moved);
            store_at(out, 3 * node, add(load_at(simd, out, 3 * node), moved));
        }
    }
}

/// Weights of the four edges along the first direction, at fractions of the two others.
#[inline(always)]
fn weights(y: f64, z: f64) -> [f64; 4] {
    [(1.0 - y) * (1.0 - z), y * (1.0 - z), (1.0 - y) * z, y * z]
}
