//! Internal force of a lattice of equal elements, four lattices at a time.
//!
//! One kernel serves a block of n×n×n elements, a face joint n×n×1, a strip n×1×1 and a corner
//! 1×1×1. It goes through the elements row by row, along the longest edge of the lattice. A
//! *station* is the four nodes of a row of elements at one place along it: their displacements
//! become the modes (1, ξ, η, ξη) of the cross section. An element takes sums and differences of
//! the modes at its two stations, the products of [`ElementTable`], and the transposed sums and
//! differences. Modes and forces of the open station stay in registers, and each finished station
//! is transformed back to its nodes.

use fearless_simd::{Simd, f64x4};
use fearless_simd_macros::simd;

use super::hexahedron::{self, HexahedronTable};
use super::table::{BoxTable, ElementTable, ObliqueTable};
use crate::math::lanes::{Lanes, Vector, add, load, splat, sub, symmetric_times, zero};

/// Computes `g = K u` of four lattices of `dims` elements. `u` and `g` hold three components a
/// node, shape `((nx+1)(ny+1)(nz+1), 3)`, with x fastest.
pub fn force<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &ElementTable,
    u: &[Lanes],
    g: &mut [Lanes],
) {
    let nodes = (u.as_chunks::<3>().0, g.as_chunks_mut::<3>().0);
    match (table, longest(dims)) {
        (ElementTable::Box(table), 0) => rows::<S, 1, _>(simd, dims, &**table, nodes),
        (ElementTable::Box(table), 1) => rows::<S, 2, _>(simd, dims, &**table, nodes),
        (ElementTable::Box(table), _) => rows::<S, 0, _>(simd, dims, &**table, nodes),
        (ElementTable::Oblique(table), _) => rows::<S, 0, _>(simd, dims, &**table, nodes),
        (ElementTable::Hexahedra(tables), _) => each(simd, dims, tables, nodes),
    }
}

/// Computes [`force`] of the remaining elements. `alive` is 1 for these and 0 for the others, by
/// element (x fastest) and lattice.
pub fn force_left<S: Simd>(
    simd: S,
    dims: [usize; 3],
    table: &ElementTable,
    alive: &[Lanes],
    u: &[Lanes],
    g: &mut [Lanes],
) {
    let nodes = (u.as_chunks::<3>().0, g.as_chunks_mut::<3>().0);
    match table {
        ElementTable::Box(table) => {
            rows::<S, 0, _>(simd, dims, &Remaining { table: &**table, alive }, nodes);
        }
        ElementTable::Oblique(table) => {
            rows::<S, 0, _>(simd, dims, &Remaining { table: &**table, alive }, nodes);
        }
        // Only joints lose elements, and these are parallelepipeds.
        ElementTable::Hexahedra(tables) => each(simd, dims, tables, nodes),
    }
}

/// Forces of hexahedra that have a table each.
#[simd]
fn each<S: Simd>(simd: S, [nx, ny, nz]: [usize; 3], tables: &[HexahedronTable], (u, g): Nodes<'_>) {
    g.fill([Lanes::ZERO; 3]);
    let mut elements = tables.iter();
    for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
        for (i, table) in (0..nx).zip(&mut elements) {
            let low = i + (nx + 1) * (j + (ny + 1) * k);
            let high = low + (nx + 1) * (ny + 1);
            let above = nx + 1;
            let at = [
                low,
                low + 1,
                low + above + 1,
                low + above,
                high,
                high + 1,
                high + above + 1,
                high + above,
            ];
            let mut moved = [zero(simd); 8];
            for (moved, &node) in moved.iter_mut().zip(&at) {
                *moved = load(simd, &u[node]);
            }
            let forces = hexahedron::force(simd, table, &moved);
            for (&force, &node) in forces.iter().zip(&at) {
                g[node] = add(load(simd, &g[node]), force).map(Lanes::from);
            }
        }
    }
}

/// Axis with the most elements, the first one in a tie.
fn longest([nx, ny, nz]: [usize; 3]) -> usize {
    if nx >= ny && nx >= nz {
        0
    } else if ny >= nz {
        1
    } else {
        2
    }
}

/// Displacements and forces of the nodes.
type Nodes<'a> = (&'a [[Lanes; 3]], &'a mut [[Lanes; 3]]);
/// Modes (1, ξ, η, ξη) × (x, y, z) at a station, or the forces on them.
type Modes<S> = [f64x4<S>; 12];
/// Forces on the modes without ζ, but for the constant one, and on those with ζ.
type ModalForces<S> = ([f64x4<S>; 9], Modes<S>);

/// Elements of a lattice. Their local axes are the coordinate axes, turned cyclically by `T`: local
/// axis i is axis i + T, and the third one points along the row.
trait Elements<S: Simd, const T: usize> {
    /// Modal forces of an element from its modes without and with ζ.
    fn forces(&self, simd: S, element: usize, s: &Modes<S>, d: &Modes<S>) -> ModalForces<S>;
}

/// Elements of which some have failed.
struct Remaining<'a, E> {
    table: &'a E,
    alive: &'a [Lanes],
}

impl<S: Simd, const T: usize, E: Elements<S, T>> Elements<S, T> for Remaining<'_, E> {
    #[inline(always)]
    fn forces(&self, simd: S, element: usize, s: &Modes<S>, d: &Modes<S>) -> ModalForces<S> {
        let alive = self.alive[element].load(simd);
        let (mut alive_s, mut alive_d) = ([alive; 12], [alive; 12]);
        for k in 0..12 {
            alive_s[k] *= s[k];
            alive_d[k] *= d[k];
        }
        self.table.forces(simd, element, &alive_s, &alive_d)
    }
}

/// Cross-section of a row of elements through four of its nodes.
struct Station<S: Simd> {
    modes: Modes<S>,
    /// Forces on the modes, of the elements so far.
    force: Modes<S>,
}

/// Steps of a row of elements through the lattice.
struct Row {
    /// First nodes of its four rows of nodes: (ξ, η) = (−, −), (+, −), (−, +), (+, +).
    starts: [usize; 4],
    /// Step from node to node.
    node_step: usize,
    /// First element, and the step from element to element.
    element: [usize; 2],
    /// Number of elements.
    count: usize,
    /// True for rows of nodes without forces of an earlier row of elements.
    overwrites: [bool; 4],
}

#[inline(always)]
fn rows<S: Simd, const T: usize, E: Elements<S, T>>(
    simd: S,
    dims: [usize; 3],
    elements: &E,
    (u, g): Nodes<'_>,
) {
    let turned = |a: [usize; 3]| [a[T % 3], a[(1 + T) % 3], a[(2 + T) % 3]];
    let [m0, m1, count] = turned(dims);
    let [s0, s1, node_step] = turned([1, dims[0] + 1, (dims[0] + 1) * (dims[1] + 1)]);
    let [e0, e1, element_step] = turned([1, dims[0], dims[0] * dims[1]]);
    for j in 0..m1 {
        for i in 0..m0 {
            let start = i * s0 + j * s1;
            let row = Row {
                starts: [start, start + s0, start + s1, start + s0 + s1],
                node_step,
                element: [i * e0 + j * e1, element_step],
                count,
                overwrites: [i == 0 && j == 0, j == 0, i == 0, true],
            };
            match count {
                1 => row_force::<S, T, 1, E>(simd, &row, elements, u, g),
                2 => row_force::<S, T, 2, E>(simd, &row, elements, u, g),
                3 => row_force::<S, T, 3, E>(simd, &row, elements, u, g),
                4 => row_force::<S, T, 4, E>(simd, &row, elements, u, g),
                _ => row_force::<S, T, 0, E>(simd, &row, elements, u, g),
            }
        }
    }
}

/// Forces of one row of `N` elements, at most four; with 0 it has any number.
#[simd]
fn row_force<S: Simd, const T: usize, const N: usize, E: Elements<S, T>>(
    simd: S,
    row: &Row,
    elements: &E,
    u: &[[Lanes; 3]],
    g: &mut [[Lanes; 3]],
) {
    let force = [splat(simd, 0.0); 12];
    let mut open = Station { modes: modes::<S, T>(simd, u, row.starts), force };
    if N == 0 {
        for p in 0..row.count {
            open = element_force(simd, row, elements, p, open, u, g);
        }
    }
    // Without a loop the modes of the open station need not move between registers.
    if N > 0 {
        open = element_force(simd, row, elements, 0, open, u, g);
    }
    if N > 1 {
        open = element_force(simd, row, elements, 1, open, u, g);
    }
    if N > 2 {
        open = element_force(simd, row, elements, 2, open, u, g);
    }
    if N > 3 {
        open = element_force(simd, row, elements, 3, open, u, g);
    }
    let count = if N == 0 { row.count } else { N };
    let last = row.starts.map(|start| start + count * row.node_step);
    give::<S, T>(simd, &open.force, last, row.overwrites, g);
}

/// Forces of one element of a row, whose lower station is `open`. Gives the forces of that station to
/// its nodes and returns the upper one.
#[inline(always)]
fn element_force<S: Simd, const T: usize, E: Elements<S, T>>(
    simd: S,
    row: &Row,
    elements: &E,
    p: usize,
    open: Station<S>,
    u: &[[Lanes; 3]],
    g: &mut [[Lanes; 3]],
) -> Station<S> {
    let Station { modes: lower, mut force } = open;
    let at = row.starts.map(|start| start + p * row.node_step);
    let upper = modes::<S, T>(simd, u, at.map(|node| node + row.node_step));
    let (mut s, mut d) = ([splat(simd, 0.0); 12], [splat(simd, 0.0); 12]);
    for k in 0..12 {
        (s[k], d[k]) = (upper[k] + lower[k], upper[k] - lower[k]);
    }
    let [first, step] = row.element;
    let (sum, difference) = elements.forces(simd, first + p * step, &s, &d);
    let mut next = [splat(simd, 0.0); 12];
    for k in 0..3 {
        (force[k], next[k]) = (force[k] - difference[k], difference[k]);
    }
    for k in 3..12 {
        force[k] += sum[k - 3] - difference[k];
        next[k] = sum[k - 3] + difference[k];
    }
    give::<S, T>(simd, &force, at, row.overwrites, g);
    Station { modes: upper, force: next }
}

/// Modes of a station.
#[inline(always)]
fn modes<S: Simd, const T: usize>(simd: S, u: &[[Lanes; 3]], at: [usize; 4]) -> Modes<S> {
    let nodes = [&u[at[0]], &u[at[1]], &u[at[2]], &u[at[3]]];
    let mut out = [splat(simd, 0.0); 12];
    for c in 0..3 {
        let own = (c + T) % 3;
        let (a, b) = (nodes[0][own].load(simd), nodes[1][own].load(simd));
        let (e, f) = (nodes[2][own].load(simd), nodes[3][own].load(simd));
        let (low, low_slope, high, high_slope) = (b + a, b - a, f + e, f - e);
        (out[c], out[c + 3]) = (high + low, high_slope + low_slope);
        (out[c + 6], out[c + 9]) = (high - low, high_slope - low_slope);
    }
    out
}

/// Transpose of [`modes`]: adds the forces on the modes of a station to those on its nodes.
#[inline(always)]
fn give<S: Simd, const T: usize>(
    simd: S,
    force: &Modes<S>,
    at: [usize; 4],
    overwrites: [bool; 4],
    g: &mut [[Lanes; 3]],
) {
    let part = |k: usize| [force[k], force[k + 1], force[k + 2]];
    let (low, high) = (sub(part(0), part(6)), add(part(0), part(6)));
    let (low_slope, high_slope) = (sub(part(3), part(9)), add(part(3), part(9)));
    put::<S, T>(simd, sub(low, low_slope), overwrites[0], &mut g[at[0]]);
    put::<S, T>(simd, add(low, low_slope), overwrites[1], &mut g[at[1]]);
    put::<S, T>(simd, sub(high, high_slope), overwrites[2], &mut g[at[2]]);
    put::<S, T>(simd, add(high, high_slope), overwrites[3], &mut g[at[3]]);
}

#[inline(always)]
fn put<S: Simd, const T: usize>(simd: S, force: Vector<S>, fresh: bool, g: &mut [Lanes; 3]) {
    for (axis, g) in g.iter_mut().enumerate() {
        let force = force[(axis + 3 - T) % 3];
        *g = Lanes::from(if fresh { force } else { g.load(simd) + force });
    }
}

#[inline(always)]
fn two<S: Simd>(simd: S, m: &[Lanes; 3], a: f64x4<S>, b: f64x4<S>) -> [f64x4<S>; 2] {
    let [aa, bb, ab] = [m[0].load(simd), m[1].load(simd), m[2].load(simd)];
    [aa * a + ab * b, ab * a + bb * b]
}

#[inline(always)]
fn three<S: Simd, const T: usize>(simd: S, m: &[Lanes; 6], v: Vector<S>) -> Vector<S> {
    let [i, j, k] = [T % 3, (1 + T) % 3, (2 + T) % 3];
    let (xx, yy, zz) = (m[i].load(simd), m[j].load(simd), m[k].load(simd));
    let (xy, yz, zx) = (m[3 + i].load(simd), m[3 + j].load(simd), m[3 + k].load(simd));
    symmetric_times([xx, yy, zz, xy, yz, zx], v)
}

impl<S: Simd, const T: usize> Elements<S, T> for BoxTable {
    /// 45 products.
    #[inline(always)]
    fn forces(&self, simd: S, _: usize, s: &Modes<S>, d: &Modes<S>) -> ModalForces<S> {
        let [i, j, k] = [T % 3, (1 + T) % 3, (2 + T) % 3];
        let [nx, ny, nz] = three::<S, T>(simd, &self.normal, [s[3], s[7], d[2]]);
        let [yz_z, yz_y] = two(simd, &self.shear[i], s[8], d[1]);
        let [zx_x, zx_z] = two(simd, &self.shear[j], d[0], s[5]);
        let [xy_y, xy_x] = two(simd, &self.shear[k], s[4], s[6]);
        let [b0_y, b0_z] = two(simd, &self.bend[i], s[10], d[5]);
        let [b1_z, b1_x] = two(simd, &self.bend[j], d[8], s[9]);
        let [b2_x, b2_y] = two(simd, &self.bend[k], d[3], d[7]);
        let [t_x, t_y, t_z] = three::<S, T>(simd, &self.twist, [d[6], d[4], s[11]]);
        let hour = |at: usize, d: f64x4<S>| self.hour[at].load(simd) * d;
        let h = [hour(i, d[9]), hour(j, d[10]), hour(k, d[11])];
        let sum = [nx, xy_y, zx_z, xy_x, ny, yz_z, b1_x, b0_y, t_z];
        let difference = [zx_x, yz_y, nz, b2_x, t_y, b0_z, t_x, b2_y, b1_z, h[0], h[1], h[2]];
        (sum, difference)
    }
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

impl<S: Simd> Elements<S, 0> for ObliqueTable {
    /// 171 products.
    #[inline(always)]
    fn forces(&self, simd: S, _: usize, s: &Modes<S>, d: &Modes<S>) -> ModalForces<S> {
        let strain = [s[3], s[6], d[0], s[4], s[7], d[1], s[5], s[8], d[2]];
        let strain = square(simd, &self.strain, &strain);
        let bend = [s[9], s[10], s[11], d[3], d[4], d[5], d[6], d[7], d[8]];
        let bend = square(simd, &self.bend, &bend);
        let hour = square(simd, &self.hour, &[d[9], d[10], d[11]]);
        let [x1, x2, x4, y1, y2, y4, z1, z2, z4] = strain;
        let sum = [x1, y1, z1, x2, y2, z2, bend[0], bend[1], bend[2]];
        let [_, _, _, b3, b4, b5, b6, b7, b8] = bend;
        let difference = [x4, y4, z4, b3, b4, b5, b6, b7, b8, hour[0], hour[1], hour[2]];
        (sum, difference)
    }
}
