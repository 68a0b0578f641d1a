//! Stiffness diagonal, volume and mean strain of one hexahedron.

use nalgebra::{Matrix3, SVector, Vector3};

use super::{HexahedronElement, HexahedronTable, IN_ORDER, WARPING, amplitudes, at_corners};

impl HexahedronElement {
    /// Diagonal of the stiffness by corner in VTK's order and component `[N/m]`.
    #[must_use]
    pub fn diagonal(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|corner| {
            [0, 1, 2].map(|c| {
                let mut u = [Vector3::zeros(); 8];
                u[corner][c] = 1.0;
                self.forces(&u)[corner][c]
            })
        })
    }

    /// Forces `f = K u` at the corners of one element `[N]`, as [`force`](super::force) gives them
    /// for four.
    #[must_use]
    pub fn forces(&self, u: &[Vector3<f64>; 8]) -> [Vector3<f64>; 8] {
        let mut a = IN_ORDER.map(|corner| u[corner]);
        amplitudes(&mut a);
        let mut gradient = Matrix3::zeros();
        for (a, b) in a[1..].iter().zip(&self.gradient) {
            gradient += a * Vector3::from(*b).transpose() / self.volume;
        }
        let warped: Vec<Vector3<f64>> = WARPING
            .iter()
            .zip(&self.warp)
            .map(|(&mode, warp)| a[mode] - gradient * Vector3::from(*warp))
            .collect();
        let bent = SVector::<f64, 9>::from_fn(|at, _| warped[at / 3][at % 3]);
        let bending = self.bend * bent;
        let bending =
            |m: usize| Vector3::new(bending[3 * m], bending[3 * m + 1], bending[3 * m + 2]);
        let q = [bending(0), bending(1), bending(2), self.hour * warped[3]];
        let mut stress = self.stress(&gradient);
        for (q, warp) in q.iter().zip(&self.warp) {
            stress -= q * Vector3::from(*warp).transpose() / self.volume;
        }
        let mut r = [Vector3::zeros(); 8];
        for (r, b) in r[1..].iter_mut().zip(&self.gradient) {
            *r = stress * Vector3::from(*b);
        }
        for (mode, q) in WARPING.into_iter().zip(q) {
            r[mode] += q;
        }
        at_corners(&mut r);
        let mut forces = [Vector3::zeros(); 8];
        for (corner, r) in IN_ORDER.into_iter().zip(r) {
            forces[corner] = r;
        }
        forces
    }

    fn stress(&self, gradient: &Matrix3<f64>) -> Matrix3<f64> {
        let strain = gradient + gradient.transpose();
        Matrix3::identity() * (self.material.lambda * gradient.trace())
            + strain * self.material.shear
    }
}

impl HexahedronTable {
    /// Volume of the element in a lane `[m³]`; `None` if it has none.
    #[must_use]
    pub fn volume(&self, lane: usize) -> Option<f64> {
        let per_volume = self.constants[2].0[lane];
        (per_volume > 0.0).then(|| 1.0 / per_volume)
    }

    /// Mean gradient `∂u/∂X` of displacements at the corners in VTK's order, in one lane.
    #[must_use]
    pub fn mean_gradient(&self, lane: usize, u: &[Vector3<f64>; 8]) -> Matrix3<f64> {
        let mut a = IN_ORDER.map(|corner| u[corner]);
        amplitudes(&mut a);
        let mut gradient = Matrix3::zeros();
        for (a, b) in a[1..].iter().zip(&self.gradient) {
            gradient += a * Vector3::from(b.map(|b| b.0[lane])).transpose();
        }
        gradient * self.constants[2].0[lane]
    }
}
