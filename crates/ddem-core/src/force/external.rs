//! Loads Q(t) of one pack: gravity and nodal loads.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use crate::model::conditions::NodalLoad;
use ddem_mechanics::math::lanes::{Lanes, add, load_at, scale, splat, store_at};

/// Loads on one pack: gravity times its factor `[m/s²]`, nodal loads and their factors.
#[derive(Clone, Copy)]
pub(crate) struct External<'a> {
    pub(crate) gravity: [f64; 3],
    /// Part of the masses that has weight, if it is not all.
    pub(crate) weight: Option<Lanes>,
    pub(crate) loads: &'a [NodalLoad],
    pub(crate) factors: &'a [f64],
}

/// Sets `q` to the loads Q(t) on the nodes of a pack; `first` is the index of the pack's first
/// value in a nodal field. Returns false and leaves `q` unchanged if no load acts.
#[simd]
pub(crate) fn apply<S: Simd>(
    simd: S,
    external: External<'_>,
    mass: &[Lanes],
    first: usize,
    q: &mut [Lanes],
) -> bool {
    let has_gravity = external.gravity != [0.0; 3];
    if !has_gravity && external.loads.is_empty() {
        return false;
    }
    if has_gravity {
        let mut gravity = external.gravity.map(|g| splat(simd, g));
        if let Some(weight) = external.weight {
            gravity = scale(gravity, weight.load(simd));
        }
        for (node, mass) in mass.iter().enumerate() {
            store_at(q, 3 * node, scale(gravity, mass.load(simd)));
        }
    } else {
        q.fill(Lanes::ZERO);
    }
    for load in external.loads {
        let factor = external.factors[load.load as usize];
        let at = load.at as usize - first;
        for c in 0..3 {
            q[at + c].0[load.lane as usize] += factor * load.force[c];
        }
    }
    true
}

/// Adds the loads `q` to `f`.
#[inline(always)]
pub(crate) fn add_to<S: Simd>(simd: S, f: &mut [Lanes], q: &[Lanes]) {
    for node in 0..f.len() / 3 {
        store_at(f, 3 * node, add(load_at(simd, f, 3 * node), load_at(simd, q, 3 * node)));
    }
}
