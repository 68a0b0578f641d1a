//! Hexahedron of any shape, for blocks that are no parallelepipeds.
//!
//! Constant strain acts through the mean gradient of the trilinear functions, so that linear fields
//! are exact on every mesh. What remains of a displacement has the bending stiffness of the
//! parallelepiped with the Jacobian of the centre. For a parallelepiped this is the element of
//! [`Modal`].
//!
//! With the modes `a = H u` and `X = H x` of displacements and corners, numbered as in
//! [`modal`](super::modal), the force is
//!
//! ```text
//! g_ik = Σ_m a_i^m b_mk / V             b_mk = ∫ ∂φ_m/∂x_k dV / 8, m = 1 … 7
//! h_i^m = a_i^m − X_k^m g_ik            m = 3, 5, 6, 7; zero for every linear field
//! q = (bend ⊕ hour) h
//! t_ik = σ_ik(g) − Σ_m X_k^m q_i^m / V
//! r_i^m = b_mk t_ik + q_i^m             f = Hᵀ r
//! ```

mod nodal;

use std::ops::{Add, Sub};

use fearless_simd::{Simd, f64x4};
use nalgebra::{Matrix3, Point3, SMatrix, Vector3};

use super::hex8::{gauss_points, jacobian};
use super::modal::{BEND, Modal};
use super::{Elastic, ElementKind};
use crate::math::lanes::{LANES, Lanes, Vector, dot, load, splat, symmetric_times, zero};

/// Largest Poisson's ratio of the bending stiffness of incompatible elements. With a higher one a
/// distorted element would resist bending by its volume.
pub(super) const MOST_POISSON: f64 = 0.3;
/// Corners with x fastest, by their numbers in VTK's order.
const IN_ORDER: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];
/// Corners at the ends of the edges along ξ, then η, then ζ, whose sums and differences are `H`.
#[rustfmt::skip]
const ENDS: [[usize; 2]; 12] = [
    [0, 1], [2, 3], [4, 5], [6, 7],
    [0, 2], [1, 3], [4, 6], [5, 7],
    [0, 4], [1, 5], [2, 6], [3, 7],
];
/// Modes beyond the linear ones.
const WARPING: [usize; 4] = [BEND[0], BEND[1], BEND[2], 7];
/// Entries of a symmetric matrix of nine rows, row by row.
const PAIRS: usize = 45;

/// Constants of one hexahedron.
#[derive(Clone, Debug, PartialEq)]
pub struct HexahedronElement {
    /// Volume `V` `[m³]`.
    pub volume: f64,
    /// Integrals `b` of the gradients of the modes ξ, η, ξη, ζ, ξζ, ηζ, ξηζ `[m²]`, shape (7, 3).
    gradient: [[f64; 3]; 7],
    /// Amplitudes `X` of the corners in the modes ξη, ξζ, ηζ, ξηζ `[m]`, shape (4, 3).
    warp: [[f64; 3]; 4],
    /// Stiffness of the modes ξη, ξζ, ηζ, as in [`Modal`].
    bend: SMatrix<f64, 9, 9>,
    /// Stiffness of the mode ξηζ.
    hour: Matrix3<f64>,
    material: Elastic,
}

impl HexahedronElement {
    /// Constants of the element with these corners in VTK's order `[m]`; `None` if its volume or its
    /// Jacobian at the centre is not positive.
    #[must_use]
    pub fn new(corners: &[Vector3<f64>; 8], material: &Elastic, kind: ElementKind) -> Option<Self> {
        let mut modes = IN_ORDER.map(|corner| corners[corner]);
        amplitudes(&mut modes);
        let edges = [modes[1], modes[2], modes[4]].map(|x| x / 4.0);
        let centre = edges[0].cross(&edges[1]).dot(&edges[2]);
        let nodes = corners.map(Point3::from);
        let mut volume = 0.0;
        let mut gradient = [Vector3::zeros(); 7];
        for at in gauss_points() {
            let jacobian = jacobian(&nodes, at);
            volume += jacobian.determinant();
            for (mode, gradient) in (1..8).zip(&mut gradient) {
                *gradient += cofactors(&jacobian) * mode_derivatives(mode, at) / 8.0;
            }
        }
        let sound = volume > 0.0 && centre > 0.0 && volume.is_finite();
        let capped = Elastic { lambda: capped_lambda(material), ..*material };
        let stiffness = match kind {
            ElementKind::Standard => Modal::new(&edges, material, kind),
            ElementKind::Incompatible => Modal::new(&edges, &capped, kind),
        };
        sound.then(|| Self {
            volume,
            gradient: gradient.map(Into::into),
            warp: WARPING.map(|mode| modes[mode].into()),
            bend: stiffness.bend * (volume / centre),
            hour: stiffness.hour * (volume / centre),
            material: *material,
        })
    }
}

/// Least scaled Jacobian at the corners of a hexahedron with these corners in VTK's order: the volume
/// of the unit vectors along the three edges that meet there, 1 for right angles. Corners at which an
/// edge has no length do not count.
#[must_use]
pub fn scaled_jacobian(corners: &[Vector3<f64>; 8]) -> f64 {
    let corners = IN_ORDER.map(|corner| corners[corner]);
    let at = |corner: usize| {
        let edge = |d: usize| {
            let [low, high] = [corner & !(1 << d), corner | 1 << d];
            (corners[high] - corners[low]).try_normalize(0.0)
        };
        Some(edge(0)?.cross(&edge(1)?).dot(&edge(2)?))
    };
    (0..8).filter_map(at).fold(1.0, f64::min)
}

/// λ of a material with the same G, `[Pa]`, and ν of at most [`MOST_POISSON`].
pub(super) fn capped_lambda(material: &Elastic) -> f64 {
    let most = 2.0 * material.shear * MOST_POISSON / (1.0 - 2.0 * MOST_POISSON);
    material.lambda.min(most)
}

/// Cofactors `|J| J⁻ᵀ`.
fn cofactors(jacobian: &Matrix3<f64>) -> Matrix3<f64> {
    let column = |k: usize| jacobian.column(k).into_owned();
    let [x, y, z] = [column(0), column(1), column(2)];
    Matrix3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)])
}

/// Derivatives of a mode by ξ, η, ζ at a reference point.
fn mode_derivatives(mode: usize, at: [f64; 3]) -> Vector3<f64> {
    let has = |k: usize| mode & (1 << k) != 0;
    let without = |k: usize| (0..3).filter(|&l| l != k && has(l)).map(|l| at[l]).product::<f64>();
    Vector3::from_fn(|k, _| if has(k) { without(k) } else { 0.0 })
}

/// Amplitudes `a = H u` of the modes, from the values at the corners with x fastest.
#[inline(always)]
fn amplitudes<T: Copy + Add<Output = T> + Sub<Output = T>>(values: &mut [T; 8]) {
    for [low, high] in ENDS {
        let (a, b) = (values[low], values[high]);
        (values[low], values[high]) = (a + b, b - a);
    }
}

/// Forces `f = Hᵀ r` at the corners, from those on the modes.
#[inline(always)]
fn at_corners<T: Copy + Add<Output = T> + Sub<Output = T>>(values: &mut [T; 8]) {
    for [low, high] in ENDS {
        let (a, b) = (values[low], values[high]);
        (values[low], values[high]) = (a - b, a + b);
    }
}

/// Constants of four hexahedra side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct HexahedronTable {
    gradient: [[Lanes; 3]; 7],
    warp: [[Lanes; 3]; 4],
    bend: [Lanes; PAIRS],
    hour: [Lanes; 6],
    /// λ and G `[Pa]`, and 1/V `[m⁻³]`.
    constants: [Lanes; 3],
}

impl HexahedronTable {
    /// Table of four elements; `None` is a lane without an element.
    #[must_use]
    pub fn new(lanes: [Option<&HexahedronElement>; LANES]) -> Self {
        let pick = |f: &dyn Fn(&HexahedronElement) -> f64| Lanes(lanes.map(|of| of.map_or(0.0, f)));
        let mut bend = [Lanes::ZERO; PAIRS];
        let pairs = (0..9).flat_map(|row| (row..9).map(move |column| (row, column)));
        for (entry, at) in bend.iter_mut().zip(pairs) {
            *entry = pick(&|of| of.bend[at]);
        }
        let hour = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];
        Self {
            gradient: std::array::from_fn(|m| [0, 1, 2].map(|k| pick(&|of| of.gradient[m][k]))),
            warp: std::array::from_fn(|m| [0, 1, 2].map(|k| pick(&|of| of.warp[m][k]))),
            bend,
            hour: hour.map(|at| pick(&|of| of.hour[at])),
            constants: [
                pick(&|of| of.material.lambda),
                pick(&|of| of.material.shear),
                pick(&|of| 1.0 / of.volume),
            ],
        }
    }
}

/// Forces `f = K u` at the corners of four elements `[N]`, in VTK's order, from their displacements
/// `[m]`.
#[inline(always)]
pub fn force<S: Simd>(simd: S, table: &HexahedronTable, u: &[Vector<S>; 8]) -> [Vector<S>; 8] {
    let [lambda, shear, per_volume] = load(simd, &table.constants);
    let nothing = splat(simd, 0.0);
    let mut a = [[nothing; 8]; 3];
    let mut gradient = [[nothing; 3]; 3];
    for i in 0..3 {
        for at in 0..8 {
            a[i][at] = u[IN_ORDER[at]][i];
        }
        amplitudes(&mut a[i]);
        for (k, gradient) in gradient[i].iter_mut().enumerate() {
            let mut sum = nothing;
            for m in 0..7 {
                sum += a[i][m + 1] * table.gradient[m][k].load(simd);
            }
            *gradient = sum * per_volume;
        }
    }
    let q = warping_force(simd, table, &a, &gradient);
    let mut t = stress(lambda, shear, &gradient);
    for (i, t) in t.iter_mut().enumerate() {
        for (k, t) in t.iter_mut().enumerate() {
            let mut sum = nothing;
            for (warp, q) in table.warp.iter().zip(&q) {
                sum += warp[k].load(simd) * q[i];
            }
            *t -= sum * per_volume;
        }
    }
    let mut f = [zero(simd); 8];
    for i in 0..3 {
        let mut r = [nothing; 8];
        for m in 0..7 {
            r[m + 1] = dot(load(simd, &table.gradient[m]), t[i]);
        }
        for m in 0..4 {
            r[WARPING[m]] += q[m][i];
        }
        at_corners(&mut r);
        for at in 0..8 {
            f[IN_ORDER[at]][i] = r[at];
        }
    }
    f
}

/// Forces `q` on the modes beyond the linear ones.
#[inline(always)]
fn warping_force<S: Simd>(
    simd: S,
    table: &HexahedronTable,
    a: &[[f64x4<S>; 8]; 3],
    gradient: &[[f64x4<S>; 3]; 3],
) -> [Vector<S>; 4] {
    let mut h = [zero(simd); 4];
    for m in 0..4 {
        let warp = load(simd, &table.warp[m]);
        for i in 0..3 {
            h[m][i] = a[i][WARPING[m]] - dot(warp, gradient[i]);
        }
    }
    let mut bend = [splat(simd, 0.0); 9];
    let mut entry = 0;
    for row in 0..9 {
        for column in row..9 {
            let stiffness = table.bend[entry].load(simd);
            entry += 1;
            bend[row] += stiffness * h[column / 3][column % 3];
            if column > row {
                bend[column] += stiffness * h[row / 3][row % 3];
            }
        }
    }
    let [xx, yy, zz, xy, yz, zx] = &table.hour;
    let ([xx, yy, zz], [xy, yz, zx]) = (load(simd, &[*xx, *yy, *zz]), load(simd, &[*xy, *yz, *zx]));
    let hour = symmetric_times([xx, yy, zz, xy, yz, zx], h[3]);
    let [x0, y0, z0, x1, y1, z1, x2, y2, z2] = bend;
    [[x0, y0, z0], [x1, y1, z1], [x2, y2, z2], hour]
}

/// Stress `σ_ik = λ δ_ik g_jj + G (g_ik + g_ki)` `[Pa]`, shape (3, 3).
#[inline(always)]
pub(super) fn stress<S: Simd>(
    lambda: f64x4<S>,
    shear: f64x4<S>,
    gradient: &[[f64x4<S>; 3]; 3],
) -> [[f64x4<S>; 3]; 3] {
    let g = gradient;
    let volume = lambda * (g[0][0] + g[1][1] + g[2][2]);
    let mut stress = [[volume; 3]; 3];
    for i in 0..3 {
        stress[i][i] += shear * (g[i][i] + g[i][i]);
        let k = (i + 1) % 3;
        let tau = shear * (g[i][k] + g[k][i]);
        (stress[i][k], stress[k][i]) = (tau, tau);
    }
    stress
}

#[cfg(test)]
pub(crate) mod tests;
