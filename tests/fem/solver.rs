//! The constrained static problem.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::System;
use super::sparse::{add_scaled, dot, norm};

/// The reduction of the preconditioned residual at which a sweep of iterations ends.
const TOLERANCE: f64 = 1e-13;

/// Upper bound of the iterations; the problems of the tests need fewer.
const MOST_ITERATIONS: usize = 20_000;

/// Static equilibrium.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The displacement of every degree of freedom.
    pub displacement: Vec<f64>,
    /// The force of the supports on every degree of freedom, zero on free ones.
    pub reactions: Vec<f64>,
    /// Norm of the unbalanced force over the norm of applied forces and reactions, recomputed from
    /// the displacement: rounding leaves a few ulp of ‖K‖‖u‖.
    pub unbalanced: f64,
    /// Conjugate gradient iterations taken.
    pub iterations: usize,
}

impl System {
    /// Solves K u = load with some displacements prescribed.
    ///
    /// Uses conjugate gradients, preconditioned by the exact inverse of the stiffness of each
    /// cluster of nodes that thin elements connect. The number of iterations therefore does not
    /// depend on the thickness of the joints. A second sweep corrects the recomputed residual.
    pub fn solve(&self, load: &[f64], prescribed: &[Option<f64>]) -> Solution {
        let free: Vec<bool> = prescribed.iter().map(Option::is_none).collect();
        let preconditioner = ClusterInverse::new(self, &free);
        let mut displacement: Vec<f64> =
            prescribed.iter().map(|value| value.unwrap_or(0.0)).collect();
        let mut iterations = 0;
        for _ in 0..2 {
            let mut residual = self.residual(load, &displacement);
            mask(&mut residual, &free);
            let (correction, steps) = self.correction(residual, &free, &preconditioner);
            add_scaled(&mut displacement, 1.0, &correction);
            iterations += steps;
        }
        let mut unbalanced = self.residual(load, &displacement);
        let held: Vec<bool> = free.iter().map(|free| !free).collect();
        let mut reactions: Vec<f64> = unbalanced.iter().map(|force| -force).collect();
        mask(&mut reactions, &held);
        mask(&mut unbalanced, &free);
        let mut acting = reactions.clone();
        add_scaled(&mut acting, 1.0, load);
        let unbalanced = norm(&unbalanced) / norm(&acting).max(f64::MIN_POSITIVE);
        Solution { displacement, reactions, unbalanced, iterations }
    }

    /// load − K u.
    fn residual(&self, load: &[f64], displacement: &[f64]) -> Vec<f64> {
        let mut residual = load.to_vec();
        add_scaled(&mut residual, -1.0, &self.stiffness.multiply(displacement));
        residual
    }

    /// Conjugate gradients from zero on the free degrees of freedom.
    fn correction(
        &self,
        mut residual: Vec<f64>,
        free: &[bool],
        preconditioner: &ClusterInverse,
    ) -> (Vec<f64>, usize) {
        let mut solution = vec![0.0; residual.len()];
        let mut scaled = preconditioner.apply(&residual);
        let mut direction = scaled.clone();
        let mut energy = dot(&residual, &scaled);
        let goal = energy * TOLERANCE * TOLERANCE;
        if energy == 0.0 {
            return (solution, 0);
        }
        let mut product = vec![0.0; residual.len()];
        for iteration in 1..=MOST_ITERATIONS {
            self.stiffness.multiply_into(&direction, &mut product);
            mask(&mut product, free);
            let step = energy / dot(&direction, &product);
            add_scaled(&mut solution, step, &direction);
            add_scaled(&mut residual, -step, &product);
            scaled = preconditioner.apply(&residual);
            let next = dot(&residual, &scaled);
            if next <= goal {
                return (solution, iteration);
            }
            for (direction, scaled) in direction.iter_mut().zip(&scaled) {
                *direction = scaled + next / energy * *direction;
            }
            energy = next;
        }
        panic!("the static problem did not converge: is a rigid motion left free?");
    }
}

/// Sets entries that are not kept to zero.
fn mask(vector: &mut [f64], kept: &[bool]) {
    for (value, &keep) in vector.iter_mut().zip(kept) {
        if !keep {
            *value = 0.0;
        }
    }
}

/// The inverse of the block diagonal of the stiffness, one block per cluster of nodes.
struct ClusterInverse {
    blocks: Vec<(Vec<usize>, Cholesky<f64, Dyn>)>,
}

impl ClusterInverse {
    /// Factorises the block of every cluster.
    fn new(system: &System, free: &[bool]) -> Self {
        let mut blocks = Vec::with_capacity(system.clusters.len());
        for cluster in &system.clusters {
            let all = cluster.iter().flat_map(|node| 3 * node..3 * node + 3);
            let dofs: Vec<usize> = all.filter(|&dof| free[dof]).collect();
            let block = DMatrix::from_fn(dofs.len(), dofs.len(), |row, column| {
                system.stiffness.get(dofs[row], dofs[column])
            });
            blocks.push((dofs, block.cholesky().expect("a node has no stiffness")));
        }
        Self { blocks }
    }

    /// The preconditioned residual, zero where fixed.
    fn apply(&self, residual: &[f64]) -> Vec<f64> {
        let mut result = vec![0.0; residual.len()];
        for (dofs, factor) in &self.blocks {
            let mut local = DVector::from_iterator(dofs.len(), dofs.iter().map(|&d| residual[d]));
            factor.solve_mut(&mut local);
            for (&dof, value) in dofs.iter().zip(local.iter()) {
                result[dof] = *value;
            }
        }
        result
    }
}
