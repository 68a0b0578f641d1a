//! One stage from its start to its end: steps, what is recorded on the way, progress.

use std::time::{Duration, Instant};

use ddem_core::deck::{Damping, OnFailure, Stage, StageKind};
use ddem_core::{ChargeState, Relaxed, RunError, Simulation, Verdict};

use super::record::{Recorder, Schedule};
use super::resume::Cursor;
use super::{Event, Observer, Progress, RunFailure};
use crate::summary::StageSummary;

/// Wall time between two progress events.
const PROGRESS: Duration = Duration::from_millis(100);

/// Part of the energy out of balance above which something is said.
const MUCH: f64 = 0.01;

/// Part of the volume of a cavity by which it may change until its charge goes off.
const CHANGED: f64 = 0.1;
/// Part of the energy that friction has taken above which blocks have slid.
const SLID: f64 = 0.1;

/// What a stage moves.
#[derive(Debug)]
pub(super) struct Moved {
    pub(super) simulation: Simulation,
    pub(super) recorder: Recorder,
    pub(super) cursor: Cursor,
}

/// A stage that is running.
pub(super) struct Running<'a> {
    stage: &'a Stage,
    /// How many stages there are.
    stages: usize,
    pub(super) moved: &'a mut Moved,
    pub(super) observer: &'a mut dyn Observer,
    schedule: Schedule,
    /// Wall time when the stage began or went on, less what recording took.
    clock: Instant,
    recording: Duration,
    steps_before: u64,
    last_progress: Instant,
    /// Charges that had gone off by then.
    off: Vec<bool>,
    /// Why it did not come to rest.
    failure: Option<RunError>,
}

/// Why a stage halts.
#[derive(Debug, PartialEq)]
pub(super) enum Halt {
    /// It is done.
    End,
    /// The observer wants to stop.
    Stopped,
    /// Enough time has passed.
    Due,
}

impl<'a> Running<'a> {
    /// From the stage's start, or from where a checkpoint left it.
    pub(super) fn new(
        stage: &'a Stage,
        stages: usize,
        moved: &'a mut Moved,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, RunFailure> {
        if moved.cursor.step.is_none() {
            moved.begin(stage).map_err(failed(stage))?;
        }
        let (samplers, cursor) = (&moved.recorder.samplers, &moved.cursor);
        let schedule = match stage.kind {
            StageKind::Relax | StageKind::Safety => Schedule::relax(samplers),
            StageKind::Dynamic => {
                Schedule::dynamic(stage, samplers, cursor.steps, cursor.time_step)
            }
        };
        let steps_before = cursor.step.unwrap_or(0);
        let now = Instant::now();
        let off = charges(&moved.simulation).map(|(_, charge)| charge.began.is_some()).collect();
        let mut running = Self {
            stage,
            stages,
            moved,
            observer,
            schedule,
            clock: now,
            recording: Duration::ZERO,
            steps_before,
            last_progress: now,
            off,
            failure: None,
        };
        // Not by the step: a run may be interrupted, or a relaxation be done, before the first one.
        running.recorded(|recorder, simulation, observer| {
            recorder.start(simulation, &stage.name, &mut |event| observer.event(event))
        })?;
        let progress = running.progress();
        running.observer.event(Event::StageStarted(&progress));
        Ok(running)
    }

    /// Goes on to the end, until the observer wants to stop, or for this long at least.
    pub(super) fn go(&mut self, at_least: Duration) -> Result<Halt, RunFailure> {
        let start = Instant::now();
        loop {
            if self.observer.wants_to_stop() {
                return Ok(Halt::Stopped);
            }
            let end = match self.step() {
                Err(failure) if failure.is_stopped() => return Ok(Halt::Stopped),
                end => end?,
            };
            let now = Instant::now();
            if end || now - self.last_progress >= PROGRESS {
                self.last_progress = now;
                let progress = self.progress();
                self.observer.event(Event::Progress(&progress));
            }
            if end {
                return Ok(Halt::End);
            }
            if now - start >= at_least {
                return Ok(Halt::Due);
            }
        }
    }

    /// One step, and what it is the time to record; true at the end of the stage.
    fn step(&mut self) -> Result<bool, RunFailure> {
        let (stage, relax) = (self.stage, self.relax());
        let before = self.moved.cursor.step;
        let first = self.moved.nominal(relax) + 1;
        let end =
            if relax { self.relax_step()? } else { self.moved.step(stage)? || self.decided() };
        let (step, stepped) =
            (self.moved.cursor.step.unwrap_or(0), self.moved.cursor.step != before);
        if stepped || end {
            let last = if relax { step } else { self.moved.nominal(relax) };
            let steps = if stepped { first..=last } else { last..=last };
            let schedule = self.schedule.clone();
            self.recorded(|recorder, simulation, observer| {
                let tell = &mut |event: Event<'_>| observer.event(event);
                let (at, when) = ((stage.name.as_str(), steps), (end, stepped));
                recorder.after_step(simulation, &schedule, at, when, tell)
            })?;
        }
        Ok(end)
    }

    /// True where a dynamic stage that ends with rest has come to it, or fails.
    fn decided(&mut self) -> bool {
        let Moved { simulation, .. } = &*self.moved;
        let wanted = self.stage.until_rest == Some(true);
        let verdict = if wanted { simulation.decided() } else { None };
        if verdict == Some(Verdict::Fails) {
            self.failure = Some(simulation.collapse());
        }
        verdict.is_some()
    }

    /// One step of relaxation; true at the end, when all loads are in equilibrium or none can be found.
    fn relax_step(&mut self) -> Result<bool, RunFailure> {
        let tolerance = self.tolerance();
        let failure = match self.moved.simulation.relax_step(tolerance) {
            Ok(Relaxed::Done) => return Ok(true),
            Ok(Relaxed::Increment(_)) => {
                self.frame()?;
                return Ok(false);
            }
            Ok(Relaxed::Moving) => {
                let Moved { simulation, cursor, .. } = &mut *self.moved;
                let step = cursor.step.unwrap_or(0) + 1;
                cursor.step = Some(step);
                if step <= cursor.steps {
                    return Ok(false);
                }
                // What it says is of the present state.
                simulation.check_finite().map_err(failed(self.stage))?;
                simulation.not_converged(tolerance, cursor.steps)
            }
            Err(failure @ (RunError::Collapsed { .. } | RunError::OutOfReach { .. })) => failure,
            Err(error) => return Err(failed(self.stage)(error)),
        };
        self.failure = Some(failure);
        Ok(true)
    }

    fn frame(&mut self) -> Result<(), RunFailure> {
        self.recorded(|recorder, simulation, _| recorder.frame(simulation))
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
        record(&mut self.moved.recorder, &mut self.moved.simulation, self.observer)?;
        self.recording += start.elapsed();
        Ok(())
    }

    /// Ends the stage: velocities are those of the present time. Returns why the run ends with it, if it does.
    pub(super) fn finish(self) -> Result<Option<RunFailure>, RunFailure> {
        let seconds = self.moved.cursor.seconds + self.seconds();
        let relax = self.relax();
        let Moved { simulation, recorder, cursor } = &mut *self.moved;
        simulation.check_finite().map_err(failed(self.stage))?;
        let unbalanced = simulation.unbalanced();
        let verdict = match &self.failure {
            Some(RunError::Collapsed { .. }) => Verdict::Fails,
            Some(_) => Verdict::Undecided,
            None if relax => Verdict::AtRest,
            None => simulation.verdict(),
        };
        let moving = match verdict {
            Verdict::Fails => simulation.moving_blocks(),
            _ => Vec::new(),
        };
        let steps = cursor.step.unwrap_or(0);
        let time_step = if relax { f64::NAN } else { simulation.time_step() };
        if relax {
            simulation.finish_relaxation();
        } else {
            simulation.settle();
        }
        recorder.fragments(simulation, &self.stage.name)?;
        let updates = simulation.model().n_nodes() as f64 * steps as f64;
        let summary = StageSummary {
            name: self.stage.name.clone(),
            kind: if relax { "relax" } else { "dynamic" }.to_owned(),
            verdict,
            moving,
            steps,
            time_step,
            wall_seconds: seconds,
            node_updates_per_second: if seconds > 0.0 { updates / seconds } else { 0.0 },
            unbalanced,
            imbalance: simulation.energy().imbalance(),
            state: simulation.state_summary(),
            ..StageSummary::default()
        };
        let doubts = [
            unbalanced_energy(summary.imbalance, cursor.imbalance, relax),
            flutter(simulation, self.stage, cursor),
        ];
        let went_off = gone_off(simulation, &self.off);
        for doubt in doubts.iter().flatten().chain(&went_off) {
            self.observer.event(Event::Warning(doubt));
        }
        self.observer.event(Event::StageDone(&summary));
        cursor.done.push(summary);
        (cursor.step, cursor.seconds) = (None, 0.0);
        let Some(failure) = self.failure.map(failed(self.stage)) else { return Ok(None) };
        if self.stage.on_failure == Some(OnFailure::Continue) {
            self.observer.event(Event::Warning(&failure.to_string()));
            return Ok(None);
        }
        Ok(Some(failure))
    }

    /// Wall time of stepping since this stage began or went on `[s]`.
    pub(super) fn seconds(&self) -> f64 {
        self.clock.elapsed().saturating_sub(self.recording).as_secs_f64()
    }

    fn relax(&self) -> bool {
        self.stage.kind == StageKind::Relax
    }

    fn tolerance(&self) -> f64 {
        self.stage.tolerance.unwrap_or(1e-5)
    }

    fn progress(&self) -> Progress {
        let Moved { simulation, cursor, .. } = &*self.moved;
        let relax = self.relax();
        let step = cursor.step.unwrap_or(0);
        let left = if relax { None } else { simulation.steps_left() };
        let steps = left.map_or(cursor.steps, |left| step + left);
        let here = step - self.steps_before;
        let seconds = self.seconds();
        let rate = if seconds > 0.0 { here as f64 / seconds } else { 0.0 };
        let left = (steps.saturating_sub(step)) as f64 / rate;
        Progress {
            stage: self.stage.name.clone(),
            stage_index: (cursor.stage, self.stages),
            relax,
            step,
            steps,
            time: simulation.time(),
            unbalanced: simulation.unbalanced(),
            tolerance: self.tolerance(),
            failed_pairs: simulation.failed_pairs().iter().sum(),
            contacts: simulation.touching_blocks() as u64,
            updates_per_second: rate * simulation.model().n_nodes() as f64,
            seconds_left: (!relax && left.is_finite()).then_some(left),
        }
    }
}

impl Moved {
    fn begin(&mut self, stage: &Stage) -> Result<(), RunError> {
        let Self { simulation, cursor, .. } = self;
        cursor.steps = match stage.kind {
            StageKind::Relax | StageKind::Safety => {
                let increments =
                    stage.increments.unwrap_or_else(|| simulation.default_increments());
                simulation.start_relaxation(increments)?;
                stage.max_steps.unwrap_or(200_000)
            }
            StageKind::Dynamic => {
                let (damping, step) = (stage.damping, stage.time_step);
                simulation.start(
                    damping.unwrap_or_default(),
                    step.unwrap_or_default(),
                    stage.duration,
                )?
            }
        };
        cursor.step = Some(0);
        cursor.begun = simulation.time();
        let energy = simulation.energy();
        (cursor.friction, cursor.imbalance) = (energy.friction, energy.imbalance());
        cursor.time_step = simulation.time_step();
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
}

pub(super) fn failed(stage: &Stage) -> impl Fn(RunError) -> RunFailure {
    let stage = stage.name.clone();
    move |source| RunFailure::Stage { stage: stage.clone(), source }
}

/// Warning about deformable blocks that slide where a deck has turned all damping off.
fn flutter(simulation: &mut Simulation, stage: &Stage, begun: &Cursor) -> Option<String> {
    let contact = simulation.model().deck().damping_ratio();
    let undamped = stage.damping.unwrap_or_default() == Damping::None && contact == 0.0;
    if stage.kind == StageKind::Relax || !undamped {
        return None;
    }
    let energy = simulation.energy();
    let most = energy.kinetic.max(energy.external.abs());
    let model = simulation.model();
    let rigid = (0..model.n_blocks()).all(|block| model.is_rigid(block));
    (!rigid && energy.friction - begun.friction > SLID * most).then(|| {
        "deformable blocks have slid without damping (`damping` in `[contact]` is 0); such blocks flutter and \
         slide too easily: look whether 0.2 changes the answer"
            .to_owned()
    })
}

/// The charges of a deck at the present time, by their numbers.
fn charges(simulation: &Simulation) -> impl Iterator<Item = (usize, ChargeState)> {
    (0..).map_while(|index| Some((index, simulation.charge(index)?)))
}

/// What is to be said of charges that have gone off since, where the rock around was not what it was at
/// the start any more.
fn gone_off(simulation: &Simulation, before: &[bool]) -> Vec<String> {
    let sizes = simulation.model().charges();
    let fresh = charges(simulation).zip(&sizes).zip(before).filter(|(_, off)| !**off);
    let said = fresh.filter_map(|(((index, charge), size), _)| {
        let part = charge.began.filter(|_| size.walls > 0)? / size.volume;
        if charge.vented && charge.began == Some(charge.volume) {
            return Some(format!(
                "charge {index} did nothing: when it went off its walls had moved apart, and the gas was out"
            ));
        }
        ((part - 1.0).abs() > CHANGED).then(|| {
            format!(
                "charge {index} went off in {:.3e} m³, {:.0} % of the room that there was at the start: the rock \
                 around had moved",
                part * size.volume,
                100.0 * part
            )
        })
    });
    said.collect()
}

/// Warning about energy that has gone out of balance in a stage.
fn unbalanced_energy(imbalance: f64, before: f64, relax: bool) -> Option<String> {
    let help = if relax { "more `increments`" } else { "a shorter `time_step`" };
    (imbalance > MUCH && imbalance > before + 0.5 * MUCH).then(|| {
        format!(
            "{:.1} % of the largest energy has come or gone without a cause (`balance` and `contact` in \
             energy.csv): look whether {help} changes the answer",
            100.0 * imbalance
        )
    })
}
