//! Largest eigenvalue of each group of blocks that the operator does not couple with others.
//!
//! One iteration serves all groups: its products are those of the whole model, and each group has a tridiagonal matrix of
//! its own.

use super::{Operator, Spectrum, Tridiagonal, largest_of_tridiagonal, start};
use crate::error::RunError;
use crate::model::Model;
use crate::step::scratch::Scratch;
use crate::step::{FirstPass, internal_forces};
use ddem_joint::broken::BrokenJoints;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::parallel::node_start;

/// Number of products: a group is a cell with some dozens of nodes, or a few cells.
const PRODUCTS: usize = 40;
/// Norm of the rest, relative to the diagonal, at which a group has no further vectors.
const NOTHING: f64 = 1e-10;

/// Groups of the blocks of a model.
struct Groups<'a> {
    model: &'a Model,
    /// Group of each lane of each pack; `None` in lanes without a block.
    of: Vec<[Option<usize>; LANES]>,
    count: usize,
}

impl<'a> Groups<'a> {
    fn new(model: &'a Model, group: &dyn Fn(usize) -> usize) -> Self {
        let mut of = vec![[None; LANES]; model.packs.packs.len()];
        let mut count = 0;
        for block in 0..model.n_blocks() {
            let (pack, lane) = model.packs.slot(block);
            of[pack][lane] = Some(group(block));
            count = count.max(group(block) + 1);
        }
        Self { model, of, count }
    }

    /// Calls `visit` with the place and the lane of each number, and its group.
    fn each(&self, mut visit: impl FnMut(usize, usize, usize)) {
        for (pack, of) in self.of.iter().enumerate() {
            let places =
                node_start(&self.model.packs, pack)..node_start(&self.model.packs, pack + 1);
            for (lane, group) in of.iter().enumerate() {
                let Some(group) = *group else { continue };
                places.clone().for_each(|at| visit(at, lane, group));
            }
        }
    }

    /// Scalar product in each group.
    fn product(&self, a: &[Lanes], b: &[Lanes]) -> Vec<f64> {
        let mut sums = vec![0.0; self.count];
        self.each(|at, lane, group| sums[group] += a[at].0[lane] * b[at].0[lane]);
        sums
    }

    /// Adds `factors` times `b` to `a`.
    fn add(&self, a: &mut [Lanes], factors: &[f64], b: &[Lanes]) {
        self.each(|at, lane, group| a[at].0[lane] += factors[group] * b[at].0[lane]);
    }

    /// Multiplies by `factors`.
    fn scale(&self, a: &mut [Lanes], factors: &[f64]) {
        self.each(|at, lane, group| a[at].0[lane] *= factors[group]);
    }
}

impl Spectrum<'_> {
    /// Largest eigenvalue of each group of blocks `[1/s²]`. `group` is the number of the group of a block; no joint of
    /// a lattice and no tie may connect two groups.
    pub(crate) fn of_groups(
        &self,
        group: &dyn Fn(usize) -> usize,
        broken_joints: &mut BrokenJoints,
        scratch: &mut Scratch,
    ) -> Result<Vec<f64>, RunError> {
        let (operator, groups) = (Operator::new(self), Groups::new(self.model, group));
        let n = 3 * self.model.packs.nodes;
        let mut q = start(self.model, n);
        operator.tie(&mut q, scratch);
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
        let norms =
            |a: &[Lanes]| groups.product(a, a).into_iter().map(f64::sqrt).collect::<Vec<_>>();
        let unit = norms(&q).into_iter().map(inverse).collect::<Vec<_>>();
        groups.scale(&mut q, &unit);
        let (mut before, mut w) = (vec![Lanes::ZERO; n], vec![Lanes::ZERO; n]);
        let mut scaled = w.clone();
        let mut found = vec![Tridiagonal::default(); groups.count];
        let mut beta = vec![0.0; groups.count];
        for _ in 0..PRODUCTS {
            if (self.stop)() {
                return Err(RunError::Stopped);
            }
            operator.scale(&q, &mut scaled);
            internal_forces(FirstPass::linear(self.model, &scaled), broken_joints, scratch);
            // As in `Operator::iterate`, with numbers of each group.
            operator.product(&q, &mut scratch.f, 0.0, &mut w);
            groups.add(&mut w, &beta.iter().map(|beta| -beta).collect::<Vec<_>>(), &before);
            let alpha = groups.product(&w, &q);
            groups.add(&mut w, &alpha.iter().map(|alpha| -alpha).collect::<Vec<_>>(), &q);
            beta = norms(&w);
            for ((found, beta), alpha) in found.iter_mut().zip(&mut beta).zip(alpha) {
                found.add(alpha, beta);
            }
            std::mem::swap(&mut before, &mut q);
            std::mem::swap(&mut q, &mut w);
            groups.scale(&mut q, &beta.iter().map(|beta| inverse(*beta)).collect::<Vec<_>>());
        }
        Ok(found.iter().map(Tridiagonal::largest_of_group).collect())
    }
}

impl Tridiagonal {
    /// Adds a product with its diagonal number and the norm of the rest, which becomes 0 if the group has no further
    /// vectors.
    fn add(&mut self, alpha: f64, beta: &mut f64) {
        if self.diagonal.len() > self.beside.len() {
            *beta = 0.0;
            return;
        }
        self.diagonal.push(alpha);
        let most = self.diagonal.iter().fold(0.0_f64, |most, alpha| most.max(alpha.abs()));
        if *beta > NOTHING * most {
            self.beside.push(*beta);
        } else {
            *beta = 0.0;
        }
    }

    fn largest_of_group(&self) -> f64 {
        if self.diagonal.is_empty() {
            0.0
        } else {
            largest_of_tridiagonal(&self.diagonal, &self.beside)
        }
    }
}
