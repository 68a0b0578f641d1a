//! Stages that search for the factor of safety.

use std::ops::ControlFlow::{self, Break, Continue};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use ddem_core::{
    RunError, Safety, SafetySearch, SafetyTrial, SearchNews, Simulation, TrialProgress, Verdict,
    most_trials, undecided,
};
use ddem_deck::Stage;
use ddem_deck::lint::{Code, Diagnostic};

use super::drive::write_checkpoint;
use super::moved::MovedBy;
use super::record::Recorder;
use super::resume::Cursor;
use super::stage::{PROGRESS, failed};
use super::warnings::stage_place;
use super::{Event, Observer, Progress, RunFailure, SearchProgress};
use crate::OutputError;
use crate::folder::Folder;
use crate::summary::StageSummary;

/// Searches for the factor of safety of the present state, which does not change. Records the
/// unstable trial with the smallest factor. A checkpoint follows each trial, in a folder with the
/// text of the deck. Returns false if the observer stopped the search.
pub(super) fn search(
    (stage, stages): (&Stage, usize),
    moved: &mut MovedBy,
    place: (&Folder, &str),
    observer: &mut dyn Observer,
) -> Result<bool, RunFailure> {
    let start = Instant::now();
    let MovedBy { simulation, recorder, timer, .. } = moved;
    timer.enter();
    timer.started(simulation);
    recorder.start(simulation, &stage.name, &mut |event| observer.event(event))?;
    timer.recorded(start.elapsed(), simulation);
    let begun = Instant::now();
    let Some(mut found) = find((stage, stages), moved, place, observer)? else {
        moved.cursor.seconds += start.elapsed().as_secs_f64();
        return Ok(false);
    };
    let MovedBy { site, simulation, recorder, cursor, timer } = moved;
    timer.tried(&found.profile, begun.elapsed());
    let begun = Instant::now();
    let mut moving = Vec::new();
    if let Some(failing) = &mut found.failing {
        recorder.frame(failing, &stage.name)?;
        if found.bracket[1].is_some() {
            moving = failing.moving_blocks();
        }
    }
    let place = stage_place(site.deck(), stage);
    for warning in warnings(&found, &stage.search(), simulation) {
        cursor.warn(site.deck(), warning.below(&place), observer);
    }
    simulation.check_finite().map_err(failed(stage))?;
    let mut summary = summary(stage, found, simulation, cursor);
    summary.moving = moving;
    timer.recorded(begun.elapsed(), simulation);
    summary.wall_seconds = cursor.seconds + start.elapsed().as_secs_f64();
    let updates = simulation.model().n_nodes() as f64 * summary.steps as f64;
    summary.node_updates_per_second = updates / summary.wall_seconds;
    summary.profile = timer.finish();
    observer.event(Event::StageDone(&summary));
    cursor.done.push(summary);
    cursor.trials.clear();
    (cursor.step, cursor.seconds) = (None, 0.0);
    Ok(true)
}

/// Runs the trials that are not done. `None` if the observer stopped the search.
fn find(
    (stage, stages): (&Stage, usize),
    moved: &mut MovedBy,
    place: (&Folder, &str),
    observer: &mut dyn Observer,
) -> Result<Option<Safety>, RunFailure> {
    let MovedBy { site, simulation, recorder, cursor, .. } = moved;
    let position = recorder.sync()?;
    cursor.step = Some(0);
    let known = cursor.trials.clone();
    let progress = beginning((stage, stages), simulation, cursor);
    observer.event(Event::StageStarted(&progress));
    let start = Instant::now();
    let searching = Mutex::new(Searching {
        observer,
        steps_before: progress.step,
        progress,
        keys: stage.search(),
        nodes: simulation.model().n_nodes(),
        seconds_before: cursor.seconds,
        cursor,
        recorder,
        start,
        told: start,
        failure: None,
    });
    let found = simulation.continue_search(&stage.search(), &known, &|news| match news {
        // While another trial tells its news, a step is not worth waiting for.
        SearchNews::Step(trial) => {
            searching.try_lock().map_or(Continue(()), |mut searching| searching.step(trial))
        }
        SearchNews::Trial(trial) => {
            let mut searching = searching.lock().unwrap_or_else(PoisonError::into_inner);
            searching.trial(trial, &|cursor, observer| {
                write_checkpoint((site, simulation), cursor, &position, place, observer)
            })
        }
        _ => Continue(()),
    });
    let searching = searching.into_inner().unwrap_or_else(PoisonError::into_inner);
    match (searching.failure, found) {
        (Some(failure), _) => Err(failure.into()),
        (None, Err(RunError::Stopped)) => Ok(None),
        (None, found) => Ok(Some(found.map_err(failed(stage))?)),
    }
}

/// Search that runs, for the threads of its trials.
struct Searching<'a> {
    observer: &'a mut dyn Observer,
    cursor: &'a mut Cursor,
    recorder: &'a mut Recorder,
    progress: Progress,
    /// Keys of the stage.
    keys: SafetySearch,
    /// Number of nodes of the model.
    nodes: usize,
    /// Steps and wall time before it began or was resumed `[s]`.
    steps_before: u64,
    seconds_before: f64,
    /// Wall times at which it began or was resumed, and of the last progress.
    start: Instant,
    told: Instant,
    /// Failure of a checkpoint or lost files, which end the search.
    failure: Option<OutputError>,
}

impl Searching<'_> {
    /// Takes a step of a trial into account.
    fn step(&mut self, trial: &TrialProgress) -> ControlFlow<()> {
        let Some(search) = &mut self.progress.search else { return Continue(()) };
        search.running.retain(|running| {
            running.trial != trial.trial && !is_known(&self.cursor.trials, running)
        });
        search.running.push(*trial);
        search.running.sort_by_key(|trial| trial.trial);
        if self.told.elapsed() >= PROGRESS {
            self.tell();
            if let Err(failure) = self.recorder.check_in_place() {
                self.failure.get_or_insert(failure);
            }
        }
        if self.failure.is_some() { Break(()) } else { Continue(()) }
    }

    /// Takes the end of a trial into account and saves it.
    fn trial(
        &mut self,
        trial: &SafetyTrial,
        save: &dyn Fn(&Cursor, &mut dyn Observer) -> Result<(), OutputError>,
    ) -> ControlFlow<()> {
        self.cursor.trials.push(*trial);
        if let Some(search) = &mut self.progress.search {
            search.done = self.cursor.trials.len() as u64;
            search.most = most_trials(&self.keys, &self.cursor.trials);
            search.running.retain(|known| known.factor != trial.factor);
        }
        self.tell();
        self.observer.event(Event::Trial { stage: &self.progress.stage, trial });
        self.cursor.seconds = self.seconds_before + self.start.elapsed().as_secs_f64();
        let saved = save(self.cursor, self.observer);
        self.cursor.seconds = self.seconds_before;
        match saved {
            Ok(()) => Continue(()),
            Err(failure) => {
                self.failure.get_or_insert(failure);
                Break(())
            }
        }
    }

    fn tell(&mut self) {
        let Self { progress, cursor, .. } = self;
        let Some(search) = &progress.search else { return };
        let new = search.running.iter().filter(|running| !is_known(&cursor.trials, running));
        progress.step = steps(&cursor.trials) + new.map(|running| running.step).sum::<u64>();
        let ratios = search.running.iter().filter_map(|trial| trial.unbalanced);
        progress.unbalanced = ratios.fold(f64::NAN, f64::max);
        let here = progress.step.saturating_sub(self.steps_before) * self.nodes as u64;
        progress.updates_per_second = here as f64 / self.start.elapsed().as_secs_f64();
        self.told = Instant::now();
        self.observer.event(Event::Progress(progress));
    }
}

/// Progress of a search that begins, or continues after some trials.
fn beginning(
    (stage, stages): (&Stage, usize),
    simulation: &Simulation,
    cursor: &Cursor,
) -> Progress {
    let search = stage.search();
    Progress {
        stage: stage.name.clone(),
        stage_index: (cursor.stage, stages),
        relax: true,
        step: steps(&cursor.trials),
        steps: search.max_steps,
        time: simulation.time(),
        unbalanced: f64::NAN,
        tolerance: search.tolerance,
        failed_pairs: simulation.failed_pairs().iter().sum(),
        contacts: simulation.touching_blocks() as u64,
        fastest: None,
        updates_per_second: 0.0,
        seconds_left: None,
        search: Some(SearchProgress {
            done: cursor.trials.len() as u64,
            most: most_trials(&search, &cursor.trials),
            running: Vec::new(),
        }),
    }
}

/// True if a trial that runs has done so before the search was resumed.
fn is_known(trials: &[SafetyTrial], running: &TrialProgress) -> bool {
    trials.iter().any(|known| known.factor == running.factor)
}

/// Steps of trials.
fn steps(trials: &[SafetyTrial]) -> u64 {
    trials.iter().map(|trial| trial.steps).sum()
}

/// Summary of a search, without its moving blocks and its wall times.
fn summary(
    stage: &Stage,
    found: Safety,
    simulation: &mut Simulation,
    cursor: &Cursor,
) -> StageSummary {
    StageSummary {
        name: stage.name.clone(),
        kind: "safety".to_owned(),
        verdict: verdict(cursor.done.last().map(|stage| stage.verdict), &found),
        factor: found.factor,
        bracket: Some(found.bracket),
        steps: steps(&found.trials),
        trials: found.trials,
        time_step: f64::NAN,
        imbalance: simulation.energy().imbalance(),
        state: simulation.state_summary(),
        unbalanced: simulation.unbalanced(),
        ..StageSummary::default()
    }
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
            let help = match simulation.model().can_fail() {
                true => "raise the second number of `bracket`",
                false => "give joints between the blocks `friction`, `cohesion` or `tension`",
            };
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
        "rounding hides its forces: make the stiffest joints and contacts softer"
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
    let without_strength: Vec<&str> = simulation.model().joints_without_strength().collect();
    if without_strength.is_empty() && !simulation.model().can_fail() {
        why += "; there is no joint whose strength could be reduced";
    }
    for joint in without_strength {
        why += &format!("; joint `{joint}` has no strength and never fails");
    }
    why
}
