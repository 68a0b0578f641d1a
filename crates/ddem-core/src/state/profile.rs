//! Wall time by phase, with a clock that the program gives.
//!
//! The passes over the packs run on several threads, and each of their tasks has a [`Stopwatch`].
//! The wall time of a pass is divided in proportion to the times of all tasks. These times are no
//! results: they may depend on the number and the order of threads.

use serde::{Deserialize, Serialize};

/// Clock that gives the time since any fixed moment `[s]`.
pub type Clock = fn() -> f64;

/// Wall times of the phases of a run `[s]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Elastic forces of the blocks.
    pub blocks: f64,
    /// Forces and failure of the joints.
    pub joints: f64,
    /// Search for contacts between blocks, and their forces.
    pub contacts: f64,
    /// Second pass: sums of the forces at the nodes, and their motion. In a relaxation only the
    /// sums.
    pub nodes: f64,
    /// Masses of relaxations, and the motion in them.
    pub relaxation: f64,
    /// Search for the critical time step.
    pub start_up: f64,
}

/// Phase of a run to which time is booked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    Blocks,
    Joints,
    Contacts,
    Nodes,
    Relaxation,
    StartUp,
}

impl Profile {
    /// Sum of all phases `[s]`.
    #[must_use]
    pub fn total(&self) -> f64 {
        let Self { blocks, joints, contacts, nodes, relaxation, start_up } = self;
        blocks + joints + contacts + nodes + relaxation + start_up
    }

    /// Adds the times of another profile, multiplied by `factor`.
    pub fn add(&mut self, other: &Self, factor: f64) {
        self.blocks += factor * other.blocks;
        self.joints += factor * other.joints;
        self.contacts += factor * other.contacts;
        self.nodes += factor * other.nodes;
        self.relaxation += factor * other.relaxation;
        self.start_up += factor * other.start_up;
    }

    fn of(&mut self, phase: Phase) -> &mut f64 {
        match phase {
            Phase::Blocks => &mut self.blocks,
            Phase::Joints => &mut self.joints,
            Phase::Contacts => &mut self.contacts,
            Phase::Nodes => &mut self.nodes,
            Phase::Relaxation => &mut self.relaxation,
            Phase::StartUp => &mut self.start_up,
        }
    }
}

/// Times of the phases of one task. It measures nothing without a clock.
#[derive(Debug, Default)]
pub(crate) struct Stopwatch {
    clock: Option<Clock>,
    /// Time of the last reading `[s]`.
    last: f64,
    profile: Profile,
}

impl Stopwatch {
    pub(crate) fn new(clock: Option<Clock>) -> Self {
        Self { clock, ..Self::default() }
    }

    /// Begins a phase.
    #[inline(always)]
    pub(crate) fn start(&mut self) {
        if let Some(clock) = self.clock {
            self.last = clock();
        }
    }

    /// Ends a phase and begins the next one.
    #[inline(always)]
    pub(crate) fn lap(&mut self, phase: Phase) {
        if let Some(clock) = self.clock {
            let now = clock();
            *self.profile.of(phase) += now - self.last;
            self.last = now;
        }
    }

    fn take(&mut self) -> Profile {
        std::mem::take(&mut self.profile)
    }
}

/// Profile of a simulation. It measures nothing without a clock.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Profiler {
    pub(crate) clock: Option<Clock>,
    pub(crate) profile: Profile,
}

/// Start of a span of time, with the profile at it; `None` without a clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpanStart(Option<(f64, Profile)>);

impl Profiler {
    pub(crate) fn begin(&self) -> SpanStart {
        SpanStart(self.clock.map(|clock| (clock(), self.profile)))
    }

    /// Ends a span and books all of it to one phase, spans inside of it included.
    pub(crate) fn end(&mut self, span: SpanStart, phase: Phase) {
        if let (Some(clock), SpanStart(Some((start, before)))) = (self.clock, span) {
            self.profile = before;
            *self.profile.of(phase) += clock() - start;
        }
    }

    /// Ends a span in which tasks have measured their phases, and divides its wall time in
    /// proportion to their times.
    pub(crate) fn end_tasks<'a>(
        &mut self,
        span: SpanStart,
        tasks: impl Iterator<Item = &'a mut Stopwatch>,
    ) {
        let (Some(clock), SpanStart(Some((start, _)))) = (self.clock, span) else { return };
        let wall = clock() - start;
        let mut sum = Profile::default();
        tasks.for_each(|task| sum.add(&task.take(), 1.0));
        let all = sum.total();
        if all > 0.0 {
            self.profile.add(&sum, wall / all);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    thread_local!(static TICKS: Cell<f64> = const { Cell::new(0.0) });

    /// Clock that advances by a second at every reading.
    fn ticks() -> f64 {
        TICKS.with(|ticks| ticks.replace(ticks.get() + 1.0))
    }

    #[test]
    fn wall_time_is_divided_as_the_times_of_the_tasks() {
        let mut profiler = Profiler { clock: Some(ticks), ..Profiler::default() };
        let mut tasks = [Stopwatch::new(Some(ticks)), Stopwatch::new(Some(ticks))];
        let span = profiler.begin();
        for task in &mut tasks {
            task.start();
            task.lap(Phase::Blocks);
            task.lap(Phase::Joints);
        }
        tasks[1].lap(Phase::Nodes);
        profiler.end_tasks(span, tasks.iter_mut());
        // Eight readings after the first take 8 s, and the tasks have measured 2 s, 2 s and 1 s.
        let expected = Profile { blocks: 3.2, joints: 3.2, nodes: 1.6, ..Profile::default() };
        assert_eq!(profiler.profile, expected);
        assert_eq!(tasks[0].take(), Profile::default());
    }

    #[test]
    fn a_span_contains_the_spans_inside_of_it() {
        let mut profiler = Profiler { clock: Some(ticks), ..Profiler::default() };
        let outer = profiler.begin();
        let inner = profiler.begin();
        profiler.end(inner, Phase::Contacts);
        assert_eq!(profiler.profile.contacts, 1.0);
        profiler.end(outer, Phase::StartUp);
        assert_eq!(profiler.profile, Profile { start_up: 3.0, ..Profile::default() });
    }

    #[test]
    fn nothing_is_measured_without_a_clock() {
        let (mut profiler, mut task) = (Profiler::default(), Stopwatch::default());
        let span = profiler.begin();
        task.start();
        task.lap(Phase::Blocks);
        profiler.end_tasks(span, std::iter::once(&mut task));
        profiler.end(span, Phase::StartUp);
        assert_eq!(profiler.profile, Profile::default());
    }
}
