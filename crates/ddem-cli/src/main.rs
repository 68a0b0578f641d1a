//! Command line of ddem.

mod advice;
mod args;
mod json;
mod plot;
mod progress;
mod results;
mod status;
mod template;

use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;
use ddem_core::ErrorCode;
use ddem_deck::{BuildProgress, DeckError};
use ddem_io::cells;
use ddem_io::run;
use ddem_io::run::{Options, Outcome, RunFailure};
use mimalloc::MiMalloc;

use args::{Cli, Command, CutArguments, RunArguments};
use json::JsonLines;
use plot::NoPicture;
use progress::{BuildDisplay, Screen, Watcher};
use results::NoResults;
use template::{NewArguments, NotWritten};

// Large models step a tenth faster than with the allocator of the system, and breaking joints more.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// Exit status of an interrupted command, as in shells.
const INTERRUPTED: u8 = 130;
/// Last line of a run that was stopped before it wrote anything.
const NOTHING_WRITTEN: &str = "stopped before the first step: nothing was written";
/// Time after a signal in which others count as the same one: `timeout` signals a program and its group.
const SAME_SIGNAL: Duration = Duration::from_millis(500);

/// Outcome of a command.
enum CommandOutcome {
    /// The command has finished.
    Done,
    /// Stopped on request, after a checkpoint.
    Interrupted,
}

/// Failure of a command.
enum CommandFailure {
    /// The command line is wrong, or asks for help or the version.
    CommandLine(clap::Error),
    /// The deck is wrong or the run failed.
    Run(RunFailure),
    /// A folder has no results.
    Results(NoResults),
    /// No picture was drawn.
    Picture(NoPicture),
    /// No starter deck was written.
    Template(NotWritten),
    /// The word `run` with the words that followed; there is no such command.
    NoCommand(Vec<String>),
    /// Standard output cannot be written.
    Output(io::Error),
}

impl From<NoResults> for CommandFailure {
    fn from(error: NoResults) -> Self {
        Self::Results(error)
    }
}

impl From<NoPicture> for CommandFailure {
    fn from(error: NoPicture) -> Self {
        Self::Picture(error)
    }
}

impl From<NotWritten> for CommandFailure {
    fn from(error: NotWritten) -> Self {
        Self::Template(error)
    }
}

impl From<RunFailure> for CommandFailure {
    fn from(failure: RunFailure) -> Self {
        Self::Run(failure)
    }
}

impl From<DeckError> for CommandFailure {
    fn from(error: DeckError) -> Self {
        Self::Run(error.into())
    }
}

fn main() -> ExitCode {
    #[cfg(unix)]
    report_large_files();
    let ending = command();
    if let Err(failure) = &ending {
        say(failure);
    }
    ExitCode::from(match ending {
        Ok(CommandOutcome::Done) => 0,
        Ok(CommandOutcome::Interrupted) => INTERRUPTED,
        Err(CommandFailure::CommandLine(error)) => u8::from(error.use_stderr()) * 2,
        Err(CommandFailure::Run(failure)) => failure.exit_status(),
        Err(CommandFailure::Picture(failure)) => failure.exit_status(),
        Err(
            CommandFailure::Results(_) | CommandFailure::Template(_) | CommandFailure::NoCommand(_),
        ) => 2,
        // A broken pipe is no error: the reader has seen enough.
        Err(CommandFailure::Output(error)) => u8::from(error.kind() != ErrorKind::BrokenPipe),
    })
}

/// Blocks the signal that ends a program when a file reaches the limit of its size (`ulimit -f`). Writing then
/// returns an error, and the run ends with a message. Threads inherit this.
#[cfg(unix)]
fn report_large_files() {
    use nix::sys::signal::{SigSet, Signal};
    let mut signals = SigSet::empty();
    signals.add(Signal::SIGXFSZ);
    // Without it the system ends the run; the last checkpoint remains.
    let _ = signals.thread_block();
}

fn command() -> Result<CommandOutcome, CommandFailure> {
    let cli = Cli::try_parse()
        .map_err(|error| CommandFailure::CommandLine(args::explained(error, &words())))?;
    match (cli.command, cli.run) {
        (None, Some(run)) if run.check => check(&run),
        (None, Some(run)) => run_deck(&run),
        (Some(Command::New(args)), _) => new(&args),
        (Some(Command::Status(args)), _) => output(&status::status(&args)?),
        (Some(Command::Schema), _) => output(&format!("{:#}\n", ddem_deck::json_schema())),
        (Some(Command::Info { folder }), _) => output(&results::info(&folder)?),
        (Some(Command::Cut(args)), _) => cut(&args),
        (Some(Command::Plot(args)), _) => {
            results::is_folder(&args.folder)?;
            plot::plot(&args)?;
            Ok(CommandOutcome::Done)
        }
        (Some(Command::Completions { shell }), _) => output(&args::completions(shell)),
        (Some(Command::Man), _) => output(&args::manual().map_err(CommandFailure::Output)?),
        (Some(Command::Run { arguments }), _) => Err(CommandFailure::NoCommand(arguments)),
        // clap answers an empty command line with the help.
        (None, None) => Ok(CommandOutcome::Done),
    }
}

/// Words of the command line after the program.
fn words() -> Vec<String> {
    std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect()
}

/// Prints a report on a deck without running it.
fn check(args: &RunArguments) -> Result<CommandOutcome, CommandFailure> {
    let (deck, source) = ddem_deck::read(&args.deck)?;
    let building = BuildDisplay::start(&Screen::new(args.quiet), false);
    let report = run::inspect_with_progress(&deck, &source, &building.progress())?;
    drop(building);
    if args.quiet {
        return Ok(CommandOutcome::Done);
    }
    for warning in &report.warnings {
        complain(&format!("warning: {warning}\n"));
    }
    output(&report.to_string())
}

/// Writes a starter deck.
fn new(args: &NewArguments) -> Result<CommandOutcome, CommandFailure> {
    let deck = template::write(args)?;
    let run = args::run_command(&deck);
    Screen::new(false).line(&format!("wrote {}, to run it: {run}", deck.display()));
    Ok(CommandOutcome::Done)
}

/// Cuts the regions of a deck.
fn cut(args: &CutArguments) -> Result<CommandOutcome, CommandFailure> {
    let (deck, source) = ddem_deck::read(&args.deck)?;
    let screen = Screen::new(false);
    let building = BuildDisplay::start(&screen, false);
    let rock = deck
        .cut_regions_with_progress(&building.progress())
        .map_err(|error| DeckError::from_faults(&source, error.faults))?;
    drop(building);
    let added = rock.added_inertia();
    for warning in rock.warnings(&added) {
        screen.line(&format!("warning: {warning}"));
    }
    let folder = cells::write(&rock, (&deck, &source), &args.folder(), args.earlier())?;
    if let Some(kept) = folder.kept() {
        screen.line(&format!("earlier results were moved to {}", kept.display()));
    }
    output(&cells::table(&rock, &added))?;
    let out = folder.path().display();
    screen.line(&format!("the blocks are in {out}: open blocks.vtkhdf there in ParaView"));
    Ok(CommandOutcome::Done)
}

fn run_deck(args: &RunArguments) -> Result<CommandOutcome, CommandFailure> {
    let (deck, source) = ddem_deck::read(&args.deck)?;
    let mut options = Options::new(args.folder());
    options.threads = args.threads;
    options.earlier = args.earlier();
    options.simd = args.simd.unwrap_or_default();
    options.profile = args.profile;
    options.checkpoint_every = args.checkpoint_every;

    let screen = Screen::new(args.quiet);
    let building = BuildDisplay::start(&screen, args.json);
    let stop = stop_on_interrupt(&screen, building.progress(), args.json);
    let lines = args.json.then(|| JsonLines::new(&deck));
    let mut watcher = Watcher::new(screen.clone(), stop, lines, building);
    let outcome = run::run(&deck, &source, &options, &mut watcher);
    watcher.end();
    if args.json {
        json::end(&outcome);
    }
    let folder = options.out.display();
    match outcome {
        Ok(Outcome::Done(_)) => {
            watcher.result();
            screen.line(&format!("results are in {folder}: open blocks.vtkhdf there in ParaView"));
            Ok(CommandOutcome::Done)
        }
        Ok(Outcome::Interrupted(checkpoint)) => {
            let resume = args.resume_command();
            screen.line(&format!("saved in {}, to continue: {resume}", checkpoint.display()));
            Ok(CommandOutcome::Interrupted)
        }
        Err(RunFailure::Stopped) => {
            screen.line(NOTHING_WRITTEN);
            Ok(CommandOutcome::Interrupted)
        }
        Err(failure) => {
            if failure.exit_status() == 1 {
                watcher.result();
                if options.out.exists() {
                    screen.line(&format!("the results up to here are in {folder}"));
                }
            }
            Err(failure.into())
        }
    }
}

/// Flag that Ctrl-C sets, and the signals by which systems end programs. A later Ctrl-C ends the program, as does
/// one while the model is being built.
fn stop_on_interrupt(screen: &Screen, building: Arc<BuildProgress>, json: bool) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let (raised, screen) = (Arc::clone(&stop), screen.clone());
    let mut first: Option<Instant> = None;
    let handler = move || match first {
        Some(first) if first.elapsed() > SAME_SIGNAL => std::process::exit(INTERRUPTED.into()),
        Some(_) => {}
        None if building.abandon() => {
            screen.clear();
            screen.line(NOTHING_WRITTEN);
            if json {
                json::end(&Err(RunFailure::Stopped));
            }
            std::process::exit(INTERRUPTED.into());
        }
        None => {
            first = Some(Instant::now());
            raised.store(true, Ordering::Relaxed);
            screen.line("stopping at the next step to save; Ctrl-C again stops at once, unsaved");
        }
    };
    // Without the handler Ctrl-C ends the program at once; the last checkpoint remains.
    let _ = ctrlc::set_handler(handler);
    stop
}

/// Writes to standard output.
fn output(text: &str) -> Result<CommandOutcome, CommandFailure> {
    let mut stdout = io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(CommandFailure::Output)?;
    Ok(CommandOutcome::Done)
}

/// Writes to standard error. Errors are ignored, because nobody reads a closed stream.
fn complain(text: &str) {
    let _ = io::stderr().write_all(text.as_bytes());
}

/// True if messages may have colours.
fn colours() -> bool {
    let no_colour = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    io::stderr().is_terminal() && !no_colour
}

/// Prints the message of a failure.
fn say(failure: &CommandFailure) {
    match failure {
        CommandFailure::CommandLine(error) if error.use_stderr() => {
            complain(&args::coded(error, colours()));
        }
        CommandFailure::CommandLine(error) => {
            let _ = error.print();
        }
        CommandFailure::Run(RunFailure::Deck(error)) => {
            complain(&error.report(colours()));
            if let DeckError::Unreadable { path, source } = error
                && source.kind() == ErrorKind::NotFound
                && let Some(near) = ddem_deck::near(path, is_deck)
            {
                complain(&format!("  did you mean `{}`?\n", near.display()));
            }
        }
        CommandFailure::Run(failure) => {
            complain(&format!("error: {}\n", advice::advised(failure)));
        }
        CommandFailure::NoCommand(arguments) => {
            let deck = if arguments.is_empty() { "deck.toml".into() } else { arguments.join(" ") };
            complain(&format!(
                "error: `run` is not a command of ddem: run a deck by `ddem {deck}` [{}]\n",
                ErrorCode::UnknownCommand
            ));
        }
        CommandFailure::Results(error) => complain(&format!("error: {error}\n")),
        CommandFailure::Template(error) => complain(&format!("error: {error}\n")),
        CommandFailure::Picture(error) => {
            if let Some(code) = error.code() {
                complain(&format!("error: {error} [{code}]\n"));
            }
        }
        CommandFailure::Output(error) if error.kind() == ErrorKind::BrokenPipe => {}
        CommandFailure::Output(error) => {
            let code = ErrorCode::FileAccess;
            complain(&format!("error: cannot write to standard output: {error} [{code}]\n"));
        }
    }
}

fn is_deck(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "toml")
}
