//! Internal force of a lattice of equal elements, four lattices at a time.
//!
//! One kernel serves a block of n×n×n elements, a face joint n×n×1, a strip n×1×1 and a corner
//! 1×1×1. Each plane of nodes is transformed to its modes in (ξ, η) once and serves the two
//! adjacent layers of elements. A layer takes sums and differences of two planes, the products of
//! [`ElementTable`], and the transposed sums and differences. Each plane is transformed back to its
//! nodes once.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use super::table::{BoxTable, ElementTable, ObliqueTable};
use crate::math::lanes::{Lanes, load, splat, symmetric_times};

/// Workspace of [`force`] for one task.
#[derive(Debug, Default)]
pub struct Planes {
    /// Sums and differences along ξ of each row of one plane.
    rows: Vec<Lanes>,
    /// Modes (1, ξ, η, ξη) of the element columns in the lower and the upper plane.
    modes: [Vec<Lanes>; 2],
    /// Modal forces of the two planes.
    forces: [Vec<Lanes>; 2],
}

impl Planes {
    fn reserve(&mut self, [nx, ny, _]: [usize; 3]) {
        let (rows, columns) = (6 * nx * (ny + 1), 12 * nx * ny);
        if self.rows.len() < rows {
            self.rows.resize(rows, Lanes::ZERO);
        }
        for plane in self.modes.iter_mut().chain(&mut self.forces) {
            if plane.len() < columns {
                plane.resize(columns, Lanes::ZERO);
            }
        }
    }
}

/// Computes `g = K u` of four lattices of `dims` elements. `u` and `g` hold three components a
/// node, with nodes x fastest: shape `((nx+1)(ny+1)(nz+1), 3)`.
pub fn force<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &ElementTable,
    u: &[Lanes],
    g: &mut [Lanes],
    planes: &mut Planes,
) {
    planes.reserve(dims);
    match table {
        ElementTable::Box(table) => force_box(simd, dims, table, u, g, planes),
        ElementTable::Oblique(table) => force_oblique(simd, dims, table, u, g, planes),
    }
}

/// Computes [`force`] of the elements that are left. `alive` is 1 for these and 0 for the others,
/// by element (x fastest) and lattice.
pub fn force_left<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &ElementTable,
    alive: &[Lanes],
    u: &[Lanes],
    g: &mut [Lanes],
    planes: &mut Planes,
) {
    planes.reserve(dims);
    match table {
        ElementTable::Box(table) => force_box_left(simd, dims, table, alive, u, g, planes),
        ElementTable::Oblique(table) => force_oblique_left(simd, dims, table, alive, u, g, planes),
    }
}

#[simd]
fn force_box<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &BoxTable,
    u: &[Lanes],
    g: &mut [Lanes],
    planes: &mut Planes,
) {
    sweep(simd, dims, u, g, planes, |_, lower, upper, f_lower, f_upper| {
        box_element(simd, table, lower, upper, f_lower, f_upper);
    });
}

#[simd]
fn force_box_left<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &BoxTable,
    alive: &[Lanes],
    u: &[Lanes],
    g: &mut [Lanes],
    planes: &mut Planes,
) {
    sweep(simd, dims, u, g, planes, |element, lower, upper, f_lower, f_upper| {
        let (lower, upper) = (left(simd, lower, alive[element]), left(simd, upper, alive[element]));
        box_element(simd, table, &lower, &upper, f_lower, f_upper);
    });
}

#[simd]
fn force_oblique<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &ObliqueTable,
    u: &[Lanes],
    g: &mut [Lanes],
    planes: &mut Planes,
) {
    sweep(simd, dims, u, g, planes, |_, lower, upper, f_lower, f_upper| {
        oblique_element(simd, table, lower, upper, f_lower, f_upper);
    });
}

#[simd]
fn force_oblique_left<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &ObliqueTable,
    alive: &[Lanes],
    u: &[Lanes],
    g: &mut [Lanes],
    planes: &mut Planes,
) {
    sweep(simd, dims, u, g, planes, |element, lower, upper, f_lower, f_upper| {
        let (lower, upper) = (left(simd, lower, alive[element]), left(simd, upper, alive[element]));
        oblique_element(simd, table, &lower, &upper, f_lower, f_upper);
    });
}

/// Nodal values of an element; zero if it has failed.
#[inline(always)]
fn left<S: Simd>(simd: S, column: &ColumnNodes, alive: Lanes) -> ColumnNodes {
    let alive = alive.load(simd);
    let mut out = *column;
    for out in &mut out {
        *out = Lanes::from(out.load(simd) * alive);
    }
    out
}

/// Modes (1, ξ, η, ξη) × three components of one element column in one plane.
type ColumnNodes = [Lanes; 12];

#[inline(always)]
fn sweep<S: Simd>(
    simd: S,
    dims: [usize; 3],
    u: &[Lanes],
    g: &mut [Lanes],
    planes: &mut Planes,
    element: impl Fn(usize, &ColumnNodes, &ColumnNodes, &mut ColumnNodes, &mut ColumnNodes),
) {
    let [nx, ny, nz] = dims;
    let plane_nodes = 3 * (nx + 1) * (ny + 1);
    let Planes { rows, modes: [lower, upper], forces: [f_lower, f_upper] } = planes;
    let rows = &mut rows[..6 * nx * (ny + 1)];
    let (mut lower, mut upper) = (&mut lower[..12 * nx * ny], &mut upper[..12 * nx * ny]);
    let (mut f_lower, mut f_upper) = (&mut f_lower[..12 * nx * ny], &mut f_upper[..12 * nx * ny]);
    to_modes(simd, [nx, ny], &u[..plane_nodes], rows, lower);
    f_lower.fill(Lanes::ZERO);
    for k in 0..nz {
        let next = (k + 1) * plane_nodes..(k + 2) * plane_nodes;
        to_modes(simd, [nx, ny], &u[next], rows, upper);
        let columns = lower.as_chunks::<12>().0.iter().zip(upper.as_chunks::<12>().0);
        let targets =
            f_lower.as_chunks_mut::<12>().0.iter_mut().zip(f_upper.as_chunks_mut::<12>().0);
        for (column, ((lower, upper), (f_lower, f_upper))) in columns.zip(targets).enumerate() {
            element(k * nx * ny + column, lower, upper, f_lower, f_upper);
        }
        let done = k * plane_nodes..(k + 1) * plane_nodes;
        to_nodes(simd, [nx, ny], f_lower, rows, &mut g[done]);
        std::mem::swap(&mut lower, &mut upper);
        std::mem::swap(&mut f_lower, &mut f_upper);
    }
    let last = nz * plane_nodes..(nz + 1) * plane_nodes;
    to_nodes(simd, [nx, ny], f_lower, rows, &mut g[last]);
}

/// Transforms one plane of nodes to the modes (1, ξ, η, ξη) of its element columns.
#[inline(always)]
fn to_modes<S: Simd>(
    simd: S,
    [nx, ny]: [usize; 2],
    u: &[Lanes],
    rows: &mut [Lanes],
    modes: &mut [Lanes],
) {
    let row_nodes = 3 * (nx + 1);
    for (row, out) in u.chunks_exact(row_nodes).zip(rows.chunks_exact_mut(6 * nx)) {
        for (i, out) in out.as_chunks_mut::<6>().0.iter_mut().enumerate() {
            let Some(pair) = row[3 * i..].first_chunk::<6>() else { return };
            for c in 0..3 {
                let (a, b) = (pair[c].load(simd), pair[c + 3].load(simd));
                out[c] = Lanes::from(b + a);
                out[c + 3] = Lanes::from(b - a);
            }
        }
    }
    for j in 0..ny {
        let (low, high) = rows[6 * nx * j..6 * nx * (j + 2)].split_at(6 * nx);
        let out = modes[12 * nx * j..12 * nx * (j + 1)].as_chunks_mut::<12>().0;
        for ((a, b), out) in low.as_chunks::<6>().0.iter().zip(high.as_chunks::<6>().0).zip(out) {
            for c in 0..6 {
                let (a, b) = (a[c].load(simd), b[c].load(simd));
                out[c] = Lanes::from(b + a);
                out[c + 6] = Lanes::from(b - a);
            }
        }
    }
}

/// Transforms modal forces of the element columns to nodal forces: the transpose of [`to_modes`].
#[inline(always)]
fn to_nodes<S: Simd>(
    simd: S,
    [nx, ny]: [usize; 2],
    modes: &[Lanes],
    rows: &mut [Lanes],
    g: &mut [Lanes],
) {
    // A row of nodes has a row of elements above it, below it, or both.
    let row = |j: usize| modes[12 * nx * j..12 * nx * (j + 1)].as_chunks::<12>().0;
    for (j, out) in rows.chunks_exact_mut(6 * nx).enumerate() {
        let out = out.as_chunks_mut::<6>().0;
        if j == 0 {
            for (out, up) in out.iter_mut().zip(row(0)) {
                *out = lower_half(simd, up);
            }
        } else if j == ny {
            for (out, down) in out.iter_mut().zip(row(ny - 1)) {
                *out = upper_half(simd, down);
            }
        } else {
            for ((out, down), up) in out.iter_mut().zip(row(j - 1)).zip(row(j)) {
                *out = plus(simd, upper_half(simd, down), lower_half(simd, up));
            }
        }
    }
    for (row, out) in rows.chunks_exact(6 * nx).zip(g.chunks_exact_mut(3 * (nx + 1))) {
        let (row, out) = (row.as_chunks::<6>().0, out.as_chunks_mut::<3>().0);
        out[0] = lower_half(simd, &row[0]);
        for (out, pair) in out[1..].iter_mut().zip(row.windows(2)) {
            *out = plus(simd, upper_half(simd, &pair[0]), lower_half(simd, &pair[1]));
        }
        out[nx] = upper_half(simd, &row[nx - 1]);
    }
}

/// Contribution of sums and differences to the lower node: first half minus second.
#[inline(always)]
fn lower_half<S: Simd, const N: usize, const M: usize>(simd: S, m: &[Lanes; N]) -> [Lanes; M] {
    let mut out = [Lanes::ZERO; M];
    for c in 0..M {
        out[c] = Lanes::from(m[c].load(simd) - m[c + M].load(simd));
    }
    out
}

/// Contribution of sums and differences to the upper node: first half plus second.
#[inline(always)]
fn upper_half<S: Simd, const N: usize, const M: usize>(simd: S, m: &[Lanes; N]) -> [Lanes; M] {
    let mut out = [Lanes::ZERO; M];
    for c in 0..M {
        out[c] = Lanes::from(m[c].load(simd) + m[c + M].load(simd));
    }
    out
}

#[inline(always)]
fn plus<S: Simd, const M: usize>(simd: S, a: [Lanes; M], b: [Lanes; M]) -> [Lanes; M] {
    let mut out = [Lanes::ZERO; M];
    for c in 0..M {
        out[c] = Lanes::from(a[c].load(simd) + b[c].load(simd));
    }
    out
}

/// Sums and differences of two planes: amplitudes of the modes without ζ and with ζ.
#[inline(always)]
fn amplitudes<S: Simd>(
    simd: S,
    lower: &ColumnNodes,
    upper: &ColumnNodes,
) -> ([f64x4<S>; 12], [f64x4<S>; 12]) {
    let (mut sum, mut difference) = ([splat(simd, 0.0); 12], [splat(simd, 0.0); 12]);
    for k in 0..12 {
        let (upper, lower) = (upper[k].load(simd), lower[k].load(simd));
        (sum[k], difference[k]) = (upper + lower, upper - lower);
    }
    (sum, difference)
}

/// Adds modal forces to the lower plane and sets those of the upper plane: the transpose of
/// [`amplitudes`]. The mode 000 carries no force.
#[inline(always)]
fn give<S: Simd>(
    simd: S,
    sum: &[f64x4<S>; 9],
    difference: &[f64x4<S>; 12],
    f_lower: &mut ColumnNodes,
    f_upper: &mut ColumnNodes,
) {
    for k in 0..3 {
        f_lower[k] = Lanes::from(f_lower[k].load(simd) - difference[k]);
        f_upper[k] = Lanes::from(difference[k]);
    }
    for k in 3..12 {
        f_lower[k] = Lanes::from(f_lower[k].load(simd) + (sum[k - 3] - difference[k]));
        f_upper[k] = Lanes::from(sum[k - 3] + difference[k]);
    }
}

#[inline(always)]
fn two<S: Simd>(simd: S, m: &[Lanes; 3], a: f64x4<S>, b: f64x4<S>) -> [f64x4<S>; 2] {
    let [aa, bb, ab] = [m[0].load(simd), m[1].load(simd), m[2].load(simd)];
    [aa * a + ab * b, ab * a + bb * b]
}

#[inline(always)]
fn three<S: Simd>(simd: S, m: &[Lanes; 6], v: [f64x4<S>; 3]) -> [f64x4<S>; 3] {
    let [xx, yy, zz, xy, yz, zx] = m;
    let (xx, yy, zz) = (xx.load(simd), yy.load(simd), zz.load(simd));
    let (xy, yz, zx) = (xy.load(simd), yz.load(simd), zx.load(simd));
    symmetric_times([xx, yy, zz, xy, yz, zx], v)
}

/// Computes the modal forces of a box element with 45 products.
#[inline(always)]
fn box_element<S: Simd>(
    simd: S,
    table: &BoxTable,
    lower: &ColumnNodes,
    upper: &ColumnNodes,
    f_lower: &mut ColumnNodes,
    f_upper: &mut ColumnNodes,
) {
    // Columns hold (1, ξ, η, ξη) × (x, y, z): s without ζ, d with ζ.
    let (s, d) = amplitudes(simd, lower, upper);
    let [nx, ny, nz] = three(simd, &table.normal, [s[3], s[7], d[2]]);
    let [xy_y, xy_x] = two(simd, &table.shear[0], s[4], s[6]);
    let [zx_z, zx_x] = two(simd, &table.shear[1], s[5], d[0]);
    let [yz_z, yz_y] = two(simd, &table.shear[2], s[8], d[1]);
    let [b0_y, b0_z] = two(simd, &table.bend[0], s[10], d[5]);
    let [b1_x, b1_z] = two(simd, &table.bend[1], s[9], d[8]);
    let [b2_x, b2_y] = two(simd, &table.bend[2], d[3], d[7]);
    let [t_z, t_y, t_x] = three(simd, &table.twist, [s[11], d[4], d[6]]);
    let [hx, hy, hz] = load(simd, &table.hour);
    let h = [hx * d[9], hy * d[10], hz * d[11]];
    let sum = [nx, xy_y, zx_z, xy_x, ny, yz_z, b1_x, b0_y, t_z];
    let difference = [zx_x, yz_y, nz, b2_x, t_y, b0_z, t_x, b2_y, b1_z, h[0], h[1], h[2]];
    give(simd, &sum, &difference, f_lower, f_upper);
}

/// Product of a square matrix and a vector.
#[inline(always)]
fn square<S: Simd, const N: usize>(
    simd: S,
    m: &[[Lanes; N]; N],
    v: &[f64x4<S>; N],
) -> [f64x4<S>; N] {
    let mut out = [splat(simd, 0.0); N];
    for (out, row) in out.iter_mut().zip(m) {
        *out = row[0].load(simd) * v[0];
        for k in 1..N {
            *out += row[k].load(simd) * v[k];
        }
    }
    out
}

/// Computes the modal forces of an oblique element with 171 products.
#[inline(always)]
fn oblique_element<S: Simd>(
    simd: S,
    table: &ObliqueTable,
    lower: &ColumnNodes,
    upper: &ColumnNodes,
    f_lower: &mut ColumnNodes,
    f_upper: &mut ColumnNodes,
) {
    let (s, d) = amplitudes(simd, lower, upper);
    let strain = [s[3], s[6], d[0], s[4], s[7], d[1], s[5], s[8], d[2]];
    let strain = square(simd, &table.strain, &strain);
    let bend = [s[9], s[10], s[11], d[3], d[4], d[5], d[6], d[7], d[8]];
    let bend = square(simd, &table.bend, &bend);
    let hour = square(simd, &table.hour, &[d[9], d[10], d[11]]);
    let [x1, x2, x4, y1, y2, y4, z1, z2, z4] = strain;
    let sum = [x1, y1, z1, x2, y2, z2, bend[0], bend[1], bend[2]];
    let [_, _, _, b3, b4, b5, b6, b7, b8] = bend;
    let difference = [x4, y4, z4, b3, b4, b5, b6, b7, b8, hour[0], hour[1], hour[2]];
    give(simd, &sum, &difference, f_lower, f_upper);
}
