//! Springs of the failed pairs of a joint lattice.

use fearless_simd::{Select, Simd, SimdBase, f64x4};

use super::springs::{LanesOf, SpringForces};
use crate::point::PairContext;
use ddem_mechanics::law::PointLoss;
use ddem_mechanics::law::springs::PointSprings;
use ddem_mechanics::law::strengths::LaneLaws;
use ddem_mechanics::math::lanes::{Lanes, Vector, add, cross, lanes_of, load, scale, splat, sub};
use ddem_mechanics::math::number::Number;
use ddem_mesh::joint_sections::JointSection;

/// Springs of the failed pairs of a joint section, four side by side.
pub(super) struct FailedSprings<'a, S: Simd> {
    laws: LaneLaws<'a, S>,
    springs: PointSprings<f64x4<S>>,
    /// True in a relaxation, in which the pairs slip from their last equilibrium.
    relaxing: bool,
    /// Losses so far, by friction, fracture and dashpots `[J]`.
    losses: [f64x4<S>; 3],
    /// Couple `Σ s × F` of the slips `[N m]`, along the joint's axes, and energy `[J]`, so far.
    couple: Vector<S>,
    stored: f64x4<S>,
    /// Square of the largest slip `[m²]`, and largest opening `[m]`, so far.
    moved: [f64x4<S>; 2],
}

impl<'a, S: Simd> FailedSprings<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, section: &JointSection, context: PairContext<'a>) -> Self {
        let dashpot = if context.undamped { Lanes::ZERO } else { section.dashpot };
        let [normal, shear] = section.stiffnesses();
        let springs = PointSprings {
            stiffness: [normal.load(simd), shear.load(simd)],
            dashpot: dashpot.load(simd),
            time_step: context.time_step,
        };
        let laws = LaneLaws::new(simd, section.laws, |number| context.law(number));
        let nothing = splat(simd, 0.0);
        Self {
            laws,
            springs,
            relaxing: context.relaxing,
            losses: [nothing; 3],
            couple: [nothing; 3],
            stored: nothing,
            moved: [nothing; 2],
        }
    }

    /// Updates the failed points of a pair. Returns their forces on side a `[N]`, 0 in other lanes.
    #[inline(always)]
    pub(super) fn force(
        &mut self,
        simd: S,
        LanesOf { points, pair, mask }: LanesOf<'_, S>,
        relative_displacement: Vector<S>,
    ) -> Vector<S> {
        let zero = splat(simd, 0.0);
        let springs = &points.springs[pair];
        let own = sub(relative_displacement, load(simd, &springs.origin));
        let area = mask.select(springs.area.load(simd), zero);
        let mut state = points.load(simd, pair);
        let loss = self.springs.update_points(&self.laws, own, &mut state);
        // Other lanes may hold any number, also infinite ones.
        let [normal, s, t] = state.total_traction();
        let traction = [mask.select(normal, zero), mask.select(s, zero), mask.select(t, zero)];
        let force = scale(traction, area);
        let slip = [zero, mask.select(state.slip[0], zero), mask.select(state.slip[1], zero)];
        let slip_squared = slip[1] * slip[1] + slip[2] * slip[2];
        self.moved[0] = self.moved[0].max(slip_squared);
        self.moved[1] = self.moved[1].max(mask.select(state.gap, zero));
        self.couple = add(self.couple, cross(slip, force));
        self.stored += mask.select(area * state.stored(self.springs.stiffness[1]), zero);
        let more = [loss.friction, loss.fracture, loss.damping];
        for (sum, more) in self.losses.iter_mut().zip(more) {
            *sum += mask.select(area * more, zero);
        }
        points.store(simd, pair, &state, mask);
        if self.relaxing {
            points.add_equilibriums(pair, lanes_of(mask));
        }
        force
    }

    /// Adds the couples and the energy of all pairs to sums.
    #[inline(always)]
    pub(super) fn add_sums(&self, simd: S, sums: &mut SpringForces) {
        sums.couple = add(load(simd, &sums.couple), self.couple).map(Lanes::from);
        sums.stored = Lanes::from(sums.stored.load(simd) + self.stored);
    }

    /// Losses of all pairs and lanes `[J]`.
    #[inline(always)]
    pub(super) fn loss(&self) -> PointLoss {
        let [friction, fracture, damping] = self.losses.map(|loss| Lanes::from(loss).sum());
        PointLoss { friction, fracture, contact: 0.0, damping }
    }

    /// Largest slip and opening of each lane `[m]`.
    #[inline(always)]
    pub(super) fn moved(&self) -> [Lanes; 2] {
        let [slip_squared, opening] = self.moved;
        [Lanes::from(slip_squared.root()), Lanes::from(opening)]
    }
}
