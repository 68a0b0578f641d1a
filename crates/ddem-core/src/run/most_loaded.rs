//! Failure in a relaxation (§7): which of the overloaded pairs fail, and when.

use crate::run::Simulation;
use crate::state::{RelaxationProgress, State};
use crate::step::{EvaluationStep, balance};
use ddem_joint::point::FailureCheck;
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// Unbalanced force ratio at which pairs are checked for failure, if the tolerance is not larger.
const NEAR: f64 = 1e-4;
/// Pairs fail together with the most loaded one around them if their load is at least this fraction
/// of its load. They are equal as far as is known near equilibrium. The failure may relieve others.
const MOST_LOADED: f64 = 0.995;
/// Steps between two looks at the loads after pairs have failed.
const LOOK_INTERVAL: usize = 10;
/// Steps after a failure in which the loads around it settle.
const LAST_LOOK: usize = 100;
/// Overload above which pairs fail at a look. The loads still change a little until equilibrium.
const CLEAR_OVERLOAD: f64 = 1.02;

impl Simulation {
    /// Fails the most loaded pairs of each place; returns true if any failed.
    ///
    /// The first pairs fail near equilibrium, so that no overshoot causes failure. A failure then
    /// changes the loads around it within few steps, and those far away slowly and little. Pairs that
    /// are clearly overloaded therefore fail as soon as the largest load around them has settled, the
    /// others at the next equilibrium.
    pub(super) fn fails_now(&mut self, progress: &mut RelaxationProgress, tolerance: f64) -> bool {
        let near = tolerance.max(if progress.failure_checked { 0.0 } else { NEAR });
        let balanced = self.last.ratio() <= near && progress.has_stopped(near);
        if !self.model.can_fail() || !(balanced || looks(progress)) {
            return false;
        }
        let overloads = self.largest_around(&self.as_measured().overloads(balanced));
        let fails = if balanced {
            progress.failure_checked = true;
            let state = &mut *self.state;
            state.watch.note_near_equilibrium(state.steps);
            self.fail_at_equilibrium(&overloads)
        } else {
            let settled = settled(&progress.overloads, &overloads);
            progress.overloads = overloads;
            self.fail_settled(&settled)
        };
        if fails {
            progress.fails_on = true;
            self.state.restart_watch(&self.model, false);
        }
        fails
    }

    /// Fails the most loaded pairs at an equilibrium, from rest. Rotated joints release their bonded
    /// pairs when nothing is overloaded.
    fn fail_at_equilibrium(&mut self, overloads: &[f64]) -> bool {
        let releases = overloads.iter().all(|&overload| overload <= 1.0);
        if releases && !self.as_measured().has_rotated_joints() {
            return false;
        }
        self.state.v.fill(Lanes::ZERO);
        let divisors = &self.failure_divisors(overloads);
        let check = FailureCheck::MostLoaded { divisors, at_equilibrium: true };
        let fails = self.fail_pairs(check, releases);
        if fails {
            // The motion up to here led from equilibrium to equilibrium.
            self.keep_slip(true);
        }
        fails
    }

    /// Fails the most loaded pairs at a look. The relaxation restarts from rest if any fail.
    fn fail_settled(&mut self, overloads: &[f64]) -> bool {
        if overloads.iter().all(|overload| overload.is_infinite()) {
            return false;
        }
        let divisors = &self.failure_divisors(overloads);
        let check = FailureCheck::MostLoaded { divisors, at_equilibrium: false };
        let fails = self.fail_pairs(check, false);
        if fails {
            self.state.v.fill(Lanes::ZERO);
        }
        fails
    }

    /// Fails pairs by a check, and the bonded pairs of rotated joints if the check `releases` them.
    /// Returns true if any failed.
    fn fail_pairs(&mut self, check: FailureCheck<'_>, releases: bool) -> bool {
        let failed = self.state.failed;
        let (mut context, state, scratch) = self.parts();
        context.failure_check = check;
        context.releases_rotated_joints &= releases;
        let State { u, v, poses, broken_joints, contacts, .. } = state;
        let (_, losses) =
            balance(context, EvaluationStep { u, v, poses, broken_joints, contacts }, scratch);
        self.add_losses(losses);
        self.state.failed != failed
    }

    /// Divisors of the tractions in the check for failure, by pack and lane, from the largest
    /// overload around each block.
    ///
    /// A pair may be relieved by the failure of a more loaded one of its two blocks, or of the blocks
    /// beside them. Pairs farther apart do not wait for each other.
    fn failure_divisors(&self, overloads: &[f64]) -> Vec<Lanes> {
        let packs = &self.model.packs;
        let mut divisors = vec![Lanes([1.0; LANES]); packs.packs.len()];
        for (block, overload) in overloads.iter().enumerate() {
            let (pack, lane) = packs.slot(block);
            divisors[pack].0[lane] = (MOST_LOADED * overload).max(1.0);
        }
        divisors
    }

    /// Largest of the values of each block and of the blocks beside it. The parts of a cell are one
    /// block.
    fn largest_around(&self, values: &[f64]) -> Vec<f64> {
        let bodies = &self.state.contacts.bodies;
        let body = |block: usize| bodies.get(block).map_or(block, |&first| first as usize);
        let mut own = vec![0.0_f64; values.len()];
        for (block, &value) in values.iter().enumerate() {
            own[body(block)] = value.max(own[body(block)]);
        }
        let mut around = own.clone();
        for joint in 0..self.model.n_joints() {
            let [a, b] = self.model.joint(joint).blocks().map(body);
            around[a] = around[a].max(own[b]);
            around[b] = around[b].max(own[a]);
        }
        (0..values.len()).map(|block| around[body(block)]).collect()
    }
}

/// True if this step looks at the loads after pairs have failed.
fn looks(progress: &RelaxationProgress) -> bool {
    let steps = progress.steps;
    progress.fails_on && steps.is_multiple_of(LOOK_INTERVAL) && (1..=LAST_LOOK).contains(&steps)
}

/// Overloads that are clear and have not changed since the look before by more than equal loads
/// differ; infinite for the others.
fn settled(before: &[f64], now: &[f64]) -> Vec<f64> {
    let is_settled = |before: f64, now: f64| {
        now >= CLEAR_OVERLOAD && now >= MOST_LOADED * before && before >= MOST_LOADED * now
    };
    let pairs = before.iter().chain(std::iter::repeat(&0.0)).zip(now);
    pairs.map(|(&a, &b)| if is_settled(a, b) { b } else { f64::INFINITY }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clear_overloads_that_stay_have_settled() {
        let now = [1.5, 1.5, 1.5, 1.01, 1.0];
        assert!(settled(&[], &now).iter().all(|overload| overload.is_infinite()), "no look before");
        let later = settled(&[1.5, 1.497, 1.6, 1.01, 1.0], &now);
        let is_settled: Vec<_> = later.iter().map(|overload| overload.is_finite()).collect();
        assert_eq!(is_settled, [true, true, false, false, false]);
    }

    #[test]
    fn looks_follow_failures_for_a_while() {
        let at = |steps: usize, fails_on: bool| {
            looks(&RelaxationProgress { steps, fails_on, ..RelaxationProgress::default() })
        };
        assert_eq!(
            [0, 5, 10, 100, 110].map(|steps| at(steps, true)),
            [false, false, true, true, false]
        );
        assert!(!at(10, false));
    }
}
