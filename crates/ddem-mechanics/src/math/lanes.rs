//! Four numbers side by side, one per block of a pack, and small vectors of them.
//!
//! Memory holds [`Lanes`]. Registers hold `f64x4` of the instruction set of the run. Every
//! operation is one IEEE operation per lane and is never fused, so that all instruction sets give
//! the same bits.

use fearless_simd::{Simd, SimdBase, SimdFrom, SimdMask, f64x4, mask64x4};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Blocks side by side in a pack.
pub const LANES: usize = 4;

/// One number for each block of a pack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[repr(C, align(32))]
pub struct Lanes(pub [f64; LANES]);

impl Lanes {
    /// Four zeros.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// Register with the four numbers.
    #[inline(always)]
    pub fn load<S: Simd>(self, simd: S) -> f64x4<S> {
        f64x4::simd_from(simd, self.0)
    }

    /// Numbers from a register.
    #[inline(always)]
    pub fn from<S: Simd>(value: f64x4<S>) -> Self {
        Self(value.into())
    }

    /// Sum over the lanes, always in the same order.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        (self.0[0] + self.0[1]) + (self.0[2] + self.0[3])
    }
}

/// Vector for each lane.
pub type Vector<S> = [f64x4<S>; 3];
/// Matrix for each lane, row by row.
pub type Matrix<S> = [[f64x4<S>; 3]; 3];

/// Register with one number in all four lanes.
#[inline(always)]
pub fn splat<S: Simd>(simd: S, value: f64) -> f64x4<S> {
    f64x4::simd_from(simd, value)
}

/// Matrix in all four lanes.
#[inline(always)]
pub fn splat_matrix<S: Simd>(simd: S, matrix: &Matrix3<f64>) -> Matrix<S> {
    // A closure would be compiled without the instruction set.
    let mut lanes = [zero(simd); 3];
    for (i, row) in lanes.iter_mut().enumerate() {
        for (k, number) in row.iter_mut().enumerate() {
            *number = splat(simd, matrix[(i, k)]);
        }
    }
    lanes
}

/// Mask that is true in some of the four lanes.
#[inline(always)]
pub fn mask_of<S: Simd>(simd: S, lanes: [bool; LANES]) -> mask64x4<S> {
    let [a, b, c, d] = lanes.map(u64::from);
    mask64x4::from_bitmask(simd, a | b << 1 | c << 2 | d << 3)
}

/// Lanes in which a mask is true.
#[inline(always)]
pub fn lanes_of<S: Simd>(mask: mask64x4<S>) -> [bool; LANES] {
    let bits = mask.to_bitmask();
    [1, 2, 4, 8].map(|lane| bits & lane != 0)
}

/// Four vectors in registers.
#[inline(always)]
pub fn load<S: Simd>(simd: S, v: &[Lanes; 3]) -> Vector<S> {
    [v[0].load(simd), v[1].load(simd), v[2].load(simd)]
}

/// Vector of the three components that start at index `at`.
#[inline(always)]
pub fn load_at<S: Simd>(simd: S, field: &[Lanes], at: usize) -> Vector<S> {
    let [x, y, z] = &field[at..at + 3] else { unreachable!() };
    [x.load(simd), y.load(simd), z.load(simd)]
}

/// Vectors of the lanes `SHIFT..SHIFT + 4` of eight lanes: four in `low`, four in `high`.
#[inline(always)]
pub fn shifted<S: Simd, const SHIFT: usize>(low: Vector<S>, high: Vector<S>) -> Vector<S> {
    if SHIFT == 0 {
        return low;
    }
    let [x, y, z] = low;
    [x.slide::<SHIFT>(high[0]), y.slide::<SHIFT>(high[1]), z.slide::<SHIFT>(high[2])]
}

/// Stores four vectors at index `at` of a field.
#[inline(always)]
pub fn store_at<S: Simd>(field: &mut [Lanes], at: usize, v: Vector<S>) {
    let [x, y, z] = &mut field[at..at + 3] else { unreachable!() };
    (*x, *y, *z) = (Lanes::from(v[0]), Lanes::from(v[1]), Lanes::from(v[2]));
}

/// Four zero vectors.
#[inline(always)]
pub fn zero<S: Simd>(simd: S) -> Vector<S> {
    [splat(simd, 0.0); 3]
}

/// Sums `a + b`.
#[inline(always)]
pub fn add<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Differences `a − b`.
#[inline(always)]
pub fn sub<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Products `a s` of vectors and numbers.
#[inline(always)]
pub fn scale<S: Simd>(a: Vector<S>, s: f64x4<S>) -> Vector<S> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// Scalar products `a · b`.
#[inline(always)]
pub fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> f64x4<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector products `a × b`.
#[inline(always)]
pub fn cross<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Products `M v` of matrices and vectors.
#[inline(always)]
pub fn times<S: Simd>(m: &Matrix<S>, v: Vector<S>) -> Vector<S> {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

/// Products `Mᵀ v` of transposed matrices and vectors.
#[inline(always)]
pub fn transposed_times<S: Simd>(m: &Matrix<S>, v: Vector<S>) -> Vector<S> {
    [
        m[0][0] * v[0] + m[1][0] * v[1] + m[2][0] * v[2],
        m[0][1] * v[0] + m[1][1] * v[1] + m[2][1] * v[2],
        m[0][2] * v[0] + m[1][2] * v[1] + m[2][2] * v[2],
    ]
}

/// Matrix products `A B`.
#[inline(always)]
pub fn product<S: Simd>(a: &Matrix<S>, b: &Matrix<S>) -> Matrix<S> {
    let mut out = *a;
    for (out, a) in out.iter_mut().zip(a) {
        *out = add(add(scale(b[0], a[0]), scale(b[1], a[1])), scale(b[2], a[2]));
    }
    out
}

/// Matrix products `Aᵀ B`.
#[inline(always)]
pub fn transposed_product<S: Simd>(a: &Matrix<S>, b: &Matrix<S>) -> Matrix<S> {
    product(&transpose(a), b)
}

/// Transposed matrices.
#[inline(always)]
pub fn transpose<S: Simd>(a: &Matrix<S>) -> Matrix<S> {
    [[a[0][0], a[1][0], a[2][0]], [a[0][1], a[1][1], a[2][1]], [a[0][2], a[1][2], a[2][2]]]
}

/// Inverse of a symmetric matrix; both are given as xx yy zz xy yz zx.
#[inline(always)]
pub fn inverse_symmetric<S: Simd>(simd: S, a: [f64x4<S>; 6]) -> [f64x4<S>; 6] {
    let [xx, yy, zz, xy, yz, zx] = a;
    let c_xx = yy * zz - yz * yz;
    let c_xy = yz * zx - xy * zz;
    let c_zx = xy * yz - yy * zx;
    let scale = splat(simd, 1.0) / (xx * c_xx + xy * c_xy + zx * c_zx);
    [
        c_xx * scale,
        (xx * zz - zx * zx) * scale,
        (xx * yy - xy * xy) * scale,
        c_xy * scale,
        (xy * zx - xx * yz) * scale,
        c_zx * scale,
    ]
}

/// Product of a symmetric matrix, given as xx yy zz xy yz zx, and a vector.
#[inline(always)]
pub fn symmetric_times<S: Simd>(a: [f64x4<S>; 6], v: Vector<S>) -> Vector<S> {
    let [xx, yy, zz, xy, yz, zx] = a;
    [
        xx * v[0] + xy * v[1] + zx * v[2],
        xy * v[0] + yy * v[1] + yz * v[2],
        zx * v[0] + yz * v[1] + zz * v[2],
    ]
}

/// Sum of a vector over the nodes of blocks with some elements along each edge. It adds by rows,
/// planes of rows, and all planes. Chains of additions are therefore short and the same for every
/// caller.
#[inline(always)]
pub fn over_nodes<S: Simd>(
    simd: S,
    divisions: usize,
    mut of: impl FnMut(usize) -> Vector<S>,
) -> Vector<S> {
    let mut sum = zero(simd);
    let mut node = 0;
    for _ in 0..=divisions {
        let mut plane = zero(simd);
        for _ in 0..=divisions {
            let mut row = zero(simd);
            for _ in 0..=divisions {
                row = add(row, of(node));
                node += 1;
            }
            plane = add(plane, row);
        }
        sum = add(sum, plane);
    }
    sum
}
