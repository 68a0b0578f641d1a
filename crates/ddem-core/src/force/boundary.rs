//! §10: what is outside of the model does to one pack: dashpots, and forces that come in.

use nalgebra::{Matrix3, Vector3};

use crate::boundary::{Dashpot, Push};
use crate::lanes::Lanes;
use crate::motion::{Coefficients, Motion};

/// `q += pushes` on the nodes of a pack whose first place in a nodal field is `first`, over nothing
/// where no load acts yet.
pub(crate) fn push(
    dashpots: &[Dashpot],
    pushes: &[Push],
    first: usize,
    (q, loaded): (&mut [Lanes], bool),
) {
    if !loaded {
        q.fill(Lanes::ZERO);
    }
    for (dashpot, push) in dashpots.iter().zip(pushes) {
        let at = dashpot.at as usize - first;
        for c in 0..3 {
            q[at + c].0[dashpot.lane as usize] += push.force[c] + push.wave[c];
        }
    }
}

/// `f += D`, the force `D = −C (v⁻ + v⁺)/2` of the dashpots of a pack, with the `v⁺` that (M2) gives
/// under all forces, `D` among them: kept in `drags`.
pub(crate) fn resist(
    motion: &Motion,
    coefficients: &Coefficients,
    (dashpots, pushes): (&[Dashpot], &[Push]),
    velocities: &[[f64; 3]],
    (first, v, f): (usize, &[Lanes], &mut [Lanes]),
    drags: &mut [[f64; 3]],
) {
    for ((dashpot, push), drag) in dashpots.iter().zip(pushes).zip(drags) {
        let (at, lane) = (dashpot.at as usize - first, usize::from(dashpot.lane));
        let three = |field: &[Lanes]| Vector3::from([0, 1, 2].map(|c| field[at + c].0[lane]));
        let (now, force) = (three(v), three(f));
        let numbers = [0, 1, 2].map(|c| coefficients.at(at + c, lane));
        let drawn = if motion.fictitious {
            Vector3::zeros()
        } else if motion.start {
            -(dashpot.resistance * now)
        } else {
            let ahead = ahead(motion, &numbers, (dashpot, push), velocities, (now, force));
            let drawn = -(dashpot.resistance * (now + ahead)) * 0.5;
            match motion.local {
                0.0 => drawn,
                // Local damping takes its part of the force that is left: the velocity counts.
                _ => Vector3::from_fn(|k, _| match dashpot.held(k) {
                    None => motion.force_for(now[k], ahead[k], numbers[k]) - force[k],
                    Some(_) => drawn[k],
                }),
            }
        };
        *drag = drawn.into();
        (0..3).for_each(|c| f[at + c].0[lane] += drawn[c]);
    }
}

/// `v⁺ = a v⁻ + b (F − C (v⁻ + v⁺)/2)`; where a support holds the node, its velocity.
fn ahead(
    motion: &Motion,
    numbers: &[[f64; 3]; 3],
    (dashpot, push): (&Dashpot, &Push),
    velocities: &[[f64; 3]],
    (now, force): (Vector3<f64>, Vector3<f64>),
) -> Vector3<f64> {
    let drawn = dashpot.resistance * now * 0.5;
    let (mut matrix, mut right) = (Matrix3::identity(), Vector3::zeros());
    for k in 0..3 {
        if let Some(fix) = dashpot.held(k) {
            right[k] = velocities[fix][k];
            continue;
        }
        let [a, b, _] = numbers[k];
        let still = if now[k] == 0.0 { 0.0 } else { now[k].signum() };
        let wave = push.wave[k];
        let left = force[k] - motion.local * (force[k] - wave).abs() * still;
        right[k] = a * now[k] + b * (left - drawn[k]);
        for j in 0..3 {
            matrix[(k, j)] += 0.5 * b * dashpot.resistance[(k, j)];
        }
    }
    // The matrix is the identity and a product of positive ones: it can be solved; were it not, the run would stop.
    matrix.lu().solve(&right).unwrap_or_else(|| Vector3::repeat(f64::NAN))
}

/// Power of the dashpots of a pack with the velocities `v`: what they take `[W]`.
pub(crate) fn power(dashpots: &[Dashpot], drags: &[[f64; 3]], first: usize, v: &[Lanes]) -> f64 {
    let each = dashpots.iter().zip(drags).map(|(dashpot, drag)| {
        let at = dashpot.at as usize - first;
        let along = |c: usize| drag[c] * v[at + c].0[usize::from(dashpot.lane)];
        -(along(0) + along(1) + along(2))
    });
    each.sum()
}
