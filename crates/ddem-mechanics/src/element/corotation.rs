//! Rotation of a block, `F̄ = Σ w_i (x_i − x̄) X_iᵀ = R S`, and the forces due to its derivative
//! (§3).
//!
//! All functions act on four blocks at a time. The weights are equal, `w_i = 1/N`. On a lattice of
//! nodes `F̄ = J + Σ_d m_d h_dᵀ`, with the edge vectors `h_d` of one element and the first moments
//! `m_d = Σ w_i (i_d − n/2) u_i`. Here `J = Σ w_i X_i X_iᵀ = v Σ_d h_d h_dᵀ` and `v = n(n+2)/12`.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, f64x4};

use crate::math::lanes::{
    Lanes, Matrix, Vector, add, cross, dot, inverse_symmetric, load, product, scale, splat, sub,
    symmetric_times, times, transpose, transposed_product, transposed_times,
};

/// Frames of four blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Rotation R, row by row.
    pub rotation: [[Lanes; 3]; 3],
    /// Mean displacement ū.
    pub mean: [Lanes; 3],
    /// `(tr(S) 1 − S)⁻¹` as xx yy zz xy yz zx.
    pub(super) inverse: [Lanes; 6],
}

impl Frame {
    /// Frames of blocks that have not rotated; `inverse` is not used then.
    pub const REST: Self = {
        let (o, i) = (Lanes::ZERO, Lanes([1.0; 4]));
        Self { rotation: [[i, o, o], [o, i, o], [o, o, i]], mean: [o; 3], inverse: [o; 6] }
    };

    /// Rotation R, row by row.
    #[inline(always)]
    pub fn matrix<S: Simd>(&self, simd: S) -> Matrix<S> {
        let [x, y, z] = &self.rotation;
        [load(simd, x), load(simd, y), load(simd, z)]
    }
}

/// Frames of four blocks from the mean and the first moments of their displacements.
#[inline(always)]
pub fn fit<S: Simd>(
    simd: S,
    divisions: usize,
    edges: &[[Lanes; 3]; 3],
    mean: Vector<S>,
    moments: [Vector<S>; 3],
) -> Frame {
    let n = divisions as f64;
    let spread = splat(simd, n * (n + 2.0) / 12.0);
    let h = [load(simd, &edges[0]), load(simd, &edges[1]), load(simd, &edges[2])];
    // Columns v h_d + m_d: the deformed edges, which give the first guess of the rotation.
    let deformed = std::array::from_fn(|d| add(scale(h[d], spread), moments[d]));
    // F̄ = Σ_d deformed_d h_dᵀ.
    let f = transposed_product(&deformed, &h);
    // Orthonormal frames of the deformed and of the reference edges: R₀ = E eᵀ.
    let (now, reference) = (orthonormal(simd, deformed), orthonormal(simd, h));
    let mut r = transposed_product(&now, &reference);
    // M = RᵀF̄ = (δR) S: the axial vector of M − Mᵀ is (tr(S) 1 − S) θ. The error of the guess is
    // of the order of the strain, and each correction cubes it. Three corrections reach rounding
    // for any strain of rock.
    for _ in 0..3 {
        let m = transposed_product(&r, &f);
        let axial = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
        let theta = symmetric_times(inverse_symmetric(simd, trace_minus(&m)), axial);
        r = product(&r, &small_rotation(simd, theta));
    }
    let inverse = inverse_symmetric(simd, trace_minus(&transposed_product(&r, &f)));
    Frame {
        rotation: r.map(|row| row.map(Lanes::from)),
        mean: mean.map(Lanes::from),
        inverse: inverse.map(Lanes::from),
    }
}

/// `tr(S) 1 − S` with S the symmetric part of M, as xx yy zz xy yz zx.
#[inline(always)]
fn trace_minus<S: Simd>(m: &Matrix<S>) -> [f64x4<S>; 6] {
    let [xx, yy, zz] = [m[0][0], m[1][1], m[2][2]];
    let xy = (m[0][1] + m[1][0]) * -0.5;
    let yz = (m[1][2] + m[2][1]) * -0.5;
    let zx = (m[2][0] + m[0][2]) * -0.5;
    [yy + zz, zz + xx, xx + yy, xy, yz, zx]
}

/// Gram–Schmidt frame of three vectors, one vector in each row.
#[inline(always)]
fn orthonormal<S: Simd>(simd: S, v: [Vector<S>; 3]) -> Matrix<S> {
    let a = unit(simd, v[0]);
    let b = unit(simd, sub(v[1], scale(a, dot(a, v[1]))));
    [a, b, cross(a, b)]
}

#[inline(always)]
fn unit<S: Simd>(simd: S, v: Vector<S>) -> Vector<S> {
    scale(v, splat(simd, 1.0) / dot(v, v).sqrt())
}

/// Rotation of the quaternion (1, θ/2), normalised.
#[inline(always)]
fn small_rotation<S: Simd>(simd: S, theta: Vector<S>) -> Matrix<S> {
    let p = scale(theta, splat(simd, 0.5));
    let two = splat(simd, 2.0) / (dot(p, p) + 1.0);
    let [x, y, z] = p;
    let one = splat(simd, 1.0);
    [
        [one - two * (y * y + z * z), two * (x * y - z), two * (x * z + y)],
        [two * (x * y + z), one - two * (x * x + z * z), two * (y * z - x)],
        [two * (x * z - y), two * (y * z + x), one - two * (x * x + y * y)],
    ]
}

/// `R − 1`, accurate relative to its own size: small rotations lose no digits.
///
/// Columns have length 1, so that `R_ii − 1 = −Σ_{k≠i} R_ki² / (1 + R_ii)`.
#[inline(always)]
pub fn minus_one<S: Simd>(simd: S, r: &Matrix<S>) -> Matrix<S> {
    let mut out = *r;
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let close = (r[j][i] * r[j][i] + r[k][i] * r[k][i]) / (r[i][i] + 1.0);
        let near = r[i][i].simd_gt(splat(simd, 0.0));
        out[i][i] = near.select(-close, r[i][i] - 1.0);
    }
    out
}

/// Rotation nearest to a sum of `count` rotations that are close to each other.
///
/// Three Newton–Schulz steps act on their mean. Its error is θ² at first, and each step squares it.
#[inline(always)]
pub fn mean_rotation<S: Simd>(simd: S, sum: &Matrix<S>, count: f64) -> Matrix<S> {
    let share = splat(simd, 1.0 / count);
    let [x, y, z] = *sum;
    let mut r = [scale(x, share), scale(y, share), scale(z, share)];
    for _ in 0..3 {
        let mut m = transposed_product(&r, &r);
        for (i, row) in m.iter_mut().enumerate() {
            for (k, x) in row.iter_mut().enumerate() {
                *x = *x * -0.5 + if i == k { 1.5 } else { 0.0 };
            }
        }
        r = product(&r, &m);
    }
    r
}

/// Torques on two blocks that are equivalent to a torque on their frame of mean rotation. They do
/// the same work as the torque on the frame, for any relative rotation of the blocks.
///
/// With `Q_k = R_k Rᵀ` and `S = Σ Q_k`, block rotations `α_k` rotate the frame by
/// `(tr(S) 1 − S)⁻¹ Σ (tr(Q_k) 1 − Q_k) α_k`. For equal rotations that is half of each. Blocks that
/// are rotated by π against each other, long after their joint has failed, have no mean rotation.
/// Even then the torques are zero if the torque on the frame is zero.
#[inline(always)]
pub fn split_torque<S: Simd>(
    simd: S,
    blocks: &[Matrix<S>; 2],
    frame: &Matrix<S>,
    torque: Vector<S>,
) -> [Vector<S>; 2] {
    let turned = transpose(frame);
    let parts = [product(&blocks[0], &turned), product(&blocks[1], &turned)];
    let mut sum = parts[0];
    for (row, more) in sum.iter_mut().zip(&parts[1]) {
        *row = add(*row, *more);
    }
    let nothing = splat(simd, 0.0);
    let some = dot(torque, torque).simd_gt(nothing);
    let inner = symmetric_times(inverse_symmetric(simd, trace_minus(&sum)), torque);
    let inner = inner.map(|x| some.select(x, nothing));
    parts.map(|q| {
        let trace = q[0][0] + q[1][1] + q[2][2];
        sub(scale(inner, trace), transposed_times(&q, inner))
    })
}

/// Coefficients `c_d` of the nodal forces due to the derivative of R, `R (w X_i × q)` with
/// `q = (tr(S) 1 − S)⁻¹ Rᵀ T`. T is the residual torque. A node at lattice steps `s_d` from the
/// centre has the force `Σ_d s_d c_d`.
#[inline(always)]
pub fn torque_forces<S: Simd>(
    simd: S,
    divisions: usize,
    edges: &[[Lanes; 3]; 3],
    frame: &Frame,
    torque: Vector<S>,
) -> [Vector<S>; 3] {
    let r = frame.matrix(simd);
    let [xx, yy, zz, xy, yz, zx] = &frame.inverse;
    let (xx, yy, zz) = (xx.load(simd), yy.load(simd), zz.load(simd));
    let (xy, yz, zx) = (xy.load(simd), yz.load(simd), zx.load(simd));
    let q = symmetric_times([xx, yy, zz, xy, yz, zx], transposed_times(&r, torque));
    let weight = splat(simd, 1.0 / (divisions as f64 + 1.0).powi(3));
    let mut forces = [q; 3];
    for d in 0..3 {
        forces[d] = times(&r, scale(cross(load(simd, &edges[d]), q), weight));
    }
    forces
}
