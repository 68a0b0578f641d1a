//! Outer loop of a run: stages of a deck, files and checkpoints.

use std::collections::BTreeMap;
use std::time::Instant;

use ddem_core::{ErrorCode, Simulation};
use ddem_deck::lint::{Code, Diagnostic};
use ddem_deck::{BuildPhase, BuiltDeck, Deck, Source, Stage, StageKind};

use super::files::{Position, nudge};
use super::given_steps::check_all_steps;
use super::moved::MovedBy;
use super::profile::StageTimer;
use super::record::Recorder;
use super::report::{Built, available_memory, located, prepare, report};
use super::resume::{self, Cursor, Resumed};
use super::safety::search;
use super::session::Session;
use super::stage::{Halt, Running, failed};
use super::tracker::{StatusFile, StatusWriter};
use super::warnings::stage_place;
use super::{Event, Observer, Options, Outcome, RunFailure};
use crate::OutputError;
use crate::folder::{self, Earlier, Folder};
use crate::replace;

/// Runs a deck: every stage, with its results in `options.out`.
///
/// # Errors
///
/// The deck or the folder is wrong; nothing has then run or been written. The run fails; the files
/// written so far are then intact.
pub fn run(
    deck: &Deck,
    source: &Source,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Outcome, RunFailure> {
    let threads = options.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| RunFailure::Threads { threads, error: Box::new(error) })?;
    // The pool is entered once; every step forks inside of it.
    let mut status = StatusFile::new(deck, &options.out);
    let mut observer = StatusWriter { observer, file: Some(&mut status) };
    let outcome = pool.install(|| Drive::start(deck, source, options, &mut observer)?.run());
    status.end(matches!(outcome, Ok(Outcome::Done(_))), outcome.as_ref().err());
    outcome
}

/// End of a stage.
enum Ended {
    /// The observer stopped the run; a checkpoint has been written.
    Interrupted,
    /// The stage is done; the run ends after it if there is a failure.
    Done(Option<RunFailure>),
}

struct Drive<'a> {
    options: &'a Options,
    observer: &'a mut dyn Observer,
    folder: Folder,
    session: Session,
}

impl<'a> Drive<'a> {
    fn start(
        deck: &Deck,
        source: &Source,
        options: &'a Options,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, RunFailure> {
        let begun = Instant::now();
        let progress = observer.build_progress();
        let Built { site, model, samplers } = prepare(deck, source, available_memory(), &progress)?;
        // Frames of a deck without dynamic stages are 1 s apart.
        let mut recorder = Recorder::new(samplers, nudge(deck, 1.0));
        let name = std::path::Path::new(source.name());
        let name = name.file_name().map_or(source.name().into(), |n| n.to_string_lossy());
        let open = || -> Result<Folder, RunFailure> {
            if !progress.finish() {
                return Err(RunFailure::Stopped);
            }
            let (title, text) = (&deck.title, source.text());
            Ok(folder::prepare(&options.out, &name, title, text, options.earlier)?)
        };
        let text = source.text().to_owned();
        let (folder, session);
        let resume = options.earlier == Earlier::Resume;
        if resume && folder::has_checkpoint(&options.out) {
            folder = open()?;
            let resumed = load_checkpoint(&folder, deck, &text, observer)?;
            let mut simulation = resumed.simulation(model, options.simd)?;
            simulation.stop_when(observer.stop_flag());
            recorder.reopen(&folder, simulation.model(), &resumed.progress.position)?;
            let mut resuming = Session::assemble(site, simulation, recorder, text);
            resuming.moved.cursor = resumed.progress.cursor;
            session = resuming;
        } else {
            let mut started = Simulation::with_simd(model, options.simd);
            progress.enter(BuildPhase::Report);
            started.stop_when(observer.stop_flag());
            check_all_steps(&mut started, deck).map_err(|failure| located(failure, source))?;
            // All checks have passed; only now are files written.
            folder = open()?;
            if resume {
                observer.event(Event::NothingSaved(folder.path()));
            }
            recorder.create(&folder, started.model())?;
            session = Session::assemble(site, started, recorder, text);
        }
        let mut drive = Self { options, observer, folder, session };
        let MovedBy { site, simulation, recorder, cursor, timer } = &mut drive.session.moved;
        if options.profile {
            *timer = StageTimer::profiled(begun, simulation);
        }
        let report = report(site, simulation, &recorder.samplers);
        for warning in &report.warnings {
            cursor.warn(site.deck(), warning.clone(), drive.observer);
        }
        drive.observer.event(Event::Built(&report));
        drive.session.warnings = report.warnings;
        if let Some(kept) = drive.folder.kept() {
            drive.observer.event(Event::Kept(kept));
        }
        Ok(drive)
    }

    fn run(mut self) -> Result<Outcome, RunFailure> {
        let stages = self.session.site().deck().stage.clone();
        while let Some(stage) = stages.get(self.session.moved.cursor.stage) {
            let ended = self.stage(stage, &stages)?;
            if let Ended::Done(_) = ended {
                self.session.moved.cursor.stage += 1;
                let Self { observer, folder, session: Session { moved, text, .. }, .. } = &mut self;
                checkpoint(moved, (folder, text), 0.0, *observer)?;
            }
            self.session.summary().write(self.folder.summary())?;
            match ended {
                Ended::Interrupted => return Ok(Outcome::Interrupted(self.folder.checkpoint())),
                Ended::Done(Some(failure)) => return Err(failure),
                Ended::Done(None) => {}
            }
        }
        self.session.moved.recorder.close();
        Ok(Outcome::Done(Box::new(self.session)))
    }

    /// Runs one stage from its start or from a checkpoint.
    fn stage(&mut self, stage: &Stage, stages: &[Stage]) -> Result<Ended, RunFailure> {
        let Self { observer, folder, session: Session { moved, text, .. }, options } = self;
        let every = moved.site.deck().output.checkpoint_interval();
        let every = options.checkpoint_every.unwrap_or(every);
        moved.timer.enter();
        if moved.cursor.step.is_none() {
            moved.simulation.enter(moved.cursor.stage).map_err(failed(stage))?;
            let next = stages.get(moved.cursor.stage + 1);
            let leads_back = is_for_safety(stage, next);
            moved.cursor.start = leads_back.then(|| moved.simulation.save());
        }
        if stage.kind == StageKind::Safety {
            if search((stage, stages.len()), moved, (folder, text), *observer)? {
                return Ok(Ended::Done(None));
            }
            checkpoint(moved, (folder, text), 0.0, *observer)?;
            return Ok(Ended::Interrupted);
        }
        let mut running = match Running::new((stage, stages.len()), None, moved, *observer) {
            Err(failure) if failure.is_stopped() => {
                checkpoint(moved, (folder, text), 0.0, *observer)?;
                return Ok(Ended::Interrupted);
            }
            running => running?,
        };
        loop {
            let halt = running.run(every)?;
            if halt == Halt::End {
                break;
            }
            let (seconds, start) = (running.seconds(), Instant::now());
            checkpoint(running.moved, (folder, text), seconds, running.observer)?;
            let MovedBy { simulation, timer, .. } = &mut *running.moved;
            timer.stepped(simulation);
            timer.recorded(start.elapsed(), simulation);
            if halt == Halt::Stopped {
                return Ok(Ended::Interrupted);
            }
        }
        let failure = running.finish()?;
        let start = moved.cursor.start.take();
        let (Some(failure), Some(start)) = (&failure, start) else {
            return Ok(Ended::Done(failure));
        };
        // The factor of safety matters most for a slope that fails. The search starts from the
        // state before this stage.
        moved.simulation = moved.simulation.back_to(&start).map_err(failed(stage))?;
        let MovedBy { site, cursor, .. } = moved;
        let at = stage_place(site.deck(), stage);
        let help =
            format!("the factor of safety refers to the state at the start of `{}`", stage.name);
        let text = failure.to_string();
        let text = failure.code().strip(&text);
        let warning = Diagnostic::warning(Code::FailedStage, at, text, help);
        cursor.warn(site.deck(), warning, *observer);
        Ok(Ended::Done(None))
    }
}

/// Checkpoint of a folder, which must come from the same deck with the same files.
///
/// If the last one is damaged or missing, it is the one before, from which the same bits follow.
fn load_checkpoint(
    folder: &Folder,
    deck: &Deck,
    text: &str,
    observer: &mut dyn Observer,
) -> Result<Resumed, RunFailure> {
    let (path, previous) = (folder.checkpoint(), folder.previous_checkpoint());
    let last = resume::load(&path).map_err(|failure| match failure {
        RunFailure::Output(error) => resume::unreadable(&path, &error),
        failure => failure,
    });
    let resumed = match last {
        Err(failure) if failure.code() == ErrorCode::InvalidFile || !path.exists() => {
            let Ok(resumed) = resume::load(&previous) else { return Err(failure) };
            // The next checkpoint would otherwise keep the damaged one as the one before it.
            let _ = std::fs::rename(&previous, &path);
            let text = failure.to_string();
            observer.event(Event::DamagedCheckpoint(failure.code().strip(&text)));
            resumed
        }
        last => last?,
    };
    let message = if resumed.deck != text {
        "the deck has changed since: restore it, or run from the start".to_owned()
    } else if let Some(file) = changed(deck, &resumed.progress.files) {
        format!("`{file}` has changed since: restore it, or run from the start")
    } else {
        return Ok(resumed);
    };
    Err(resume::wrong(&path, message))
}

/// True if a stage finds the equilibrium whose factor of safety the next stage searches for.
fn is_for_safety(stage: &Stage, next: Option<&Stage>) -> bool {
    let searches = next.is_some_and(|next| next.kind == StageKind::Safety);
    searches && stage.kind == StageKind::Relax && stage.on_failure.is_none()
}

/// Path of a file that the deck names and whose contents have changed.
fn changed(deck: &Deck, before: &BTreeMap<String, Vec<f64>>) -> Option<String> {
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let differs = |(path, now): &(String, Vec<f64>)| {
        before.get(path).is_none_or(|before| bits(before) != bits(now))
    };
    ddem_deck::file_contents(deck).into_iter().find(differs).map(|(path, _)| path)
}

/// Writes a checkpoint. `seconds` is the wall time of the running stage since it began or was
/// resumed `[s]`.
fn checkpoint(
    moved: &mut MovedBy,
    place: (&Folder, &str),
    seconds: f64,
    observer: &mut dyn Observer,
) -> Result<(), OutputError> {
    let MovedBy { site, simulation, recorder, cursor, .. } = moved;
    let position = recorder.sync()?;
    let before = cursor.seconds;
    cursor.seconds += seconds;
    let written = write_checkpoint((site, simulation), cursor, &position, place, observer);
    cursor.seconds = before;
    written
}

/// Writes a checkpoint to a folder, with the text of the deck, for files that are on the disk up to `position`.
pub(super) fn write_checkpoint(
    of: (&BuiltDeck, &Simulation),
    cursor: &Cursor,
    position: &Position,
    (folder, text): (&Folder, &str),
    observer: &mut dyn Observer,
) -> Result<(), OutputError> {
    let path = folder.checkpoint();
    replace::keep_previous(&path, &folder.previous_checkpoint());
    resume::save(&path, text, of, cursor, position)?;
    observer.event(Event::Checkpoint(&path));
    Ok(())
}
