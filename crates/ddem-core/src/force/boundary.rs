//! Forces from outside the model on one pack: dashpots and boundary forces (§10).

use nalgebra::{Matrix3, Vector3};

use crate::model::boundary::{BoundaryForce, Dashpot};
use crate::state::motion::{Coefficients, Motion};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::math::leapfrog::local_damping;

/// Dashpots of one pack, and the boundary forces at their nodes.
#[derive(Clone, Copy)]
pub(crate) struct Dashpots<'a> {
    pub(crate) list: &'a [Dashpot],
    pub(crate) boundary_forces: &'a [BoundaryForce],
    /// Velocity of each support (`fix`) `[m/s]`.
    pub(crate) velocities: &'a [[f64; 3]],
    /// Index of the pack's first value in a nodal field.
    pub(crate) first: usize,
}

impl Dashpots<'_> {
    /// Adds the boundary forces to the loads `q`.
    pub(crate) fn add_boundary_forces(&self, q: &mut [Lanes]) {
        for (dashpot, boundary_force) in self.list.iter().zip(self.boundary_forces) {
            let at = dashpot.at as usize - self.first;
            for c in 0..3 {
                q[at + c].0[dashpot.lane as usize] +=
                    boundary_force.force[c] + boundary_force.wave[c];
            }
        }
    }

    /// Adds the dashpot forces `D = −C v̄` at the present time to `f` and stores them in
    /// `dashpot_forces`. `v̄` uses the `v⁺` that (M2) gives under all forces, `D` included.
    pub(crate) fn add_dashpot_forces(
        &self,
        motion: &Motion,
        coefficients: &Coefficients,
        v: &[Lanes],
        f: &mut [Lanes],
        dashpot_forces: &mut [[f64; 3]],
    ) {
        for ((dashpot, boundary_force), force) in
            self.list.iter().zip(self.boundary_forces).zip(dashpot_forces)
        {
            let (at, lane) = (dashpot.at as usize - self.first, usize::from(dashpot.lane));
            let three = |field: &[Lanes]| Vector3::from([0, 1, 2].map(|c| field[at + c].0[lane]));
            let node = DashpotNode {
                dashpot,
                wave: boundary_force.wave / dashpot.share,
                numbers: [0, 1, 2].map(|c| coefficients.at(at + c, lane)),
                now: three(v),
                force: three(f),
            };
            let taken = node.dashpot_force(motion, self.velocities);
            *force = (taken * dashpot.share).into();
            (0..3).for_each(|c| f[at + c].0[lane] += taken[c]);
        }
    }

    /// Power that the dashpots dissipate at the velocities `v` `[W]`.
    pub(crate) fn power(&self, v: &[Lanes], dashpot_forces: &[[f64; 3]]) -> f64 {
        let each = self.list.iter().zip(dashpot_forces).map(|(dashpot, force)| {
            let at = dashpot.at as usize - self.first;
            let along = |c: usize| force[c] * v[at + c].0[usize::from(dashpot.lane)];
            -(along(0) + along(1) + along(2))
        });
        each.sum()
    }
}

/// Node with dashpots: velocity, force without theirs, and coefficients of (M2).
struct DashpotNode<'a> {
    dashpot: &'a Dashpot,
    wave: Vector3<f64>,
    numbers: [[f64; 3]; 3],
    now: Vector3<f64>,
    force: Vector3<f64>,
}

impl DashpotNode<'_> {
    fn dashpot_force(&self, motion: &Motion, velocities: &[[f64; 3]]) -> Vector3<f64> {
        let Self { dashpot, now, force, numbers, .. } = self;
        if motion.fictitious {
            return Vector3::zeros();
        }
        let fraction = 0.5 * motion.previous_step_ratio();
        let ahead = self.ahead(motion.local, fraction, velocities);
        let taken = -(dashpot.resistance * (now * (1.0 - fraction) + ahead * fraction));
        if motion.local == 0.0 {
            return taken;
        }
        // (M2) applies local damping to the total force. Invert it, so that it gives `ahead`.
        Vector3::from_fn(|k, _| match dashpot.held(k) {
            None => motion.force_for(now[k], ahead[k], numbers[k]) - force[k],
            Some(_) => taken[k],
        })
    }

    /// Velocity `v⁺ = a v⁻ + b (F − C v̄)` with `v̄ = (1 − θ) v⁻ + θ v⁺`, θ the `fraction` `[m/s]`.
    /// Supported axes have the velocity of their support.
    fn ahead(&self, local: f64, fraction: f64, velocities: &[[f64; 3]]) -> Vector3<f64> {
        let Self { dashpot, wave, now, force, numbers } = self;
        let taken = dashpot.resistance * now * (1.0 - fraction);
        let (mut matrix, mut right) = (Matrix3::identity(), Vector3::zeros());
        for k in 0..3 {
            if let Some(fix) = dashpot.held(k) {
                right[k] = velocities[fix][k];
                continue;
            }
            let [a, b, _] = numbers[k];
            let left = force[k] - local_damping(local, force[k] - wave[k], now[k]);
            right[k] = a * now[k] + b * (left - taken[k]);
            for j in 0..3 {
                matrix[(k, j)] += fraction * b * dashpot.resistance[(k, j)];
            }
        }
        // The identity plus a product of positive matrices is invertible. Otherwise NaN stops the
        // run.
        matrix.lu().solve(&right).unwrap_or_else(|| Vector3::repeat(f64::NAN))
    }
}
