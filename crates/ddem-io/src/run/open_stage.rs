//! Stages that a session begins, advances from pause to pause, and ends.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use ddem_core::{ErrorCode, Fault, ModelError, RunError, Simulation};
use ddem_deck::lint::{Code, Diagnostic, load_at_rest};
use ddem_deck::{BuiltDeck, Stage, StageKind};

use super::given_steps::{check_steps, unsafe_steps};
use super::moved::MovedBy;
use super::session::Session;
use super::stage::{Halt, Running, StageProgress};
use super::tracker::{StatusFile, StatusWriter};
use super::{Event, Observer, RunFailure};
use crate::folder::Folder;

/// A stage that a session has begun but not ended.
#[derive(Debug)]
pub struct OpenStage {
    stage: Stage,
    folder: Option<Folder>,
    /// `None` only while it advances.
    progress: Option<StageProgress>,
    /// Status file in the folder.
    status: Option<StatusFile>,
}

/// Status of a stage after [`advance`](Session::advance).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageStatus {
    /// The stage is at its end.
    Done,
    /// The stage is at a pause that is due.
    Paused,
    /// The observer stopped the stage.
    Stopped,
}

impl Session {
    /// Enters a stage of the deck, by its number.
    ///
    /// # Errors
    ///
    /// The stage comes before the present one; the fault names `place`.
    pub fn enter(&mut self, stage: usize, place: &str) -> Result<(), Fault> {
        let MovedBy { site, simulation, .. } = &mut self.moved;
        enter(site, simulation, stage, place)
    }

    /// Moves the simulation through a stage, which need neither belong to the deck nor have a name.
    /// If the deck has a stage of that name, its supports and loads come into force, unless they
    /// are in force already. Otherwise those of the stage that was [entered](Simulation::enter)
    /// last remain. With a folder the results are written there like those of a deck. All results
    /// that one session writes to one folder are one run, and the files are complete after each
    /// stage.
    ///
    /// Returns false if the observer stopped the stage; the simulation can continue from its
    /// present state.
    ///
    /// # Errors
    ///
    /// Faults of the stage; a folder that cannot be used; a run that fails.
    pub fn stage(
        &mut self,
        stage: &Stage,
        folder: Option<&Path>,
        observer: &mut dyn Observer,
    ) -> Result<bool, RunFailure> {
        let Some(mut open) = self.begin(stage, folder, None, observer)? else { return Ok(false) };
        let status = self.advance(&mut open, observer);
        let done = matches!(status, Ok(StageStatus::Done));
        let closed = self.end(open, done, observer);
        status?;
        closed?;
        Ok(done)
    }

    /// Begins a stage for a program that reads the simulation in between.
    /// [`advance`](Self::advance) moves the stage and [`end`](Self::end) must end it;
    /// [`stage`](Self::stage) does all three. `pauses` is the time between pauses in a dynamic
    /// stage, rounded to whole steps `[s]`.
    ///
    /// `None` if the observer stopped the stage.
    ///
    /// # Errors
    ///
    /// Faults of the stage; a folder that cannot be used.
    pub fn begin(
        &mut self,
        stage: &Stage,
        folder: Option<&Path>,
        pauses: Option<f64>,
        observer: &mut dyn Observer,
    ) -> Result<Option<OpenStage>, RunFailure> {
        self.stoppable(observer.stop_flag(), |session| {
            let Some(folder) = session.prepare(stage, folder, observer)? else { return Ok(None) };
            let stage = session.named(stage);
            let mut status = folder.as_ref().map(|folder| {
                let before = session.moved.cursor.done.len();
                StatusFile::of_stage(session.site().deck(), &stage, before, folder.path())
            });
            let mut writer = StatusWriter { observer, file: status.as_mut() };
            match Running::new((&stage, 1), pauses, &mut session.moved, &mut writer) {
                Ok(running) => {
                    let progress = Some(running.pause());
                    Ok(Some(OpenStage { stage, folder, progress, status }))
                }
                Err(failure) => {
                    if let Some(status) = &mut status {
                        status.end(false, Some(&failure));
                    }
                    let closed = session.close(folder.as_ref());
                    if !failure.is_stopped() {
                        return Err(failure);
                    }
                    closed.map(|()| None)
                }
            }
        })
    }

    /// Moves the simulation to the next pause that is due, or to the end of the stage.
    ///
    /// # Errors
    ///
    /// A run that fails; a file that cannot be written.
    pub fn advance(
        &mut self,
        open: &mut OpenStage,
        observer: &mut dyn Observer,
    ) -> Result<StageStatus, RunFailure> {
        let OpenStage { stage, progress, status, .. } = open;
        let Some(held) = progress.take() else { return Ok(StageStatus::Stopped) };
        self.stoppable(observer.stop_flag(), |session| {
            let mut writer = StatusWriter { observer, file: status.as_mut() };
            let mut running = Running::resume(stage, &mut session.moved, &mut writer, held);
            let halt = running.run(Duration::MAX);
            *progress = Some(running.pause());
            if let (Err(failure), Some(status)) = (&halt, status) {
                status.end(false, Some(failure));
            }
            Ok(match halt? {
                Halt::End => StageStatus::Done,
                Halt::Callback => StageStatus::Paused,
                Halt::Stopped | Halt::Due => StageStatus::Stopped,
            })
        })
    }

    /// Ends a stage and its files. With `done` the stage ends as at its last step; otherwise the
    /// simulation stays where it was stopped.
    ///
    /// # Errors
    ///
    /// A stage that has failed; a file that cannot be written.
    pub fn end(
        &mut self,
        open: OpenStage,
        done: bool,
        observer: &mut dyn Observer,
    ) -> Result<(), RunFailure> {
        let OpenStage { stage, folder, progress, mut status } = open;
        let mut writer = StatusWriter { observer, file: status.as_mut() };
        let finish = |progress| {
            let mut running = Running::resume(&stage, &mut self.moved, &mut writer, progress);
            running.end_here()?;
            running.finish()?.map_or(Ok(()), Err)
        };
        let ended = progress.filter(|_| done).map_or(Ok(()), finish);
        let ended = ended.and(self.close(folder.as_ref()));
        if let Some(status) = &mut status {
            status.end(done, ended.as_ref().err());
        }
        ended
    }

    /// Runs `work`, which ends early if the flag is set.
    fn stoppable<T>(
        &mut self,
        flag: Arc<AtomicBool>,
        work: impl FnOnce(&mut Self) -> Result<T, RunFailure>,
    ) -> Result<T, RunFailure> {
        self.moved.simulation.stop_when(flag);
        let done = work(self);
        self.moved.simulation.stop_when(Arc::default());
        done
    }

    /// Checks that a stage can begin, brings its supports and loads into force and opens its files.
    /// Returns `None` if the observer stopped it.
    fn prepare(
        &mut self,
        stage: &Stage,
        folder: Option<&Path>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Option<Folder>>, RunFailure> {
        let mut faults = stage.check();
        if stage.kind == StageKind::Safety {
            let fault = Fault::new(
                ErrorCode::NotSupported,
                "kind",
                "a session has no stage that searches for a factor of safety",
            );
            faults
                .push(fault.help("`Simulation::factor_of_safety` finds that of the present state"));
        }
        if !faults.is_empty() {
            return Err(ModelError { faults }.into());
        }
        let MovedBy { site, simulation, cursor, .. } = &mut self.moved;
        let stages = std::slice::from_ref(stage);
        if let Err(failure) = check_steps(simulation, stages) {
            return if failure.is_stopped() { Ok(None) } else { Err(failure) };
        }
        let mut warnings = unsafe_steps(site.deck(), simulation, stages);
        warnings.extend(begin(site, simulation, stage)?);
        for warning in warnings {
            cursor.warn(site.deck(), warning, observer);
        }
        let folder = folder.map(|path| self.open(path)).transpose()?;
        if let Some(kept) = folder.as_ref().and_then(Folder::kept) {
            observer.event(Event::Kept(kept));
        }
        Ok(Some(folder))
    }

    /// Copy of a stage; if it has no name, it gets one with its kind and number.
    fn named(&self, stage: &Stage) -> Stage {
        let mut named = stage.clone();
        if named.name.is_empty() {
            let kind = if stage.kind == StageKind::Relax { "relax" } else { "run" };
            named.name = format!("{kind} {}", self.moved.cursor.done.len() + 1);
        }
        named
    }
}

/// Enters a stage of the deck.
///
/// # Errors
///
/// The stage comes before the present one; the fault names `place`.
pub(super) fn enter(
    site: &BuiltDeck,
    simulation: &mut Simulation,
    stage: usize,
    place: &str,
) -> Result<(), Fault> {
    simulation.enter(stage).map_err(|error| match error {
        RunError::EarlierStage { stage, present } => {
            let name = |stage: usize| &site.deck().stage[stage].name;
            let message = format!(
                "`{}` comes before `{}`, which has begun: stages are entered forwards only",
                name(stage),
                name(present)
            );
            Fault::new(ErrorCode::EarlierStage, place, message)
                .help("load a state that was saved before to go back")
        }
        error => Fault::new(error.code(), place, error.code().strip(&error.to_string())),
    })
}

/// Brings the supports and loads of the deck's stage of the same name into force, if there is one.
/// Returns warnings.
fn begin(
    site: &BuiltDeck,
    simulation: &mut Simulation,
    stage: &Stage,
) -> Result<Vec<Diagnostic>, ModelError> {
    let mut warnings = Vec::new();
    let stages = &site.deck().stage;
    match stages.iter().position(|own| own.name == stage.name) {
        Some(own) if own != simulation.stage() => enter(site, simulation, own, "name")?,
        Some(_) => {}
        None if stage.name.is_empty() => {}
        None => {
            // Any name is allowed, for the results. It may be a mistake if the stage with nearly
            // this name has not begun.
            let later = stages.iter().skip(simulation.stage() + 1);
            let names = later.map(|own| own.name.as_str());
            if let Some(near) = ddem_deck::names::nearest(&stage.name, names) {
                let message = format!(
                    "the model has a stage `{near}`, but none named `{}`: its supports and loads do not come \
                     into force",
                    stage.name
                );
                let help = format!("did you mean `{near}`?");
                warnings.push(Diagnostic::warning(Code::UnknownStage, "name", message, help));
            }
        }
    }
    if stage.kind == StageKind::Relax {
        if let Some(fault) = site.free_motion(simulation) {
            return Err(fault.into());
        }
        let at_zero = simulation.loads_at_zero().into_iter();
        warnings.extend(at_zero.map(|load| load_at_rest(load, &stage.name)));
    }
    Ok(warnings)
}
