//! Tests of `ddem status`, and of the lines of `--json`.

use std::process::Stdio;
use std::time::Duration;

use serde_json::Value;

use super::harness::*;

/// Search for a factor of safety of a block on a plane.
const SEARCH: &str = "
[[stage]]
name = 'factor'
kind = 'safety'
bracket = [1.0, 2.0]
";

fn lines(stdout: &str) -> Vec<Value> {
    stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn status(desk: &Desk, folder: &str) -> Value {
    let outcome = desk.run(&format!("status {folder} --json"));
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let mut lines = lines(&outcome.stdout);
    assert_eq!(lines.len(), 1);
    lines.remove(0)
}

/// Text of `ddem status`, without wall times and rates.
fn text(desk: &Desk) -> String {
    let outcome = desk.run("status results/column");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    outcome.stdout
}

#[test]
fn status_of_a_complete_run_has_its_last_stage_and_frame() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    assert_eq!(desk.run("column.toml --quiet").status, Some(0));
    insta::with_settings!({filters => vec![(r"\d+(\.\d)? (m?s|min \d+ s) ago", "[age] ago"), (r"\d\.\de-?\d+\n", "[ratio]\n")]}, {
        insta::assert_snapshot!(text(&desk));
    });
    let status = status(&desk, "results/column");
    assert_eq!((&status["event"], &status["state"]), (&"status".into(), &"done".into()));
    assert_eq!((&status["stage"], &status["number"]), (&"shake".into(), &2.into()));
    assert_eq!((&status["kind"], &status["progress"]), (&"dynamic".into(), &1.0.into()));
    assert_eq!(status["step"], status["steps"]);
    // The frame at the start, that of the relaxation, and five of the motion, which ends after 0.01 s.
    assert_eq!(status["last_frame"]["number"], 6);
    for time in [&status["time"], &status["last_frame"]["time"]] {
        assert!((time.as_f64().unwrap() - 0.01).abs() < 1e-12, "{time}");
    }
}

/// Waits until the status of a run has some property.
fn wait_for(desk: &Desk, folder: &str, enough: impl Fn(&Value) -> bool) -> Value {
    for _ in 0..1200 {
        let outcome = desk.run(&format!("status {folder} --json"));
        if outcome.status == Some(0) {
            let status = lines(&outcome.stdout).remove(0);
            if enough(&status) {
                return status;
            }
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("the run does not get there: {:?}", desk.run(&format!("status {folder}")));
}

#[test]
fn running_and_killed_runs_differ() {
    // It is killed long before its end.
    let desk = Desk::with(&[&LONG_SHAKE.replace("duration = 4.0", "duration = 400.0")]);
    let mut child = desk.command("column.toml --quiet --checkpoint-every 0.05").spawn().unwrap();
    let running = wait_for(&desk, "results/column", |status| {
        status["progress"].as_f64() > Some(0.0) && !status["checkpoint_age_seconds"].is_null()
    });
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!((&running["state"], &running["stage"]), (&"running".into(), &"shake".into()));
    let number = |name: &str| running[name].as_f64().unwrap_or_else(|| panic!("{name}: {running}"));
    let (progress, part) = (number("progress"), number("step") / number("steps"));
    assert!((progress - part).abs() < 1e-12 && progress < 1.0, "{progress} {part}");
    // Steps are equal: time advances with them, up to the 400 s of the stage.
    assert!((number("time") / 400.0 - part).abs() < 1e-2, "{running}");
    assert!(number("seconds_left") > 0.0 && number("node_updates_per_second") > 0.0);
    assert_eq!(status(&desk, "results/column")["state"], "killed");
    let text = text(&desk);
    assert!(text.contains("state          not running: killed, last word"), "{text}");
    assert!(text.contains("ago: --resume continues"), "{text}");
    assert!(!text.contains("time left"), "{text}");
}

#[test]
#[cfg(unix)]
fn interrupted_and_failed_runs_say_so() {
    let desk = Desk::with(&[LONG_SHAKE]);
    desk.interrupt("column.toml --out a", "shake");
    assert_eq!(status(&desk, "a")["state"], "interrupted");
    let desk = Desk::with(&[&LONG_PRESS.replace("150000", "20")]);
    assert_eq!(desk.run("column.toml --out a").status, Some(1));
    let status = status(&desk, "a");
    assert_eq!(status["state"], "failed");
    assert!(status["message"].as_str().unwrap().ends_with("[not-converged]"), "{status}");
}

/// Each line is one object, and the names are those of docs/deck.md.
#[test]
fn json_lines_tell_the_whole_run() {
    let desk = Desk::new();
    let strength = "material = 'rock'\ncohesion = 1e9\nfriction = 30\n[[blocks]]";
    let column = COLUMN.replace("material = 'rock'\n[[blocks]]", strength);
    desk.write("column.toml", &(column + PRESS + SHAKE + SEARCH));
    let outcome = desk.run("column.toml --json --quiet");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let lines = lines(&outcome.stdout);
    let events: Vec<_> = lines.iter().map(|line| line["event"].as_str().unwrap()).collect();
    let count = |event: &str| events.iter().filter(|&&found| found == event).count();
    assert_eq!((events[0], events[events.len() - 1]), ("model", "end"));
    assert_eq!((count("stage"), count("stage_done")), (3, 3));
    // A checkpoint follows each stage and each trial.
    assert_eq!(count("checkpoint"), 3 + count("trial"));
    assert!(count("trial") >= 2);
    assert_eq!(lines[0]["blocks"], 3);
    assert_eq!(lines[lines.len() - 1]["state"], "done");
    let docs = include_str!("../../../../docs/deck.md");
    for line in lines.iter().filter(|line| line["event"] != "stage_done") {
        for name in line.as_object().unwrap().keys() {
            assert!(docs.contains(&format!("`{name}`")), "docs/deck.md does not explain `{name}`");
        }
    }
    let status = status(&desk, "results/column");
    for name in status.as_object().unwrap().keys() {
        assert!(docs.contains(&format!("`{name}`")), "docs/deck.md does not explain `{name}`");
    }
    assert_eq!((&status["kind"], &status["progress"]), (&"safety".into(), &1.0.into()));
    let trials = lines.iter().filter(|line| line["event"] == "trial").count();
    assert_eq!(status["trials"], trials);
    assert_eq!(count("warning"), 1, "{}", outcome.stdout);
}

#[test]
fn json_lines_end_with_the_error() {
    let desk = Desk::with(&[&LONG_PRESS.replace("150000", "20")]);
    let outcome = desk.run("column.toml --json");
    assert_eq!(outcome.status, Some(1));
    let last = lines(&outcome.stdout).pop().unwrap();
    assert_eq!((&last["state"], &last["code"]), (&"failed".into(), &"not-converged".into()));
    assert!(outcome.stderr.contains("[not-converged]"), "{}", outcome.stderr);
}

/// Nobody reads the lines: the run goes on.
#[test]
fn closed_pipe_does_not_stop_a_run() {
    let desk = Desk::with(&[PRESS]);
    let mut command = desk.command("column.toml --json --quiet");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), vec![]));
    assert!(desk.path("results/column/summary.json").exists());
}

#[test]
fn folders_without_status_are_explained() {
    let desk = Desk::with(&[PRESS]);
    std::fs::create_dir(desk.path("results")).unwrap();
    let mut found = String::new();
    for line in ["status results", "status result", "status column.toml"] {
        let outcome = desk.run(line);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
        found += &outcome.stderr;
    }
    assert_eq!(desk.run("column.toml --quiet").status, Some(0));
    desk.write("results/column/status.json", "{}");
    found += &desk.run("status results/column").stderr;
    insta::assert_snapshot!(found);
}
