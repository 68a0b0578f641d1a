//! Sums over all nodes that a step leaves behind: forces, works, kinetic energy.
//!
//! Work is that of the leap-frog scheme itself: a force G at time t does `½ G·v⁻ Δt` with the
//! velocity of the half step before and `½ G·v⁺ Δt` with the one after. Then kinetic energy
//! `½ v⁻ m v⁺` plus strain energy minus work is constant to rounding for a linear model.
//! Where the step changes, from Δt⁻ to Δt⁺, kinetic energy is `½ v⁻ m (v⁻ + Δt⁻/h (v⁺ − v⁻))`, `½ v m v` at the
//! start of a stage, and a force does its work over h with the mean of both velocities.

use fearless_simd::{Simd, f64x4};

use crate::math::exact::sum;
use crate::math::lanes::{Lanes, splat};

/// Sums over the nodes of a pack, or over all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepSums {
    /// `Σ F²`, the forces that are out of balance `[N²]`.
    pub free: f64,
    /// `Σ (Q + R)²`, loads and reactions `[N²]`.
    pub applied: f64,
    /// `Σ F·v` of relaxation, with the velocity before or after `[W]`; `Σ v⁻ m (v⁺ − v⁻)` where the step changes `[J]`.
    pub power: f64,
    /// Power of the loads at the half steps before and after `[W]`.
    pub loads: [f64; 2],
    /// Power of the supports `[W]`.
    pub supports: [f64; 2],
    /// Power that damping takes `[W]`.
    pub damping: [f64; 2],
    /// `½ Σ v⁻ m v⁺`, or `½ Σ v m v` of velocities at the present time `[J]`; in a trial.
    pub kinetic: f64,
    /// `½ Σ m (v⁺ − v⁻)²` `[J]`, where the step changes.
    pub change: f64,
    /// `Σ v⁺·v⁺` of a step of relaxation `[m²]`.
    pub moved: f64,
    /// Largest size of a component of velocity, by lane; over all packs in the first `[m/s]`.
    pub fastest: Lanes,
}

impl StepSums {
    /// Sum over packs, in whatever order.
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

    /// Unbalanced force ratio `‖F_free‖ / ‖F_applied + reactions‖` (§7); not a number where
    /// nothing is applied and forces are out of balance.
    pub fn ratio(&self) -> f64 {
        match (self.free, self.applied) {
            (0.0, _) => 0.0,
            (_, 0.0) => f64::NAN,
            (free, applied) => (free / applied).sqrt(),
        }
    }
}

/// Running sums of the four lanes while a pack is gone through: by rows of nodes, planes of rows, and all planes, so
/// that chains of additions are short and the same wherever they are made.
#[derive(Clone, Copy)]
pub struct SumsByRow<S: Simd> {
    row: RunningSum<S>,
    plane: RunningSum<S>,
    pack: RunningSum<S>,
    /// Rows of a plane, and of the present one so far.
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
    /// Of bodies with some elements along each edge.
    #[inline(always)]
    pub fn new(simd: S, divisions: usize) -> Self {
        let none = RunningSum::new(simd);
        Self { row: none, plane: none, pack: none, rows: [divisions + 1, 0] }
    }

    /// After the last node of each row.
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

    /// The force on one component of one node.
    #[inline(always)]
    pub fn force(&mut self, force: f64x4<S>) {
        self.row.free += force * force;
    }

    /// The load on one component of one node and the velocities before and after.
    #[inline(always)]
    pub fn loaded(&mut self, load: f64x4<S>, before: f64x4<S>, after: f64x4<S>) {
        self.row.loads[0] += load * before;
        self.row.loads[1] += load * after;
    }

    /// The damping force `D` (against the motion) and the velocities before and after.
    #[inline(always)]
    pub fn damped(&mut self, force: f64x4<S>, before: f64x4<S>, after: f64x4<S>) {
        self.row.damping[0] += force * before;
        self.row.damping[1] += force * after;
    }

    /// For relaxation: the force on a component and its velocity before.
    #[inline(always)]
    pub fn relaxed(&mut self, force: f64x4<S>, old: f64x4<S>) {
        self.row.free += force * force;
        self.row.power += force * old;
    }

    /// For relaxation: the force on a component and the way that it goes.
    #[inline(always)]
    pub fn moved(&mut self, force: f64x4<S>, new: f64x4<S>) {
        self.row.power += force * new;
        self.row.moved += new * new;
    }

    /// Adds kinetic energies `½ m v⁻ v⁺`, of velocities half a step before and after.
    #[inline(always)]
    pub fn kinetic(&mut self, mass: f64x4<S>, before: f64x4<S>, after: f64x4<S>) {
        self.row.kinetic += mass * before * after * 0.5;
    }

    /// The velocity before and its change, where the step changes.
    #[inline(always)]
    pub fn change(&mut self, mass: f64x4<S>, before: f64x4<S>, more: f64x4<S>) {
        self.row.power += mass * before * more;
        self.row.change += mass * more * more * 0.5;
    }

    /// Into the sums of the pack.
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
