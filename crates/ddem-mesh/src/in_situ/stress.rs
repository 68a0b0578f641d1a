//! In-situ stress of a block, and its forces and energy in an element.

use nalgebra::{Matrix3, Point3, SVector};

use crate::Vec3;
use crate::assembly::Element;
use ddem_mechanics::element::Elastic;
use ddem_mechanics::element::hex8::{gauss_points, shape, strain_matrix};

/// Stress xx yy zz xy yz zx that is linear in the position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stress {
    /// Stress at the origin `[Pa]`.
    pub origin: [f64; 6],
    /// Gradients along x, y and z `[Pa/m]`.
    pub gradient: [[f64; 6]; 3],
}

/// Initial tractions at the points of a nonconforming joint at rest, on the block that `normal`
/// points out of `[Pa]`. They follow from the mean stress of both blocks. `quads` are the common
/// parts of the faces that have points only at their corners.
pub fn between(
    both: [Option<Stress>; 2],
    normal: &Vec3,
    points: &[Vec3],
    quads: &[[u32; 4]],
) -> Option<Vec<Vec3>> {
    let stress = Stress::mean(&both)?;
    let mut sums = vec![(0.0, Vec3::zeros()); points.len()];
    for quad in quads {
        // A triangle repeats its last corner.
        let corners = if quad[2] == quad[3] { &quad[..3] } else { &quad[..] };
        let at = |corner: &u32| points[*corner as usize];
        let centre = corners.iter().map(at).sum::<Vec3>() / corners.len() as f64;
        let [a, b, c] = [0, 1, 2].map(|k| at(&corners[k]));
        let area = (b - a).cross(&(c - a)).norm();
        for corner in corners {
            // ∫ N σ dA over the part, with N linear in a triangle and bilinear in a parallelogram.
            let there = centre + (at(corner) - centre) / (7 - corners.len()) as f64;
            let (weight, sum) = &mut sums[*corner as usize];
            *weight += area;
            *sum += stress.at(&there) * normal * area;
        }
    }
    let mean = |(point, (weight, sum)): (&Vec3, (f64, Vec3))| {
        if weight > 0.0 { sum / weight } else { stress.at(point) * normal }
    };
    Some(points.iter().zip(sums).map(mean).collect())
}

/// Point of a quadrature over a quadrilateral, with the shape functions of its corners times the
/// area of the point.
#[derive(Clone, Copy, Debug)]
pub struct QuadIntegral {
    /// Numbers of the corners.
    pub points: [u32; 4],
    /// Shape functions times the area `[m²]`.
    pub weights: [f64; 4],
    /// Position `[m]`.
    pub at: Vec3,
}

/// Initial tractions as [`between`] gives them, `∫ N σ n dA / ∫ N dA`, from a quadrature that is
/// exact for linear stress.
pub fn over_quads(
    both: [Option<Stress>; 2],
    normal: &Vec3,
    points: usize,
    integrals: &[QuadIntegral],
) -> Option<Vec<Vec3>> {
    let stress = Stress::mean(&both)?;
    let mut sums = vec![(0.0, Vec3::zeros()); points];
    for QuadIntegral { points, weights, at } in integrals {
        let traction = stress.at(at) * normal;
        for (&point, &weight) in points.iter().zip(weights) {
            let (whole, sum) = &mut sums[point as usize];
            *whole += weight;
            *sum += traction * weight;
        }
    }
    Some(sums.into_iter().map(|(whole, sum)| sum / whole).collect())
}

impl Stress {
    /// Stress at a point `[Pa]`.
    pub fn at(&self, x: &Vec3) -> Matrix3<f64> {
        matrix(&self.origin) + self.along(x)
    }

    /// Change of stress along a vector `[Pa]`.
    fn along(&self, x: &Vec3) -> Matrix3<f64> {
        let [a, b, c] = self.gradient.each_ref().map(matrix);
        a * x.x + b * x.y + c * x.z
    }

    /// Divergence `∂σ_ij/∂x_j`, which carries a weight `[N/m³]`.
    pub fn divergence(&self) -> Vec3 {
        let [x, y, z] = &self.gradient;
        let [xx, yy, zz, xy, yz, zx] = [0, 1, 2, 3, 4, 5];
        Vec3::new(x[xx] + y[xy] + z[zx], x[xy] + y[yy] + z[yz], x[zx] + y[yz] + z[zz])
    }

    /// Mean of several stresses.
    pub(super) fn mean(of: &[Option<Self>]) -> Option<Self> {
        let first = *of.first()?;
        if of.iter().all(|stress| *stress == first) {
            return first;
        }
        let mut mean = Self::default();
        let part = 1.0 / of.len() as f64;
        for stress in of.iter().flatten() {
            let pairs = mean.origin.iter_mut().zip(&stress.origin);
            let slopes = mean.gradient.iter_mut().flatten().zip(stress.gradient.iter().flatten());
            pairs.chain(slopes).for_each(|(sum, x)| *sum += part * x);
        }
        Some(mean)
    }

    /// Nodal forces `∫ Bᵀσ⁰ dV` at the corners of an element, x fastest, and energy
    /// `½ ∫ σ⁰:C⁻¹:σ⁰ dV`.
    pub(super) fn element_forces(&self, centre: &Vec3, element: &Element) -> ([Vec3; 8], f64) {
        let middle = self.at(centre);
        // Over ξ, η, ζ from −1 to 1: σ = middle + Σ_d ξ_d slopes_d.
        let slopes = element.edges.map(|edge| self.along(&(edge * 0.5)));
        // An element without volume has no forces; NaN stops the run at once.
        let inverse = Matrix3::from_columns(&element.edges).try_inverse();
        let inverse = inverse.unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        let normals = [0, 1, 2].map(|d| inverse.row(d).transpose() * (element.volume / 4.0));
        let forces = std::array::from_fn(|corner| {
            let sign = |d: usize| if corner >> d & 1 == 1 { 1.0 } else { -1.0 };
            let mut force = Vec3::zeros();
            for (d, normal) in normals.iter().enumerate() {
                let [e, f] = [(d + 1) % 3, (d + 2) % 3];
                let across = slopes[e] * (sign(e) / 3.0) + slopes[f] * (sign(f) / 3.0);
                force += (middle + across) * normal * sign(d);
            }
            force
        });
        let density = |stress: &Matrix3<f64>| energy_density(&element.elastic, stress);
        let varying = slopes.iter().map(density).sum::<f64>() / 3.0;
        (forces, element.volume * (density(&middle) + varying))
    }

    /// Nodal forces `∫ Bᵀσ⁰ dV` at the corners of a hexahedron of any shape, and energy
    /// `½ ∫ σ⁰:C⁻¹:σ⁰ dV`, by 2×2×2 points. Corners are in VTK's order.
    pub(super) fn hexahedron_forces(
        &self,
        corners: &[Vec3; 8],
        elastic: &Elastic,
    ) -> ([Vec3; 8], f64) {
        let nodes = corners.map(Point3::from);
        let (mut forces, mut energy) = ([Vec3::zeros(); 8], 0.0);
        for at in gauss_points() {
            let x = shape(at).iter().zip(corners).map(|(n, x)| x * *n).sum::<Vec3>();
            let (b, volume) = strain_matrix(&nodes, at);
            let stress = self.at(&x);
            let six = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].map(|at| stress[at]);
            let work = b.transpose() * SVector::<f64, 6>::from(six) * volume;
            for (corner, force) in forces.iter_mut().enumerate() {
                *force += work.fixed_rows::<3>(3 * corner);
            }
            energy += energy_density(elastic, &stress) * volume;
        }
        (forces, energy)
    }
}

/// Energy density `½ σ:C⁻¹:σ` `[J/m³]`.
fn energy_density(elastic: &Elastic, stress: &Matrix3<f64>) -> f64 {
    let &Elastic { lambda, shear, .. } = elastic;
    let trace = stress.trace();
    let square = stress.norm_squared() - lambda / (3.0 * lambda + 2.0 * shear) * trace * trace;
    square / (4.0 * shear)
}

fn matrix(&[xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
}
