//! Display of a run's progress.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ddem_core::{FastestBlock, SafetyTrial, TrialProgress, Verdict};
use ddem_deck::BuildProgress;
use ddem_io::run::{Event, Observer, Progress, Report, SearchProgress};
use ddem_io::summary::StageSummary;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::json::JsonLines;

mod building;
#[cfg(test)]
mod tests;

pub(crate) use building::BuildDisplay;

/// Wall-clock time between lines if there is no terminal.
const EVERY: Duration = Duration::from_secs(5);

/// Number of parts of the bar.
const LENGTH: u64 = 1000;

/// Amount of output.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ProgressMode {
    /// Nothing.
    Quiet,
    /// A line at intervals.
    Lines,
    /// One line that is updated.
    Live,
}

/// Standard error, with the live line at its end.
#[derive(Clone, Debug)]
pub(crate) struct Screen {
    mode: ProgressMode,
    bar: ProgressBar,
}

impl Screen {
    /// Screen with a live line on a terminal, otherwise with lines; silent if `quiet`.
    pub(crate) fn new(quiet: bool) -> Self {
        let target = ProgressDrawTarget::stderr();
        let mode = match (quiet, target.is_hidden()) {
            (true, _) => ProgressMode::Quiet,
            (false, true) => ProgressMode::Lines,
            (false, false) => ProgressMode::Live,
        };
        let bar = ProgressBar::with_draw_target(Some(LENGTH), target);
        if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {msg}") {
            bar.set_style(style.progress_chars("━╸ "));
        }
        bar.finish_and_clear();
        Self { mode, bar }
    }

    /// Prints a line that stays.
    pub(crate) fn line(&self, text: &str) {
        if self.mode != ProgressMode::Quiet {
            // Errors are ignored, because nobody reads a closed standard error.
            self.bar.suspend(|| {
                let _ = writeln!(io::stderr(), "{text}");
            });
        }
    }

    /// Shows the text in the live line, without progress.
    fn live(&self, text: String) {
        self.bar.set_prefix(text);
        self.bar.reset();
    }

    /// Removes the live line.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Observer that shows a run and stops it once the flag is set.
#[derive(Debug)]
pub(crate) struct Watcher {
    screen: Screen,
    stop: Arc<AtomicBool>,
    /// First unbalanced ratio of the stage, at which its bar begins.
    first: Option<f64>,
    /// Number of failed pairs at the last progress event.
    failed: u64,
    /// Time at which the last line was written.
    written: Instant,
    /// Summary of the last completed stage.
    last: Option<StageSummary>,
    /// Writer of lines for machines, if they are wanted.
    lines: Option<JsonLines>,
    /// Display before the first event.
    building: Option<BuildDisplay>,
}

impl Watcher {
    /// Watcher that shows a run on `screen` and, if they are given, by lines of JSON.
    pub(crate) fn new(
        screen: Screen,
        stop: Arc<AtomicBool>,
        lines: Option<JsonLines>,
        building: BuildDisplay,
    ) -> Self {
        let (written, building) = (Instant::now(), Some(building));
        Self { screen, stop, first: None, failed: 0, written, last: None, lines, building }
    }

    /// Ends the display of a run that has ended.
    pub(crate) fn end(&mut self) {
        self.building = None;
        self.screen.clear();
    }

    /// Shows the state at the end of the last completed stage.
    pub(crate) fn result(&self) {
        if let Some(stage) = &self.last {
            self.screen.line(&format!("\n{stage}"));
        }
    }

    fn stage_started(&mut self, progress: &Progress) {
        self.first = None;
        self.written = Instant::now();
        match self.screen.mode {
            ProgressMode::Live => {
                self.screen.bar.set_prefix(label(progress));
                self.screen.bar.set_message("");
                self.screen.bar.reset();
                self.progress(progress);
            }
            ProgressMode::Lines => self.screen.line(&beginning(progress)),
            ProgressMode::Quiet => {}
        }
    }

    fn progress(&mut self, progress: &Progress) {
        self.failed = progress.failed_pairs;
        let ratio = progress.unbalanced;
        self.first = self.first.or((ratio.is_finite() && ratio > 0.0).then_some(ratio));
        match self.screen.mode {
            ProgressMode::Live => {
                let part = self.first.map_or(0.0, |first| progress.part(first));
                self.screen.bar.set_message(match &progress.search {
                    Some(search) => trials(search, progress.tolerance).join("  "),
                    None => figures(progress).join("  "),
                });
                self.screen.bar.set_position((part * LENGTH as f64) as u64);
            }
            ProgressMode::Lines if self.written.elapsed() >= EVERY => {
                self.written = Instant::now();
                let lines = match &progress.search {
                    Some(search) => trials(search, progress.tolerance),
                    None => vec![format!("step {}", figures(progress).join(", "))],
                };
                for line in lines {
                    self.screen.line(&format!("{}: {line}", label(progress)));
                }
            }
            ProgressMode::Lines | ProgressMode::Quiet => {}
        }
    }
}

impl Observer for Watcher {
    fn event(&mut self, event: Event<'_>) {
        self.building = None;
        if let Some(lines) = &mut self.lines {
            lines.event(&event);
        }
        match event {
            Event::Built(report) => {
                self.screen.line(&model(report));
            }
            Event::Kept(folder) => {
                let folder = folder.display();
                self.screen.line(&format!("earlier results were moved to {folder}"));
            }
            Event::NothingSaved(folder) => {
                let folder = folder.display();
                self.screen.line(&format!(
                    "nothing was saved in {folder} yet: the run starts from the beginning"
                ));
            }
            Event::DamagedCheckpoint(reason) => {
                self.screen.line(reason);
                self.screen.line(
                    "the run continues from the checkpoint before it, checkpoint-previous.h5",
                );
            }
            Event::Warning(warning) => self.screen.line(&format!("warning: {warning}")),
            Event::StepLimit { limit, .. } => {
                let step = limit.step;
                self.screen.line(&format!("critical step {step:.4e} s, limited by {limit}"));
            }
            Event::StageStarted(progress) => self.stage_started(progress),
            Event::Progress(progress) => self.progress(progress),
            Event::StageDone(stage) => {
                self.screen.clear();
                self.screen.line(&end(stage, self.failed));
                if let Some(profile) = &stage.profile {
                    self.screen.line(&format!("{profile}\n"));
                }
                self.last = Some(stage.clone());
            }
            Event::Trial { stage, trial: SafetyTrial { factor, verdict, steps } } => {
                self.screen.line(&format!(
                    "{stage}: strengths / {factor:.4}: {verdict} after {steps} steps"
                ));
            }
            // The last line of an interrupted run names its checkpoint, so it is not shown here.
            _ => {}
        }
    }

    fn stop_flag(&self) -> Arc<AtomicBool> {
        self.stop.clone()
    }

    fn build_progress(&self) -> Arc<BuildProgress> {
        self.building.as_ref().map(BuildDisplay::progress).unwrap_or_default()
    }

    fn wants_to_stop(&mut self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Lines at the start of a run.
fn model(report: &Report) -> String {
    let Report { blocks, nodes, pairs, breakable_pairs, charges, .. } = report;
    let line = format!("model: {blocks} blocks, {nodes} nodes, {pairs} pairs");
    let mut lines = match breakable_pairs {
        0 => line,
        all if all == pairs => line + ", which can all fail",
        some => format!("{line}, of which {some} can fail"),
    };
    for interface in &report.interfaces {
        lines += &format!("\n{interface}");
    }
    for selection in &report.selections {
        lines += &format!("\n{selection}");
    }
    for (index, charge) in charges.iter().enumerate() {
        lines += &format!("\ncharge {index}: {charge}");
    }
    lines
}

/// Name of the stage, with its number if there are several stages.
fn label(progress: &Progress) -> String {
    match progress.stage_index {
        (_, 0 | 1) => progress.stage.clone(),
        (index, stages) => format!("{} ({}/{stages})", progress.stage, index + 1),
    }
}

/// Key figures of a running stage.
fn figures(progress: &Progress) -> Vec<String> {
    let mut figures = Vec::new();
    // Relaxation has no physical time and ends before its last step.
    if progress.relax {
        let Progress { step, unbalanced, tolerance, .. } = progress;
        figures.push(step.to_string());
        figures.push(format!("unbalanced {} → {tolerance:e}", ratio(*unbalanced)));
    } else {
        figures.push(format!("{}/{}", progress.step, progress.steps));
        figures.push(format!("t {:.4e} s", progress.time));
        figures.push(format!("unbalanced {}", ratio(progress.unbalanced)));
    }
    if progress.failed_pairs > 0 {
        figures.push(format!("{} failed", progress.failed_pairs));
    }
    if progress.contacts > 0 {
        figures.push(format!("{} contacts", progress.contacts));
    }
    if let Some(FastestBlock { block, speed, .. }) = &progress.fastest {
        figures.push(format!("block {block} at {speed:.1e} m/s"));
    }
    figures.extend(rate(progress.updates_per_second));
    let left = progress.seconds_left.and_then(clock);
    figures.extend(left.map(|left| format!("{left} left")));
    figures
}

/// Line on each trial that runs.
fn trials(search: &SearchProgress, tolerance: f64) -> Vec<String> {
    let line = |running: &TrialProgress| {
        let TrialProgress { trial, factor, step, unbalanced } = running;
        let unbalanced = ratio(unbalanced.unwrap_or(f64::NAN));
        format!(
            "trial {trial} of at most {}, strengths / {factor:.4}: step {step}, unbalanced {unbalanced} → {tolerance:e}",
            search.most
        )
    };
    search.running.iter().map(line).collect()
}

/// Line at the start of a stage.
fn beginning(progress: &Progress) -> String {
    if let Some(SearchProgress { done, most, .. }) = &progress.search {
        let known = match done {
            0 => String::new(),
            done => format!(", of which {done} are done"),
        };
        return format!(
            "{}: search for the factor of safety, at most {most} trials{known}",
            label(progress)
        );
    }
    let what = if progress.relax {
        format!("relaxation to an unbalanced ratio of {:e}", progress.tolerance)
    } else {
        format!("{} steps", progress.steps)
    };
    let from = match progress.step {
        0 => String::new(),
        step => format!(", from step {step} on"),
    };
    format!("{}: {what}{from}", label(progress))
}

/// Unbalanced ratio as text; a dash if there is none because nothing is applied.
pub(crate) fn ratio(unbalanced: f64) -> String {
    if unbalanced.is_finite() { format!("{unbalanced:.1e}") } else { "–".to_owned() }
}

/// Line at the end of a stage; `failed` is the number of pairs that have failed in the run.
fn end(stage: &StageSummary, failed: u64) -> String {
    let verdict = match (stage.verdict, stage.kind.as_str()) {
        (Verdict::Undecided, "dynamic") => "done".to_owned(),
        (verdict, _) => verdict.to_string(),
    };
    let mut line = match stage.bracket {
        None => format!("{}: {verdict} after {} steps", stage.name, stage.steps),
        Some(_) => {
            let (trials, steps) = (stage.trials.len(), stage.steps);
            format!(
                "{}: {} after {trials} trials of {steps} steps in all",
                stage.name,
                stage.safety()
            )
        }
    };
    if let Some(time) = clock(stage.wall_seconds) {
        line += &format!(" and {time}");
    }
    line += &format!(", unbalanced {}", ratio(stage.unbalanced));
    if stage.imbalance > 0.0 {
        line += &format!(", energy off by {:.0e}", stage.imbalance);
    }
    if failed > 0 {
        line += &format!(", {failed} pairs failed");
    }
    if let Some(rate) = rate(stage.node_updates_per_second) {
        line += &format!(", {rate}");
    }
    line
}

/// Node updates per second as text, if the rate is positive and finite.
pub(crate) fn rate(rate: f64) -> Option<String> {
    let (scale, unit) = match rate {
        _ if !rate.is_finite() || rate <= 0.0 => return None,
        _ if rate < 999_950.0 => (1e3, "thousand node updates/s"),
        _ if rate < 999_950_000.0 => (1e6, "million node updates/s"),
        _ => (1e9, "billion node updates/s"),
    };
    Some(format!("{:.1} {unit}", rate / scale))
}

/// Wall-clock time as text in its two largest units; `None` if negative or not finite.
pub(crate) fn clock(seconds: f64) -> Option<String> {
    if !seconds.is_finite() || seconds < 0.0 {
        return None;
    }
    let whole = seconds.round() as u64;
    Some(match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        3600..86_400 => format!("{} h {} min", whole / 3600, whole / 60 % 60),
        _ => format!("{} d {} h", whole / 86_400, whole / 3600 % 24),
    })
}
