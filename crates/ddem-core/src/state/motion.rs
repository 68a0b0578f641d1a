//! Coefficients of (M2) for a step (§6).
//!
//! `v⁺ = [(m/h − c/2) v⁻ + F] / (m/h + c/2)` with `h = ½ (Δt⁻ + Δt⁺)`, the time between the half
//! steps before and after, is `v⁺ = a v⁻ + b F`. `a` and `b` stay the same until the step changes.
//! Velocities at the present time, as at the start of a stage, have `Δt⁻ = 0`.

use fearless_simd::{Simd, f64x4};

use crate::model::stage::Damping;
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::math::leapfrog::{before_local_damping, coefficients};
use ddem_mechanics::rigid::MassProperties;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::inertia::Inertia;

/// Coefficients `a`, `b` and damping `c` of the nodes of equal packs, three of each per node.
#[derive(Clone, Debug)]
pub(crate) struct Coefficients {
    pub(crate) a: Vec<Lanes>,
    pub(super) b: Vec<Lanes>,
    pub(super) c: Vec<Lanes>,
}

impl Coefficients {
    pub(crate) fn at(&self, at: usize, lane: usize) -> [f64; 3] {
        [self.a[at].0[lane], self.b[at].0[lane], self.c[at].0[lane]]
    }

    /// Fields `a`, `b` and `c`.
    pub(crate) fn fields(&self) -> [&[Lanes]; 3] {
        [&self.a, &self.b, &self.c]
    }

    /// Coefficients of four blocks.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S, at: usize) -> [f64x4<S>; 3] {
        [self.a[at].load(simd), self.b[at].load(simd), self.c[at].load(simd)]
    }

    /// Coefficients from mass and damping of each degree of freedom; 0 without mass, so that
    /// nothing moves.
    fn new(n: usize, interval: f64, mass_properties: impl Fn(usize, usize) -> (f64, f64)) -> Self {
        let numbers = |i: usize, lane: usize| match mass_properties(i, lane) {
            (m, c) if m > 0.0 => {
                let [a, b] = coefficients(m / interval, c);
                [a, b, c]
            }
            _ => [0.0; 3],
        };
        let each = |k: usize| {
            let lanes = |i| Lanes(std::array::from_fn(|lane| numbers(i, lane)[k]));
            (0..n).map(lanes).collect()
        };
        Self { a: each(0), b: each(1), c: each(2) }
    }
}

/// Settings of (M2) for a step.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// Δt⁺ `[s]`; 1 in relaxation.
    pub(crate) time_step: f64,
    /// Δt⁻, the step of the velocities `[s]`; 0 if they are at the present time.
    pub(crate) before: f64,
    /// h, the time over which forces change velocities `[s]`.
    pub(crate) interval: f64,
    /// Coefficients for each [`Inertia`], under the same number.
    pub(crate) classes: Vec<Coefficients>,
    damping: Damping,
    /// β of stiffness damping `[s]`.
    pub(crate) stiffness: f64,
    /// α of local damping.
    pub(crate) local: f64,
    /// True in a relaxation: forces are only balanced, and (M2) moves no nodes.
    pub(crate) fictitious: bool,
}

impl Motion {
    /// Motion of a dynamic stage, with damping of every kind in §6. Of the paper's forms these are
    /// the mass-proportional part of eq. (9), and eq. (10).
    pub(crate) fn dynamic(
        assembly: &Assembly,
        damping: Damping,
        before: f64,
        time_step: f64,
    ) -> Self {
        Self::over(assembly, damping, [before, time_step], 0.5 * (before + time_step))
    }

    /// Motion with another h between Δt⁻ and Δt⁺.
    pub(crate) fn over(
        assembly: &Assembly,
        damping: Damping,
        [before, time_step]: [f64; 2],
        interval: f64,
    ) -> Self {
        let damping_of = |inertia: &Inertia, i: usize, lane: usize| {
            let m = inertia.moved_mass()[i / 3].0[lane];
            let k = inertia.moved_diagonal()[i].0[lane];
            let c = match damping {
                Damping::Ratio(zeta) => 2.0 * zeta * (m * k).sqrt(),
                Damping::Mass(alpha) => alpha * m,
                Damping::Stiffness(_) | Damping::Local(_) | Damping::None => 0.0,
            };
            (m, c)
        };
        let class = |inertia: &Inertia| {
            let n = inertia.diagonal.len();
            Coefficients::new(n, interval, |i, lane| damping_of(inertia, i, lane))
        };
        Self {
            time_step,
            before,
            interval,
            classes: assembly.inertia.iter().map(class).collect(),
            damping,
            stiffness: damping.stiffness(),
            local: if let Damping::Local(alpha) = damping { alpha } else { 0.0 },
            fictitious: false,
        }
    }

    /// Motion until a step is set: energies are those of a vanishing step.
    pub(crate) fn without_step(assembly: &Assembly) -> Self {
        Self::dynamic(assembly, Damping::None, 0.0, 1e-12)
    }

    /// Motion for the balance of forces in a relaxation: unit steps and no damping.
    pub(crate) fn relaxing(assembly: &Assembly) -> Self {
        Self { fictitious: true, ..Self::dynamic(assembly, Damping::None, 1.0, 1.0) }
    }

    /// Motion for velocities of another step.
    pub(crate) fn after(&self, assembly: &Assembly, before: f64) -> Self {
        Self::dynamic(assembly, self.damping, before, self.time_step)
    }

    /// Ratio `Δt⁻/h`. The change of velocities times half of it leads to the present time. Times
    /// all of it, it leads as far beyond that time as the velocities were before it.
    pub(crate) fn previous_step_ratio(&self) -> f64 {
        self.before / self.interval
    }

    /// True if the time step changes.
    pub(crate) fn changes(&self) -> bool {
        self.before != self.time_step
    }

    /// True if there is any damping.
    pub(crate) fn is_damped(&self) -> bool {
        self.damping != Damping::None
    }

    /// Damping `c/m` of a degree of freedom with stiffness k and mass m `[1/s]`, from `k/m`.
    pub(crate) fn rate(&self, square: f64) -> f64 {
        match self.damping {
            Damping::Mass(alpha) => alpha,
            Damping::Ratio(zeta) => 2.0 * zeta * square.sqrt(),
            Damping::Stiffness(_) | Damping::Local(_) | Damping::None => 0.0,
        }
    }

    /// Damping `c/m` of the translation of a rigid block along each axis, and of its rotation
    /// `[1/s]`.
    pub(crate) fn rates(&self, mass_properties: &MassProperties) -> [f64; 4] {
        match self.damping {
            Damping::Mass(alpha) => [alpha; 4],
            Damping::Ratio(zeta) => {
                let rate = |k: usize| {
                    2.0 * zeta * (mass_properties.stiffness[k] / mass_properties.mass).sqrt()
                };
                let [x, y, z] = [rate(0), rate(1), rate(2)];
                [x, y, z, (x + y + z) / 3.0]
            }
            Damping::Stiffness(_) | Damping::Local(_) | Damping::None => [0.0; 4],
        }
    }

    /// Force with which (M2) changes the velocity `now` into `target`.
    pub(crate) fn force_for(&self, now: f64, target: f64, [a, b, _]: [f64; 3]) -> f64 {
        before_local_damping(self.local, (target - a * now) / b, now)
    }
}

/// Velocity `v⁺` of one component of a node of four blocks, (M2).
#[inline(always)]
pub(crate) fn advanced<S: Simd>([a, b]: [f64x4<S>; 2], v: f64x4<S>, force: f64x4<S>) -> f64x4<S> {
    a * v + b * force
}
