//! Simulation that a program moves stage by stage, with its probes and its files.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use ddem_core::{Fault, ModelError, Safety, SafetySearch, Simd, Simulation};
use ddem_deck::lint::{Diagnostic, loose_tolerance};
use ddem_deck::{BuildProgress, BuiltDeck, Deck};

use super::RunFailure;
use super::files::{Position, nudge};
use super::moved::MovedBy;
use super::profile::StageTimer;
use super::record::Recorder;
use super::report::{Built, available_memory, build};
use super::resume::{self, Cursor};
use super::safety;
use crate::folder::{self, Earlier, Folder};
use crate::summary::{
    AddedInertia, ChargeSummary, FailedPairs, InterfaceSummary, SelectionSummary, Summary,
    WorstElement, peak_memory_bytes,
};
use crate::version::{REVISION, VERSION};

/// Time shift between frames without motion if the deck has no dynamic stage `[s]`.
const STILL: f64 = 1e-9;

/// A simulation with its probes and, if a folder is given, its files.
///
/// A program moves it through stages of its own, or step by step through
/// [`simulation`](Self::simulation); [`run`](super::run) moves it through those of its deck.
#[derive(Debug)]
pub struct Session {
    pub(super) moved: MovedBy,
    /// Text of the deck.
    pub(super) text: String,
    /// Warnings about the model and its probes.
    pub(super) warnings: Vec<Diagnostic>,
    /// Folders of files, each with the position in the files and the stamp of its checkpoint.
    recorded: BTreeMap<PathBuf, (Position, Option<Stamp>)>,
}

/// Modification time and size of a file; they differ if another simulation has written it.
type Stamp = (SystemTime, u64);

fn stamp(file: &Path) -> Option<Stamp> {
    let about = fs::metadata(file).ok()?;
    Some((about.modified().ok()?, about.len()))
}

impl Session {
    /// Builds the model of a deck.
    ///
    /// # Errors
    ///
    /// The deck has mistakes, or its model does not fit in memory.
    pub fn new(deck: &Deck, simd: Simd) -> Result<Self, RunFailure> {
        Self::with(deck, simd, |_| Ok(()))
    }

    /// Builds the model of a deck and changes properties that a deck cannot hold, such as a law or
    /// a history that a program computes.
    ///
    /// # Errors
    ///
    /// Those of [`new`](Self::new), and the fault of `change`.
    pub fn with(
        deck: &Deck,
        simd: Simd,
        change: impl FnOnce(&mut ddem_core::Model) -> Result<(), Fault>,
    ) -> Result<Self, RunFailure> {
        let Built { site, mut model, samplers } =
            build(deck, available_memory(), &BuildProgress::default())?;
        change(&mut model).map_err(ModelError::from)?;
        let text = ddem_deck::write(deck)?;
        let recorder = Recorder::new(samplers, nudge(deck, STILL));
        let simulation = Simulation::with_simd(model, simd);
        let mut session = Self::assemble(site, simulation, recorder, text);
        session.find_warnings();
        Ok(session)
    }

    pub(super) fn assemble(
        site: BuiltDeck,
        simulation: Simulation,
        recorder: Recorder,
        text: String,
    ) -> Self {
        let (cursor, timer) = (Cursor::default(), StageTimer::default());
        let moved = MovedBy { site, simulation, recorder, cursor, timer };
        Self { moved, text, warnings: Vec::new(), recorded: BTreeMap::new() }
    }

    /// Finds the warnings about the model and its probes, for the program and the summary.
    fn find_warnings(&mut self) {
        let MovedBy { site, simulation, recorder, cursor, .. } = &mut self.moved;
        let deck = site.deck();
        let mut warnings = site.warnings(simulation.model());
        warnings.extend(recorder.samplers.iter().filter_map(|sampler| sampler.warning.clone()));
        warnings.retain(|warning| cursor.keep(deck, warning));
        self.warnings = warnings;
    }

    /// The deck with its blocks cut.
    #[must_use]
    pub fn site(&self) -> &BuiltDeck {
        &self.moved.site
    }

    /// The simulation.
    #[must_use]
    pub fn simulation(&self) -> &Simulation {
        &self.moved.simulation
    }

    /// The simulation, for reading and moving.
    pub fn simulation_mut(&mut self) -> &mut Simulation {
        &mut self.moved.simulation
    }

    /// Warnings about the model and its probes.
    #[must_use]
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }

    /// Warnings about a search for the factor of safety of the present state, from its result. Their
    /// places are the keys of the search. The summary has them, too.
    pub fn search_warnings(&mut self, search: &SafetySearch, found: &Safety) -> Vec<Diagnostic> {
        let before = loose_tolerance(search);
        let after = safety::warnings(found, search, &mut self.moved.simulation);
        before.into_iter().chain(after).filter(|warning| self.warn(warning)).collect()
    }

    /// Adds a warning of a program to the summary, unless the deck allows it. Returns true if the
    /// program must show it.
    pub fn warn(&mut self, warning: &Diagnostic) -> bool {
        let MovedBy { site, cursor, .. } = &mut self.moved;
        cursor.keep(site.deck(), warning)
    }

    /// Names and columns of the probes, in the order of
    /// [`Event::Sample`](super::Event::Sample).
    #[must_use]
    pub fn probes(&self) -> Vec<(&str, &'static [&'static str])> {
        self.moved.recorder.samplers.iter().map(|s| (s.name.as_str(), s.components)).collect()
    }

    /// Opens new files, or those that this session wrote before.
    pub(super) fn open(&mut self, path: &Path) -> Result<Folder, RunFailure> {
        let MovedBy { site, simulation, recorder, .. } = &mut self.moved;
        let model = simulation.model();
        // The canonical path identifies the folder.
        let known = path.canonicalize().ok();
        let before = known.and_then(|path| self.recorded.get(&path));
        let title = &site.deck().title;
        let name = model_name(&self.text);
        let earlier = if before.is_some() { Earlier::Reopen } else { Earlier::Keep };
        let folder = folder::prepare(path, &name, title, &self.text, earlier)?;
        match before {
            Some((_, left)) if stamp(&folder.checkpoint()) != *left => {
                return Err(RunFailure::Recorded { folder: path.to_owned() });
            }
            Some((position, _)) => recorder.reopen(&folder, model, position)?,
            None => recorder.create(&folder, model)?,
        }
        Ok(folder)
    }

    /// Ends a stage: writes everything to the disk and closes the files, so that others can read
    /// them.
    pub(super) fn close(&mut self, folder: Option<&Folder>) -> Result<(), RunFailure> {
        self.moved.cursor.step = None;
        let Some(folder) = folder else { return Ok(()) };
        let synced = self.moved.recorder.sync();
        self.moved.recorder.close();
        let position = synced?;
        let path = folder.path().canonicalize().unwrap_or_else(|_| folder.path().to_owned());
        let between = Cursor { step: None, ..self.moved.cursor.clone() };
        let of = (&self.moved.site, &self.moved.simulation);
        let saved = resume::save(&folder.checkpoint(), &self.text, of, &between, &position);
        self.recorded.insert(path, (position, stamp(&folder.checkpoint())));
        saved?;
        self.summary().write(folder.summary())?;
        Ok(())
    }

    /// Session that continues from a file of [`save`](Self::save) or of a run. The model is that of
    /// the deck in the file, to which a given `deck` must be equal; `change` is as in
    /// [`with`](Self::with).
    ///
    /// # Errors
    ///
    /// The file cannot be read, is not a checkpoint, or belongs to another model.
    pub fn load(
        path: &Path,
        simd: Simd,
        deck: Option<&Deck>,
        change: impl FnOnce(&mut ddem_core::Model) -> Result<(), Fault>,
    ) -> Result<Self, RunFailure> {
        // The stamp is taken before reading, so that writing by another simulation in the meantime
        // is detected.
        let read = stamp(path);
        let resumed = resume::load(path)?;
        let text = &resumed.deck;
        let (mut saved, _) = ddem_deck::parse_alone(text, &path.display().to_string())?;
        if !ddem_deck::restore_files(&mut saved, &resumed.progress.files) {
            return Err(resume::wrong(
                path,
                "the contents of a file that its deck names are missing: save it again",
            ));
        }
        if deck.is_some_and(|deck| *deck != saved) {
            return Err(resume::wrong(
                path,
                "another model wrote it: load it with that model, or without one",
            ));
        }
        let Built { site, mut model, samplers } =
            build(&saved, available_memory(), &BuildProgress::default())?;
        change(&mut model).map_err(ModelError::from)?;
        let recorder = Recorder::new(samplers, nudge(&saved, STILL));
        let simulation = resumed.simulation(model, simd)?;
        let mut session = Self::assemble(site, simulation, recorder, text.to_owned());
        // A session from the checkpoint of a folder continues the files of that folder.
        let position = resumed.progress.position;
        if let (Some(folder), true) = (path.parent(), path.ends_with(folder::CHECKPOINT))
            && let (Ok(folder), true) = (folder.canonicalize(), position.has_files())
        {
            session.recorded.insert(folder, (position, read));
        }
        let mut cursor = resumed.progress.cursor;
        // A stage of the deck that was interrupted does not continue here.
        (cursor.step, cursor.start) = (None, None);
        cursor.trials.clear();
        session.moved.cursor = cursor;
        session.find_warnings();
        Ok(session)
    }

    /// Writes everything that the simulation needs to continue bit for bit.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), RunFailure> {
        let between = Cursor { step: None, ..self.moved.cursor.clone() };
        let of = (&self.moved.site, &self.moved.simulation);
        Ok(resume::save(path, &self.text, of, &between, &Position::default())?)
    }

    /// Summary of the run so far.
    pub fn summary(&mut self) -> Summary {
        let contacts = self.moved.simulation.contact_summary();
        let fragments = self.moved.simulation.fragment_summary();
        let [shear, tension] = self.moved.simulation.failed_pairs();
        let MovedBy { site, simulation, .. } = &self.moved;
        let model = simulation.model();
        Summary {
            version: VERSION.to_owned(),
            revision: REVISION.map(str::to_owned),
            title: site.deck().title.clone(),
            blocks: model.n_whole_blocks() as u64,
            nodes: model.n_nodes() as u64,
            elements: model.n_elements() as u64,
            pairs: model.n_pairs() as u64,
            failed_pairs: FailedPairs { shear, tension },
            contacts,
            fragments,
            interfaces: site.interfaces().into_iter().map(InterfaceSummary::from).collect(),
            charges: model.charges().into_iter().map(ChargeSummary::from).collect(),
            selections: site.selections().into_iter().map(SelectionSummary::from).collect(),
            added_inertia: AddedInertia::of_regions(site, model),
            worst_element: WorstElement::new(model),
            peak_memory_bytes: peak_memory_bytes(),
            stages: self.moved.cursor.done.clone(),
            warnings: self.moved.cursor.warnings.clone(),
            deck: self.text.clone(),
        }
    }
}

/// Name of a program's model, from the text of its deck. A deck with any difference gives another
/// name.
#[must_use]
pub fn model_name(text: &str) -> String {
    format!("model {:08x}", fingerprint(text))
}

/// Number that distinguishes texts (FNV-1a hash).
fn fingerprint(text: &str) -> u32 {
    text.bytes().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}
