//! The command line.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, CommandFactory, Parser, Subcommand};
use ddem_core::{ErrorCode, Simd};
use ddem_deck::names;
use ddem_io::folder::Earlier;

use crate::status::StatusArguments;
use crate::template::NewArguments;

/// Largest number of threads that `--threads` accepts, more than any machine has. Starting even
/// more would only waste time.
const MOST_THREADS: usize = 1024;

/// Three-dimensional deformable block discrete element method for jointed rock.
#[derive(Debug, Parser)]
#[command(
    name = "ddem",
    version = ddem_io::version::FULL_VERSION,
    arg_required_else_help = true,
    args_conflicts_with_subcommands = true,
    disable_help_subcommand = true,
    subcommand_negates_reqs = true,
    after_help = "Example: ddem deck.toml --out results/first --threads 4"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) run: Option<RunArguments>,
}

/// Subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write a commented starter deck
    New(NewArguments),
    /// Print how far a run is: stage, progress, time left, last frame and checkpoint
    Status(StatusArguments),
    /// Print the JSON Schema of decks, for editors (a deck of this name is `./schema`)
    Schema,
    /// Print the results of a run: verdicts, largest displacement, failed joints, reactions, energy
    Info {
        /// Folder of the results
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
    /// Cut the regions of a deck and list their blocks: blocks.csv, blocks.vtkhdf and a table
    Cut(CutArguments),
    /// Draw a picture of the results with the Python module of ddem
    Plot(Plot),
    /// Print the completion script of a shell
    Completions {
        /// Shell of the script
        #[arg(value_name = "SHELL")]
        shell: clap_complete::Shell,
    },
    /// Print the manual page
    Man,
    /// Explain that the command `run` does not exist
    #[command(hide = true, disable_help_flag = true)]
    Run {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
}

/// Options of a cut.
#[derive(Debug, Args)]
pub(crate) struct CutArguments {
    /// Deck with regions, a TOML file
    #[arg(value_name = "DECK")]
    pub(crate) deck: PathBuf,
    /// Folder of the files [default: results/<name of the deck>-cut]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Remove earlier files of the deck; without it they are moved to a folder DIR.1, DIR.2, ...
    #[arg(long)]
    pub(crate) overwrite: bool,
}

impl CutArguments {
    /// Folder of the files.
    pub(crate) fn folder(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| {
            let mut name = self.deck.file_stem().unwrap_or_default().to_owned();
            name.push("-cut");
            Path::new("results").join(name)
        })
    }

    /// Treatment of earlier files.
    pub(crate) fn earlier(&self) -> Earlier {
        if self.overwrite { Earlier::Overwrite } else { Earlier::Keep }
    }
}

/// Picture of results.
#[derive(Debug, Args)]
pub(crate) struct Plot {
    /// Folder of the results
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Field that colours the blocks, or one of the joints [default: displacement]
    #[arg(long, value_name = "NAME")]
    pub(crate) field: Option<String>,
    /// Frame, a number from 0 or negative from the end [default: last]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) frame: Option<String>,
    /// Direction of view: iso, xz, xy, yz, -xz, -xy or -yz [default: the side of a slab, iso otherwise]
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub(crate) view: Option<String>,
    /// Magnification of the displacements [default: one that shows them]
    #[arg(long, value_name = "X")]
    pub(crate) scale: Option<String>,
    /// Picture to write [default: DIR/plot.png]
    #[arg(long, value_name = "FILE.png")]
    pub(crate) out: Option<PathBuf>,
}

impl Plot {
    /// The arguments of the drawing program.
    pub(crate) fn arguments(&self) -> Vec<OsString> {
        let word = |word: &Option<String>| word.clone().map(OsString::from);
        let given = [
            ("--field=", word(&self.field)),
            ("--frame=", word(&self.frame)),
            ("--view=", word(&self.view)),
            ("--scale=", word(&self.scale)),
            ("--out=", self.out.clone().map(OsString::from)),
        ];
        let mut arguments = Vec::new();
        for (name, value) in given {
            arguments.extend(value.map(|value| {
                let mut argument = OsString::from(name);
                argument.push(value);
                argument
            }));
        }
        // A name that begins with a dash would be taken for an option.
        arguments.extend(["--".into(), self.folder.clone().into_os_string()]);
        arguments
    }
}

/// Options of a run.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// Deck to run, a TOML file
    #[arg(value_name = "DECK")]
    pub(crate) deck: PathBuf,
    /// Folder of the results [default: results/<name of the deck>]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Threads, which do not change the results [default: one for each processor]
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub(crate) threads: Option<usize>,
    /// Print only errors
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Print events and progress as lines of JSON on standard output
    #[arg(long, conflicts_with = "check")]
    pub(crate) json: bool,
    /// Build the model, report its size, memory and run time, and stop
    #[arg(long)]
    pub(crate) check: bool,
    /// Continue from the checkpoint in the folder of the results; without one, start
    #[arg(long)]
    pub(crate) resume: bool,
    /// Remove earlier results of the deck; without it they are moved to a folder DIR.1, DIR.2, ...
    #[arg(long, conflicts_with = "resume")]
    pub(crate) overwrite: bool,
    /// Wall time between checkpoints within a stage, which does not change the results [default: that of the deck]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    pub(crate) checkpoint_every: Option<Duration>,
    /// Measure the time of each phase of the steps, and print it at the end of each stage
    #[arg(long)]
    pub(crate) profile: bool,
    /// Instruction set of the kernels, which does not change the results
    #[arg(long, value_name = "NAME", value_parser = simd, hide = true)]
    pub(crate) simd: Option<Simd>,
}

impl RunArguments {
    /// Folder of the results.
    pub(crate) fn folder(&self) -> PathBuf {
        match &self.out {
            Some(out) => out.clone(),
            None => Path::new("results").join(self.deck.file_stem().unwrap_or_default()),
        }
    }

    /// Treatment of earlier results.
    pub(crate) fn earlier(&self) -> Earlier {
        match (self.resume, self.overwrite) {
            (true, _) => Earlier::Resume,
            (_, true) => Earlier::Overwrite,
            _ => Earlier::Keep,
        }
    }

    /// Command that resumes this run.
    pub(crate) fn resume_command(&self) -> String {
        let mut command = run_command(&self.deck);
        if let Some(out) = &self.out {
            command += &format!(" --out={}", quoted(out));
        }
        if let Some(threads) = self.threads {
            command += &format!(" --threads {threads}");
        }
        if let Some(every) = self.checkpoint_every {
            command += &format!(" --checkpoint-every {}", every.as_secs_f64());
        }
        if self.profile {
            command += " --profile";
        }
        if self.json {
            command += " --json";
        }
        command + " --resume"
    }
}

/// Commands, for a message.
const COMMANDS: &str = "ddem runs one deck, and its commands are new, status, schema, info, cut, plot, completions and man";

/// Completion script of a shell.
pub(crate) fn completions(shell: clap_complete::Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "ddem", &mut script);
    String::from_utf8_lossy(&script).into_owned()
}

/// Manual page, in the format of `man`.
pub(crate) fn manual() -> std::io::Result<String> {
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut page)?;
    let mut page = String::from_utf8_lossy(&page).into_owned();
    // The commands have no pages of their own.
    for command in Cli::command().get_subcommands() {
        let name = command.get_name();
        page = page.replace(&format!("ddem\\-{name}(1)"), &format!("ddem {name}"));
    }
    Ok(page)
}

/// Error with a plain message for an unexpected second word: a misspelt command or a second deck.
/// Other errors are returned unchanged. `words` are those of the command line.
pub(crate) fn explained(error: clap::Error, words: &[String]) -> clap::Error {
    let Some(ContextValue::String(second)) = error.get(ContextKind::InvalidSubcommand) else {
        return error;
    };
    if error.kind() != ErrorKind::ArgumentConflict {
        return error;
    }
    let is_deck = |word: &str| Path::new(word).extension().is_some_and(|end| end == "toml");
    let first = words.iter().find(|word| !word.starts_with('-'));
    let (kind, message) = match first {
        Some(first) if is_deck(second) && !is_deck(first) => {
            let option = if first == "check" { " --check" } else { "" };
            let message =
                format!("there is no command `{first}`: write `ddem {second}{option}`; {COMMANDS}");
            (ErrorKind::InvalidSubcommand, message)
        }
        _ => (ErrorKind::ArgumentConflict, format!("unexpected `{second}`: {COMMANDS}")),
    };
    Cli::command().error(kind, message)
}

/// Text of an error of the command line, with the code at the end of its first line.
pub(crate) fn coded(error: &clap::Error, colour: bool) -> String {
    let text = error.render();
    let text = if colour { text.ansi().to_string() } else { text.to_string() };
    let code = match error.kind() {
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => return text,
        ErrorKind::InvalidSubcommand => ErrorCode::UnknownCommand,
        _ => ErrorCode::InvalidArgument,
    };
    match text.split_once('\n') {
        Some((first, rest)) => format!("{first} [{code}]\n{rest}"),
        None => format!("{text} [{code}]\n"),
    }
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(threads @ 1..=MOST_THREADS) => Ok(threads),
        _ => Err(format!(
            "expected a whole number from 1 to {MOST_THREADS}; without --threads there is one for \
             each processor"
        )),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let duration = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    duration.ok_or_else(|| "expected a number of seconds, such as 60".to_owned())
}

fn simd(text: &str) -> Result<Simd, String> {
    let known = Simd::available();
    match known.iter().find(|(name, _)| *name == text) {
        Some((_, simd)) => Ok(*simd),
        None => {
            let known = names::list(known.iter().map(|(name, _)| *name));
            Err(format!("this machine has {known}"))
        }
    }
}

/// Command that runs a deck.
pub(crate) fn run_command(deck: &Path) -> String {
    // A name that begins with a dash would be taken for an option.
    let dash = deck.as_os_str().as_encoded_bytes().starts_with(b"-");
    format!("ddem {}{}", if dash { "./" } else { "" }, quoted(deck))
}

/// Path as text, quoted for a shell if necessary.
fn quoted(path: &Path) -> String {
    let path = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:@%=\\".contains(c);
    if !path.is_empty() && path.chars().all(plain) && (cfg!(windows) || !path.contains('\\')) {
        path
    } else if cfg!(windows) {
        format!("\"{path}\"")
    } else {
        format!("'{}'", path.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(line: &[&str]) -> RunArguments {
        Cli::try_parse_from(line).unwrap().run.unwrap()
    }

    #[test]
    fn command_line_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn manual_names_no_other_page() {
        let page = manual().unwrap();
        assert!(!page.contains("(1)") && page.contains("\nddem status\n"), "{page}");
    }

    #[test]
    fn results_folder_has_the_name_of_the_deck() {
        let folder = run(&["ddem", "decks/beam.v2.toml"]).folder();
        assert_eq!(folder, Path::new("results").join("beam.v2"));
        assert_eq!(run(&["ddem", "beam.toml", "--out", "a/b"]).folder(), Path::new("a/b"));
    }

    #[test]
    fn schema_is_a_command_and_its_path_a_deck() {
        let cli = Cli::try_parse_from(["ddem", "schema"]).unwrap();
        assert!(matches!(cli.command, Some(Command::Schema)) && cli.run.is_none());
        assert_eq!(run(&["ddem", "./schema"]).deck, Path::new("./schema"));
    }

    #[test]
    #[cfg(unix)]
    fn resume_command_is_quoted_for_the_shell() {
        let command = |line: &[&str]| run(line).resume_command();
        assert_eq!(command(&["ddem", "beam.toml"]), "ddem beam.toml --resume");
        assert_eq!(
            command(&["ddem", "my beam.toml", "--threads", "2", "--out", "it's", "--quiet"]),
            r"ddem 'my beam.toml' --out='it'\''s' --threads 2 --resume"
        );
        assert_eq!(
            command(&["ddem", "beam.toml", "--profile"]),
            "ddem beam.toml --profile --resume"
        );
        assert_eq!(command(&["ddem", "beam.toml", "--json"]), "ddem beam.toml --json --resume");
        assert_eq!(
            command(&["ddem", "beam.toml", "--checkpoint-every", "2.5"]),
            "ddem beam.toml --checkpoint-every 2.5 --resume"
        );
        assert_eq!(command(&["ddem", "--", "-x"]), "ddem ./-x --resume");
    }
}
