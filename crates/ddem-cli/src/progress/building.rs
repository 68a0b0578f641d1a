//! Display of the work before the first step, by a thread that reads its progress.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ddem_deck::{BuildPhase, BuildProgress};

use super::{EVERY, ProgressMode, Screen};
use crate::json;

/// Wall time after which the work is shown: most models are built sooner.
const AFTER: Duration = Duration::from_secs(2);
/// Wall time between two versions of the live line, and two lines of JSON.
const TICK: Duration = Duration::from_secs(1);

/// Display of the building of a model, until it is dropped.
#[derive(Debug)]
pub(crate) struct BuildDisplay {
    progress: Arc<BuildProgress>,
    /// Thread of the display, which ends with the sender.
    thread: Option<(Sender<()>, JoinHandle<()>)>,
}

impl BuildDisplay {
    /// Display on a screen, and with `json` by lines of JSON.
    pub(crate) fn start(screen: &Screen, json: bool) -> Self {
        let progress = Arc::<BuildProgress>::default();
        let (sender, ended) = channel();
        let (screen, shown) = (screen.clone(), progress.clone());
        let run = move || show(&screen, json, &shown, &ended);
        // Without a thread the model is built unseen.
        let thread = thread::Builder::new().spawn(run).ok().map(|thread| (sender, thread));
        Self { progress, thread }
    }

    /// Progress that is shown.
    pub(crate) fn progress(&self) -> Arc<BuildProgress> {
        self.progress.clone()
    }
}

impl Drop for BuildDisplay {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.thread.take() {
            drop(sender);
            let _ = thread.join();
        }
    }
}

/// Shows the progress until the sender of `ended` is dropped.
fn show(screen: &Screen, json: bool, progress: &BuildProgress, ended: &Receiver<()>) {
    let mut wait = AFTER;
    let mut written: Option<Instant> = None;
    while ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
        wait = TICK;
        if json {
            json::building(progress);
        }
        match screen.mode {
            ProgressMode::Live => screen.live(text(progress)),
            ProgressMode::Lines if written.is_none_or(|written| written.elapsed() >= EVERY) => {
                written = Some(Instant::now());
                screen.line(&text(progress));
            }
            ProgressMode::Lines | ProgressMode::Quiet => {}
        }
    }
    screen.clear();
}

/// Line on the progress.
fn text(progress: &BuildProgress) -> String {
    let cells = progress.cells();
    let phase = match progress.phase() {
        BuildPhase::Cut { number, cuts } => {
            return format!("building: cut {} of {cuts}, {cells} cells so far", number + 1);
        }
        BuildPhase::Blocks => "blocks",
        BuildPhase::Joints => "joints",
        BuildPhase::Model => "contacts",
        BuildPhase::Report => "warnings and time step",
        _ => "checks of the deck",
    };
    match cells {
        0 => format!("building: {phase}"),
        cells => format!("building: {phase} of {cells} cells"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_on_a_model_that_is_built() {
        let progress = BuildProgress::default();
        let mut lines = vec![text(&progress)];
        for phase in [
            BuildPhase::Cut { number: 1, cuts: 3 },
            BuildPhase::Blocks,
            BuildPhase::Joints,
            BuildPhase::Model,
            BuildPhase::Report,
        ] {
            progress.enter(phase);
            lines.push(text(&progress));
        }
        insta::assert_snapshot!(lines.join("\n"));
    }
}
