//! Sums over all nodes in a step: forces, works, kinetic energy.
//!
//! Work is that of the leap-frog scheme itself. A force G at time t does `½ G·v⁻ Δt` with the
//! velocity of the half step before and `½ G·v⁺ Δt` with the velocity after. Kinetic energy
//! `½ v⁻ m v⁺` plus strain energy minus work is then constant to rounding for a linear model.
//!
//! If the step changes from Δt⁻ to Δt⁺, kinetic energy is `½ v⁻ m (v⁻ + Δt⁻/h (v⁺ − v⁻))`. At the
//! start of a stage it is `½ v m v`, and a force does its work over h with the mean of both
//! velocities.

use fearless_simd::{Simd, f64x4};

use crate::math::exact::sum;
use crate::math::lanes::{Lanes, Vector, add, zero};

/// Sums over the nodes of a pack, or of all packs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepSums {
    /// Squares `Σ F²` of the unbalanced forces `[N²]`.
    pub free: f64,
    /// Squares `Σ (Q + R)²` of loads and reactions `[N²]`.
    pub applied: f64,
    /// Power `Σ F·v` of relaxation with the velocity before or after `[W]`. If the step changes it
    /// is `Σ v⁻ m (v⁺ − v⁻)` `[J]`.
    pub power: f64,
    /// Power of the loads at the half steps before and after `[W]`.
    pub loads: [f64; 2],
    /// Power of the supports, with the velocities before and after `[W]`.
    pub supports: [f64; 2],
    /// Power that damping takes, with the velocities before and after `[W]`.
    pub damping: [f64; 2],
    /// Kinetic energy `½ Σ v⁻ m v⁺` `[J]`, or `½ Σ v m v` with velocities at the present time;
    /// evaluated without motion.
    pub kinetic: f64,
    /// Kinetic energy `½ Σ m (v⁺ − v⁻)²` of the change of velocity, if the step changes `[J]`.
    pub change: f64,
    /// Squares `Σ v⁺·v⁺` of the displacement increments in a step of relaxation `[m²]`.
    pub moved: f64,
    /// Largest absolute velocity component in each lane `[m/s]`; in a total the first lane holds
    /// that of all packs.
    pub fastest: Lanes,
}

impl StepSums {
    /// Sum over packs, independent of their order.
    pub fn total(packs: &[Self]) -> Self {
        let of = |part: fn(&Self) -> f64| sum(packs.iter().map(part));
        let fastest = packs.iter().flat_map(|sums| sums.fastest.0).fold(0.0, f64::max);
        Self {
            free: of(|sums| sums.free),
            applied: of(|sums| sums.applied),
            power: of(|sums| sums.power),
            loads: [of(|sums| sums.loads[0]), of(|sums| sums.loads[1])],
            supports: [of(|sums| sums.supports[0]), of(|sums| sums.supports[1])],
            damping: [of(|sums| sums.damping[0]), of(|sums| sums.damping[1])],
            kinetic: of(|sums| sums.kinetic),
            change: of(|sums| sums.change),
            moved: of(|sums| sums.moved),
            fastest: Lanes([fastest, 0.0, 0.0, 0.0]),
        }
    }

    /// Unbalanced force ratio `‖F_free‖ / ‖F_applied + reactions‖` (§7). It is NaN if nothing is
    /// applied and forces are unbalanced.
    pub fn ratio(&self) -> f64 {
        match (self.free, self.applied) {
            (0.0, _) => 0.0,
            (_, 0.0) => f64::NAN,
            (free, applied) => (free / applied).sqrt(),
        }
    }
}

/// Sums over the nodes of a pack that a loop over its nodes may take, in the order of their cost.
/// A loop takes the first few of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sum {
    /// [`StepSums::free`].
    Free,
    /// [`StepSums::damping`], with the velocity before.
    DampingBefore,
    /// [`StepSums::damping`], with the velocity after.
    DampingAfter,
    /// [`StepSums::loads`], with the velocity before.
    LoadsBefore,
    /// [`StepSums::loads`], with the velocity after.
    LoadsAfter,
    /// [`StepSums::power`].
    Power,
    /// [`StepSums::moved`].
    Moved,
    /// [`StepSums::kinetic`].
    Kinetic,
    /// [`StepSums::change`].
    Change,
}

impl Sum {
    /// Number of sums.
    pub const COUNT: usize = Self::Change as usize + 1;
}

/// The first `N` sums of the four lanes over the nodes of a pack. They add by component and by row
/// of nodes. Chains of additions are therefore short and the same for every caller.
#[derive(Clone, Copy)]
pub struct NodeSums<S: Simd, const N: usize> {
    row: [Vector<S>; N],
    pack: [Vector<S>; N],
}

impl<S: Simd, const N: usize> NodeSums<S, N> {
    /// Empty sums.
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        Self { row: [zero(simd); N], pack: [zero(simd); N] }
    }

    /// Adds the term of one component of one node to a sum.
    #[inline(always)]
    pub fn add(&mut self, sum: Sum, component: usize, term: f64x4<S>) {
        self.row[sum as usize][component] += term;
    }

    /// Ends a row, after its last node.
    #[inline(always)]
    pub fn end_row(&mut self, simd: S) {
        for (pack, row) in self.pack.iter_mut().zip(&mut self.row) {
            *pack = add(*pack, *row);
            *row = zero(simd);
        }
    }

    /// Writes the sums of the pack to `sums`.
    #[inline(always)]
    pub fn give(self, sums: &mut StepSums) {
        let of = |sum: Sum| match self.pack.get(sum as usize) {
            Some(&[x, y, z]) => Lanes::from(x + y + z).sum(),
            None => 0.0,
        };
        sums.free = of(Sum::Free);
        sums.damping = [of(Sum::DampingBefore), of(Sum::DampingAfter)];
        sums.loads = [of(Sum::LoadsBefore), of(Sum::LoadsAfter)];
        sums.power = of(Sum::Power);
        sums.moved = of(Sum::Moved);
        sums.kinetic = of(Sum::Kinetic);
        sums.change = of(Sum::Change);
    }
}
