//! Stages that search for the factor of safety.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use ddem_core::{RunError, Safety, SafetySearch, SafetyTrial, Simulation, Verdict, undecided};
use ddem_deck::Stage;
use ddem_deck::lint::{Code, Diagnostic};

use super::moved::MovedBy;
use super::stage::failed;
use super::warnings::stage_place;
use super::{Event, Observer, RunFailure};
use crate::summary::StageSummary;

/// Searches for the factor of safety of the present state, which does not change. Records the
/// unstable trial with the smallest factor. Returns false if the observer stopped it.
pub(super) fn search(
    stage: &Stage,
    moved: &mut MovedBy,
    observer: &mut dyn Observer,
) -> Result<bool, RunFailure> {
    let start = Instant::now();
    let MovedBy { site, simulation, recorder, cursor, timer } = moved;
    timer.enter();
    timer.started(simulation);
    recorder.start(simulation, &stage.name, &mut |event| observer.event(event))?;
    timer.recorded(start.elapsed(), simulation);
    let begun = Instant::now();
    let shared = Mutex::new(&mut *observer);
    let found = simulation.factor_of_safety(&stage.search(), &|trial| {
        let mut observer = shared.lock().unwrap_or_else(PoisonError::into_inner);
        observer.event(Event::Trial { stage: &stage.name, trial });
    });
    let mut found = match found {
        Err(RunError::Stopped) => return Ok(false),
        found => found.map_err(failed(stage))?,
    };
    timer.tried(&found.profile, begun.elapsed());
    let begun = Instant::now();
    let mut moving = Vec::new();
    if let Some(failing) = &mut found.failing {
        recorder.frame(failing, &stage.name)?;
        if found.bracket[1].is_some() {
            moving = failing.moving_blocks();
        }
    }
    let verdict = verdict(cursor.done.last().map(|stage| stage.verdict), &found);
    let deck = site.deck();
    let place = stage_place(deck, stage);
    for warning in warnings(&found, &stage.search(), simulation) {
        cursor.warn(deck, warning.below(&place), observer);
    }
    let steps = found.trials.iter().map(|trial| trial.steps).sum();
    let seconds = start.elapsed().as_secs_f64();
    let updates = simulation.model().n_nodes() as f64 * steps as f64;
    simulation.check_finite().map_err(failed(stage))?;
    let (imbalance, state) = (simulation.energy().imbalance(), simulation.state_summary());
    timer.recorded(begun.elapsed(), simulation);
    let summary = StageSummary {
        name: stage.name.clone(),
        kind: "safety".to_owned(),
        verdict,
        moving,
        factor: found.factor,
        bracket: Some(found.bracket),
        trials: found.trials,
        steps,
        time_step: f64::NAN,
        limit: None,
        wall_seconds: seconds,
        node_updates_per_second: updates / seconds,
        unbalanced: simulation.unbalanced(),
        imbalance,
        state,
        profile: timer.finish(),
    };
    observer.event(Event::StageDone(&summary));
    cursor.done.push(summary);
    Ok(true)
}

/// Verdict for the actual strengths: that of the stage `before`, otherwise the one that follows
/// from the factor.
fn verdict(before: Option<Verdict>, found: &Safety) -> Verdict {
    let [stable, unstable] = found.bracket;
    match (before, found.factor.or(stable), unstable) {
        (Some(verdict @ (Verdict::AtRest | Verdict::Fails)), ..) => verdict,
        (_, Some(factor), _) if factor >= 1.0 => Verdict::AtRest,
        (_, _, end) if undecided(&found.trials, end) => Verdict::Undecided,
        (_, _, Some(factor)) if factor <= 1.0 => Verdict::Fails,
        (_, Some(_), Some(_)) => Verdict::Fails,
        _ => Verdict::Undecided,
    }
}

/// Warnings about a factor of safety that is uncertain or was not found. Their places are the keys
/// of the search.
pub(super) fn warnings(
    found: &Safety,
    search: &SafetySearch,
    simulation: &mut Simulation,
) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    let [low, high] = search.bracket;
    match found.bracket {
        [None, None] => {
            let Some(SafetyTrial { factor, steps, .. }) = found.trials.first() else {
                return warnings;
            };
            let message = format!(
                "there is no factor of safety: the trial with strengths / {factor:.4} was undecided after {steps} \
                 steps"
            );
            let help = decisive(*steps, search);
            warnings.push(Diagnostic::warning(Code::UndecidedTrial, "max_steps", message, help));
        }
        [None, Some(_)] => {
            let message = format!("the blocks fail with the smallest factor, {low}");
            let help = "lower the first number of `bracket`";
            warnings.push(Diagnostic::warning(Code::FactorBelowBracket, "bracket", message, help));
        }
        [Some(_), None] => {
            let why = why_it_holds(simulation);
            let message = format!("the blocks hold with the largest factor, {high}{why}");
            let help = "raise the second number of `bracket`";
            warnings.push(Diagnostic::warning(Code::FactorAboveBracket, "bracket", message, help));
        }
        _ => {}
    }
    let Some(unstable) = found.bracket[1] else { return warnings };
    let is_end =
        |trial: &&SafetyTrial| trial.factor == unstable && trial.verdict == Verdict::Undecided;
    if let Some(SafetyTrial { steps, .. }) = found.trials.iter().find(is_end) {
        let message = format!(
            "the trial with strengths / {unstable:.4} was undecided after {steps} steps and counts as unstable: the \
             factor of safety may be larger"
        );
        let help = decisive(*steps, search);
        warnings.push(Diagnostic::warning(Code::UndecidedTrial, "max_steps", message, help));
    }
    let rests = |trial: &&SafetyTrial| trial.factor > unstable && trial.verdict == Verdict::AtRest;
    if let Some(SafetyTrial { factor, .. }) = found.trials.iter().rev().find(rests) {
        let message = format!(
            "strengths / {factor:.4} came to rest, but strengths / {unstable:.4} did not: the factor of safety may \
             be as large as {factor:.4}"
        );
        let help = format!("search again with a `bracket` above {unstable:.4}");
        warnings.push(Diagnostic::warning(Code::NonmonotonicSafety, "bracket", message, help));
    }
    warnings
}

/// Advice on a trial that was undecided after some steps.
fn decisive(steps: u64, search: &SafetySearch) -> &'static str {
    if steps < search.max_steps {
        "rounding hides its forces: move the model nearer to the origin, or make the stiffest joints softer"
    } else {
        "raise `max_steps`"
    }
}

/// Reasons why blocks may hold although they should fail.
fn why_it_holds(simulation: &mut Simulation) -> String {
    let energy = simulation.energy();
    let mut why = String::new();
    if simulation.model().problem().properties.gravity.iter().all(|g| *g == 0.0) {
        why += "; the model has no `gravity`";
    } else if energy.strain_bodies + energy.strain_joints == 0.0 && simulation.unbalanced() == 0.0 {
        why += "; no joint carries any load: check `gravity` and the supports";
    }
    for joint in simulation.model().joints_without_strength() {
        why += &format!("; joint `{joint}` has no strength and never fails");
    }
    why
}
