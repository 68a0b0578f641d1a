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
use crate::math::lanes::{Lanes, splat};

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
    /// evaluated in a trial.
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

/// Running sums of the four lanes over a pack. They add by rows of nodes, planes of rows, and all
/// planes. Chains of additions are therefore short and the same for every caller.
#[derive(Clone, Copy)]
pub struct SumsByRow<S: Simd> {
    row: RunningSum<S>,
    plane: RunningSum<S>,
    pack: RunningSum<S>,
    /// Rows of a plane, and rows of the present plane so far.
    rows: [usize; 2],
}

#[derive(Clone, Copy)]
struct RunningSum<S: Simd> {
    free: f64x4<S>,
    power: f64x4<S>,
    loads: [f64x4<S>; 2],
    damping: [f64x4<S>; 2],
    kinetic: f64x4<S>,
    change: f64x4<S>,
    moved: f64x4<S>,
}

impl<S: Simd> RunningSum<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        let two = [zero; 2];
        Self {
            free: zero,
            power: zero,
            loads: two,
            damping: two,
            kinetic: zero,
            change: zero,
            moved: zero,
        }
    }

    #[inline(always)]
    fn add(&mut self, more: &Self) {
        self.free += more.free;
        self.power += more.power;
        for side in 0..2 {
            self.loads[side] += more.loads[side];
            self.damping[side] += more.damping[side];
        }
        self.kinetic += more.kinetic;
        self.change += more.change;
        self.moved += more.moved;
    }
}

impl<S: Simd> SumsByRow<S> {
    /// Empty sums of blocks with some elements along each edge.
    #[inline(always)]
    pub fn new(simd: S, divisions: usize) -> Self {
        let none = RunningSum::new(simd);
        Self { row: none, plane: none, pack: none, rows: [divisions + 1, 0] }
    }

    /// Ends a row, after its last node.
    #[inline(always)]
    pub fn end_row(&mut self, simd: S) {
        self.plane.add(&self.row);
        self.row = RunningSum::new(simd);
        let [all, done] = &mut self.rows;
        *done += 1;
        if done == all {
            *done = 0;
            self.pack.add(&self.plane);
            self.plane = RunningSum::new(simd);
        }
    }

    /// Adds the square of the force on one component of one node.
    #[inline(always)]
    pub fn force(&mut self, force: f64x4<S>) {
        self.row.free += force * force;
    }

    /// Adds the power of a load on one component of one node, with the velocities before and after.
    #[inline(always)]
    pub fn loaded(&mut self, load: f64x4<S>, before: f64x4<S>, after: f64x4<S>) {
        self.row.loads[0] += load * before;
        self.row.loads[1] += load * after;
    }

    /// Adds the power of a damping force `D` (against the motion), with the velocities before and
    /// after.
    #[inline(always)]
    pub fn damped(&mut self, force: f64x4<S>, before: f64x4<S>, after: f64x4<S>) {
        self.row.damping[0] += force * before;
        self.row.damping[1] += force * after;
    }

    /// Adds the square of the force on a component, and its power with the velocity before, for
    /// relaxation.
    #[inline(always)]
    pub fn relaxed(&mut self, force: f64x4<S>, old: f64x4<S>) {
        self.row.free += force * force;
        self.row.power += force * old;
    }

    /// Adds the power of the force on a component, and the square of its displacement increment,
    /// for relaxation.
    #[inline(always)]
    pub fn moved(&mut self, force: f64x4<S>, new: f64x4<S>) {
        self.row.power += force * new;
        self.row.moved += new * new;
    }

    /// Adds kinetic energies `½ m v⁻ v⁺` from velocities half a step before and after.
    #[inline(always)]
    pub fn kinetic(&mut self, mass: f64x4<S>, before: f64x4<S>, after: f64x4<S>) {
        self.row.kinetic += mass * before * after * 0.5;
    }

    /// Adds the terms of a velocity change `more`, if the step changes.
    #[inline(always)]
    pub fn change(&mut self, mass: f64x4<S>, before: f64x4<S>, more: f64x4<S>) {
        self.row.power += mass * before * more;
        self.row.change += mass * more * more * 0.5;
    }

    /// Writes the sums of the pack to `sums`.
    #[inline(always)]
    pub fn give(self, sums: &mut StepSums) {
        debug_assert_eq!(self.rows[1], 0, "a plane has not ended");
        let sum = |x: f64x4<S>| Lanes::from(x).sum();
        sums.free = sum(self.pack.free);
        sums.power = sum(self.pack.power);
        sums.loads = self.pack.loads.map(sum);
        sums.damping = self.pack.damping.map(sum);
        sums.kinetic = sum(self.pack.kinetic);
        sums.change = sum(self.pack.change);
        sums.moved = sum(self.pack.moved);
    }
}
