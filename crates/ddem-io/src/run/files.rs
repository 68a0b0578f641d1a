//! The files that grow during a run.

use ddem_core::{CONTACT_FIELDS, Contact, Energy, Field, Fragment, Model, On, Simulation};
use serde::{Deserialize, Serialize};

use ddem_deck::Deck;

use super::mesh::{self, Mesh};
use crate::OutputError;
use crate::folder::Folder;
use crate::tables::{EnergyTable, FragmentTable, FrameTable, ProbeTable};
use crate::vtkhdf::{Cloud, FieldSpec, Kind, Values, Writer};

/// Frames of a dynamic stage when the deck does not say.
pub(super) const DEFAULT_FRAMES: u64 = 20;

/// Columns of a fragment: its number, and what it is.
fn fragment_columns() -> Vec<&'static str> {
    ["fragment"].into_iter().chain(Fragment::NAMES).collect()
}

/// All files that grow during a run.
#[derive(Debug)]
pub(super) struct Files {
    blocks: Writer,
    /// Only of a model with joints: some readers stumble over a mesh without cells.
    joints: Option<Writer>,
    /// Only of a model whose blocks can meet.
    contacts: Option<Cloud>,
    pub(super) probes: ProbeTable,
    pub(super) energy: EnergyTable,
    fragments: FragmentTable,
    frames: FrameTable,
    /// Time of the last frame in the files.
    last_frame: f64,
    /// What frames that would share a time are put apart by.
    nudge: f64,
}

/// How far the files had got.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Position {
    pub(super) frames: u64,
    pub(super) probe_rows: u64,
    pub(super) energy_rows: u64,
    pub(super) fragment_rows: u64,
    pub(super) last_frame: f64,
}

impl Files {
    pub(super) fn create(
        folder: &Folder,
        model: &Model,
        columns: &[&str],
        nudge: f64,
    ) -> Result<Self, OutputError> {
        let (blocks, joints) = (mesh::blocks(model), mesh::joints(model));
        let create = |path, mesh: &Mesh, joints| {
            Writer::create(path, &mesh.grid, &mesh.constants(), &specs(model, joints))
        };
        let blocks = create(folder.blocks(), &blocks, false)?;
        let joints =
            (model.n_pairs() > 0).then(|| create(folder.joints(), &joints, true)).transpose()?;
        let contacts = model.can_meet().then(|| Cloud::create(folder.contacts(), &contact_specs()));
        Ok(Self {
            blocks,
            joints,
            contacts: contacts.transpose()?,
            probes: ProbeTable::create(folder.probes(), columns)?,
            energy: EnergyTable::create(folder.energy(), &Energy::NAMES)?,
            fragments: FragmentTable::create(folder.fragments(), &fragment_columns())?,
            frames: FrameTable::create(folder.frames(), &["paraview_time"])?,
            last_frame: f64::NEG_INFINITY,
            nudge,
        })
    }

    /// Opens the files of an earlier run and cuts them where the checkpoint was.
    pub(super) fn reopen(
        folder: &Folder,
        model: &Model,
        position: Position,
        nudge: f64,
    ) -> Result<Self, OutputError> {
        let frames = position.frames as usize;
        Ok(Self {
            blocks: Writer::reopen(folder.blocks(), &specs(model, false), frames)?,
            joints: (model.n_pairs() > 0)
                .then(|| Writer::reopen(folder.joints(), &specs(model, true), frames))
                .transpose()?,
            contacts: (model.can_meet())
                .then(|| Cloud::reopen(folder.contacts(), &contact_specs(), frames))
                .transpose()?,
            probes: ProbeTable::reopen(folder.probes(), position.probe_rows)?,
            energy: EnergyTable::reopen(folder.energy(), position.energy_rows)?,
            fragments: FragmentTable::reopen(folder.fragments(), position.fragment_rows)?,
            frames: FrameTable::reopen(folder.frames(), position.frames)?,
            last_frame: position.last_frame,
            nudge,
        })
    }

    /// Nothing has been written yet.
    pub(super) fn are_new(&self) -> bool {
        self.last_frame == f64::NEG_INFINITY
    }

    /// One time step in the files for ParaView.
    pub(super) fn frame(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
    ) -> Result<(), OutputError> {
        // Times must grow: relaxation takes none, so its frames are put a little apart.
        let now = simulation.time();
        let time = if now > self.last_frame { now } else { self.last_frame + self.nudge };
        self.last_frame = time;
        let files = [(false, Some(&mut self.blocks)), (true, self.joints.as_mut())];
        for (joints, writer) in files {
            let Some(writer) = writer else { continue };
            let fields = table(simulation.model(), joints);
            let fill = |field: &Field| Filled::new(kind(field.name), (field.fill)(simulation));
            let filled: Vec<Filled> = fields.map(fill).collect();
            let values: Vec<Values<'_>> = filled.iter().map(Filled::values).collect();
            writer.append(time, &values)?;
        }
        if let Some(cloud) = &mut self.contacts {
            append(cloud, time, &simulation.contacts())?;
        }
        // At once, after the others: what has a row is there for those who read while it runs.
        self.frames.row(stage, simulation.steps(), now, &[time])?;
        self.frames.flush()
    }

    /// The fragments at the end of a stage.
    pub(super) fn fragments(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
    ) -> Result<(), OutputError> {
        let (step, time) = (simulation.steps(), simulation.time());
        for (number, fragment) in simulation.fragments().iter().enumerate() {
            let values: Vec<f64> = [number as f64].into_iter().chain(fragment.values()).collect();
            self.fragments.row(stage, step, time, &values)?;
        }
        Ok(())
    }

    /// Everything so far safely on the disk, and how far that is.
    pub(super) fn sync(&mut self) -> Result<Position, OutputError> {
        self.blocks.sync()?;
        if let Some(joints) = &mut self.joints {
            joints.sync()?;
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.sync()?;
        }
        self.probes.sync()?;
        self.energy.sync()?;
        self.fragments.sync()?;
        self.frames.sync()?;
        Ok(Position {
            frames: self.blocks.steps() as u64,
            probe_rows: self.probes.rows_written(),
            energy_rows: self.energy.rows_written(),
            fragment_rows: self.fragments.rows_written(),
            last_frame: self.last_frame,
        })
    }
}

/// One time step in the file of the contacts.
fn append(cloud: &mut Cloud, time: f64, contacts: &[Contact]) -> Result<(), OutputError> {
    let points: Vec<[f64; 3]> = contacts.iter().map(|contact| contact.position).collect();
    let fields = CONTACT_FIELDS.iter();
    let filled: Vec<Filled> =
        fields.map(|field| Filled::new(kind(field.name), field.fill(contacts))).collect();
    let values: Vec<Values<'_>> = filled.iter().map(Filled::values).collect();
    cloud.append(time, &points, &values)
}

/// Frames of a relaxation are a millionth of the shortest time between frames of motion apart, or
/// `still` where the deck has none.
pub(super) fn nudge(deck: &Deck, still: f64) -> f64 {
    let between = deck.stage.iter().filter_map(|stage| {
        let frames = stage.frames.unwrap_or(DEFAULT_FRAMES) as f64;
        stage.fields_every.or(stage.duration.map(|duration| duration / frames))
    });
    let shortest = between.fold(f64::INFINITY, f64::min);
    if shortest.is_finite() { 1e-6 * shortest } else { still }
}

/// Fields of the joint surfaces, or of the blocks.
fn table(model: &Model, joints: bool) -> impl Iterator<Item = &'static Field> + use<> {
    model.fields().filter(move |field| (field.on == On::Pair) == joints)
}

/// States and numbers of blocks are whole numbers in the files.
fn kind(name: &str) -> Kind {
    match name {
        "state" | "open" | "released" | "removed" | "sliding" => Kind::U8,
        "blocks" | "fragment" => Kind::I32,
        _ => Kind::F64,
    }
}

fn contact_specs() -> Vec<FieldSpec> {
    let spec = |name, components| FieldSpec::point(name, components).kind(kind(name));
    CONTACT_FIELDS.iter().map(|field| spec(field.name, field.components)).collect()
}

fn specs(model: &Model, joints: bool) -> Vec<FieldSpec> {
    let spec = |field: &Field| {
        let spec = match field.on {
            On::Element => FieldSpec::cell(field.name, field.components),
            On::Node | On::Pair => FieldSpec::point(field.name, field.components),
        };
        spec.kind(kind(field.name))
    };
    table(model, joints).map(spec).collect()
}

/// The values of one field in the type of its file.
enum Filled {
    F64(Vec<f64>),
    I32(Vec<i32>),
    U8(Vec<u8>),
}

impl Filled {
    fn new(kind: Kind, values: Vec<f64>) -> Self {
        match kind {
            Kind::U8 => Self::U8(values.into_iter().map(|x| x as u8).collect()),
            Kind::I32 => Self::I32(values.into_iter().map(|x| x as i32).collect()),
            Kind::F64 => Self::F64(values),
        }
    }

    fn values(&self) -> Values<'_> {
        match self {
            Self::F64(values) => Values::F64(values),
            Self::I32(values) => Values::I32(values),
            Self::U8(values) => Values::U8(values),
        }
    }
}
