//! Points of a joint lattice, four lanes side by side. They are stored field by field, so that a
//! step reads and writes only what it needs: bonded pairs have no slip and no damage.

use fearless_simd::{Simd, f64x4};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::point::{JointPoint, PairFailure};
use ddem_mechanics::law::points::{LastEquilibrium, Points};
use ddem_mechanics::law::{Equilibrium, FailureMode, PointState, Traction, damage_at_equilibrium};
use ddem_mechanics::math::lanes::{LANES, Lanes, load, splat};
use ddem_mechanics::math::number::Number;

/// Points of a joint lattice, by pair and lane.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LatticePoints {
    /// Springs of all pairs.
    pub(super) springs: Vec<SpringLanes>,
    /// Failure modes; `None` for bonded pairs.
    pub(super) modes: Vec<[Option<FailureMode>; LANES]>,
    /// Times of failure `[s]`; empty if no pair has failed.
    times: Vec<Lanes>,
    /// States of failed pairs; empty if no pair has failed.
    pub(super) failed: Vec<FailedLanes>,
    /// Last equilibriums of failed pairs, and the lanes that have one; empty outside of relaxations.
    equilibriums: Vec<([bool; LANES], EquilibriumLanes)>,
}

/// Springs of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct SpringLanes {
    /// [`JointPoint::area`] `[m²]`.
    pub(super) area: Lanes,
    /// [`JointPoint::origin`] `[m]`.
    pub(super) origin: [Lanes; 3],
    /// [`PointState::traction`], normal and shear `[Pa]`.
    pub(super) traction: [Lanes; 3],
    /// [`PointState::gap`] `[m]`.
    pub(super) gap: Lanes,
}

/// The rest of the [`PointState`] of a pair that has failed in at least one lane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct FailedLanes {
    pub(super) slip: [Lanes; 2],
    pub(super) dilation: Lanes,
    damage: Lanes,
    pub(super) applied_dilation: Lanes,
    added_tractions: [Lanes; 2],
    pub(super) energy_excess: Lanes,
}

/// [`Equilibrium`] of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct EquilibriumLanes {
    slip: [Lanes; 2],
    dilation: Lanes,
    damage: Lanes,
    gap: Lanes,
}

// Frequent copies reuse the memory of the target.
impl Clone for LatticePoints {
    fn clone(&self) -> Self {
        let mut clone = Self::default();
        clone.clone_from(self);
        clone
    }

    fn clone_from(&mut self, source: &Self) {
        let Self { springs, modes, times, failed, equilibriums } = source;
        self.springs.clone_from(springs);
        self.modes.clone_from(modes);
        self.times.clone_from(times);
        self.failed.clone_from(failed);
        self.equilibriums.clone_from(equilibriums);
    }
}

impl LatticePoints {
    /// Bonded points without area.
    pub(super) fn new(pairs: usize) -> Self {
        Self {
            springs: vec![SpringLanes::default(); pairs],
            modes: vec![[None; LANES]; pairs],
            ..Self::default()
        }
    }

    /// Number of pairs.
    pub fn len(&self) -> usize {
        self.springs.len()
    }

    /// True for strips and corners, which have no pairs.
    pub fn is_empty(&self) -> bool {
        self.springs.is_empty()
    }

    /// True if the fields have as many entries as there are pairs.
    pub(super) fn is_consistent(&self) -> bool {
        let whole = |n: usize| n == 0 || n == self.len();
        let optional = [self.times.len(), self.failed.len(), self.equilibriums.len()];
        self.modes.len() == self.len() && optional.into_iter().all(whole)
    }

    /// Memory in use `[bytes]`.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.springs[..])
            + size_of_val(&self.modes[..])
            + size_of_val(&self.times[..])
            + size_of_val(&self.failed[..])
            + size_of_val(&self.equilibriums[..])
    }

    /// Point of a pair in one lane.
    // Inlined, so that callers load only the fields that they use.
    #[inline(always)]
    pub fn get(&self, pair: usize, lane: usize) -> JointPoint {
        let springs = &self.springs[pair];
        let [normal, s, t] = springs.traction.map(|traction| traction.0[lane]);
        let mut state = PointState {
            traction: Traction { normal, shear: Vector2::new(s, t) },
            gap: springs.gap.0[lane],
            ..PointState::default()
        };
        if let Some(failed) = self.failed.get(pair) {
            state.slip = Vector2::from(failed.slip.map(|slip| slip.0[lane]));
            state.dilation = failed.dilation.0[lane];
            state.damage = failed.damage.0[lane];
            state.applied_dilation = failed.applied_dilation.0[lane];
            state.added_tractions = failed.added_tractions.map(|traction| traction.0[lane]);
            state.energy_excess = failed.energy_excess.0[lane];
        }
        let last = self.equilibriums.get(pair).filter(|(set, _)| set[lane]);
        state.equilibrium = last.map(|(_, last)| Equilibrium {
            slip: Vector2::from(last.slip.map(|slip| slip.0[lane])),
            dilation: last.dilation.0[lane],
            damage: last.damage.0[lane],
            gap: last.gap.0[lane],
        });
        let time = self.times.get(pair).map_or(0.0, |time| time.0[lane]);
        JointPoint {
            area: springs.area.0[lane],
            origin: Vector3::from(springs.origin.map(|c| c.0[lane])),
            failure: self.modes[pair][lane].map(|mode| PairFailure { mode, time }),
            state,
        }
    }

    /// Stores the point of a pair in one lane.
    pub(super) fn set(&mut self, pair: usize, lane: usize, point: &JointPoint) {
        let JointPoint { area, origin, failure, state } = point;
        let springs = &mut self.springs[pair];
        springs.area.0[lane] = *area;
        let Traction { normal, shear } = state.traction;
        for (c, traction) in [normal, shear.x, shear.y].into_iter().enumerate() {
            (springs.origin[c].0[lane], springs.traction[c].0[lane]) = (origin[c], traction);
        }
        springs.gap.0[lane] = state.gap;
        self.modes[pair][lane] = failure.map(|failure| failure.mode);
        self.set_failed(pair, lane, point);
        self.set_equilibrium(pair, lane, state.equilibrium);
    }

    /// Stores what only failed pairs have.
    fn set_failed(
        &mut self,
        pair: usize,
        lane: usize,
        JointPoint { failure, state, .. }: &JointPoint,
    ) {
        if failure.is_some() && self.failed.is_empty() {
            self.failed.resize(self.springs.len(), FailedLanes::default());
            self.times.resize(self.springs.len(), Lanes::ZERO);
        }
        let Some(failed) = self.failed.get_mut(pair) else { return };
        self.times[pair].0[lane] = failure.map_or(0.0, |failure| failure.time);
        for c in 0..2 {
            failed.slip[c].0[lane] = state.slip[c];
            failed.added_tractions[c].0[lane] = state.added_tractions[c];
        }
        failed.dilation.0[lane] = state.dilation;
        failed.damage.0[lane] = state.damage;
        failed.applied_dilation.0[lane] = state.applied_dilation;
        failed.energy_excess.0[lane] = state.energy_excess;
    }

    fn set_equilibrium(&mut self, pair: usize, lane: usize, equilibrium: Option<Equilibrium>) {
        if equilibrium.is_some() && self.equilibriums.is_empty() {
            self.equilibriums.resize(self.springs.len(), Default::default());
        }
        let Some((set, last)) = self.equilibriums.get_mut(pair) else { return };
        set[lane] = equilibrium.is_some();
        let Equilibrium { slip, dilation, damage, gap } = equilibrium.unwrap_or_default();
        (0..2).for_each(|c| last.slip[c].0[lane] = slip[c]);
        last.dilation.0[lane] = dilation;
        (last.damage.0[lane], last.gap.0[lane]) = (damage, gap);
    }

    /// Changes the point of a pair in one lane.
    pub(super) fn change(
        &mut self,
        pair: usize,
        lane: usize,
        change: impl FnOnce(&mut JointPoint),
    ) {
        let mut point = self.get(pair, lane);
        change(&mut point);
        self.set(pair, lane, &point);
    }

    /// Gives closed faces that have parted their residual cohesion again, in an equilibrium.
    pub(super) fn regain_cohesion(&mut self) {
        for (failed, springs) in self.failed.iter_mut().zip(&self.springs) {
            for (damage, gap) in failed.damage.0.iter_mut().zip(springs.gap.0) {
                *damage = damage_at_equilibrium(*damage, gap);
            }
        }
    }

    /// Stores the present state of all failed pairs as equilibrium if `now`; otherwise clears it.
    pub(super) fn set_equilibriums(&mut self, now: bool) {
        self.equilibriums.clear();
        if now && !self.failed.is_empty() {
            self.equilibriums.resize(self.len(), Default::default());
            (0..self.len()).for_each(|pair| self.add_equilibriums(pair, [true; LANES]));
        }
    }

    /// Stores the present state of the failed points of a pair as equilibrium in the given lanes
    /// that have none.
    pub(super) fn add_equilibriums(&mut self, pair: usize, lanes: [bool; LANES]) {
        for (lane, given) in lanes.into_iter().enumerate() {
            let known = self.equilibriums.get(pair).is_some_and(|(set, _)| set[lane]);
            if given && !known && self.modes[pair][lane].is_some() {
                let mut state = self.get(pair, lane).state;
                state.set_equilibrium();
                self.set_equilibrium(pair, lane, state.equilibrium);
            }
        }
    }

    /// States of the points of a pair in all lanes.
    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S, pair: usize) -> Points<f64x4<S>> {
        let (springs, failed) = (&self.springs[pair], &self.failed[pair]);
        let zero = splat(simd, 0.0);
        let [normal, s, t] = load(simd, &springs.traction);
        let mut points = Points {
            slip: [failed.slip[0].load(simd), failed.slip[1].load(simd)],
            dilation: failed.dilation.load(simd),
            damage: failed.damage.load(simd),
            gap: springs.gap.load(simd),
            applied_dilation: failed.applied_dilation.load(simd),
            normal,
            shear: [s, t],
            dashpot: failed.added_tractions[0].load(simd),
            correction: failed.added_tractions[1].load(simd),
            energy_excess: failed.energy_excess.load(simd),
            relaxing: zero.exceeds(zero),
            equilibrium: LastEquilibrium {
                slip: [zero; 2],
                dilation: zero,
                damage: zero,
                gap: zero,
            },
        };
        if let Some((set, last)) = self.equilibriums.get(pair) {
            let set = Lanes(set.map(|set| f64::from(u8::from(set))));
            points.relaxing = set.load(simd).exceeds(zero);
            points.equilibrium = LastEquilibrium {
                slip: [last.slip[0].load(simd), last.slip[1].load(simd)],
                dilation: last.dilation.load(simd),
                damage: last.damage.load(simd),
                gap: last.gap.load(simd),
            };
        }
        points
    }

    /// Stores the states of the points of a pair in the lanes of a mask.
    #[inline(always)]
    pub(super) fn store<S: Simd>(
        &mut self,
        simd: S,
        pair: usize,
        points: &Points<f64x4<S>>,
        mask: <f64x4<S> as Number>::Mask,
    ) {
        let (springs, failed) = (&mut self.springs[pair], &mut self.failed[pair]);
        let [normal, s, t] = &mut springs.traction;
        let FailedLanes {
            slip,
            dilation,
            damage,
            applied_dilation,
            added_tractions,
            energy_excess,
        } = failed;
        let ([slip_s, slip_t], [dashpot, correction]) = (slip, added_tractions);
        let numbers: [(&mut Lanes, f64x4<S>); 12] = [
            (normal, points.normal),
            (s, points.shear[0]),
            (t, points.shear[1]),
            (&mut springs.gap, points.gap),
            (slip_s, points.slip[0]),
            (slip_t, points.slip[1]),
            (dilation, points.dilation),
            (damage, points.damage),
            (applied_dilation, points.applied_dilation),
            (dashpot, points.dashpot),
            (correction, points.correction),
            (energy_excess, points.energy_excess),
        ];
        for (to, from) in numbers {
            *to = Lanes::from(f64x4::select(mask, from, to.load(simd)));
        }
    }
}
