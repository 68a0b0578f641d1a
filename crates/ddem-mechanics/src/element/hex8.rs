//! The hex8 element of the paper, integrated by 2×2×2 Gauss points.
//!
//! Its stiffness is the reference of the tests; runs use [`modal`](super::modal) and
//! [`hexahedron`](super::hexahedron).
//!
//! ```text
//!        7-------6        node numbers: VTK order
//!       /|      /|
//!      4-------5 |        ζ
//!      | 3-----|-2        | η
//!      |/      |/         |/
//!      0-------1          o--ξ
//! ```

use nalgebra::{Matrix3, Point3, SMatrix, Vector3};

use super::Elastic;

/// Reference coordinates of the eight nodes, ±1.
pub const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Stiffness of one element `[N/m]`. Rows and columns are grouped by node, with x y z inside a
/// node.
pub type ElementStiffness = SMatrix<f64, 24, 24>;

/// Shape functions `N_a = ⅛ (1+ξξ_a)(1+ηη_a)(1+ζζ_a)` at a reference point, shape `(8)`, eq. (4).
#[doc(alias = "eq 4")]
#[must_use]
pub fn shape(at: [f64; 3]) -> [f64; 8] {
    CORNERS.map(|s| (0..3).map(|k| 1.0 + s[k] * at[k]).product::<f64>() / 8.0)
}

/// Derivatives `∂N_a/∂ξ_k` at a reference point, shape `(8, 3)`.
#[must_use]
pub fn shape_derivatives(at: [f64; 3]) -> [[f64; 3]; 8] {
    CORNERS.map(|s| {
        let f = |k: usize| 1.0 + s[k] * at[k];
        [s[0] * f(1) * f(2) / 8.0, f(0) * s[1] * f(2) / 8.0, f(0) * f(1) * s[2] / 8.0]
    })
}

/// Positions of the eight Gauss points; all weights are 1.
#[must_use]
pub fn gauss_points() -> [[f64; 3]; 8] {
    CORNERS.map(|s| s.map(|c| c / 3.0_f64.sqrt()))
}

/// Jacobian `J_ik = ∂x_i/∂ξ_k` at a reference point.
pub(super) fn jacobian(nodes: &[Point3<f64>; 8], at: [f64; 3]) -> Matrix3<f64> {
    let dn = shape_derivatives(at);
    nodes.iter().zip(dn).map(|(x, d)| x.coords * Vector3::from(d).transpose()).sum()
}

/// Strain matrix B for strains xx yy zz xy yz zx (engineering shears), shape `(6, 24)`, eq. (6),
/// and the determinant of the Jacobian, both at a reference point.
#[doc(alias = "eq 6")]
#[must_use]
pub fn strain_matrix(nodes: &[Point3<f64>; 8], at: [f64; 3]) -> (SMatrix<f64, 6, 24>, f64) {
    let jacobian = jacobian(nodes, at);
    let inverse = jacobian.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
    let mut b = SMatrix::<f64, 6, 24>::zeros();
    for (a, d) in shape_derivatives(at).into_iter().enumerate() {
        let g = inverse.transpose() * Vector3::from(d);
        for k in 0..3 {
            b[(k, 3 * a + k)] = g[k];
        }
        for (row, (i, k)) in [(0, 1), (1, 2), (2, 0)].into_iter().enumerate() {
            b[(3 + row, 3 * a + i)] = g[k];
            b[(3 + row, 3 * a + k)] = g[i];
        }
    }
    (b, jacobian.determinant())
}

/// Stiffness of one element `[N/m]`, shape `(24, 24)`, eq. (7).
///
/// ```text
/// kᵉ = ∫ Bᵀ D B dΩ ≈ Σ_q B_qᵀ D B_q |J|_q
/// ```
#[doc(alias = "eq 7")]
#[must_use]
pub fn stiffness(nodes: &[Point3<f64>; 8], material: &Elastic) -> ElementStiffness {
    let d = SMatrix::<f64, 6, 6>::from_fn(|i, k| material.matrix()[i][k]);
    gauss_points()
        .into_iter()
        .map(|q| {
            let (b, volume) = strain_matrix(nodes, q);
            b.transpose() * d * b * volume
        })
        .sum()
}

/// Lumped mass of each node `[kg]`: row sums of `∫ ρ NᵀN dV`, shape `(8)`, eq. (3).
#[doc(alias = "eq 3")]
#[must_use]
pub fn lumped_mass(nodes: &[Point3<f64>; 8], density: f64) -> [f64; 8] {
    let mut mass = [0.0; 8];
    for q in gauss_points() {
        let volume = jacobian(nodes, q).determinant();
        // Σ_b N_a N_b = N_a gives the row sum of the consistent mass.
        for (m, n) in mass.iter_mut().zip(shape(q)) {
            *m += density * n * volume;
        }
    }
    mass
}

/// Moments of the mass of one element, exact for any hexahedron: mass `[kg]`, first moments `[kg m]`
/// and second moments `∫ ρ x xᵀ dV` `[kg m²]` about the origin.
#[must_use]
pub fn mass_moments(nodes: &[Point3<f64>; 8], density: f64) -> (f64, Vector3<f64>, Matrix3<f64>) {
    // The integrand has degree 4 in each coordinate: three points are exact up to 5.
    const POINTS: [(f64, f64); 3] = [(-1.0, 5.0 / 9.0), (0.0, 8.0 / 9.0), (1.0, 5.0 / 9.0)];
    let far = 0.6_f64.sqrt();
    let (mut mass, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for number in 0..27 {
        let on = [number % 3, number / 3 % 3, number / 9].map(|k| POINTS[k]);
        let at = on.map(|(side, _)| side * far);
        let weight = on[0].1 * on[1].1 * on[2].1;
        let x: Vector3<f64> = nodes.iter().zip(shape(at)).map(|(x, n)| x.coords * n).sum();
        let part = density * weight * jacobian(nodes, at).determinant();
        mass += part;
        first += x * part;
        second += x * x.transpose() * part;
    }
    (mass, first, second)
}
