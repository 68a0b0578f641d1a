//! Failure in a relaxation (§7): which of the overloaded pairs fail, and when.

use std::collections::BTreeMap;

use crate::output::tractions::Overloads;
use crate::run::Simulation;
use crate::state::{RelaxationProgress, State};
use crate::step::{EvaluationStep, balance};
use ddem_joint::point::FailureCheck;
use ddem_mechanics::math::lanes::Lanes;

/// Unbalanced force ratio at which pairs are checked for failure, if the tolerance is not larger.
const NEAR: f64 = 1e-4;
/// Joints fail together with the most loaded one around them if their load is at least this fraction
/// of its load. They are equal as far as is known near equilibrium. The failure may relieve others.
const MOST_LOADED: f64 = 0.995;
/// Fraction of its excess over the strength with which a load counts for the blocks beside its own two.
/// A failure relieves them less.
const BESIDE: f64 = 0.7;
/// Steps between two looks at the loads after pairs have failed.
const LOOK_INTERVAL: usize = 3;
/// Steps after a failure in which the loads around it settle.
const LAST_LOOK: usize = 100;
/// Overload above which pairs fail at a look. The loads still change a little until equilibrium.
const CLEAR_OVERLOAD: f64 = 1.02;

/// Joint between two blocks, or between two cells with all their parts.
type WholeJoint = [usize; 2];

impl Simulation {
    /// Fails the overloaded pairs of the most loaded joint of each place. Returns true if the relaxation
    /// begins anew from rest.
    ///
    /// The first pairs fail near equilibrium, so that no overshoot causes failure. A failure then
    /// changes the loads around it within few steps, and those far away slowly and little. Pairs that
    /// are clearly overloaded therefore fail as soon as the largest load around them has settled, the
    /// others at the next equilibrium. Pairs that shed no load relieve nothing when they fail, and do not
    /// wait until the loads have settled.
    pub(super) fn fails_now(&mut self, progress: &mut RelaxationProgress, tolerance: f64) -> bool {
        let near = tolerance.max(if progress.failure_checked { 0.0 } else { NEAR });
        let balanced = self.last.ratio() <= near && progress.has_stopped(near.max(self.still));
        if !self.model.can_fail() || !(balanced || looks(progress)) {
            return false;
        }
        let failed = self.state.failed;
        let Overloads { shedding, keeping } = self.as_measured().overloads();
        let joints = self.whole_joints(shedding);
        let around = self.largest_around(&joints);
        let fails = if balanced {
            progress.failure_checked = true;
            let state = &mut *self.state;
            state.watch.note_near_equilibrium(state.steps);
            let most_loaded = self.most_loaded(&joints, &around);
            self.fail_at_equilibrium(&most_loaded, keeping)
        } else {
            let settled = settled(&progress.overloads, &around);
            let most_loaded = self.most_loaded(&joints, &settled);
            progress.overloads = around;
            self.fail_at_look(&most_loaded, keeping)
        };
        if self.state.failed != failed {
            progress.fails_on = true;
            self.state.restart_watch(&self.model, false);
        }
        fails
    }

    /// Fails overloaded pairs of some joints, and those that shed no load if there are such (`keeping`),
    /// at an equilibrium. Rotated joints release their bonded pairs when nothing is overloaded. Returns
    /// true if any failed.
    fn fail_at_equilibrium(&mut self, joints: &[[(usize, usize); 2]], keeping: bool) -> bool {
        let releases = joints.is_empty() && !keeping;
        if releases && !self.as_measured().has_rotated_joints() {
            return false;
        }
        self.state.v.fill(Lanes::ZERO);
        let check = match releases {
            true => FailureCheck::Overloaded,
            false => FailureCheck::MostLoaded { joints, least: 1.0 },
        };
        let fails = self.fail_pairs(check, releases);
        if fails {
            // The motion up to here led from equilibrium to equilibrium.
            self.regain_cohesion();
            self.keep_slip(true);
        }
        fails
    }

    /// Fails clearly overloaded pairs of some joints, and those that shed no load if there are such
    /// (`keeping`), at a look. Returns true if pairs of the joints may have failed.
    fn fail_at_look(&mut self, joints: &[[(usize, usize); 2]], keeping: bool) -> bool {
        if joints.is_empty() && !keeping {
            return false;
        }
        let check = FailureCheck::MostLoaded { joints, least: CLEAR_OVERLOAD };
        let fails = self.fail_pairs(check, false) && !joints.is_empty();
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

    /// Block, or first block of a cell, of each of the two blocks of a joint.
    fn whole_joint(&self, joint: usize) -> WholeJoint {
        let bodies = &self.state.contacts.bodies;
        let body = |block: usize| bodies.get(block).map_or(block, |&first| first as usize);
        self.model.joint(joint).blocks().map(body)
    }

    /// Largest overload of each joint.
    fn whole_joints(&self, overloads: Vec<(usize, f64)>) -> BTreeMap<WholeJoint, f64> {
        let mut joints = BTreeMap::new();
        for (joint, overload) in overloads {
            let most = joints.entry(self.whole_joint(joint)).or_insert(overload);
            *most = overload.max(*most);
        }
        joints
    }

    /// Largest overload of the joints of each block, and of the blocks beside it by [`BESIDE`].
    fn largest_around(&self, joints: &BTreeMap<WholeJoint, f64>) -> Vec<f64> {
        let mut own = vec![1.0_f64; self.model.n_blocks()];
        for (blocks, &overload) in joints {
            for &block in blocks {
                own[block] = overload.max(own[block]);
            }
        }
        let beside = |overload: f64| 1.0 + BESIDE * (overload - 1.0);
        let mut around = own.clone();
        for joint in self.model.joints() {
            let [a, b] = self.whole_joint(joint);
            around[a] = around[a].max(beside(own[b]));
            around[b] = around[b].max(beside(own[a]));
        }
        around
    }

    /// Blocks of the joints that carry the largest overload around them, by pack and lane, sorted.
    ///
    /// A joint may be relieved by the failure of a more loaded one of its two blocks, or of the blocks
    /// beside them. Joints farther apart do not wait for each other. The pairs of one joint share its
    /// load: a failure of some loads the others more.
    fn most_loaded(
        &self,
        joints: &BTreeMap<WholeJoint, f64>,
        around: &[f64],
    ) -> Vec<[(usize, usize); 2]> {
        let is_most = |blocks: WholeJoint| {
            let around = blocks.map(|block| around[block]);
            let own = joints.get(&blocks);
            own.is_some_and(|&own| own >= MOST_LOADED * around[0].max(around[1]))
        };
        let mut most_loaded: Vec<_> = self
            .model
            .joints()
            .filter(|&joint| is_most(self.whole_joint(joint)))
            .map(|joint| self.model.joint(joint).blocks().map(|at| self.model.packs.slot(at)))
            .collect();
        most_loaded.sort_unstable();
        most_loaded
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
            [0, 2, 3, 99, 102].map(|steps| at(steps, true)),
            [false, false, true, true, false]
        );
        assert!(!at(3, false));
    }
}
