//! Progress of the present stage, collected from the events of a run.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use ddem_deck::{BuildProgress, Deck, Stage};

use super::{Event, Observer, Progress, RunFailure, SearchProgress};
use crate::folder::STATUS;
use crate::status::{RunStatus, StageReport, StatusKind};

/// Wall time between two versions of the status file.
const EVERY: Duration = Duration::from_secs(1);

/// Progress of the present stage.
#[derive(Debug)]
pub struct Tracker {
    stages: Vec<Stage>,
    /// Number of stages before these.
    before: usize,
    report: StageReport,
    /// First unbalanced ratio of the stage, at which its progress begins.
    first: Option<f64>,
    /// Trials of a search before it was resumed.
    known: u64,
    /// Wall time at which the stage began.
    begun: Instant,
}

impl Tracker {
    /// Tracker of the stages of a deck.
    #[must_use]
    pub fn new(deck: &Deck) -> Self {
        // The rest of a deck may be a large mesh.
        let stages = deck.stage.clone();
        let report = StageReport::beginning(&stages, 0);
        Self { stages, before: 0, report, first: None, known: 0, begun: Instant::now() }
    }

    /// Tracker of one stage of a program, which comes after others.
    pub(super) fn of_stage(stage: &Stage, before: usize) -> Self {
        let mut tracker =
            Self { before, ..Self::new(&Deck { stage: vec![stage.clone()], ..Deck::default() }) };
        tracker.enter(0);
        tracker
    }

    /// Progress so far.
    #[must_use]
    pub fn report(&self) -> StageReport {
        let wall_seconds = self.begun.elapsed().as_secs_f64();
        let mut report = StageReport { wall_seconds, ..self.report.clone() };
        if let (Some(done), Some(most)) = (report.trials, report.most_trials)
            && done > self.known
        {
            // Trials take about the same time.
            let each = wall_seconds / (done - self.known) as f64;
            report.seconds_left = Some(each * most.saturating_sub(done) as f64);
        }
        report
    }

    /// Takes an event into account.
    pub fn event(&mut self, event: &Event<'_>) {
        match event {
            Event::StageStarted(progress) => {
                self.enter(progress.stage_index.0);
                self.known = progress.search.as_ref().map_or(0, |search| search.done);
                self.progress(progress);
            }
            Event::Progress(progress) => self.progress(progress),
            Event::StageDone(stage) => {
                let place = |index: &usize| self.stages[*index].name == stage.name;
                let next = (0..self.stages.len()).find(place).map_or(0, |index| index + 1);
                if next < self.stages.len() {
                    self.enter(next);
                } else {
                    self.report.progress = Some(1.0);
                    self.report.seconds_left = Some(0.0);
                }
            }
            _ => {}
        }
    }

    fn enter(&mut self, index: usize) {
        let StageReport { time, failed_pairs, contacts, .. } = self.report;
        let mut beginning = StageReport::beginning(&self.stages, index);
        beginning.number += self.before;
        beginning.stages += self.before;
        self.report = StageReport { time, failed_pairs, contacts, ..beginning };
        (self.first, self.known, self.begun) = (None, 0, Instant::now());
    }

    fn progress(&mut self, progress: &Progress) {
        let finite = |value: f64| value.is_finite().then_some(value);
        let ratio = progress.unbalanced;
        self.first = self.first.or((ratio.is_finite() && ratio > 0.0).then_some(ratio));
        let report = &mut self.report;
        report.progress = Some(progress.part(self.first.unwrap_or(0.0)));
        if let Some(SearchProgress { done, most, running }) = &progress.search {
            (report.trials, report.most_trials) = (Some(*done), Some(*most));
            report.running.clone_from(running);
        }
        report.step = progress.step;
        report.steps = (!progress.relax).then_some(progress.steps);
        report.time = progress.time;
        report.unbalanced = finite(ratio);
        report.tolerance = if progress.relax { finite(progress.tolerance) } else { None };
        (report.failed_pairs, report.contacts) = (progress.failed_pairs, progress.contacts);
        report.fastest.clone_from(&progress.fastest);
        report.node_updates_per_second = finite(progress.updates_per_second);
        report.seconds_left = progress.seconds_left;
    }
}

impl Progress {
    /// Part of the stage that is done, 0 to 1. A relaxation counts the digits that the unbalanced ratio has gained since
    /// its `first` value, because its number of steps is unknown; a search counts its trials.
    #[must_use]
    pub fn part(&self, first: f64) -> f64 {
        let Self { unbalanced, tolerance, .. } = *self;
        let part = if let Some(search) = &self.search {
            search.done as f64 / search.most as f64
        } else if !self.relax {
            self.step as f64 / self.steps as f64
        } else if first > tolerance && tolerance > 0.0 {
            (first / unbalanced).ln() / (first / tolerance).ln()
        } else {
            0.0
        };
        if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) }
    }
}

/// The file `status.json` of a run.
#[derive(Debug)]
pub(super) struct StatusFile {
    tracker: Tracker,
    path: PathBuf,
    title: String,
    /// True once the folder belongs to the run.
    begun: bool,
    /// Time at which the file was written.
    written: Option<Instant>,
}

impl StatusFile {
    /// File in the folder of a run, which does not exist before the model is built.
    pub(super) fn new(deck: &Deck, folder: &Path) -> Self {
        let (tracker, title) = (Tracker::new(deck), deck.title.clone());
        Self { tracker, path: folder.join(STATUS), title, begun: false, written: None }
    }

    /// File of a stage of a program in a folder that belongs to it.
    pub(super) fn of_stage(deck: &Deck, stage: &Stage, before: usize, folder: &Path) -> Self {
        let (tracker, title) = (Tracker::of_stage(stage, before), deck.title.clone());
        Self { tracker, path: folder.join(STATUS), title, begun: true, written: None }
    }

    /// Writes the end of the run; without a failure it is done or, on request, interrupted.
    pub(super) fn end(&mut self, done: bool, failure: Option<&RunFailure>) {
        let (state, message) = match failure.filter(|failure| !failure.is_stopped()) {
            Some(failure) => (StatusKind::Failed, Some(failure.to_string())),
            None if done => (StatusKind::Done, None),
            None => (StatusKind::Interrupted, None),
        };
        self.write(state, message);
    }

    fn event(&mut self, event: &Event<'_>) {
        self.tracker.event(event);
        let news = match event {
            Event::Built(_) => {
                self.begun = true;
                true
            }
            Event::StageStarted(_) | Event::StageDone(_) | Event::Trial { .. } => true,
            Event::Progress(_) => self.written.is_none_or(|written| written.elapsed() >= EVERY),
            _ => false,
        };
        if news {
            self.write(StatusKind::Running, None);
        }
    }

    fn write(&mut self, state: StatusKind, message: Option<String>) {
        if !self.begun {
            return;
        }
        self.written = Some(Instant::now());
        let (title, report) = (self.title.clone(), self.tracker.report());
        // Results matter more than their status: a full disk stops the run where it writes those.
        let _ = RunStatus { state, message, title, report }.write(&self.path);
    }
}

/// Observer that passes all events on and keeps the status file of a run, if it has one, up to date.
pub(super) struct StatusWriter<'a> {
    pub(super) observer: &'a mut dyn Observer,
    pub(super) file: Option<&'a mut StatusFile>,
}

impl Observer for StatusWriter<'_> {
    fn event(&mut self, event: Event<'_>) {
        if let Some(file) = &mut self.file {
            file.event(&event);
        }
        self.observer.event(event);
    }

    fn wants_to_stop(&mut self) -> bool {
        self.observer.wants_to_stop()
    }

    fn stop_flag(&self) -> Arc<AtomicBool> {
        self.observer.stop_flag()
    }

    fn build_progress(&self) -> Arc<BuildProgress> {
        self.observer.build_progress()
    }
}
