//! The assembled equations of a mesh.

use super::sparse::{add_scaled, dot, norm};
use super::{Csr, Formulation, LatticePart, Mesh, element};

/// Stiffness, mass, and the node clusters of the solver's preconditioner.
#[derive(Clone, Debug)]
pub struct System {
    /// The assembled stiffness.
    pub stiffness: Csr,
    /// The lumped mass of every node.
    pub mass: Vec<f64>,
    /// Clusters of nodes that thin elements connect.
    pub(super) clusters: Vec<Vec<usize>>,
}

impl System {
    /// Assembles all elements of a mesh in their order: blocks with this formulation; joints,
    /// strips and corners with the trilinear one.
    pub fn assemble(mesh: &Mesh, formulation: Formulation) -> Self {
        let pattern = mesh.elements.iter().map(|element| element.nodes);
        let mut stiffness = Csr::of_elements(mesh.nodes.len(), pattern);
        for element in &mesh.elements {
            let formulation = match element.kind {
                LatticePart::Body => formulation,
                _ => Formulation::Standard,
            };
            let matrix = element::stiffness(&mesh.corners(element), &element.material, formulation);
            for row in 0..24 {
                let global_row = 3 * element.nodes[row / 3] + row % 3;
                for column in 0..24 {
                    let global_column = 3 * element.nodes[column / 3] + column % 3;
                    stiffness.add(global_row, global_column, matrix[(row, column)]);
                }
            }
        }
        Self { stiffness, mass: mesh.masses(), clusters: mesh.clusters() }
    }

    /// Number of degrees of freedom.
    pub fn dofs(&self) -> usize {
        self.stiffness.size()
    }

    /// The lumped mass of every degree of freedom.
    pub fn dof_masses(&self) -> Vec<f64> {
        self.mass.iter().flat_map(|&mass| [mass; 3]).collect()
    }

    /// The damping coefficients 2 ζ √(m k) of every degree of freedom, k from the diagonal.
    pub fn damping(&self, ratio: f64) -> Vec<f64> {
        let diagonal = self.stiffness.diagonal();
        let critical = |(k, m): (&f64, f64)| 2.0 * ratio * (m * k).sqrt();
        diagonal.iter().zip(self.dof_masses()).map(critical).collect()
    }

    /// The strain energy of a displacement.
    pub fn strain_energy(&self, displacement: &[f64]) -> f64 {
        dot(displacement, &self.stiffness.multiply(displacement)) / 2.0
    }

    /// The largest eigenvalue of M⁻¹K on the degrees of freedom that are not fixed, by Lanczos
    /// iteration to about 1e-10. With its square root ω the critical step is 2/ω.
    pub fn largest_eigenvalue(&self, fixed: &[bool]) -> f64 {
        let root: Vec<f64> = self
            .dof_masses()
            .iter()
            .zip(fixed)
            .map(|(mass, &held)| if held { 0.0 } else { 1.0 / mass.sqrt() })
            .collect();
        let scale = |x: &[f64]| -> Vec<f64> { x.iter().zip(&root).map(|(x, r)| x * r).collect() };

        let mut current = scale(&start_vector(self.dofs()));
        let length = norm(&current);
        current.iter_mut().for_each(|x| *x /= length);
        let mut previous = vec![0.0; self.dofs()];
        let (mut diagonal, mut off_diagonal) = (Vec::new(), Vec::<f64>::new());
        let mut estimate = 0.0;
        for step in 1..=1000 {
            let mut next = scale(&self.stiffness.multiply(&scale(&current)));
            add_scaled(&mut next, -off_diagonal.last().copied().unwrap_or(0.0), &previous);
            diagonal.push(dot(&next, &current));
            add_scaled(&mut next, -diagonal[step - 1], &current);
            let rest = norm(&next);
            let exhausted = rest <= 1e-12 * diagonal[0].abs();
            if step % 20 == 0 || exhausted {
                let refined = largest_of_tridiagonal(&diagonal, &off_diagonal);
                if exhausted || (refined - estimate).abs() <= 1e-13 * refined {
                    return refined;
                }
                estimate = refined;
            }
            off_diagonal.push(rest);
            next.iter_mut().for_each(|x| *x /= rest);
            previous = std::mem::replace(&mut current, next);
        }
        panic!("the largest eigenvalue did not converge: {estimate}");
    }
}

/// A fixed vector with a part in every mode: a linear congruential sequence in (−1, 1).
fn start_vector(size: usize) -> Vec<f64> {
    let mut state = 1u64;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..size).map(|_| draw()).collect()
}

/// The largest eigenvalue of a symmetric tridiagonal matrix, by bisection on Sturm counts.
fn largest_of_tridiagonal(diagonal: &[f64], off_diagonal: &[f64]) -> f64 {
    let at = |index: usize| off_diagonal.get(index).map_or(0.0, |value| value.abs());
    let reach = |row: usize| at(row) + if row > 0 { at(row - 1) } else { 0.0 };
    let bound = |row: usize| diagonal[row] + reach(row);
    let mut high = (0..diagonal.len()).map(bound).fold(f64::NEG_INFINITY, f64::max);
    let mut low = diagonal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    while high - low > 1e-15 * high.abs() {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            break;
        }
        if exceeds_all(diagonal, off_diagonal, middle) { high = middle } else { low = middle }
    }
    high
}

/// True if a number lies above all eigenvalues of a symmetric tridiagonal matrix.
fn exceeds_all(diagonal: &[f64], off_diagonal: &[f64], shift: f64) -> bool {
    let mut pivot = shift - diagonal[0];
    for row in 1..diagonal.len() {
        if pivot <= 0.0 {
            return false;
        }
        pivot = shift - diagonal[row] - off_diagonal[row - 1].powi(2) / pivot;
    }
    pivot > 0.0
}
