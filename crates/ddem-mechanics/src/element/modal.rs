//! Stiffness of an affine hex8 element in its modal basis. It has the same values as
//! [`hex8::stiffness`](super::hex8::stiffness) with 45 numbers for a box and 171 for any
//! parallelepiped.
//!
//! One displacement component is `u_i = Σ_m a_i^m ξ^{m1} η^{m2} ζ^{m3}` with eight modes
//! m ∈ {0,1}³. They are written here as the bits of a number: 1 = ξ, 2 = η, 4 = ζ, 3 = ξη, 5 = ξζ,
//! 6 = ηζ, 7 = ξηζ. With a constant Jacobian the monomials are orthogonal, so that the stiffness
//! decouples:
//!
//! | group | amplitudes | stiffness |
//! |---|---|---|
//! | strain | (i, α): component i, mode ξ_α | constant strain, 9×9 |
//! | bend | (m, i): modes ξη, ξζ, ηζ | bending and twisting, 9×9 |
//! | hour | i: mode ξηζ | 3×3 |
//!
//! The numbers include the `1/64` of the two transforms `a = ⅛ H u`, `f = ⅛ Hᵀ r`.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::Elastic;
use super::ElementKind;
use super::hex8::{CORNERS, ElementStiffness};

/// Modes with two ones, in the order of the bend group.
pub(super) const BEND: [usize; 3] = [3, 5, 6];

/// Modal stiffness of one element `[N/m]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Modal {
    /// Constant strain; rows and columns `3 i + α` for component i of mode ξ_α.
    pub strain: SMatrix<f64, 9, 9>,
    /// Bending and twisting; rows and columns `3 k + i` for component i of the k-th of the modes
    /// ξη, ξζ, ηζ.
    pub bend: SMatrix<f64, 9, 9>,
    /// Mode ξηζ; rows and columns i for component i.
    pub hour: Matrix3<f64>,
}

impl Modal {
    /// Modal stiffness of the parallelepiped with these edge vectors `[m]`.
    #[must_use]
    pub fn new(edges: &[Vector3<f64>; 3], material: &Elastic, kind: ElementKind) -> Self {
        let c = reference_stiffness(edges, material) / 64.0;
        let linear = [0, 1, 2].map(|monomial| match kind {
            ElementKind::Standard => c,
            ElementKind::Incompatible => condense(&c, monomial),
        });
        let mut bend = SMatrix::<f64, 9, 9>::zeros();
        for (monomial, linear) in linear.iter().enumerate() {
            // Modes ξ_monomial ξ_α, whose derivative along α is the monomial.
            for alpha in (0..3).filter(|&a| a != monomial) {
                for beta in (0..3).filter(|&b| b != monomial) {
                    let (m, n) = (bend_index(monomial, alpha), bend_index(monomial, beta));
                    for i in 0..3 {
                        for j in 0..3 {
                            bend[(3 * m + i, 3 * n + j)] +=
                                linear[(3 * i + alpha, 3 * j + beta)] / 3.0;
                        }
                    }
                }
            }
        }
        let hour = Matrix3::from_fn(|i, j| (0..3).map(|a| c[(3 * i + a, 3 * j + a)]).sum::<f64>());
        Self { strain: c, bend, hour: hour / 9.0 }
    }

    /// Dense stiffness `[N/m]`, shape `(24, 24)`, nodes in VTK order: `K = Hᵀ M H`.
    #[must_use]
    pub fn dense(&self) -> ElementStiffness {
        let mut modes = SMatrix::<f64, 24, 24>::zeros();
        for i in 0..3 {
            for j in 0..3 {
                for (a, m) in [1, 2, 4].into_iter().enumerate() {
                    for (b, n) in [1, 2, 4].into_iter().enumerate() {
                        modes[(3 * m + i, 3 * n + j)] = self.strain[(3 * i + a, 3 * j + b)];
                    }
                }
                for (a, m) in BEND.into_iter().enumerate() {
                    for (b, n) in BEND.into_iter().enumerate() {
                        modes[(3 * m + i, 3 * n + j)] = self.bend[(3 * a + i, 3 * b + j)];
                    }
                }
                modes[(21 + i, 21 + j)] = self.hour[(i, j)];
            }
        }
        let transform = SMatrix::<f64, 24, 24>::from_fn(|row, column| {
            let same_component = row % 3 == column % 3;
            if same_component { sign(row / 3, CORNERS[column / 3]) } else { 0.0 }
        });
        transform.transpose() * modes * transform
    }
}

/// Value of a mode at a corner.
fn sign(mode: usize, corner: [f64; 3]) -> f64 {
    (0..3).map(|k| if mode & (1 << k) == 0 { 1.0 } else { corner[k] }).product()
}

/// Index of the mode ξ_a ξ_b in the bend group.
fn bend_index(a: usize, b: usize) -> usize {
    a + b - 1
}

/// Reference stiffness `C̃_{iα jβ} = V J⁻¹_{αk} C_{ik jl} J⁻¹_{βl}`, rows and columns `3 i + α`,
/// with `C_{ik jl} = λ δ_ik δ_jl + G (δ_ij δ_kl + δ_il δ_kj)`.
fn reference_stiffness(edges: &[Vector3<f64>; 3], material: &Elastic) -> SMatrix<f64, 9, 9> {
    let jacobian = Matrix3::from_columns(edges) / 2.0;
    // An element without volume has no stiffness; NaN stops the run at once.
    let inverse = jacobian.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
    let volume = 8.0 * jacobian.determinant().abs();
    let Elastic { lambda, shear, .. } = *material;
    SMatrix::from_fn(|row, column| {
        let (i, a, j, b) = (row / 3, row % 3, column / 3, column % 3);
        let along = |p: usize, q: usize| inverse[(p, q)];
        let metric: f64 = (0..3).map(|k| along(a, k) * along(b, k)).sum();
        let same = if i == j { metric } else { 0.0 };
        volume * (lambda * along(a, i) * along(b, j) + shear * (same + along(a, j) * along(b, i)))
    })
}

/// Stiffness of the group of the monomial ξ_m with incompatible modes (Wilson–Taylor). The function
/// `1 − ξ_m²` of each component adds a gradient along m to this group. It is condensed out, because
/// its own force is zero.
fn condense(c: &SMatrix<f64, 9, 9>, m: usize) -> SMatrix<f64, 9, 9> {
    let own = Matrix3::from_fn(|i, j| c[(3 * i + m, 3 * j + m)]);
    let coupling = SMatrix::<f64, 9, 3>::from_fn(|row, j| c[(row, 3 * j + m)]);
    let inverse = own.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
    c - coupling * inverse * coupling.transpose()
}
