//! The result files of a run and when they are written.

use std::ops::RangeInclusive;

use ddem_core::{Energy, FIELDS, Field, Model, On, Simulation};

use super::mesh::{self, Mesh};
use super::probe::Sampler;
use crate::OutputError;
use crate::folder::Folder;
use crate::tables::{EnergyTable, ProbeTable};
use crate::vtkhdf::{FieldSpec, Kind, Values, Writer};

/// Frames of a dynamic stage when the deck does not say.
const DEFAULT_FRAMES: u64 = 20;
/// Samples of a probe in a dynamic stage when the deck does not say.
const DEFAULT_SAMPLES: u64 = 1000;
/// Rows of `energy.csv` in a dynamic stage, and steps between them in a relaxation.
const ENERGY_ROWS: u64 = 200;
const ENERGY_STEPS: u64 = 100;

/// When things are due in one stage, in steps of that stage; of motion, in steps as long as its
/// first.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    frames: Due,
    energy: Due,
    probes: Vec<Due>,
}

#[derive(Clone, Copy, Debug)]
enum Due {
    /// Every so many steps, and at the end.
    Every(u64),
    /// This many times in this many steps.
    Times(u64, u64),
    /// At the end alone.
    End,
}

impl Due {
    /// Seconds, rounded to whole steps.
    fn seconds(every: f64, time_step: f64) -> Self {
        Self::Every(((every / time_step).round() as u64).max(1))
    }

    fn at(self, step: u64) -> bool {
        match self {
            Self::Every(every) => step.is_multiple_of(every),
            Self::Times(times, steps) => {
                // Step k·steps/times, rounded: is one of them here?
                let k = (step as f64 * times as f64 / steps as f64).round();
                (k * steps as f64 / times as f64).round() as u64 == step
            }
            Self::End => false,
        }
    }
}

impl Schedule {
    pub(super) fn dynamic(
        stage: &ddem_core::deck::Stage,
        samplers: &[Sampler],
        steps: u64,
        time_step: f64,
    ) -> Self {
        let frames = match (stage.fields_every, stage.frames) {
            (Some(every), _) => Due::seconds(every, time_step),
            (None, frames) => Due::Times(frames.unwrap_or(DEFAULT_FRAMES).min(steps), steps),
        };
        let sample = |sampler: &Sampler| match sampler.every {
            Some(every) => Due::seconds(every, time_step),
            None => Due::Every((steps / DEFAULT_SAMPLES).max(1)),
        };
        Self {
            frames,
            energy: Due::Every((steps / ENERGY_ROWS).max(1)),
            probes: samplers.iter().map(sample).collect(),
        }
    }

    pub(super) fn relax(samplers: &[Sampler]) -> Self {
        Self {
            frames: Due::End,
            energy: Due::Every(ENERGY_STEPS),
            probes: samplers.iter().map(|s| Due::Every(s.every_steps)).collect(),
        }
    }
}

/// All files that grow during a run.
#[derive(Debug)]
pub(super) struct Recorder {
    blocks: Writer,
    /// Only of a model with joints: some readers stumble over a mesh without cells.
    joints: Option<Writer>,
    probes: ProbeTable,
    energy: EnergyTable,
    pub(super) samplers: Vec<Sampler>,
    /// Time of the last frame in the files.
    pub(super) last_frame: f64,
    /// What frames that would share a time are put apart by.
    nudge: f64,
}

/// How far the files had got.
#[derive(Clone, Copy, Debug)]
pub(super) struct Position {
    pub(super) frames: u64,
    pub(super) probe_rows: u64,
    pub(super) energy_rows: u64,
    pub(super) last_frame: f64,
}

impl Recorder {
    pub(super) fn create(
        folder: &Folder,
        model: &Model,
        samplers: Vec<Sampler>,
    ) -> Result<Self, OutputError> {
        let (blocks, joints) = (mesh::blocks(model), mesh::joints(model));
        let create = |path, mesh: &Mesh, joints| {
            Writer::create(path, &mesh.grid, &mesh.constants(), &specs(joints))
        };
        let blocks = create(folder.blocks(), &blocks, false)?;
        let joints =
            (model.n_pairs() > 0).then(|| create(folder.joints(), &joints, true)).transpose()?;
        let columns = columns(&samplers);
        let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
        Ok(Self {
            blocks,
            joints,
            probes: ProbeTable::create(folder.probes(), &columns)?,
            energy: EnergyTable::create(folder.energy(), &Energy::NAMES)?,
            samplers,
            last_frame: f64::NEG_INFINITY,
            nudge: nudge(model),
        })
    }

    /// Opens the files of an earlier run and cuts them where the checkpoint was.
    pub(super) fn reopen(
        folder: &Folder,
        model: &Model,
        samplers: Vec<Sampler>,
        position: Position,
    ) -> Result<Self, OutputError> {
        let frames = position.frames as usize;
        Ok(Self {
            blocks: Writer::reopen(folder.blocks(), &specs(false), frames)?,
            joints: (model.n_pairs() > 0)
                .then(|| Writer::reopen(folder.joints(), &specs(true), frames))
                .transpose()?,
            probes: ProbeTable::reopen(folder.probes(), position.probe_rows)?,
            energy: EnergyTable::reopen(folder.energy(), position.energy_rows)?,
            samplers,
            last_frame: position.last_frame,
            nudge: nudge(model),
        })
    }

    /// Writes what is due after a step of a stage; at its end everything, but for what the last
    /// step has written already when the end took none.
    pub(super) fn after_step(
        &mut self,
        simulation: &mut Simulation,
        schedule: &Schedule,
        (stage, steps): (&str, RangeInclusive<u64>),
        (end, stepped): (bool, bool),
    ) -> Result<(), OutputError> {
        let due = |due: &Due| match (end, stepped) {
            (false, _) => steps.clone().any(|step| due.at(step)),
            (true, true) => true,
            (true, false) => *steps.end() == 0 || !due.at(*steps.end()),
        };
        if schedule.probes.iter().any(due) {
            let which: Vec<bool> = schedule.probes.iter().map(due).collect();
            self.sample(simulation, stage, &which)?;
        }
        if due(&schedule.energy) {
            self.balance(simulation, stage)?;
        }
        if due(&schedule.frames) {
            self.frame(simulation)?;
        }
        Ok(())
    }

    /// Frame and sample 0: the start of the run.
    pub(super) fn start(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
    ) -> Result<(), OutputError> {
        self.sample(simulation, stage, &vec![true; self.samplers.len()])?;
        self.balance(simulation, stage)?;
        self.frame(simulation)
    }

    fn sample(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
        which: &[bool],
    ) -> Result<(), OutputError> {
        let mut row = Vec::new();
        for (sampler, &due) in self.samplers.iter().zip(which) {
            if due {
                row.extend(sampler.sample(simulation).into_iter().map(Some));
            } else {
                row.resize(row.len() + sampler.columns.len(), None);
            }
        }
        self.probes.row(stage, simulation.steps(), simulation.time(), &row)
    }

    fn balance(&mut self, simulation: &mut Simulation, stage: &str) -> Result<(), OutputError> {
        let energy = simulation.energy().values();
        self.energy.row(stage, simulation.steps(), simulation.time(), &energy)
    }

    /// One time step in the files for ParaView.
    pub(super) fn frame(&mut self, simulation: &mut Simulation) -> Result<(), OutputError> {
        // Times must grow: relaxation takes none, so its frames are put a little apart.
        let time = simulation.time();
        let time = if time > self.last_frame { time } else { self.last_frame + self.nudge };
        self.last_frame = time;
        let files = [(false, Some(&mut self.blocks)), (true, self.joints.as_mut())];
        for (joints, writer) in files {
            let Some(writer) = writer else { continue };
            let filled: Vec<Filled> =
                table(joints).map(|field| Filled::new(field, simulation)).collect();
            let values: Vec<Values<'_>> = filled.iter().map(Filled::values).collect();
            writer.append(time, &values)?;
        }
        Ok(())
    }

    /// Everything so far safely on the disk, and how far that is.
    pub(super) fn sync(&mut self) -> Result<Position, OutputError> {
        self.blocks.sync()?;
        if let Some(joints) = &mut self.joints {
            joints.sync()?;
        }
        self.probes.sync()?;
        self.energy.sync()?;
        Ok(Position {
            frames: self.blocks.steps() as u64,
            probe_rows: self.probes.rows_written(),
            energy_rows: self.energy.rows_written(),
            last_frame: self.last_frame,
        })
    }
}

fn columns(samplers: &[Sampler]) -> Vec<String> {
    samplers.iter().flat_map(|s| s.columns.iter().cloned()).collect()
}

/// Frames of a relaxation are a millionth of the shortest time between frames of motion apart;
/// 1 where nothing moves.
fn nudge(model: &Model) -> f64 {
    let between = model.deck().stage.iter().filter_map(|stage| {
        let frames = stage.frames.unwrap_or(DEFAULT_FRAMES) as f64;
        stage.fields_every.or(stage.duration.map(|duration| duration / frames))
    });
    let shortest = between.fold(f64::INFINITY, f64::min);
    if shortest.is_finite() { 1e-6 * shortest } else { 1.0 }
}

/// Fields of the joint surfaces, or of the blocks.
fn table(joints: bool) -> impl Iterator<Item = &'static Field> {
    FIELDS.iter().filter(move |field| (field.on == On::Pair) == joints)
}

/// States are whole numbers in the files.
fn kind(field: &Field) -> Kind {
    match field.name {
        "state" | "open" => Kind::U8,
        _ => Kind::F64,
    }
}

fn specs(joints: bool) -> Vec<FieldSpec> {
    let spec = |field: &Field| {
        let spec = match field.on {
            On::Element => FieldSpec::cell(field.name, field.components),
            On::Node | On::Pair => FieldSpec::point(field.name, field.components),
        };
        spec.kind(kind(field))
    };
    table(joints).map(spec).collect()
}

/// The values of one field in the type of its file.
enum Filled {
    F64(Vec<f64>),
    U8(Vec<u8>),
}

impl Filled {
    fn new(field: &Field, simulation: &mut Simulation) -> Self {
        let values = (field.fill)(simulation);
        match kind(field) {
            Kind::U8 => Self::U8(values.into_iter().map(|x| x as u8).collect()),
            _ => Self::F64(values),
        }
    }

    fn values(&self) -> Values<'_> {
        match self {
            Self::F64(values) => Values::F64(values),
            Self::U8(values) => Values::U8(values),
        }
    }
}
