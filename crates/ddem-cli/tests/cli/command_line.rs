//! Tests of options, help, refused decks and `info`.

use std::fs;
use std::process::Stdio;

use super::harness::*;

#[test]
fn help_goes_to_standard_output() {
    let outcome = Desk::new().run("--help");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    insta::assert_snapshot!(outcome.stdout, @r"
    Three-dimensional deformable block discrete element method for jointed rock

    Usage: ddem [OPTIONS] <DECK>
           ddem <COMMAND>

    Commands:
      new          Write a commented starter deck
      status       Print how far a run is: stage, progress, time left, last frame and checkpoint
      schema       Print the JSON Schema of decks, for editors (a deck of this name is `./schema`)
      info         Print the results of a run: verdicts, largest displacement, failed joints, reactions, energy
      cut          Cut the regions of a deck and list their blocks: blocks.csv, blocks.vtkhdf and a table
      plot         Draw a picture of the results with the Python module of ddem
      completions  Print the completion script of a shell
      man          Print the manual page

    Arguments:
      <DECK>  Deck to run, a TOML file

    Options:
          --out <DIR>                   Folder of the results [default: results/<name of the deck>]
          --threads <N>                 Threads, which do not change the results [default: one for each processor]
          --quiet                       Print only errors
          --json                        Print events and progress as lines of JSON on standard output
          --check                       Build the model, report its size, memory and run time, and stop
          --resume                      Continue from the checkpoint in the folder of the results; without one, start
          --overwrite                   Remove earlier results of the deck; without it they are moved to a folder DIR.1, DIR.2, ...
          --checkpoint-every <SECONDS>  Wall time between checkpoints within a stage, which does not change the results [default: that of the deck]
          --profile                     Measure the time of each phase of the steps, and print it at the end of each stage
      -h, --help                        Print help
      -V, --version                     Print version

    Example: ddem deck.toml --out results/first --threads 4
    ");
}

#[test]
fn missing_deck_shows_usage() {
    let stderr = refused("");
    assert!(stderr.contains("Usage: ddem [OPTIONS] <DECK>"), "{stderr}");
    assert!(refused("--quiet").contains("<DECK>"));
}

#[test]
fn version_is_that_of_the_package() {
    let outcome = Desk::new().run("--version");
    assert_eq!(outcome.status, Some(0));
    // A release build also names the revision.
    assert_eq!(outcome.stdout, format!("ddem {}\n", ddem_io::version::FULL_VERSION));
    assert!(outcome.stdout.starts_with(concat!("ddem ", env!("CARGO_PKG_VERSION"))));
}

#[test]
fn schema_is_json() {
    let outcome = Desk::new().run("schema");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let schema: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert!(schema["properties"]["materials"].is_object());
}

#[test]
fn completions_and_manual_know_the_options() {
    for (line, option) in [
        ("completions bash", "--checkpoint-every"),
        ("completions zsh", "--checkpoint-every"),
        ("completions fish", "checkpoint-every"),
        ("completions powershell", "--checkpoint-every"),
        ("man", "checkpoint\\-every"),
    ] {
        let outcome = Desk::new().run(line);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""), "{line}");
        assert!(outcome.stdout.contains(option), "{line}: {}", outcome.stdout);
    }
    assert!(refused("completions tcsh").contains("invalid value 'tcsh'"));
}

/// The shell itself reads the script.
#[test]
#[cfg(unix)]
fn bash_accepts_its_completions() {
    let desk = Desk::new();
    desk.write("ddem.bash", &desk.run("completions bash").stdout);
    let checked = std::process::Command::new("bash").arg("-n").arg(desk.path("ddem.bash")).status();
    // Not every machine has this shell.
    assert!(checked.is_err() || checked.is_ok_and(|status| status.success()));
}

#[test]
fn deck_may_be_called_schema() {
    let desk = Desk::new();
    desk.write("schema", &(COLUMN.to_owned() + SHAKE));
    let outcome = desk.run("./schema --quiet");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(desk.path("results/schema/summary.json").exists());
}

#[test]
fn closed_output_pipe_is_no_error() {
    let desk = Desk::new();
    let mut command = desk.command("schema");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), vec![]));
}

#[test]
#[cfg(target_os = "linux")]
fn unwritable_output_is_an_error() {
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let desk = Desk::new();
    let output = desk.command("schema").stdout(full).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    insta::assert_snapshot!(stderr);
}

#[test]
fn missing_deck_suggests_similar_name() {
    insta::assert_snapshot!(refused("colum.toml --out new"), @r"
      × cannot read the deck `colum.toml` [invalid-file]
      ╰─▶ No such file or directory (os error 2)
      help: a deck is a TOML file
      did you mean `column.toml`?
    ");
    assert!(!refused("elsewhere/column.toml").contains("did you mean"));
    assert!(refused(".").contains("cannot read the deck `.`"));
}

#[test]
fn invalid_options_are_refused() {
    for threads in ["0", "x", "-1", "1.5", "1000000"] {
        let stderr = refused(&format!("column.toml --threads={threads}"));
        assert!(stderr.contains("expected a whole number from 1 to 1024"), "{stderr}");
    }
    let stderr = refused("column.toml --simd mmx");
    assert!(stderr.contains("this machine has `baseline`"), "{stderr}");
    assert!(refused("column.toml --out").contains("--out <DIR>"));
    assert!(refused("column.toml --thread 2").contains("a similar argument exists: '--threads'"));
    for line in ["column.toml other.toml", "column.toml info", "inf column"] {
        assert!(refused(line).contains("ddem runs one deck, and its commands are"), "{line}");
    }
}

#[test]
fn misspelt_key_is_shown_and_nothing_is_written() {
    let desk = Desk::new();
    desk.write("column.toml", &(COLUMN.replace("young", "yuong") + SHAKE));
    for arguments in ["column.toml", "column.toml --check", "column.toml --quiet --out new"] {
        let outcome = desk.run(arguments);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
        assert_eq!(desk.names(), ["column.toml"]);
        insta::allow_duplicates! { insta::assert_snapshot!(outcome.stderr, @r"
        the deck `column.toml` has a mistake in line 7

          × unknown key `yuong` [unknown-key]
           ╭─[column.toml:7:1]
         6 │ density = 2400
         7 │ yuong = 18e9
           · ──┬──
           ·   ╰── materials.rock.yuong
         8 │ poisson = 0.25
           ╰────
          help: did you mean `young`? keys here: `density`, `young`, `poisson`
        "); }
    }
}

#[test]
fn unstable_time_step_is_refused_before_any_output() {
    let long = format!("{SHAKE}time_step = 1e-3\n");
    let desk = Desk::with(&[PRESS, &long]);
    for arguments in ["column.toml", "column.toml --check"] {
        let outcome = desk.run(arguments);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
        assert!(outcome.stderr.contains("critical"), "{}", outcome.stderr);
        assert_eq!(desk.names(), ["column.toml"]);
    }
}

/// Blocks a hundred times as stiff have a tenth of the critical step. The stage in which they become so is checked
/// before anything runs, and one in which they are no longer so is not refused.
#[test]
fn time_steps_are_checked_with_the_materials_of_their_stage() {
    let deck = |entry: &str| {
        let stages =
            SHAKE.to_owned() + "[[stage]]\nname = 'later'\nkind = 'dynamic'\nduration = 0.01\n";
        let hard = "[materials.hard]\ndensity = 2400\nyoung = 18e11\npoisson = 0.25\n[[assign]]\nmaterial = 'hard'\n";
        let column = COLUMN.replace("joint = 'seam'\n", "").replace("count = [1, 1, 3]\n", "");
        format!("{column}{hard}{entry}\n{stages}")
    };
    let desk = Desk::new();
    let check = |text: &str| {
        desk.write("column.toml", text);
        desk.run("column.toml --check")
    };
    let number = |text: &str, before: &str| {
        let rest = text.split(before).nth(1).unwrap_or_else(|| panic!("{before}: {text}"));
        rest.trim_start().split(' ').next().unwrap().parse::<f64>().unwrap()
    };
    let soft = number(&check(&deck("from = 'later'")).stdout, "critical step");
    let given = format!("time_step = {:e}", 0.5 * soft);
    let later = check(&(deck("from = 'later'") + &given));
    assert_eq!(later.status, Some(2), "{}", later.stdout);
    assert!(later.stderr.contains("stage[1].time_step"), "{}", later.stderr);
    let hard = number(&later.stderr, "exceeds the critical time step, ");
    assert!((10.0 * hard / soft - 1.0).abs() < 1e-5, "{hard} {soft}");
    // The soft stage, which is the first one, comes last.
    let until = check(&(deck("until = 'later'") + &given));
    assert_eq!(until.status, Some(0), "{}", until.stderr);
}

#[test]
fn run_is_no_command() {
    let desk = Desk::with(&[SHAKE]);
    let outcome = desk.run("run column.toml --check");
    assert_eq!(outcome.status, Some(2));
    let expected = "error: `run` is not a command of ddem: run a deck by `ddem column.toml --check` [unknown-command]\n";
    assert_eq!(outcome.stderr, expected);
}

#[test]
fn info_prints_summary_of_a_run() {
    let desk = Desk::with(&[PRESS]);
    let outcome = desk.run("column.toml");
    let printed = desk.run("info results/column");
    assert_eq!(printed.status, Some(0), "{}", printed.stderr);
    insta::with_settings!({filters => vec![(r"\d+\.\d s", "[time]"), (r" off by .*", " off by [little]")]}, {
        insta::assert_snapshot!(printed.stdout, @r"
        column
        3 blocks, 24 elements, 81 nodes, 18 pairs

        stage  kind     verdict        steps   wall time
        press  relax    at rest          303       [time]

        at the end of `press`:
        verdict        at rest
        displacement   at most 705.2 µm, in block 2 (set `blocks[0]`) at (1, 0.5, 3)
        reaction       of fix[0]: (-0.100, 0, 1.000) MN
        energy         strain 113.8 J, damping 113.7 J, external work 227.4 J; off by [little]
        ");
    });
    // The run ends with the same text.
    let state = printed.stdout.split_once("\n\n").and_then(|(_, rest)| rest.split_once("\n\n"));
    let (_, state) = state.expect("the state at the end");
    assert!(outcome.stderr.contains(state), "{}", outcome.stderr);
}

#[test]
fn info_prints_the_warnings_of_a_run() {
    let desk = Desk::with(&["[[probe]]\nname = 'far'\nat = [9, 0, 0]\n", PRESS]);
    let outcome = desk.run("column.toml");
    let printed = desk.run("info results/column");
    assert_eq!(printed.status, Some(0), "{}", printed.stderr);
    let (warnings, _) = printed.stdout.split_once("\n\nstage").expect("the table of stages");
    insta::assert_snapshot!(warnings, @r"
    column
    3 blocks, 24 elements, 81 nodes, 18 pairs

    warning: probe[1].at: probe `far` has no block at [9, 0, 0]; it records the nearest node, at [1, 0, 0], 8.0000 m away; give a point of a block, in metres [far-probe]
    ");
    let line =
        |text: &str| text.lines().find(|line| line.starts_with("warning")).map(str::to_owned);
    assert_eq!(line(&outcome.stderr), line(&printed.stdout));
}

#[test]
fn info_explains_missing_results() {
    let desk = Desk::with(&[SHAKE]);
    desk.run("column.toml");
    let message = |line: &str| {
        let outcome = desk.run(line);
        assert_eq!(outcome.status, Some(2), "{}", outcome.stderr);
        outcome.stderr
    };
    let missing = "error: there is no folder `results/colum`, did you mean `results/column`? [results-folder]\n";
    assert_eq!(message("info results/colum"), missing);
    let nothing = "error: `results` has no summary.json: no run has ended a stage there; give the folder of one that has [results-folder]\n";
    assert_eq!(message("info results"), nothing);
    let file = "error: `column.toml` is a file: give the folder of the results, such as `results/column` [results-folder]\n";
    assert_eq!(message("info column.toml"), file);
}

/// Checks that the deck in README.md is `examples/block.toml`, and that the run prints the output
/// shown there, except for wall-clock times.
#[test]
fn readme_deck_prints_the_output_shown() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let read = |path: &str| std::fs::read_to_string(root.join(path)).expect("a file");
    let (readme, deck) = (read("README.md"), read("examples/block.toml"));
    assert!(readme.contains(&format!("```toml\n{deck}```")), "the deck is another one");
    let shown = readme.split("```").find(|block| block.trim().starts_with("model: 4 blocks"));
    let desk = Desk::new();
    desk.write("block.toml", &deck);
    let outcome = desk.run("block.toml");
    // Times and rates are followed by their unit; a busy machine has another unit.
    let timeless = |line: &str| {
        let line = line.replace("thousand node updates", "million node updates");
        let words: Vec<&str> = line.split_whitespace().collect();
        let is_time = |at: usize| matches!(words.get(at + 1), Some(&("s," | "million")));
        let kept = (0..words.len()).filter(|&at| !is_time(at)).map(|at| words[at]);
        kept.collect::<Vec<_>>().join(" ")
    };
    let printed: Vec<String> = (outcome.stdout + &outcome.stderr).lines().map(timeless).collect();
    for line in shown.expect("the output").lines().filter(|line| *line != "...") {
        assert!(printed.contains(&timeless(line)), "{line}\n{printed:#?}");
    }
}
