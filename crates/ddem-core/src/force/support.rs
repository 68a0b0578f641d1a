//! Fixed and driven nodes: the force that makes a node move as prescribed.

use crate::conditions::Support;
use crate::lanes::Lanes;
use crate::motion::{Coefficients, Motion};

/// Reactions of the supports of one pack `[N]`: added to `f`, so that (M2) gives the prescribed
/// velocity, and kept in `reactions`.
pub(crate) fn react(
    motion: &Motion,
    coefficients: &Coefficients,
    supports: &[Support],
    velocities: &[[f64; 3]],
    (first, v, f): (usize, &[Lanes], &mut [Lanes]),
    reactions: &mut [f64],
) {
    for (support, reaction) in supports.iter().zip(reactions) {
        let (at, lane) = (support.at as usize - first, support.lane as usize);
        let target = velocities[support.fix as usize][support.axis as usize];
        let [a, b, c] = coefficients.at(at, lane);
        let (now, force) = (v[at].0[lane], f[at].0[lane]);
        *reaction = motion.force_for(now, target, [a, b, c]) - force;
        f[at].0[lane] = force + *reaction;
    }
}

/// Supports have the last word on velocities: no rounding lets a held node creep.
pub(crate) fn enforce(
    supports: &[Support],
    velocities: &[[f64; 3]],
    first: usize,
    v: &mut [Lanes],
) {
    for support in supports {
        let target = velocities[support.fix as usize][support.axis as usize];
        v[support.at as usize - first].0[support.lane as usize] = target;
    }
}
