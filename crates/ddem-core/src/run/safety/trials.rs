//! Trials of a search for the factor of safety, and the order in which they run.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use rayon::prelude::*;

use super::rungs::{RUNG, rungs, thirds};
use super::{Safety, SafetyTrial, SearchNews, TellSearch, TrialProgress};
use crate::error::RunError;
use crate::model::stage::SafetySearch;
use crate::run::Simulation;
use crate::run::relax::Relaxed;
use crate::run::saved::Saved;
use crate::state::profile::Profile;
use crate::state::watch::Verdict;

/// Unbalanced force ratio of rounding above which a trial is undecided, as a fraction of the
/// resolution: blocks that slide under so small a force would count as at rest.
const ROUNDED: f64 = 0.1;

/// Excess of the logarithm of a factor over that of a rung, relative to it, that is rounding.
const ROUNDED_RUNG: f64 = 1e-9;
/// Path of the last steps, over half of the whole path, at which a trial is at rest if its tolerance is
/// not larger. A trial only asks if blocks move on; the last bit of a slow settlement would take most
/// of its steps.
const STILL: f64 = 1e-4;

/// State from which trials begin.
struct TrialStart {
    /// Divisor of its strengths.
    divisor: f64,
    saved: Saved,
}

impl TrialStart {
    /// State of a simulation at rest.
    fn of(divisor: f64, simulation: &mut Simulation) -> Self {
        simulation.finish_relaxation();
        Self { divisor, saved: simulation.save() }
    }
}

/// Trial, and its final state unless it was known or others have begun from it.
type Tried = (SafetyTrial, Option<Simulation>);

/// Trials of the rungs above a state.
#[derive(Default)]
struct Climb {
    tried: Vec<Tried>,
    /// State at the end of the last stable one, if there is one.
    last: Option<TrialStart>,
    profile: Profile,
}

impl Safety {
    /// Adds a trial.
    fn add(&mut self, (trial, mut simulation): Tried) {
        if let Some(simulation) = &mut simulation {
            self.profile.add(&simulation.take_profile(), 1.0);
        }
        let [stable, unstable] = &mut self.bracket;
        if trial.verdict != Verdict::AtRest {
            if unstable.is_none_or(|known| trial.factor < known) {
                *unstable = Some(trial.factor);
                self.failing = simulation.map(Box::new);
            }
        } else if stable.is_none_or(|known| trial.factor > known) {
            *stable = Some(trial.factor);
        }
        self.trials.push(trial);
        // A larger factor that is stable, above one that fails, is at the limit: the failure counts.
        if let [Some(stable), Some(unstable)] = self.bracket
            && stable >= unstable
        {
            let rests =
                |trial: &&SafetyTrial| trial.verdict == Verdict::AtRest && trial.factor < unstable;
            let below = self.trials.iter().filter(rests);
            self.bracket[0] = below.map(|trial| trial.factor).reduce(f64::max);
        }
    }

    /// Adds the trials of rungs; returns the state at the end of the last stable one.
    fn add_climb(&mut self, climb: Climb) -> Option<TrialStart> {
        climb.tried.into_iter().for_each(|tried| self.add(tried));
        self.profile.add(&climb.profile, 1.0);
        climb.last
    }
}

/// Trials of a search.
pub(super) struct Trials<'a> {
    pub(super) start: &'a Simulation,
    pub(super) search: &'a SafetySearch,
    /// Numbers of the joints whose strengths are divided.
    pub(super) divided: Vec<usize>,
    /// Trials of an earlier search of this state.
    pub(super) known: &'a [SafetyTrial],
    pub(super) tell: &'a TellSearch<'a>,
}

impl Trials<'_> {
    /// Finds the largest rung that is stable, then tries pairs of factors until the bracket is as narrow
    /// as the resolution.
    pub(super) fn find(&self) -> Result<Safety, RunError> {
        let mut found = Safety {
            factor: None,
            bracket: [None; 2],
            trials: Vec::new(),
            failing: None,
            profile: Profile::default(),
        };
        let own = TrialStart { divisor: 1.0, saved: self.start.save() };
        let further = self.climb(&own, &mut found)?;
        let base = further.as_ref().unwrap_or(&own);
        while let [Some(stable), Some(unstable)] = found.bracket {
            let Some(thirds) = thirds([stable, unstable], self.search.resolution) else { break };
            let before = found.trials.len() as u64;
            let tried = thirds.into_par_iter().zip([1, 2]);
            let tried =
                tried.map(|(factor, number)| self.try_factor(base, factor, before + number));
            for tried in tried.collect::<Vec<_>>() {
                found.add(tried?);
            }
        }
        if let [Some(stable), Some(unstable)] = found.bracket {
            found.factor = Some((stable * unstable).sqrt());
        }
        let is_lowest = found.bracket[1] == Some(self.search.bracket[0]);
        self.finish(if is_lowest { &own } else { base }, &mut found)?;
        Ok(found)
    }

    /// Tries the lowest factor, and rungs above it and above 1 until one is not stable. Returns the state
    /// at the end of the largest stable one above 1, if there is one.
    fn climb(&self, own: &TrialStart, found: &mut Safety) -> Result<Option<TrialStart>, RunError> {
        let low = self.search.bracket[0];
        if low <= 1.0 {
            // Both begin with the present strengths.
            let (lowest, climb) =
                rayon::join(|| self.try_factor(own, low, 1), || self.try_rungs(own, 2));
            found.add(lowest?);
            return Ok(found.add_climb(climb?));
        }
        let (lowest, mut simulation) = self.run(own, low, 1)?;
        if lowest.verdict != Verdict::AtRest {
            found.add((lowest, Some(simulation)));
            return Ok(None);
        }
        found.profile.add(&simulation.take_profile(), 1.0);
        found.add((lowest, None));
        let base = TrialStart::of(low, &mut simulation);
        drop(simulation);
        let climb = self.try_rungs(&base, 2)?;
        Ok(found.add_climb(climb).or(Some(base)))
    }

    /// Tries the rungs above a state until one is not stable; the first has this `number`.
    fn try_rungs(&self, base: &TrialStart, number: u64) -> Result<Climb, RunError> {
        let mut simulation = self.begin(base)?;
        let mut climb = Climb::default();
        let mut from = base.divisor;
        for (factor, number) in rungs(self.search).into_iter().zip(number..) {
            let known = self.known(factor);
            if let Some(known) = known.filter(|known| known.verdict != Verdict::AtRest) {
                climb.tried.push((known, None));
                break;
            }
            let trial = self.reduce(&mut simulation, [from, factor], number)?;
            climb.profile.add(&simulation.take_profile(), 1.0);
            if trial.verdict != Verdict::AtRest {
                climb.tried.push((trial, Some(simulation)));
                break;
            }
            climb.tried.push((trial, None));
            climb.last = Some(TrialStart::of(factor, &mut simulation));
            from = factor;
        }
        Ok(climb)
    }

    /// Runs the trial of a factor unless it is known.
    fn try_factor(&self, base: &TrialStart, factor: f64, number: u64) -> Result<Tried, RunError> {
        if let Some(known) = self.known(factor) {
            return Ok((known, None));
        }
        let (trial, simulation) = self.run(base, factor, number)?;
        Ok((trial, Some(simulation)))
    }

    /// Gives the unstable trial of the smallest factor in its final state, which a known trial has
    /// not.
    fn finish(&self, base: &TrialStart, found: &mut Safety) -> Result<(), RunError> {
        let Some(unstable) = found.bracket[1] else { return Ok(()) };
        if found.failing.is_none() {
            let place = found.trials.iter().position(|trial| trial.factor == unstable);
            let number = place.map_or(0, |place| place as u64 + 1);
            let (_, mut simulation) = self.run(base, unstable, number)?;
            found.profile.add(&simulation.take_profile(), 1.0);
            found.failing = Some(Box::new(simulation));
        }
        if let Some(failing) = &mut found.failing {
            failing.failing = true;
        }
        Ok(())
    }

    /// Trial of a factor that an earlier search knew.
    fn known(&self, factor: f64) -> Option<SafetyTrial> {
        self.known.iter().find(|known| known.factor == factor).copied()
    }

    /// Copy of the model in a state.
    fn begin(&self, base: &TrialStart) -> Result<Simulation, RunError> {
        let mut simulation = self.start.back_to(&base.saved)?;
        simulation.finish_relaxation();
        simulation.far = self.search.limit;
        simulation.still = STILL;
        Ok(simulation)
    }

    /// Relaxes a copy with the strengths divided by a factor.
    fn run(
        &self,
        base: &TrialStart,
        factor: f64,
        number: u64,
    ) -> Result<(SafetyTrial, Simulation), RunError> {
        let mut simulation = self.begin(base)?;
        let trial = self.reduce(&mut simulation, [base.divisor, factor], number)?;
        Ok((trial, simulation))
    }

    /// Reduces the strengths of a simulation from one divisor to another in parts, and relaxes it.
    fn reduce(
        &self,
        simulation: &mut Simulation,
        [from, factor]: [f64; 2],
        trial: u64,
    ) -> Result<SafetyTrial, RunError> {
        let ratio = factor / from;
        let parts = (libm::log(ratio) / libm::log(RUNG) - ROUNDED_RUNG).ceil().max(1.0);
        let mut progress = TrialProgress { trial, factor, step: 0, unbalanced: None };
        let mut part = 1.0;
        let verdict = loop {
            let divisor = if part < parts { from * libm::pow(ratio, part / parts) } else { factor };
            simulation.model.laws.clone_from(&self.start.model.laws);
            let all = self.search.joints.is_none();
            simulation.reduce_strengths(&self.divided, all, divisor);
            simulation.start_relaxation(1)?;
            let verdict = self.come_to_rest(simulation, &mut progress)?;
            if verdict != Verdict::AtRest || part >= parts {
                break verdict;
            }
            part += 1.0;
        };
        let trial = SafetyTrial { factor, verdict, steps: progress.step };
        let told = match self.known(factor) {
            Some(_) => ControlFlow::Continue(()),
            None => (self.tell)(SearchNews::Trial(&trial)),
        };
        if told.is_break() { Err(RunError::Stopped) } else { Ok(trial) }
    }

    /// Relaxes until there is a verdict, and counts the steps.
    fn come_to_rest(
        &self,
        simulation: &mut Simulation,
        progress: &mut TrialProgress,
    ) -> Result<Verdict, RunError> {
        let search = self.search;
        loop {
            match simulation.relax_step(search.tolerance) {
                Ok(Relaxed::Done) => return Ok(Verdict::AtRest),
                Err(RunError::NoEquilibrium { .. } | RunError::DeepPenetration { .. }) => {
                    return Ok(Verdict::Fails);
                }
                // Only rounding is out of balance.
                Err(RunError::UnreachableTolerance { ratio, .. }) => {
                    let is_small = ratio <= ROUNDED * search.resolution;
                    return Ok(if is_small { Verdict::AtRest } else { Verdict::Undecided });
                }
                Err(error) => return Err(error),
                Ok(_) if progress.step >= search.max_steps => return Ok(Verdict::Undecided),
                Ok(_) => progress.step += 1,
            }
            let ratio = simulation.unbalanced();
            progress.unbalanced = ratio.is_finite().then_some(ratio);
            let told = (self.tell)(SearchNews::Step(progress));
            if told.is_break() || simulation.stop.load(Ordering::Relaxed) {
                return Err(RunError::Stopped);
            }
        }
    }
}
