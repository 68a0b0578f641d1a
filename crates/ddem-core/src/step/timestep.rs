//! Critical step `Δt = 2/ω_max`, with `ω_max²` the largest eigenvalue of `M⁻¹ K` (§6).
//!
//! This is a power iteration on the operator of the step, in the form of Lanczos. It uses the
//! Krylov space of the same products and needs only some dozens of them for the largest eigenvalue,
//! accurate to rounding. Supports are left out, because they can only decrease the eigenvalue.
//!
//! The spectrum of a large model is dense at its end, and the last digits take many products. There
//! the iteration ends earlier and adds the residual as a margin: an eigenvalue of the operator lies
//! within the residual of each Ritz value, and the largest one converges from below.

mod groups;

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::error::RunError;
use crate::model::Model;
use crate::step::rigid_modes::RigidModes;
use crate::step::scratch::Scratch;
use crate::step::{FirstPass, internal_forces};
use ddem_joint::broken::BrokenJoints;
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::inertia::Inertia;
use ddem_mesh::pack::Pack;
use ddem_mesh::parallel::{each_pack, node_start};

/// Largest number of products with K.
const MOST_STEPS: usize = 120;
/// Relative change of the eigenvalue over [`PATIENCE`] products at which the iteration ends.
const TOLERANCE: f64 = 1e-10;
const PATIENCE: usize = 8;
/// Nodes from which on a model is large, and the relative residual at which its iteration ends.
const LARGE: usize = 50_000;
const RESIDUAL: f64 = 5e-3;
/// Products between two residuals.
const RESIDUAL_INTERVAL: usize = 5;

/// Model and its stiffnesses beside those of the first pass.
pub(crate) struct Spectrum<'a> {
    pub(crate) model: &'a Model,
    /// Additional stiffness over mass of each node of deformable blocks `[1/s²]`; empty if there is
    /// none.
    pub(crate) added: &'a [Lanes],
    /// Flag that ends the iteration with an error.
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

/// Fastest mode of a model.
pub(crate) struct FastestMode {
    /// Unit vector of displacements times the roots of the masses.
    pub(crate) scaled: Vec<Lanes>,
    /// Displacements of the nodes.
    pub(crate) u: Vec<Lanes>,
}

impl Spectrum<'_> {
    /// Iterates until the largest eigenvalue of `M⁻¹ K` is known.
    pub(crate) fn iterate(
        &self,
        broken_joints: &mut BrokenJoints,
        scratch: &mut Scratch,
    ) -> Result<Tridiagonal, RunError> {
        Operator::new(self).iterate(broken_joints, scratch, &mut |_, _| {})
    }

    /// Fastest mode. A second iteration sums its vectors, none of which is kept in the first.
    pub(crate) fn fastest_mode(
        &self,
        iterated: &Tridiagonal,
        broken_joints: &mut BrokenJoints,
        scratch: &mut Scratch,
    ) -> Result<FastestMode, RunError> {
        let operator = Operator::new(self);
        let parts = iterated.parts_of_fastest();
        let mut scaled = vec![Lanes::ZERO; 3 * self.model.packs.nodes];
        operator.iterate(broken_joints, scratch, &mut |number, q| {
            for (sum, q) in scaled.iter_mut().zip(q) {
                (0..LANES).for_each(|lane| sum.0[lane] += parts[number] * q.0[lane]);
            }
        })?;
        let mut u = vec![Lanes::ZERO; scaled.len()];
        operator.scale(&scaled, &mut u);
        Ok(FastestMode { scaled, u })
    }
}

/// Tridiagonal matrix of an iteration.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tridiagonal {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
    /// Largest eigenvalue after each product.
    values: Vec<f64>,
    /// Margin if the iteration ended early.
    margin: f64,
}

impl Tridiagonal {
    /// Largest eigenvalue `[1/s²]`.
    pub(crate) fn largest(&self) -> f64 {
        self.values.last().map_or(0.0, |largest| largest + self.margin)
    }

    /// Parts of the vectors of the iteration in the fastest mode.
    fn parts_of_fastest(&self) -> DVector<f64> {
        let eigen = tridiagonal(&self.diagonal, &self.beside).symmetric_eigen();
        eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned()
    }

    /// True if the iteration ends after a product whose rest has the norm `beta`.
    fn ends(&mut self, beta: f64, is_large: bool) -> bool {
        self.values.push(largest_of_tridiagonal(&self.diagonal, &self.beside));
        let values = &self.values;
        let largest = values[values.len() - 1];
        let equilibrium = values.len() > PATIENCE
            && largest - values[values.len() - 1 - PATIENCE] <= TOLERANCE * largest;
        if equilibrium || beta <= 1e-13 * largest {
            return true;
        }
        if is_large && values.len().is_multiple_of(RESIDUAL_INTERVAL) {
            let residual = beta * last_of_largest(&self.diagonal, &self.beside);
            if residual <= RESIDUAL * largest {
                self.margin = residual;
                return true;
            }
        }
        false
    }
}

/// Operator `M^{-½} K M^{-½}`, which is symmetric and has the eigenvalues of `M⁻¹ K`.
struct Operator<'a> {
    spectrum: &'a Spectrum<'a>,
    model: &'a Model,
    /// Inverse roots `m^{-½}` of the masses of the nodes of equal packs.
    roots: Vec<Vec<Lanes>>,
    /// Square roots of the parts of the nodes in the masses that are tied to them, divided by those
    /// masses' roots, by inertia; empty for equal packs without ties. A tied node has the value of all
    /// times the root of its part, so that sums count it once.
    returns: Vec<Vec<Lanes>>,
    blocks: RigidModes,
}

impl<'a> Operator<'a> {
    fn new(spectrum: &'a Spectrum<'a>) -> Self {
        let model = spectrum.model;
        let (roots, returns) = (inverse_roots(model), tied_returns(model));
        Self { spectrum, model, roots, returns, blocks: RigidModes::new(model) }
    }

    /// Iterates until the largest eigenvalue is known. `visit` receives each vector of the basis
    /// with its number.
    fn iterate(
        &self,
        broken_joints: &mut BrokenJoints,
        scratch: &mut Scratch,
        visit: &mut dyn FnMut(usize, &[Lanes]),
    ) -> Result<Tridiagonal, RunError> {
        let model = self.model;
        let n = 3 * model.packs.nodes;
        let mut q = start(model, n);
        self.tie(&mut q, scratch);
        let (mut before, mut scaled) = (vec![Lanes::ZERO; n], vec![Lanes::ZERO; n]);
        let mut found = Tridiagonal::default();
        let is_large = model.packs.nodes * LANES >= LARGE;
        for number in 0..MOST_STEPS {
            if (self.spectrum.stop)() {
                return Err(RunError::Stopped);
            }
            visit(number, &q);
            self.scale(&q, &mut scaled);
            internal_forces(FirstPass::linear(model, &scaled), broken_joints, scratch);
            // w = A q − β q₋; α = w·q; w −= α q; β = |w|. The product is −f.
            let beta = found.beside.last().copied().unwrap_or(0.0);
            let alpha = self.product(&q, &mut scratch.f, beta, &mut before);
            let beta = take_part(model, alpha, &q, &mut before);
            found.diagonal.push(alpha);
            if found.ends(beta, is_large) {
                break;
            }
            found.beside.push(beta);
            over_packs(model, [&mut before, &mut q], |_, _, [w, q]| {
                for (w, q) in w.iter_mut().zip(q) {
                    for lane in 0..LANES {
                        let next = w.0[lane] / beta;
                        w.0[lane] = q.0[lane];
                        q.0[lane] = next;
                    }
                }
                0.0
            });
        }
        found.beside.truncate(found.diagonal.len().saturating_sub(1));
        Ok(found)
    }

    /// Makes the values of tied nodes those of one node.
    fn tie(&self, q: &mut [Lanes], scratch: &mut Scratch) {
        if self.model.ties.is_empty() {
            return;
        }
        // Any values in the ratios √m_i of the copies are those of one node.
        self.scale(q, &mut scratch.f);
        scratch.share_ties(self.model);
        let square = over_packs(self.model, [q], |pack, range, [q]| {
            let f = &scratch.f[range];
            let factors = self.factors(pack);
            let mut own = 0.0;
            for ((q, f), factor) in q.iter_mut().zip(f).zip(factors) {
                for lane in 0..LANES {
                    q.0[lane] = f.0[lane] * factor.0[lane];
                    own += q.0[lane] * q.0[lane];
                }
            }
            own
        });
        let norm = square.sqrt();
        q.iter_mut().for_each(|q| q.0.iter_mut().for_each(|x| *x /= norm));
    }

    /// Factors from forces to products with the operator.
    fn factors(&self, pack: usize) -> &[Lanes] {
        let returns = &self.returns[self.model.assembly.pack_inertia[pack] as usize];
        if returns.is_empty() { self.root(pack) } else { returns }
    }

    fn root(&self, pack: usize) -> &[Lanes] {
        &self.roots[self.model.assembly.pack_inertia[pack] as usize]
    }

    /// Computes `M^{-½} q`: displacements, to which K gives forces.
    fn scale(&self, q: &[Lanes], scaled: &mut [Lanes]) {
        over_packs(self.model, [scaled], |pack, range, [scaled]| {
            if self.model.packs.packs[pack].rigid {
                self.blocks.corners(self.model, pack, &q[range], scaled);
            } else {
                for ((scaled, q), r) in scaled.iter_mut().zip(&q[range]).zip(self.root(pack)) {
                    (0..LANES).for_each(|lane| scaled.0[lane] = q.0[lane] * r.0[lane]);
                }
            }
            0.0
        });
    }

    /// Replaces `q₋` in `before` by `w = A q − β q₋`, from the forces −f; returns `w·q`.
    fn product(&self, q: &[Lanes], f: &mut [Lanes], beta: f64, before: &mut [Lanes]) -> f64 {
        over_packs(self.model, [f, before], |pack, range, [f, before]| {
            let mut own = 0.0;
            if self.model.packs.packs[pack].rigid {
                self.blocks.resultants(self.model, pack, f);
            }
            for (i, (at, r)) in range.zip(self.factors(pack)).enumerate() {
                for lane in 0..LANES {
                    let more = self.spectrum.added.get(at / 3).map_or(0.0, |more| more.0[lane]);
                    let product = more * q[at].0[lane] - f[i].0[lane] * r.0[lane];
                    before[i].0[lane] = product - beta * before[i].0[lane];
                    own += before[i].0[lane] * q[at].0[lane];
                }
            }
            own
        })
    }
}

/// Subtracts `α q` from `w`; returns the norm of the rest.
fn take_part(model: &Model, alpha: f64, q: &[Lanes], w: &mut [Lanes]) -> f64 {
    let square = over_packs(model, [w], |_, range, [w]| {
        let mut own = 0.0;
        for (w, q) in w.iter_mut().zip(&q[range]) {
            for lane in 0..LANES {
                w.0[lane] -= alpha * q.0[lane];
                own += w.0[lane] * w.0[lane];
            }
        }
        own
    });
    square.sqrt()
}

/// Exact sum of the values that `op` returns for each pack. `op` receives the pack, its range in a
/// nodal field, and its parts of the fields.
fn over_packs<const N: usize>(
    model: &Model,
    fields: [&mut [Lanes]; N],
    op: impl Fn(usize, Range<usize>, [&mut [Lanes]; N]) -> f64 + Sync,
) -> f64 {
    let packs = &model.packs;
    let mut sums = vec![0.0; packs.packs.len()];
    each_pack(packs, fields, &mut sums, |pack, fields, sum| {
        *sum = op(pack, node_start(packs, pack)..node_start(packs, pack + 1), fields);
    });
    sum(sums)
}

/// Inverse roots `m^{-½}` of the masses of the nodes of equal packs; 0 without mass, 1 in rigid
/// blocks.
fn inverse_roots(model: &Model) -> Vec<Vec<Lanes>> {
    let root = |m: f64| if m > 0.0 { 1.0 / m.sqrt() } else { 0.0 };
    let class = |inertia: &Inertia| {
        inertia.mass.iter().flat_map(|mass| [Lanes(mass.0.map(root)); 3]).collect()
    };
    let mut roots: Vec<Vec<Lanes>> = model.assembly.inertia.iter().map(class).collect();
    for (pack, &class) in model.packs.packs.iter().zip(&model.assembly.pack_inertia) {
        if pack.rigid {
            roots[class as usize].fill(Lanes([1.0; LANES]));
        }
    }
    roots
}

/// Factors of tied nodes as in [`Operator`], `√m_i / M` with the mass `M` of all of them.
fn tied_returns(model: &Model) -> Vec<Vec<Lanes>> {
    let class = |inertia: &Inertia| {
        let Some(tied) = &inertia.tied else { return Vec::new() };
        let factor = |(own, all): (&Lanes, &Lanes)| {
            let of = |own: f64, all: f64| if all > 0.0 { own.sqrt() / all } else { 0.0 };
            [Lanes(std::array::from_fn(|lane| of(own.0[lane], all.0[lane]))); 3]
        };
        inertia.mass.iter().zip(&tied.mass).flat_map(factor).collect()
    };
    model.assembly.inertia.iter().map(class).collect()
}

/// Fixed sequence of numbers between −½ and ½.
pub(crate) struct XorShift(pub(crate) u64);

impl XorShift {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// Unit vector that favours no mode: numbers of a fixed sequence for each pack, 0 in lanes without
/// a block and in parts of bodies. It is zero if all blocks are parts of bodies.
pub(super) fn start(model: &Model, n: usize) -> Vec<Lanes> {
    let mut q = vec![Lanes::ZERO; n];
    let square = over_packs(model, [&mut q], |pack, _, [q]| {
        let Pack { rigid, filled, .. } = model.packs.packs[pack];
        let mut random = XorShift(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(2 * pack as u64 + 1));
        let mut own = 0.0;
        for q in q.iter_mut().take(if rigid { 6 } else { usize::MAX }) {
            for lane in 0..filled {
                let x = random.next();
                if rigid && model.assembly.bodies.body(pack, lane).is_some() {
                    continue;
                }
                q.0[lane] = x;
                own += x * x;
            }
        }
        own
    });
    let norm = square.sqrt();
    if norm > 0.0 {
        q.iter_mut().for_each(|q| q.0.iter_mut().for_each(|x| *x /= norm));
    }
    q
}

fn tridiagonal(diagonal: &[f64], beside: &[f64]) -> DMatrix<f64> {
    let n = diagonal.len();
    DMatrix::from_fn(n, n, |i, k| match i.abs_diff(k) {
        0 => diagonal[i],
        1 => beside[i.min(k)],
        _ => 0.0,
    })
}

fn largest_of_tridiagonal(diagonal: &[f64], beside: &[f64]) -> f64 {
    tridiagonal(diagonal, beside).symmetric_eigenvalues().max()
}

/// Size of the last component of the unit eigenvector of the largest eigenvalue.
fn last_of_largest(diagonal: &[f64], beside: &[f64]) -> f64 {
    let eigen = tridiagonal(diagonal, beside).symmetric_eigen();
    let last = eigen.eigenvectors.nrows() - 1;
    eigen.eigenvectors[(last, eigen.eigenvalues.imax())].abs()
}
