//! §6: the critical step, `Δt = 2/ω_max` with `ω_max²` the largest eigenvalue of `M⁻¹ K`.
//!
//! Power iteration on the real operator, in the form of Lanczos: the Krylov space of the same
//! products, from which the largest eigenvalue comes to rounding in some dozens of them. Supports
//! are left out: they can only lower it.

use nalgebra::DMatrix;

use crate::assembly::Inertia;
use crate::lanes::Lanes;
use crate::model::Model;
use crate::parallel::node_start;
use crate::scratch::Scratch;
use crate::step::linear_forces;

/// Most products with K.
const MOST_STEPS: usize = 120;
/// Relative change of the eigenvalue over [`PATIENCE`] products at which it is found.
const TOLERANCE: f64 = 1e-10;
const PATIENCE: usize = 8;

/// Largest eigenvalue of `M⁻¹ K` for diagonal masses, given for each degree of freedom by
/// (inertia, place, lane).
pub(crate) fn largest_eigenvalue(
    model: &Model,
    scratch: &mut Scratch,
    mass: &dyn Fn(&Inertia, usize, usize) -> f64,
) -> f64 {
    let n = 3 * model.packs.nodes;
    let roots = inverse_roots(model, mass);
    let root = |pack: usize| &roots[model.assembly.pack_inertia[pack] as usize];
    // M^{-½} K M^{-½}: the same eigenvalues, symmetric.
    let mut q = start(model, n, &roots);
    let mut before = vec![Lanes::ZERO; n];
    let mut scaled = vec![Lanes::ZERO; n];
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let mut values: Vec<f64> = Vec::new();
    for _ in 0..MOST_STEPS {
        for_each_pack(model, |pack, range| {
            for (at, r) in range.zip(root(pack)) {
                for lane in 0..4 {
                    scaled[at].0[lane] = q[at].0[lane] * r.0[lane];
                }
            }
        });
        linear_forces(model, &scaled, scratch);
        // w = A q − β q₋; α = w·q; w −= α q; β = |w|. The product is −f.
        let beta = beside.last().copied().unwrap_or(0.0);
        let mut alpha = 0.0;
        for_each_pack(model, |pack, range| {
            for (at, r) in range.zip(root(pack)) {
                for lane in 0..4 {
                    let product = -scratch.f[at].0[lane] * r.0[lane];
                    before[at].0[lane] = product - beta * before[at].0[lane];
                    alpha += before[at].0[lane] * q[at].0[lane];
                }
            }
        });
        let mut norm = 0.0;
        for (w, q) in before.iter_mut().zip(&q) {
            for lane in 0..4 {
                w.0[lane] -= alpha * q.0[lane];
                norm += w.0[lane] * w.0[lane];
            }
        }
        let beta = norm.sqrt();
        diagonal.push(alpha);
        values.push(largest_of_tridiagonal(&diagonal, &beside));
        let largest = values[values.len() - 1];
        let settled = values.len() > PATIENCE
            && largest - values[values.len() - 1 - PATIENCE] <= TOLERANCE * largest;
        if settled || beta <= 1e-13 * largest {
            break;
        }
        beside.push(beta);
        for (w, q) in before.iter_mut().zip(&mut q) {
            for lane in 0..4 {
                let next = w.0[lane] / beta;
                w.0[lane] = q.0[lane];
                q.0[lane] = next;
            }
        }
    }
    values.last().copied().unwrap_or(0.0)
}

fn for_each_pack(model: &Model, mut f: impl FnMut(usize, std::ops::Range<usize>)) {
    for pack in 0..model.packs.packs.len() {
        f(pack, node_start(&model.packs, pack)..node_start(&model.packs, pack + 1));
    }
}

/// `m^{-½}` of the nodes of equal packs; 0 where there is no mass.
fn inverse_roots(
    model: &Model,
    mass: &dyn Fn(&Inertia, usize, usize) -> f64,
) -> Vec<Vec<Lanes>> {
    let root = |m: f64| if m > 0.0 { 1.0 / m.sqrt() } else { 0.0 };
    let class = |inertia: &Inertia| {
        let lanes = |at: usize| Lanes(std::array::from_fn(|lane| root(mass(inertia, at, lane))));
        (0..inertia.diagonal.len()).map(lanes).collect()
    };
    model.assembly.inertia.iter().map(class).collect()
}

/// A unit vector that favours no mode: numbers from a fixed sequence.
fn start(model: &Model, n: usize, roots: &[Vec<Lanes>]) -> Vec<Lanes> {
    let mut q = vec![Lanes::ZERO; n];
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    let mut norm = 0.0;
    for_each_pack(model, |pack, range| {
        let root = &roots[model.assembly.pack_inertia[pack] as usize];
        for (at, root) in range.zip(root) {
            for lane in (0..4).filter(|&lane| root.0[lane] > 0.0) {
                seed ^= seed << 13;
                seed ^= seed >> 7;
                seed ^= seed << 17;
                let x = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
                q[at].0[lane] = x;
                norm += x * x;
            }
        }
    });
    let norm = norm.sqrt();
    q.iter_mut().for_each(|q| q.0.iter_mut().for_each(|x| *x /= norm));
    q
}

fn largest_of_tridiagonal(diagonal: &[f64], beside: &[f64]) -> f64 {
    let n = diagonal.len();
    let matrix = DMatrix::from_fn(n, n, |i, k| match i.abs_diff(k) {
        0 => diagonal[i],
        1 => beside[i.min(k)],
        _ => 0.0,
    });
    matrix.symmetric_eigenvalues().max()
}
