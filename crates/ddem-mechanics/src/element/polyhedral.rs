//! Element at a vertex of a polyhedron where more than three edges meet.
//!
//! A hexahedron fills the corner of a polyhedron at a vertex of three edges. With d edges the corner
//! is a polyhedron itself: its nodes are the vertex, d middles of edges, d means of faces, and the
//! mean of the cell; its surface has d quadrilaterals around the vertex and d around the mean of the
//! cell. Constant strain acts through the mean gradient, which follows from the surface. What remains
//! of a displacement is held by equal springs (the virtual element of first order):
//!
//! ```text
//! g_ik = Σ_I u_iI b_Ik / V              b_Ik = ∮ N_I n_k dA
//! h_iI = u_iI − ū_i − (x_I − x̄)_k g_ik  zero for every linear field
//! q = α (λ̂ + 2G) V^{1/3} h
//! t_ik = σ_ik(g) − Σ_I q_iI (x_I − x̄)_k / V
//! f_iI = b_Ik t_ik + q_iI − q̄_i
//! ```

use fearless_simd::{Simd, f64x4};
use nalgebra::Vector3;

use super::Elastic;
use super::hexahedron::{capped_lambda, stress};
use crate::math::lanes::{LANES, Lanes, Vector, add, dot, load, scale, splat, sub, zero};

/// Stiffness α of the springs relative to `(λ̂ + 2G) V^{1/3}`: the mean of those of a cube in
/// bending, with incompatible modes and ν = 0.25.
const SPRING: f64 = 0.125;

/// Numbers of the nodes at the corner of a cell where some edges meet: the vertex first, then the
/// middles of the edges and the means of the faces, both in order around the vertex and face i
/// between the edges i and i + 1, then the mean of the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CornerNodes {
    /// Number of edges, 3 or more.
    pub edges: usize,
}

impl CornerNodes {
    /// Number of nodes, 2 d + 2.
    #[must_use]
    pub fn count(self) -> usize {
        2 * self.edges + 2
    }

    /// Nodes of the quadrilaterals of the surface, counter-clockwise seen from outside if the edges
    /// are, around the vertex.
    pub fn quads(self) -> impl Iterator<Item = [usize; 4]> {
        let (edge, face) =
            (move |i: usize| 1 + i % self.edges, move |i: usize| 1 + self.edges + i % self.edges);
        let outside = (0..self.edges).map(move |i| [0, edge(i), face(i), edge(i + 1)]);
        let inside =
            (0..self.edges).map(move |i| [self.count() - 1, face(i + 1), edge(i + 1), face(i)]);
        outside.chain(inside)
    }
}

/// Constants of one corner of a polyhedron.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyhedralCorner {
    /// Volume `V` `[m³]`.
    pub volume: f64,
    /// Surface integrals `b` `[m²]`, by node.
    gradient: Vec<Vector3<f64>>,
    /// Positions from their mean `[m]`, by node.
    offsets: Vec<Vector3<f64>>,
    material: Elastic,
}

impl PolyhedralCorner {
    /// Constants of the element with these nodes `[m]`, in the order of [`CornerNodes`]; `None` if
    /// their number is not that of three or more edges, or the volume is not positive.
    #[must_use]
    pub fn new(nodes: &[Vector3<f64>], material: &Elastic) -> Option<Self> {
        let corner = CornerNodes { edges: nodes.len().checked_sub(2)? / 2 };
        if corner.edges < 3 || corner.count() != nodes.len() {
            return None;
        }
        let mean = nodes.iter().sum::<Vector3<f64>>() / nodes.len() as f64;
        let offsets: Vec<_> = nodes.iter().map(|x| x - mean).collect();
        let mut gradient = vec![Vector3::zeros(); nodes.len()];
        for quad in corner.quads() {
            let areas = nodal_areas(&quad.map(|node| offsets[node]));
            for (node, area) in quad.into_iter().zip(areas) {
                gradient[node] += area;
            }
        }
        let moments = gradient.iter().zip(&offsets).map(|(b, x)| b.dot(x));
        let volume = moments.sum::<f64>() / 3.0;
        let sound = volume > 0.0 && volume.is_finite();
        sound.then_some(Self { volume, gradient, offsets, material: *material })
    }

    /// Stiffness of the springs `[N/m]`.
    fn spring(&self) -> f64 {
        SPRING * (capped_lambda(&self.material) + 2.0 * self.material.shear) * self.volume.cbrt()
    }
}

/// Integrals `∫ N_I n dA` of the functions of a bilinear quadrilateral `[m²]`.
fn nodal_areas(corners: &[Vector3<f64>; 4]) -> [Vector3<f64>; 4] {
    let [a, b, c, d] = corners;
    // x = m + ξ p + η q + ξη w; ∂x/∂ξ × ∂x/∂η = p×q + ξ p×w + η w×q, which is linear.
    let (p, q) = ((b + c - a - d) / 4.0, (c + d - a - b) / 4.0);
    let w = (a + c - b - d) / 4.0;
    let (mean, along, across) = (p.cross(&q), p.cross(&w) / 3.0, w.cross(&q) / 3.0);
    [mean - along - across, mean + along - across, mean + along + across, mean - along + across]
}

/// Constants of four corners side by side, all with the same number of nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyhedralTable {
    gradient: Vec<[Lanes; 3]>,
    offsets: Vec<[Lanes; 3]>,
    /// λ and G `[Pa]`, and 1/V `[m⁻³]`.
    constants: [Lanes; 3],
    /// Stiffness of the springs `[N/m]`.
    spring: Lanes,
}

impl PolyhedralTable {
    /// Table of four elements with this number of nodes; `None` is a lane without an element.
    #[must_use]
    pub fn new(lanes: [Option<&PolyhedralCorner>; LANES], nodes: usize) -> Self {
        let pick = |f: &dyn Fn(&PolyhedralCorner) -> f64| Lanes(lanes.map(|of| of.map_or(0.0, f)));
        let vector = |f: &dyn Fn(&PolyhedralCorner) -> Vector3<f64>| {
            [0, 1, 2].map(|k| pick(&|of: &PolyhedralCorner| f(of)[k]))
        };
        Self {
            gradient: (0..nodes).map(|node| vector(&|of| of.gradient[node])).collect(),
            offsets: (0..nodes).map(|node| vector(&|of| of.offsets[node])).collect(),
            constants: [
                pick(&|of| of.material.lambda),
                pick(&|of| of.material.shear),
                pick(&|of| 1.0 / of.volume),
            ],
            spring: pick(&PolyhedralCorner::spring),
        }
    }
}

/// Forces `f = K u` at the nodes of four elements `[N]`, from their displacements `[m]`.
#[inline(always)]
pub fn force<S: Simd>(simd: S, table: &PolyhedralTable, u: &[[Lanes; 3]], f: &mut [[Lanes; 3]]) {
    let nodes = table.gradient.len();
    let [lambda, shear, per_volume] = load(simd, &table.constants);
    let (spring, share) = (table.spring.load(simd), splat(simd, 1.0 / nodes as f64));
    let mut gradient = [zero(simd); 3];
    let mut mean = zero(simd);
    for node in 0..nodes {
        let (u, b) = (load(simd, &u[node]), load(simd, &table.gradient[node]));
        mean = add(mean, u);
        add_product(&mut gradient, u, b);
    }
    mean = scale(mean, share);
    for row in &mut gradient {
        *row = scale(*row, per_volume);
    }
    let mut moments = [zero(simd); 3];
    let mut mean_force = zero(simd);
    for node in 0..nodes {
        let (u, offset) = (load(simd, &u[node]), load(simd, &table.offsets[node]));
        let q = springs(spring, sub(u, mean), &gradient, offset);
        mean_force = add(mean_force, q);
        add_product(&mut moments, q, offset);
    }
    mean_force = scale(mean_force, share);
    let mut t = stress(lambda, shear, &gradient);
    for i in 0..3 {
        t[i] = sub(t[i], scale(moments[i], per_volume));
    }
    for node in 0..nodes {
        let (u, offset) = (load(simd, &u[node]), load(simd, &table.offsets[node]));
        let b = load(simd, &table.gradient[node]);
        let q = sub(springs(spring, sub(u, mean), &gradient, offset), mean_force);
        for i in 0..3 {
            f[node][i] = Lanes::from(dot(b, t[i]) + q[i]);
        }
    }
}

/// Adds `a_i b_k` to a matrix.
#[inline(always)]
fn add_product<S: Simd>(sum: &mut [Vector<S>; 3], a: Vector<S>, b: Vector<S>) {
    for i in 0..3 {
        sum[i] = add(sum[i], scale(b, a[i]));
    }
}

/// Forces `q` of the springs of a node.
#[inline(always)]
fn springs<S: Simd>(
    spring: f64x4<S>,
    u: Vector<S>,
    gradient: &[Vector<S>; 3],
    offset: Vector<S>,
) -> Vector<S> {
    let [x, y, z] = gradient;
    let linear = [dot(offset, *x), dot(offset, *y), dot(offset, *z)];
    scale(sub(u, linear), spring)
}

#[cfg(test)]
mod tests;
