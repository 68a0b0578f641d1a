//! Status of a run, for another terminal.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use ddem_core::{FastestBlock, TrialProgress, counted};
use ddem_io::serde_json;
use ddem_io::status::{FolderStatus, LastFrame, RunStatus, StageReport, StatusKind};

use crate::progress::{clock, rate, ratio};
use crate::results::{self, NoResults};

/// Run to report.
#[derive(Debug, Args)]
pub(crate) struct StatusArguments {
    /// Folder of the results
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

/// Status of the run in a folder, as text or as a line of JSON.
pub(crate) fn status(arguments: &StatusArguments) -> Result<String, NoResults> {
    let StatusArguments { folder, json } = arguments;
    results::is_folder(folder)?;
    let Some(status) = FolderStatus::read(folder)? else {
        return Err(NoResults::NoStatus { folder: folder.clone() });
    };
    Ok(if *json { line("status", &status) } else { results::printable(&text(&status)) })
}

/// Line of JSON with the kind of its event.
pub(crate) fn line(event: &str, of: &impl serde::Serialize) -> String {
    /// Event with its facts.
    #[derive(serde::Serialize)]
    struct JsonLine<'a, T> {
        event: &'a str,
        #[serde(flatten)]
        of: &'a T,
    }
    // Only maps with other keys than texts have no JSON.
    serde_json::to_string(&JsonLine { event, of })
        .map_or_else(|_| String::new(), |line| line + "\n")
}

fn text(status: &FolderStatus) -> String {
    let FolderStatus { status: RunStatus { state, message, title, report }, .. } = status;
    let mut text = String::new();
    if !title.is_empty() {
        text += &format!("{title}\n");
    }
    let mut say = |name: &str, value: &str| {
        // A string takes any text.
        let _ = writeln!(text, "{name:<15}{value}");
    };
    say("state", &state_line(*state, status.age_seconds));
    if let Some(message) = message {
        say("error", message);
    }
    say(
        "stage",
        &format!("`{}` ({}/{}), {}", report.stage, report.number, report.stages, report.kind),
    );
    say("progress", &progress(report));
    for TrialProgress { trial, factor, step, unbalanced } in &report.running {
        let goal = report.tolerance.map_or_else(String::new, |goal| format!(" → {goal:e}"));
        let unbalanced = ratio(unbalanced.unwrap_or(f64::NAN));
        say(
            &format!("trial {trial}"),
            &format!("strengths / {factor:.4}, step {step}, unbalanced {unbalanced}{goal}"),
        );
    }
    if let (Some(unbalanced), None) = (report.unbalanced, report.trials) {
        let goal = report.tolerance.map_or_else(String::new, |goal| format!(" → {goal:e}"));
        say("unbalanced", &format!("{}{goal}", ratio(unbalanced)));
    }
    if report.failed_pairs > 0 {
        say("failed", &counted(report.failed_pairs, "pair"));
    }
    if report.contacts > 0 {
        say("contacts", &(counted(report.contacts, "pair") + " of blocks"));
    }
    if let Some(FastestBlock { block, set, speed }) = &report.fastest {
        say("fastest", &format!("block {block} (set `{set}`), {speed:.4e} m/s"));
    }
    if *state == StatusKind::Running {
        if let Some(rate) = report.node_updates_per_second.and_then(rate) {
            say("rate", &rate);
        }
        let left = report.seconds_left.and_then(clock);
        say(
            "time left",
            &left.map_or("unknown".to_owned(), |left| format!("about {left} in this stage")),
        );
    }
    let frame = status.last_frame.as_ref().map(|LastFrame { number, time, step, stage }| {
        let at = if *time > 0.0 { format!(" at {time:.4e} s") } else { String::new() };
        format!("{number}{at}, step {step} of `{stage}`")
    });
    say("last frame", frame.as_deref().unwrap_or("none yet"));
    let saved = status.checkpoint_age_seconds.and_then(clock);
    let resume = if matches!(state, StatusKind::Killed | StatusKind::Interrupted) {
        ": --resume continues"
    } else {
        ""
    };
    say("checkpoint", &saved.map_or("none yet".to_owned(), |age| format!("{age} ago{resume}")));
    text
}

fn state_line(state: StatusKind, age: Option<f64>) -> String {
    let age = age.and_then(clock).map_or_else(String::new, |age| format!(", {age} ago"));
    match state {
        StatusKind::Running => format!("running{age}"),
        StatusKind::Done => format!("done{age}"),
        StatusKind::Interrupted => format!("interrupted{age}"),
        StatusKind::Failed => format!("failed{age}"),
        StatusKind::Killed => format!("not running: killed, last word{age}"),
    }
}

fn progress(report: &StageReport) -> String {
    let mut parts = Vec::new();
    if let Some(part) = report.progress {
        parts.push(format!("{:.0} %", 100.0 * part));
    }
    match (report.trials, report.most_trials, report.steps) {
        (Some(done), Some(most), _) => parts.push(format!("{done} of at most {most} trials")),
        (_, _, Some(steps)) => parts.push(format!("step {} of {steps}", report.step)),
        _ => parts.push(format!("step {}", report.step)),
    }
    if report.time > 0.0 {
        parts.push(format!("simulated {:.4e} s", report.time));
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Searches that run, and that were killed.
    #[test]
    fn status_of_a_search() {
        let report = StageReport {
            stage: "factor".to_owned(),
            number: 2,
            stages: 2,
            kind: "safety".to_owned(),
            progress: Some(0.25),
            trials: Some(3),
            most_trials: Some(12),
            running: vec![TrialProgress {
                trial: 4,
                factor: 1.25,
                step: 1234,
                unbalanced: Some(3.2e-4),
            }],
            unbalanced: Some(3.2e-4),
            tolerance: Some(1e-5),
            failed_pairs: 1,
            contacts: 2,
            fastest: Some(FastestBlock { block: 7, set: "slope".to_owned(), speed: 0.25 }),
            node_updates_per_second: Some(4.2e7),
            seconds_left: Some(90.0),
            ..StageReport::default()
        };
        let mut status = FolderStatus {
            status: RunStatus { title: "A slope".to_owned(), report, ..RunStatus::default() },
            age_seconds: Some(1.0),
            checkpoint_age_seconds: Some(30.0),
            ..FolderStatus::default()
        };
        let running = text(&status);
        status.status.state = StatusKind::Killed;
        insta::assert_snapshot!(format!("{running}\n{}", text(&status)));
    }
}
