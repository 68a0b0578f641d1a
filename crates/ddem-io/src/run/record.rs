//! Schedule and writing of records during a run.

use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use ddem_core::{Model, Simulation};
use ddem_deck::Probe;

use super::Event;
use super::files::{Files, Position};
use super::probe::Sampler;
use crate::OutputError;
use crate::folder::Folder;

/// Rows of `energy.csv` in a dynamic stage, the fewest steps between them, and steps between rows in
/// a relaxation. A row costs as much as a step.
const ENERGY_ROWS: u64 = 200;
const FEWEST_ENERGY_STEPS: u64 = 10;
const ENERGY_STEPS: u64 = 100;

/// Wall time between two looks at the files.
const SEEN_EVERY: Duration = Duration::from_secs(5);

/// Steps of one stage at which records are due; in a dynamic stage, steps of the initial length.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    frames: Due,
    energy: Due,
    probes: Vec<Due>,
    callbacks: Due,
}

#[derive(Clone, Copy, Debug)]
enum Due {
    /// Multiples of a number of steps, and the end.
    Every(u64),
    /// Number of times, spread evenly over a number of steps.
    Times(u64, u64),
    /// The end alone.
    End,
}

impl Due {
    /// Interval in seconds, rounded to whole steps.
    fn seconds(every: f64, time_step: f64) -> Self {
        Self::Every(((every / time_step).round() as u64).max(1))
    }

    fn at(self, step: u64) -> bool {
        match self {
            Self::Every(every) => step.is_multiple_of(every),
            Self::Times(times, steps) => {
                // True if this is step k·steps/times, rounded, for some k.
                let k = (step as f64 * times as f64 / steps as f64).round();
                (k * steps as f64 / times as f64).round() as u64 == step
            }
            Self::End => false,
        }
    }
}

impl Schedule {
    pub(super) fn dynamic(
        stage: &ddem_deck::Stage,
        samplers: &[Sampler],
        steps: u64,
        time_step: f64,
    ) -> Self {
        let frames = match (stage.fields_every, stage.frames) {
            (Some(every), _) => Due::seconds(every, time_step),
            (None, _) => Due::Times(stage.frames().min(steps), steps),
        };
        let sample = |sampler: &Sampler| match sampler.every {
            Some(every) => Due::seconds(every, time_step),
            None => Due::Every((steps / Probe::SAMPLES).max(1)),
        };
        Self {
            frames,
            energy: Due::Every((steps / ENERGY_ROWS).max(FEWEST_ENERGY_STEPS)),
            probes: samplers.iter().map(sample).collect(),
            callbacks: Due::End,
        }
    }

    pub(super) fn relax(samplers: &[Sampler]) -> Self {
        Self {
            frames: Due::End,
            energy: Due::Every(ENERGY_STEPS),
            probes: samplers.iter().map(|s| Due::Every(s.every_steps)).collect(),
            callbacks: Due::End,
        }
    }

    /// Same schedule with callbacks at an interval `[s]`, if one is given.
    pub(super) fn with_callbacks(self, every: Option<f64>, time_step: f64) -> Self {
        Self { callbacks: every.map_or(Due::End, |every| Due::seconds(every, time_step)), ..self }
    }

    /// True if a look at the simulation is due after one of the steps.
    pub(super) fn callbacks(&self, mut steps: RangeInclusive<u64>) -> bool {
        steps.any(|step| self.callbacks.at(step))
    }
}

/// Samples of probes and, if a folder is given, the files that grow during a run.
#[derive(Debug)]
pub(super) struct Recorder {
    pub(super) samplers: Vec<Sampler>,
    files: Option<Files>,
    /// Time shift between frames at equal times.
    nudge: f64,
    /// Step and time of the last reported samples.
    last_event: Option<(u64, f64)>,
    /// Wall time at which the files were last seen in their place.
    seen: Instant,
}

/// Callback for samples.
pub(super) type Tell<'a> = dyn FnMut(Event<'_>) + 'a;

impl Recorder {
    pub(super) fn new(samplers: Vec<Sampler>, nudge: f64) -> Self {
        Self { samplers, files: None, nudge, last_event: None, seen: Instant::now() }
    }

    /// Creates new files.
    pub(super) fn create(&mut self, folder: &Folder, model: &Model) -> Result<(), OutputError> {
        self.files = Some(Files::create(folder, model, &self.columns(), self.nudge)?);
        Ok(())
    }

    /// Continues the files of an earlier run, cut at `position`.
    pub(super) fn reopen(
        &mut self,
        folder: &Folder,
        model: &Model,
        position: &Position,
    ) -> Result<(), OutputError> {
        self.files = Some(Files::reopen(folder, model, position, self.nudge)?);
        Ok(())
    }

    /// Closes the files; nothing more is written.
    pub(super) fn close(&mut self) {
        self.files = None;
    }

    /// Checks at intervals that the files are still in their place, long before the next output.
    pub(super) fn check_in_place(&mut self) -> Result<(), OutputError> {
        if self.seen.elapsed() < SEEN_EVERY {
            return Ok(());
        }
        self.seen = Instant::now();
        self.files.as_ref().map_or(Ok(()), Files::check_in_place)
    }

    fn columns(&self) -> Vec<&str> {
        self.samplers.iter().flat_map(|s| s.columns.iter().map(String::as_str)).collect()
    }

    /// Writes the records that are due after a step of a stage. At its end all records are due,
    /// except those that the last step has already written if the end takes no step.
    pub(super) fn after_step(
        &mut self,
        simulation: &mut Simulation,
        schedule: &Schedule,
        (stage, steps): (&str, RangeInclusive<u64>),
        (end, stepped): (bool, bool),
        tell: &mut Tell<'_>,
    ) -> Result<(), OutputError> {
        let due = |due: &Due| match (end, stepped) {
            (false, _) => steps.clone().any(|step| due.at(step)),
            (true, true) => true,
            (true, false) => *steps.end() == 0 || !due.at(*steps.end()),
        };
        if schedule.probes.iter().any(due) {
            let which: Vec<bool> = schedule.probes.iter().map(due).collect();
            self.sample(simulation, stage, &which, tell)?;
        }
        if due(&schedule.energy) {
            self.balance(simulation, stage)?;
        }
        if due(&schedule.frames) {
            self.frame(simulation, stage)?;
        }
        Ok(())
    }

    /// Writes frame and sample 0, unless they have been written.
    pub(super) fn start(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
        tell: &mut Tell<'_>,
    ) -> Result<(), OutputError> {
        let new_files = self.files.as_ref().is_some_and(Files::are_new);
        if new_files || (self.files.is_none() && self.last_event.is_none()) {
            self.sample(simulation, stage, &vec![true; self.samplers.len()], tell)?;
        }
        if new_files {
            self.balance(simulation, stage)?;
            self.frame(simulation, stage)?;
        }
        Ok(())
    }

    fn sample(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
        which: &[bool],
        tell: &mut Tell<'_>,
    ) -> Result<(), OutputError> {
        let mut row = Vec::new();
        for (sampler, &due) in self.samplers.iter().zip(which) {
            if due {
                row.extend(sampler.sample(simulation).into_iter().map(Some));
            } else {
                row.resize(row.len() + sampler.columns.len(), None);
            }
        }
        let (step, time) = (simulation.steps(), simulation.time());
        if self.last_event != Some((step, time)) {
            tell(Event::Sample { step, time, values: &row });
        }
        self.last_event = Some((step, time));
        match &mut self.files {
            Some(files) => files.probes.row(stage, step, time, &row),
            None => Ok(()),
        }
    }

    fn balance(&mut self, simulation: &mut Simulation, stage: &str) -> Result<(), OutputError> {
        let Some(files) = &mut self.files else { return Ok(()) };
        let energy = simulation.energy().values();
        files.energy.row(stage, simulation.steps(), simulation.time(), &energy)
    }

    /// Writes one time step to the files for ParaView.
    pub(super) fn frame(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
    ) -> Result<(), OutputError> {
        self.files.as_mut().map_or(Ok(()), |files| files.frame(simulation, stage))
    }

    /// Writes the fragments at the end of a stage.
    pub(super) fn fragments(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
    ) -> Result<(), OutputError> {
        self.files.as_mut().map_or(Ok(()), |files| files.fragments(simulation, stage))
    }

    /// Writes everything so far safely to the disk and returns the position in the files.
    pub(super) fn sync(&mut self) -> Result<Position, OutputError> {
        self.files.as_mut().map_or(Ok(Position::default()), Files::sync)
    }
}
