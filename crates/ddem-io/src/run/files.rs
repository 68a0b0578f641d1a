//! The files that grow during a run.

use std::ops::Range;
use std::path::{Path, PathBuf};

use ddem_core::{
    CONTACT_FIELDS, Energy, Field, FieldKind, FieldLocation, Fragment, Model, Simulation,
};
use ddem_deck::Deck;
use serde::{Deserialize, Serialize};

use super::mesh::{self, OutputMesh};
use crate::OutputError;
use crate::folder::{self, Folder};
use crate::tables::Table;
use crate::vtkhdf::{EarlierSteps, FieldSpec, NumberType, PointOwner, Savepoint, Writer};

/// Number of leading columns of `fragments.csv` with whole numbers: number of the fragment and
/// number of its blocks.
const WHOLE: usize = 2;

/// All files that grow during a run.
#[derive(Debug)]
pub(super) struct Files {
    blocks: Writer,
    /// File of the joints; `None` without joints: some readers cannot handle a mesh without cells.
    joints: Option<Writer>,
    /// File of the contacts; `None` if blocks cannot come into contact.
    contacts: Option<Writer>,
    pub(super) probes: Table,
    pub(super) energy: Table,
    fragments: Table,
    frames: Table,
    /// Time of the last frame in the files.
    last_frame: f64,
    /// Time shift between frames of equal time `[s]`.
    nudge: f64,
}

/// Position in the files.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Position {
    pub(super) frames: u64,
    /// Savepoints of the files of blocks, joints and contacts.
    pub(super) savepoints: [Option<Savepoint>; 3],
    pub(super) probe_rows: u64,
    pub(super) energy_rows: u64,
    pub(super) fragment_rows: u64,
    pub(super) last_frame: f64,
}

impl Position {
    /// True unless a program saved a session without files.
    pub(super) fn has_files(&self) -> bool {
        self.savepoints.iter().any(Option::is_some)
    }
}

impl Files {
    pub(super) fn create(
        folder: &Folder,
        model: &Model,
        columns: &[&str],
        nudge: f64,
    ) -> Result<Self, OutputError> {
        // The files are created one after the other, so that only one mesh exists at a time.
        let create = |path, mesh: OutputMesh, joints| {
            Writer::create(path, &mesh.grid, &mesh.constants(), &specs(model, joints))
        };
        let blocks = create(folder.blocks(), mesh::blocks(model), false)?;
        let joints = (model.n_pairs() > 0)
            .then(|| create(folder.joints(), mesh::joints(model), true))
            .transpose()?;
        let contacts =
            model.can_meet().then(|| Writer::create_cloud(folder.contacts(), &contact_specs()));
        let fragments: Vec<_> = ["fragment"].into_iter().chain(Fragment::NAMES).collect();
        Ok(Self {
            blocks,
            joints,
            contacts: contacts.transpose()?,
            probes: Table::create(folder.probes(), columns)?,
            energy: Table::create(folder.energy(), &Energy::NAMES)?,
            fragments: Table::create(folder.fragments(), &fragments)?.with_whole(WHOLE),
            frames: Table::create(folder.frames(), &["paraview_time"])?,
            last_frame: f64::NEG_INFINITY,
            nudge,
        })
    }

    /// Opens the files of an earlier run and brings them back to the position of the checkpoint.
    pub(super) fn reopen(
        folder: &Folder,
        model: &Model,
        position: &Position,
        nudge: f64,
    ) -> Result<Self, OutputError> {
        let reopen = |file: usize, path: PathBuf, points, fields: &[FieldSpec]| {
            let savepoint = position.savepoints[file].as_ref().ok_or_else(|| {
                let message =
                    "the checkpoint beside it was saved without this file: run from the start";
                OutputError::unusable(&path, message)
            })?;
            Writer::reopen(&path, points, fields, savepoint)
        };
        let joints = (model.n_pairs() > 0)
            .then(|| reopen(1, folder.joints(), PointOwner::Mesh, &specs(model, true)));
        let contacts = model
            .can_meet()
            .then(|| reopen(2, folder.contacts(), PointOwner::Step, &contact_specs()));
        Ok(Self {
            blocks: reopen(0, folder.blocks(), PointOwner::Mesh, &specs(model, false))?,
            joints: joints.transpose()?,
            contacts: contacts.transpose()?,
            probes: Table::reopen(folder.probes(), position.probe_rows)?,
            energy: Table::reopen(folder.energy(), position.energy_rows)?,
            fragments: Table::reopen(folder.fragments(), position.fragment_rows)?.with_whole(WHOLE),
            frames: Table::reopen(folder.frames(), position.frames)?,
            last_frame: position.last_frame,
            nudge,
        })
    }

    /// True if no frame has been written yet.
    pub(super) fn are_new(&self) -> bool {
        self.last_frame == f64::NEG_INFINITY
    }

    /// Writes one time step to the files for ParaView.
    pub(super) fn frame(
        &mut self,
        simulation: &mut Simulation,
        stage: &str,
    ) -> Result<(), OutputError> {
        // Times must increase. Relaxation takes no time, so its frames are shifted a little.
        let now = simulation.time();
        let time = if now > self.last_frame { now } else { self.last_frame + self.nudge };
        self.last_frame = time;
        let snapshot = simulation.snapshot();
        let append = |writer: &mut Writer, joints| {
            let fields: Vec<&Field> = table(snapshot.model(), joints).collect();
            writer.append(time, None, &|at, rows, out| snapshot.fill(fields[at], rows, out))
        };
        let Self { blocks, joints, contacts: cloud, .. } = self;
        // HDF5 works for one thread at a time, while the other one computes numbers or copies bytes.
        let (on_blocks, on_joints) = rayon::join(
            || append(blocks, false),
            || joints.as_mut().map(|joints| append(joints, true)),
        );
        let on_cloud = cloud.as_mut().map(|cloud| {
            let contacts = simulation.contacts();
            let points = contacts.iter().map(|contact| contact.position).collect();
            cloud.append(time, Some(points), &|at, rows: Range<usize>, out: &mut [f64]| {
                CONTACT_FIELDS[at].fill(&contacts[rows], out);
            })
        });
        let mut appended = vec![(blocks, on_blocks)];
        appended.extend(joints.as_mut().zip(on_joints));
        appended.extend(cloud.as_mut().zip(on_cloud));
        keep(appended)?;
        // This row is written at once and last, so that programs that read during the run find
        // complete frames.
        self.frames.row(stage, simulation.steps(), now, &[time])?;
        self.frames.flush()
    }

    /// Writes the fragments at the end of a stage.
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

    /// Checks that all files are still in their place.
    pub(super) fn check_in_place(&self) -> Result<(), OutputError> {
        let writers = [Some(&self.blocks), self.joints.as_ref(), self.contacts.as_ref()];
        let tables = [&self.probes, &self.energy, &self.fragments, &self.frames];
        let files = writers.into_iter().flatten().map(Writer::path);
        let folder = self.blocks.path().parent().unwrap_or(Path::new("."));
        folder::check_in_place(folder, files.chain(tables.map(Table::path)))
    }

    /// Writes everything so far safely to the disk and returns the position in the files.
    pub(super) fn sync(&mut self) -> Result<Position, OutputError> {
        self.blocks.sync()?;
        self.joints.iter().chain(&self.contacts).try_for_each(Writer::sync)?;
        self.probes.sync()?;
        self.energy.sync()?;
        self.fragments.sync()?;
        self.frames.sync()?;
        let savepoint = |writer: &Writer| writer.savepoint();
        Ok(Position {
            frames: self.blocks.steps() as u64,
            savepoints: [
                Some(self.blocks.savepoint()?),
                self.joints.as_ref().map(savepoint).transpose()?,
                self.contacts.as_ref().map(savepoint).transpose()?,
            ],
            probe_rows: self.probes.rows_written(),
            energy_rows: self.energy.rows_written(),
            fragment_rows: self.fragments.rows_written(),
            last_frame: self.last_frame,
        })
    }
}

/// Keeps the step that was appended to several files in all of them, or in none.
pub(super) fn keep(
    appended: Vec<(&mut Writer, Result<EarlierSteps, OutputError>)>,
) -> Result<(), OutputError> {
    let (mut complete, mut errors) = (Vec::new(), Vec::new());
    for (writer, result) in appended {
        match result {
            Ok(earlier) => complete.push((writer, earlier)),
            Err(error) => errors.push(error),
        }
    }
    let Some(error) = errors.into_iter().next() else { return Ok(()) };
    for (writer, earlier) in complete {
        // The first error is the one to report.
        let _ = writer.go_back(&earlier);
    }
    Err(error)
}

/// Time shift between frames of a relaxation `[s]`: a millionth of the shortest time between frames
/// of dynamic stages, or `still` if the deck has none.
pub(super) fn nudge(deck: &Deck, still: f64) -> f64 {
    let between = deck.stage.iter().filter_map(|stage| {
        let frames = stage.frames() as f64;
        stage.fields_every.or(stage.duration.map(|duration| duration / frames))
    });
    let shortest = between.fold(f64::INFINITY, f64::min);
    if shortest.is_finite() { 1e-6 * shortest } else { still }
}

/// Fields of the joint surfaces, or of the blocks.
fn table(model: &Model, joints: bool) -> impl Iterator<Item = &'static Field> + use<> {
    ddem_core::fields(model).filter(move |field| (field.on == FieldLocation::Pair) == joints)
}

/// Type of the numbers of a field in the files.
fn kind(kind: FieldKind) -> NumberType {
    match kind {
        FieldKind::Real => NumberType::F64,
        FieldKind::Integer => NumberType::I32,
        FieldKind::State | FieldKind::Flag => NumberType::U8,
    }
}

fn contact_specs() -> Vec<FieldSpec> {
    let fields = CONTACT_FIELDS.iter();
    fields
        .map(|field| FieldSpec::point(field.name, field.components).kind(kind(field.kind)))
        .collect()
}

fn specs(model: &Model, joints: bool) -> Vec<FieldSpec> {
    let spec = |field: &Field| {
        let spec = match field.on {
            FieldLocation::Element => FieldSpec::cell(field.name, field.components),
            FieldLocation::Node | FieldLocation::Pair => {
                FieldSpec::point(field.name, field.components)
            }
        };
        let spec = spec.kind(kind(field.kind));
        // Compression makes dense fields a third smaller, but takes most of the time of a frame.
        if field.dense { spec.uncompressed() } else { spec }
    };
    table(model, joints).map(spec).collect()
}
