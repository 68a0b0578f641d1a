//! The outer loop: stages, steps, files, checkpoints.

use std::time::{Duration, Instant};

use ddem_core::deck::{Stage, StageKind};
use ddem_core::{Deck, Relaxed, RunError, Simulation};

use super::record::{Recorder, Schedule};
use super::report::{available_memory, critical_steps, prepare, report};
use super::resume::{self, Cursor};
use super::{Event, Observer, Options, Outcome, Progress, RunFailure};
use crate::Source;
use crate::folder::{self, Folder};
use crate::summary::{FailedPairs, StageSummary, Summary, peak_memory_bytes};

/// Wall time between two progress events.
const PROGRESS: Duration = Duration::from_millis(100);

/// Runs a deck: every stage, with its results in `options.out`.
///
/// # Errors
///
/// What is wrong with the deck or the folder, before anything runs or is written; a run that
/// fails, with what was written so far intact.
pub fn run(
    deck: &Deck,
    source: &Source,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Outcome, RunFailure> {
    let threads = options.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|source| RunFailure::Threads { threads, source: Box::new(source) })?;
    // Entered once: every step forks from inside.
    pool.install(|| Drive::start(deck, source, options, observer)?.run())
}

struct Drive<'a> {
    source: &'a Source,
    options: &'a Options,
    observer: &'a mut dyn Observer,
    folder: Folder,
    simulation: Simulation,
    recorder: Recorder,
    cursor: Cursor,
    /// Wall time when the running stage began or went on, less what recording took.
    clock: Instant,
    recording: Duration,
    steps_before: u64,
    last_progress: Instant,
    last_checkpoint: Instant,
}

impl<'a> Drive<'a> {
    fn start(
        deck: &Deck,
        source: &'a Source,
        options: &'a Options,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, RunFailure> {
        let (model, samplers) = prepare(deck, source, available_memory())?;
        let name = std::path::Path::new(source.name());
        let name = name.file_name().map_or(source.name().into(), |n| n.to_string_lossy());
        let open =
            || folder::prepare(&options.out, &name, &deck.title, source.text(), options.resume);
        let (folder, simulation, recorder, cursor);
        if options.resume {
            folder = open()?;
            let resumed = resume::load(&folder, source.text())?;
            simulation = resumed.simulation(model, options.simd, &folder)?;
            let position = resumed.position;
            recorder = Recorder::reopen(&folder, simulation.model(), samplers, position)?;
            cursor = resumed.cursor;
        } else {
            let mut fresh = Simulation::with_simd(model, options.simd);
            critical_steps(&mut fresh, deck, source)?;
            // Only now is everything known to be right: from here on files are written.
            folder = open()?;
            recorder = Recorder::create(&folder, fresh.model(), samplers)?;
            simulation = fresh;
            cursor = Cursor::default();
        }
        let now = Instant::now();
        let mut drive = Self {
            source,
            options,
            observer,
            folder,
            simulation,
            recorder,
            cursor,
            clock: now,
            recording: Duration::ZERO,
            steps_before: 0,
            last_progress: now,
            last_checkpoint: now,
        };
        let report = report(&mut drive.simulation);
        for warning in &report.warnings {
            drive.observer.event(Event::Warning(warning));
        }
        drive.observer.event(Event::Built(&report));
        Ok(drive)
    }

    fn run(mut self) -> Result<Outcome, RunFailure> {
        let stages = self.simulation.model().deck().stage.clone();
        while let Some(stage) = stages.get(self.cursor.stage) {
            if self.stage(stage)?.is_none() {
                self.checkpoint()?;
                return Ok(Outcome::Interrupted(self.folder.checkpoint()));
            }
            self.cursor.stage += 1;
            (self.cursor.step, self.cursor.seconds) = (None, 0.0);
            self.checkpoint()?;
        }
        let summary = self.summary();
        summary.write(self.folder.summary())?;
        Ok(Outcome::Done(Box::new(summary)))
    }

    /// One stage, from its start or from where a checkpoint left it. `None` when interrupted.
    fn stage(&mut self, stage: &Stage) -> Result<Option<()>, RunFailure> {
        let relax = stage.kind == StageKind::Relax;
        if self.cursor.step.is_none() {
            self.begin(stage).map_err(failed(stage))?;
        }
        let samplers = &self.recorder.samplers;
        let schedule = if relax {
            Schedule::relax(samplers)
        } else {
            Schedule::dynamic(stage, samplers, self.cursor.steps, self.cursor.time_step)
        };
        (self.clock, self.recording) = (Instant::now(), Duration::ZERO);
        self.steps_before = self.cursor.step.unwrap_or(0);
        // Not by the step: a run may be interrupted, or a relaxation be done, before the first one.
        if self.recorder.last_frame == f64::NEG_INFINITY {
            self.recorded(|recorder, simulation| recorder.start(simulation, &stage.name))?;
        }
        let progress = self.progress(stage);
        self.observer.event(Event::StageStarted(&progress));
        loop {
            if self.observer.wants_to_stop() {
                return Ok(None);
            }
            let before = self.cursor.step;
            let first = self.nominal(relax) + 1;
            let end = if relax { self.relax_step(stage)? } else { self.step(stage)? };
            let (step, stepped) = (self.cursor.step.unwrap_or(0), self.cursor.step != before);
            if stepped || end {
                let last = if relax { step } else { self.nominal(relax) };
                let steps = if stepped { first..=last } else { last..=last };
                self.recorded(|recorder, simulation| {
                    recorder.after_step(simulation, &schedule, (&stage.name, steps), (end, stepped))
                })?;
            }
            if end || self.last_progress.elapsed() >= PROGRESS {
                self.last_progress = Instant::now();
                let progress = self.progress(stage);
                self.observer.event(Event::Progress(&progress));
            }
            if end {
                break;
            }
            if self.last_checkpoint.elapsed() >= self.options.checkpoint_every {
                self.checkpoint()?;
            }
        }
        self.finish(stage)?;
        Ok(Some(()))
    }

    fn begin(&mut self, stage: &Stage) -> Result<(), RunError> {
        self.simulation.enter(self.cursor.stage);
        self.cursor.steps = match stage.kind {
            StageKind::Relax => {
                self.simulation.start_relaxation(stage.increments.unwrap_or(1));
                stage.max_steps.unwrap_or(200_000)
            }
            StageKind::Dynamic => {
                let (damping, step) = (stage.damping, stage.time_step);
                self.simulation.start(
                    damping.unwrap_or_default(),
                    step.unwrap_or_default(),
                    stage.duration,
                )?
            }
        };
        self.cursor.step = Some(0);
        self.cursor.begun = self.simulation.time();
        self.cursor.time_step = self.simulation.time_step();
        Ok(())
    }

    /// One step of motion; true at the end of the stage.
    fn step(&mut self, stage: &Stage) -> Result<bool, RunFailure> {
        self.simulation.step().map_err(failed(stage))?;
        let step = self.cursor.step.unwrap_or(0) + 1;
        self.cursor.step = Some(step);
        Ok(self.simulation.steps_left() == Some(0))
    }

    /// Steps of the stage that are done; of motion, in steps as long as its first, which become
    /// shorter when joints fail.
    fn nominal(&self, relax: bool) -> u64 {
        if relax {
            return self.cursor.step.unwrap_or(0);
        }
        let done = (self.simulation.time() - self.cursor.begun) / self.cursor.time_step;
        (done + 1e-6) as u64
    }

    /// One step of relaxation; true when all loads are in equilibrium.
    fn relax_step(&mut self, stage: &Stage) -> Result<bool, RunFailure> {
        let tolerance = stage.tolerance.unwrap_or(1e-6);
        let relaxed = self.simulation.relax_step(tolerance);
        if let Err(RunError::Collapsed { .. }) = relaxed {
            // What was reached is worth looking at.
            self.recorded(|recorder, simulation| recorder.frame(simulation))?;
        }
        match relaxed.map_err(failed(stage))? {
            Relaxed::Done => Ok(true),
            Relaxed::Increment(_) => {
                self.recorded(|recorder, simulation| recorder.frame(simulation))?;
                Ok(false)
            }
            Relaxed::Moving => {
                let step = self.cursor.step.unwrap_or(0) + 1;
                self.cursor.step = Some(step);
                if step <= self.cursor.steps {
                    return Ok(false);
                }
                let ratio = self.simulation.unbalanced();
                // What was reached is worth looking at.
                self.recorded(|recorder, simulation| recorder.frame(simulation))?;
                let max_steps = self.cursor.steps;
                let pairs = self.simulation.failed_pairs().iter().sum();
                let error = RunError::NotConverged { ratio, tolerance, max_steps, failed: pairs };
                Err(failed(stage)(error))
            }
        }
    }

    fn recorded(
        &mut self,
        record: impl FnOnce(&mut Recorder, &mut Simulation) -> Result<(), crate::OutputError>,
    ) -> Result<(), RunFailure> {
        let start = Instant::now();
        record(&mut self.recorder, &mut self.simulation)?;
        self.recording += start.elapsed();
        Ok(())
    }

    fn checkpoint(&mut self) -> Result<(), RunFailure> {
        let position = self.recorder.sync()?;
        let mut cursor = self.cursor.clone();
        if cursor.step.is_some() {
            cursor.seconds += self.seconds();
        }
        resume::save(&self.folder, self.source.text(), &self.simulation, &cursor, position)?;
        self.last_checkpoint = Instant::now();
        self.observer.event(Event::Checkpoint(&self.folder.checkpoint()));
        Ok(())
    }

    /// Wall time of stepping since this stage began or went on `[s]`.
    fn seconds(&self) -> f64 {
        self.clock.elapsed().saturating_sub(self.recording).as_secs_f64()
    }

    fn finish(&mut self, stage: &Stage) -> Result<(), RunFailure> {
        let relax = stage.kind == StageKind::Relax;
        self.simulation.check_finite().map_err(failed(stage))?;
        let unbalanced = self.simulation.unbalanced();
        let seconds = self.cursor.seconds + self.seconds();
        let steps = self.cursor.step.unwrap_or(0);
        let time_step = if relax { f64::NAN } else { self.simulation.time_step() };
        if relax {
            self.simulation.finish_relaxation();
        } else {
            self.simulation.settle();
        }
        let updates = self.simulation.model().n_nodes() as f64 * steps as f64;
        let summary = StageSummary {
            name: stage.name.clone(),
            kind: if relax { "relax" } else { "dynamic" }.to_owned(),
            steps,
            time_step,
            wall_seconds: seconds,
            node_updates_per_second: if seconds > 0.0 { updates / seconds } else { 0.0 },
            unbalanced,
        };
        self.observer.event(Event::StageDone(&summary));
        self.cursor.done.push(summary);
        Ok(())
    }

    fn progress(&self, stage: &Stage) -> Progress {
        let relax = stage.kind == StageKind::Relax;
        let step = self.cursor.step.unwrap_or(0);
        let left = if relax { None } else { self.simulation.steps_left() };
        let steps = left.map_or(self.cursor.steps, |left| step + left);
        let here = step - self.steps_before;
        let seconds = self.seconds();
        let rate = if seconds > 0.0 { here as f64 / seconds } else { 0.0 };
        let left = (steps.saturating_sub(step)) as f64 / rate;
        let deck = self.simulation.model().deck();
        Progress {
            stage: stage.name.clone(),
            stage_index: (self.cursor.stage, deck.stage.len()),
            relax,
            step,
            steps,
            time: self.simulation.time(),
            unbalanced: self.simulation.unbalanced(),
            tolerance: stage.tolerance.unwrap_or(1e-6),
            failed_pairs: self.simulation.failed_pairs().iter().sum(),
            updates_per_second: rate * self.simulation.model().n_nodes() as f64,
            seconds_left: (!relax && left.is_finite()).then_some(left),
        }
    }

    fn summary(&self) -> Summary {
        let model = self.simulation.model();
        let [shear, tension] = self.simulation.failed_pairs();
        Summary {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            title: model.deck().title.clone(),
            blocks: model.n_blocks() as u64,
            nodes: model.n_nodes() as u64,
            elements: model.n_elements() as u64,
            pairs: model.n_pairs() as u64,
            failed_pairs: FailedPairs { shear, tension },
            peak_memory_bytes: peak_memory_bytes(),
            stages: self.cursor.done.clone(),
            deck: self.source.text().to_owned(),
        }
    }
}

fn failed(stage: &Stage) -> impl Fn(RunError) -> RunFailure {
    let stage = stage.name.clone();
    move |source| RunFailure::Stage { stage: stage.clone(), source }
}
