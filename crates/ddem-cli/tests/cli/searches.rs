//! Tests of searches for the factor of safety that are killed and resumed, and of what they tell.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::harness::*;
use super::kills::compare;
use super::verdicts::slope;

const SAFETY: &str =
    "kind = 'relax'\n[[stage]]\nname = 'safety'\nkind = 'safety'\nresolution = 0.01";

const LINE: &str = "slope.toml --out cut --resume --json --quiet";

/// Slope with its whole run in `whole`.
fn desk(friction: f64) -> Desk {
    let desk = Desk::new();
    desk.write("slope.toml", &slope(friction, SAFETY));
    let whole = desk.run("slope.toml --out whole --quiet");
    assert_eq!(whole.status, Some(0), "{}", whole.stderr);
    desk
}

fn start(desk: &Desk, line: &str) -> (Child, BufReader<ChildStdout>) {
    let mut child = desk.command(line).stdout(Stdio::piped()).spawn().unwrap();
    let stdout = BufReader::new(child.stdout.take().unwrap());
    (child, stdout)
}

/// Stages of a summary without their wall times.
fn stages(desk: &Desk, out: &str) -> Vec<Value> {
    let summary: Value =
        serde_json::from_slice(&desk.read(&format!("{out}/summary.json"))).unwrap();
    let mut stages = summary["stages"].as_array().unwrap().clone();
    for stage in &mut stages {
        let stage = stage.as_object_mut().unwrap();
        stage.remove("wall_seconds");
        stage.remove("node_updates_per_second");
    }
    stages
}

/// Reads the lines of a run until one satisfies a condition; false if the run ends before.
fn read_until(stdout: BufReader<ChildStdout>, mut is_last: impl FnMut(&Value) -> bool) -> bool {
    stdout.lines().any(|line| is_last(&serde_json::from_str(&line.unwrap()).unwrap()))
}

/// Each run is killed when its first trial is saved. The next one knows the trials of all runs before, and
/// the last one ends with the bits of a run that nobody killed.
#[test]
fn killed_search_resumes_at_its_last_trial() {
    let desk = desk(35.0);
    let (mut known, mut runs) = (0, 1);
    loop {
        let (mut child, stdout) = start(&desk, LINE);
        let mut tried = false;
        let killed = read_until(stdout, |event| {
            if event["event"] == "stage" && event["stage"] == "safety" {
                let now = event["trials"].as_u64().unwrap();
                assert!(now >= known, "{now} trials after {known}");
                known = now + 1;
            }
            tried |= event["event"] == "trial";
            tried && event["event"] == "checkpoint" && child.kill().is_ok()
        });
        child.wait().unwrap();
        if !killed {
            break;
        }
        runs += 1;
    }
    let expected = stages(&desk, "whole");
    // Trials that have begun end while the first is saved, so that a run saves up to three before it dies.
    let trials = expected[1]["trials"].as_array().unwrap().len();
    assert!(trials >= 8 && runs > trials / 3, "{runs} runs with {trials} trials");
    assert_eq!(stages(&desk, "cut"), expected);
    compare(&desk, LINE);
}

/// A slope that fails leads back to its state before; a run that resumes knows that state, too.
#[test]
fn killed_failure_leads_back_to_the_same_state() {
    let desk = desk(20.0);
    let (mut child, stdout) = start(&desk, &format!("{LINE} --checkpoint-every 0.01"));
    let killed = read_until(stdout, |event| event["event"] == "checkpoint" && child.kill().is_ok());
    child.wait().unwrap();
    assert!(killed);
    let status: Value = serde_json::from_str(&desk.run("status cut --json").stdout).unwrap();
    assert_eq!((&status["stage"], &status["state"]), (&"weight".into(), &"killed".into()));
    compare(&desk, LINE);
    assert_eq!(stages(&desk, "cut"), stages(&desk, "whole"));
}

/// A search tells its trials while they run: by lines for machines and by `ddem status`.
#[test]
#[cfg(unix)]
fn running_search_tells_its_trials() {
    let desk = Desk::new();
    // Trials with so small a tolerance and so many elements take long.
    let search = format!("{SAFETY}\ntolerance = 1e-14\nmax_steps = 100000000");
    desk.write("slope.toml", &slope(35.0, &search).replace("divisions = 2", "divisions = 8"));
    let (mut child, stdout) = start(&desk, LINE);
    let mut progress = Value::Null;
    assert!(read_until(stdout, |event| {
        let running = event["running"].as_array().map_or(0, Vec::len);
        progress.clone_from(event);
        // Only the last trials run two at a time.
        event["event"] == "progress" && running > 0
    }));
    // The status at the start of the search, and that after the end of a trial, has none that run.
    let deadline = Instant::now() + Duration::from_secs(60);
    let text = loop {
        let text = desk.run("status cut").stdout;
        if text.contains("   strengths / ") {
            break text;
        }
        assert!(Instant::now() < deadline, "{text}");
        sleep(Duration::from_millis(100));
    };
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let running = progress["running"].as_array().unwrap();
    let done = progress["trials"].as_u64().unwrap();
    for (number, trial) in (done + 1..).zip(running) {
        assert_eq!(trial["trial"], number, "{progress}");
        assert!(trial["step"].as_u64() > Some(0) && trial["unbalanced"].is_number(), "{trial}");
    }
    assert!(text.contains(", unbalanced ") && text.contains(" → 1e-14"), "{text}");
}
