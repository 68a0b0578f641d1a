//! One stage from its start to its end: steps, records and progress.

mod progress;

use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use ddem_core::{FastestBlock, Relaxed, RunError, Simulation, Verdict};
use ddem_deck::lint::{Code, Diagnostic};
use ddem_deck::{OnFailure, Stage, StageKind};

use super::moved::MovedBy;
use super::record::{Recorder, Schedule};
use super::warnings::{charges, detonations, energy_imbalance, stage_place, undamped_sliding};
use super::{Event, Observer, RunFailure};
use crate::summary::StageSummary;

/// Wall time between two progress events.
pub(super) const PROGRESS: Duration = Duration::from_millis(100);

/// A stage that is running.
pub(super) struct Running<'a> {
    stage: &'a Stage,
    pub(super) moved: &'a mut MovedBy,
    pub(super) observer: &'a mut dyn Observer,
    counters: StageProgress,
}

/// Progress of a stage, besides the state of its simulation.
#[derive(Debug)]
pub(super) struct StageProgress {
    /// Number of stages.
    stages: usize,
    schedule: Schedule,
    /// Wall time at which the stage was paused.
    paused_at: Option<Instant>,
    /// True once all records of the end are written.
    ended: bool,
    /// Wall time when the stage began or resumed; `recording` is the time spent on records.
    clock: Instant,
    recording: Duration,
    steps_before: u64,
    last_progress: Instant,
    /// The fastest block, and when it was found.
    fastest: (Option<FastestBlock>, Option<Instant>),
    /// Flags by charge, true if it had detonated by then.
    detonated: Vec<bool>,
    /// Reason why the stage did not come to rest.
    failure: Option<RunError>,
}

/// Reason why a stage halts.
#[derive(Debug, PartialEq)]
pub(super) enum Halt {
    /// The stage is done.
    End,
    /// The observer stops the run.
    Stopped,
    /// Enough wall time has passed.
    Due,
    /// A callback is due.
    Callback,
}

impl<'a> Running<'a> {
    /// Running stage, from its start or from a checkpoint.
    ///
    /// `callbacks` is the time between callbacks, if there are any `[s]`.
    pub(super) fn new(
        (stage, stages): (&'a Stage, usize),
        callbacks: Option<f64>,
        moved: &'a mut MovedBy,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, RunFailure> {
        moved.timer.enter();
        if moved.cursor.step.is_none() {
            moved.begin(stage).map_err(failed(stage))?;
        }
        moved.timer.started(&mut moved.simulation);
        let (samplers, cursor) = (&moved.recorder.samplers, &moved.cursor);
        let schedule = match stage.kind {
            StageKind::Relax | StageKind::Safety => Schedule::relax(samplers),
            StageKind::Dynamic => {
                Schedule::dynamic(stage, samplers, cursor.steps, cursor.time_step)
            }
        };
        let schedule = schedule.with_callbacks(callbacks, cursor.time_step);
        let steps_before = cursor.step.unwrap_or(0);
        let now = Instant::now();
        let detonated = charges(&moved.simulation)
            .map(|(_, charge)| charge.detonation_volume.is_some())
            .collect();
        let counters = StageProgress {
            stages,
            schedule,
            paused_at: None,
            ended: false,
            clock: now,
            recording: Duration::ZERO,
            steps_before,
            last_progress: now,
            fastest: (None, None),
            detonated,
            failure: None,
        };
        let mut running = Self { stage, moved, observer, counters };
        // A run may be interrupted, or a relaxation may be done, before the first step.
        running.recorded(|recorder, simulation, observer| {
            recorder.start(simulation, &stage.name, &mut |event| observer.event(event))
        })?;
        if let Some(limit) = &running.moved.cursor.limit {
            running.observer.event(Event::StepLimit { stage: &stage.name, limit });
        }
        let progress = running.progress();
        running.observer.event(Event::StageStarted(&progress));
        Ok(running)
    }

    /// Running stage that continues after [`pause`](Self::pause).
    pub(super) fn resume(
        stage: &'a Stage,
        moved: &'a mut MovedBy,
        observer: &'a mut dyn Observer,
        mut counters: StageProgress,
    ) -> Self {
        counters.recording +=
            counters.paused_at.take().map_or(Duration::ZERO, |since| since.elapsed());
        Self { stage, moved, observer, counters }
    }

    /// Pauses the stage between two steps, so that a program can use the simulation.
    pub(super) fn pause(self) -> StageProgress {
        StageProgress { paused_at: Some(Instant::now()), ..self.counters }
    }

    /// Continues to the end, to the next callback that is due, until the observer stops it, or for at
    /// least the given wall time.
    pub(super) fn run(&mut self, at_least: Duration) -> Result<Halt, RunFailure> {
        let start = Instant::now();
        loop {
            if self.observer.wants_to_stop() {
                return Ok(Halt::Stopped);
            }
            let callback = match self.step() {
                Err(failure) if failure.is_stopped() => return Ok(Halt::Stopped),
                callback => callback?,
            };
            let now = Instant::now();
            if self.counters.ended || now - self.counters.last_progress >= PROGRESS {
                self.counters.last_progress = now;
                self.find_fastest(now);
                let progress = self.progress();
                self.observer.event(Event::Progress(&progress));
                self.moved.recorder.check_in_place()?;
            }
            if self.counters.ended {
                return Ok(Halt::End);
            }
            if callback {
                return Ok(Halt::Callback);
            }
            if now - start >= at_least {
                return Ok(Halt::Due);
            }
        }
    }

    /// Takes one step and writes the records that are due. Returns true if a callback is due.
    fn step(&mut self) -> Result<bool, RunFailure> {
        let (stage, relax) = (self.stage, self.relax());
        let before = self.moved.cursor.step;
        let first = self.moved.nominal(relax) + 1;
        let end = if relax {
            self.relax_step()?
        } else {
            let over = self.moved.step(stage)?;
            self.decided(over)
        };
        let (step, stepped) =
            (self.moved.cursor.step.unwrap_or(0), self.moved.cursor.step != before);
        let last = if relax { step } else { self.moved.nominal(relax) };
        let steps = if stepped { first..=last } else { last..=last };
        let callback = stepped && self.counters.schedule.callbacks(steps.clone());
        if stepped || end {
            self.record(steps, (end, stepped))?;
        }
        self.counters.ended = end;
        Ok(callback)
    }

    /// Writes the records that are due after some steps of the stage, or at its end.
    fn record(&mut self, steps: RangeInclusive<u64>, when: (bool, bool)) -> Result<(), RunFailure> {
        let schedule = self.counters.schedule.clone();
        let at = (self.stage.name.as_str(), steps);
        self.recorded(|recorder, simulation, observer| {
            let tell = &mut |event: Event<'_>| observer.event(event);
            recorder.after_step(simulation, &schedule, at, when, tell)
        })
    }

    /// Ends the stage now, as if its time were over, unless it has ended.
    pub(super) fn end_here(&mut self) -> Result<(), RunFailure> {
        if self.counters.ended {
            return Ok(());
        }
        let step = self.moved.nominal(self.relax());
        self.counters.ended = true;
        self.record(step..=step, (true, false))
    }

    /// True if a dynamic stage is over or, with `until_rest`, has come to rest or fails.
    fn decided(&mut self, over: bool) -> bool {
        let MovedBy { simulation, .. } = &*self.moved;
        if !self.stage.until_rest.unwrap_or_default() {
            return over;
        }
        let verdict = if over { Some(simulation.verdict()) } else { simulation.decided() };
        if verdict == Some(Verdict::Fails) {
            self.counters.failure = Some(simulation.no_equilibrium());
        }
        verdict.is_some()
    }

    /// Takes one relaxation step. Returns true at the end, in equilibrium or without finding one.
    fn relax_step(&mut self) -> Result<bool, RunFailure> {
        let tolerance = self.tolerance();
        let failure = match self.moved.simulation.relax_step(tolerance) {
            Ok(Relaxed::Done) => return Ok(true),
            Ok(Relaxed::Increment(_)) => {
                self.frame()?;
                return Ok(false);
            }
            Ok(Relaxed::Moving) => {
                let MovedBy { simulation, cursor, .. } = &mut *self.moved;
                let step = cursor.step.unwrap_or(0) + 1;
                cursor.step = Some(step);
                if step <= cursor.steps {
                    return Ok(false);
                }
                // The error describes the present state.
                simulation.check_finite().map_err(failed(self.stage))?;
                simulation.not_converged(tolerance, cursor.steps)
            }
            Err(
                failure @ (RunError::NoEquilibrium { .. } | RunError::UnreachableTolerance { .. }),
            ) => failure,
            Err(error) => return Err(failed(self.stage)(error)),
        };
        self.counters.failure = Some(failure);
        Ok(true)
    }

    fn frame(&mut self) -> Result<(), RunFailure> {
        let stage = &self.stage.name;
        self.recorded(|recorder, simulation, _| recorder.frame(simulation, stage))
    }

    fn recorded(
        &mut self,
        record: impl FnOnce(
            &mut Recorder,
            &mut Simulation,
            &mut dyn Observer,
        ) -> Result<(), crate::OutputError>,
    ) -> Result<(), RunFailure> {
        let start = Instant::now();
        let MovedBy { simulation, recorder, timer, .. } = &mut *self.moved;
        timer.stepped(simulation);
        record(recorder, simulation, self.observer)?;
        let time = start.elapsed();
        timer.recorded(time, simulation);
        self.counters.recording += time;
        Ok(())
    }

    /// Ends the stage, with velocities at the present time. Returns the failure that ends the run.
    pub(super) fn finish(self) -> Result<Option<RunFailure>, RunFailure> {
        let seconds = self.moved.cursor.seconds + self.seconds();
        let (relax, verdict) = (self.relax(), self.verdict());
        let MovedBy { site, simulation, recorder, cursor, timer } = &mut *self.moved;
        timer.stepped(simulation);
        let start = Instant::now();
        simulation.check_finite().map_err(failed(self.stage))?;
        let unbalanced = simulation.unbalanced();
        let moving = match verdict {
            Verdict::Fails => simulation.moving_blocks(),
            _ => Vec::new(),
        };
        let steps = cursor.step.unwrap_or(0);
        let time_step = if relax { f64::NAN } else { simulation.time_step() };
        if relax {
            simulation.finish_relaxation();
        } else {
            simulation.synchronise();
        }
        recorder.fragments(simulation, &self.stage.name)?;
        let updates = simulation.model().n_nodes() as f64 * steps as f64;
        let energy = simulation.energy();
        let state = simulation.state_summary();
        timer.recorded(start.elapsed(), simulation);
        let summary = StageSummary {
            name: self.stage.name.clone(),
            kind: if relax { "relax" } else { "dynamic" }.to_owned(),
            verdict,
            moving,
            steps,
            time_step,
            limit: cursor.limit.take(),
            wall_seconds: seconds,
            node_updates_per_second: if seconds > 0.0 { updates / seconds } else { 0.0 },
            unbalanced,
            imbalance: energy.imbalance(),
            state,
            profile: timer.finish(),
            ..StageSummary::default()
        };
        let deck = site.deck();
        let warnings = [
            energy_imbalance(&energy, cursor.imbalance, self.stage, deck),
            undamped_sliding(simulation, self.stage, cursor),
        ];
        let detonations = detonations(simulation, &self.counters.detonated);
        for warning in warnings.into_iter().flatten().chain(detonations) {
            cursor.warn(deck, warning, self.observer);
        }
        self.observer.event(Event::StageDone(&summary));
        cursor.done.push(summary);
        (cursor.step, cursor.seconds) = (None, 0.0);
        let Some(failure) = self.counters.failure.map(failed(self.stage)) else { return Ok(None) };
        if self.stage.on_failure.unwrap_or_default() == OnFailure::Continue {
            let at = stage_place(deck, self.stage);
            let help = "later stages start from the state at the failure";
            let text = failure.to_string();
            let text = failure.code().strip(&text);
            let warning = Diagnostic::warning(Code::FailedStage, at, text, help);
            cursor.warn(deck, warning, self.observer);
            return Ok(None);
        }
        Ok(Some(failure))
    }

    fn verdict(&self) -> Verdict {
        match &self.counters.failure {
            Some(RunError::NoEquilibrium { .. }) => Verdict::Fails,
            Some(_) => Verdict::Undecided,
            None if self.relax() => Verdict::AtRest,
            None => self.moved.simulation.verdict(),
        }
    }

    /// Wall time of stepping since this stage began or resumed `[s]`.
    pub(super) fn seconds(&self) -> f64 {
        self.counters.clock.elapsed().saturating_sub(self.counters.recording).as_secs_f64()
    }

    fn relax(&self) -> bool {
        self.stage.kind == StageKind::Relax
    }

    fn tolerance(&self) -> f64 {
        self.stage.tolerance()
    }
}

pub(super) fn failed(stage: &Stage) -> impl Fn(RunError) -> RunFailure {
    let stage = stage.name.clone();
    move |error| RunFailure::Stage { stage: stage.clone(), error }
}
