//! Detection of blocks without a bonded joint that continue to move against each other (§7).
//!
//! Every 200 steps, in a very long stage less often, a *sample* records two values. The first is how
//! far any two blocks have moved against each other since the last event (the start of a stage or an
//! increment, or a failure), as a fraction of an edge. The second is the unbalanced force ratio. A mechanism
//! continues to slide under a constant unbalanced force. Blocks that find an equilibrium slow down
//! as their forces fade.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::model::stage::SafetySearch;

/// Number of steps between two samples.
const SAMPLE_INTERVAL: u64 = 200;
/// Number of samples at which every second one is dropped, so that the memory of a long stage and the
/// time of its verdicts stay bounded.
const MOST_SAMPLES: usize = 4096;
/// Bound of the number of times that samples are dropped. No stage has so many steps.
const MOST_THINNED: u32 = 40;
/// Least number of steps from an event to a verdict.
const SHORTEST_WAIT: u64 = 1000;
/// Number of steps to wait if no stage has been near equilibrium yet.
const DEFAULT_WAIT: u64 = 2500;
/// Least growth of a continuing motion from the middle sample to the last one, as a factor.
const GROWTH: f64 = 1.5;
/// Fraction of the unbalanced ratio of the second quarter of the samples that an endless motion
/// keeps in the second half.
const KEPT_IMBALANCE: f64 = 0.8;
/// Fraction of the path of the first half below which blocks in a dynamic stage slow down in the
/// second half. Friction reduces the path of blocks that slide to rest by more than this.
const STEADY_PATH: f64 = 1.0 - 1e-4;
/// Motion, as a fraction of an edge, beyond that of blocks that settle.
pub(crate) const FAR: f64 = SafetySearch::LIMIT;
/// Motion, as a fraction of an edge, at which a dynamic stage ends before its duration. Blocks that
/// settle on soft joints move far.
const FALLEN_AWAY: f64 = 0.5;
/// Range of the last eighth of the samples in a continuing motion, as a fraction of its path. It is
/// less if the motion stops, and more if blocks have just come together.
const LATE_PART: [f64; 2] = [0.1, 0.5];
/// Motion, as a fraction of an edge, below which it may be rounding.
const SMALLEST_MOTION: f64 = 1e-6;
/// Multiple of the first waiting time after which a growing motion is endless, however slow.
const LONG_WAIT: u64 = 4;
/// Motion, as a fraction of an edge, that counts as none.
const NEGLIGIBLE_MOTION: f64 = 1e-4;
/// Fraction of its growth from the second to the third quarter by which a motion that comes to rest
/// still grows from the third to the fourth.
const FADING_GROWTH: f64 = 0.8;
/// Largest difference of the means of the last two quarters of a swinging motion, as a fraction of
/// its span.
const SWING_TOLERANCE: f64 = 0.25;
/// Number of samples before a dynamic stage may end.
const FEWEST_SAMPLES: usize = 10;
/// Largest unbalanced force ratio of blocks at rest.
const BALANCED_RATIO: f64 = 1e-2;
/// Fraction of gravity that may still accelerate blocks at rest.
const RESIDUAL_GRAVITY: f64 = 1e-3;

/// Time within which the motion of blocks that accelerate under a fraction of gravity is detected
/// `[s]`. `edge` is their edge `[m]`, `gravity` the acceleration `[m/s²]`, and `local` the local
/// damping of the stage.
pub(super) fn detection_time(edge: f64, gravity: f64, local: f64) -> f64 {
    if gravity == 0.0 {
        return 0.0;
    }
    // In its fourth quarter the path `a t²/2` grows by 7/32 of `a t²`.
    (SMALLEST_MOTION * edge * 32.0 / 7.0 / (RESIDUAL_GRAVITY * gravity * (1.0 - local))).sqrt()
}

/// Verdict on a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// In equilibrium.
    #[serde(rename = "at rest")]
    AtRest,
    /// Blocks continue to move against each other.
    Fails,
    /// Neither is certain.
    #[default]
    Undecided,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AtRest => "at rest",
            Self::Fails => "fails",
            Self::Undecided => "undecided",
        })
    }
}

/// Motion of neighbours since the last event.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MotionWatch {
    /// Step of the last event.
    pub(crate) since: u64,
    /// Largest number of steps from an event to near equilibrium; 0 if unknown.
    pub(super) settling_steps: u64,
    /// Values at each sample: motion of touching blocks as a fraction of an edge, unbalanced force
    /// ratio, and motion of blocks in flight.
    samples: Vec<[f64; 3]>,
    /// Number of times that every second sample was dropped.
    thinned: u32,
    /// Mean displacement of each block at the start of the stage and at the last event `[m]`.
    pub(super) displacements: [Vec<[f64; 3]>; 2],
}

impl MotionWatch {
    /// Restarts the watch at an event. With `stage` the event is the start of a stage.
    pub(super) fn begin(&mut self, step: u64, stage: bool, displacements: Vec<[f64; 3]>) {
        if stage || self.displacements[0].len() != displacements.len() {
            self.displacements[0].clone_from(&displacements);
        }
        self.displacements[1] = displacements;
        self.since = step;
        self.samples.clear();
        self.thinned = 0;
    }

    /// Number of steps between two samples.
    pub(super) fn interval(&self) -> u64 {
        SAMPLE_INTERVAL << self.thinned
    }

    /// True if this can be the watch after so many steps.
    pub(crate) fn is_valid(&self, steps: u64) -> bool {
        let few = self.samples.len() < MOST_SAMPLES && self.thinned < MOST_THINNED;
        self.since <= steps && few
    }

    /// Adds the sample of an interval after the last one.
    pub(super) fn add(&mut self, sample: [f64; 3]) {
        self.samples.push(sample);
        if self.samples.len() == MOST_SAMPLES {
            let mut number = 0;
            self.samples.retain(|_| {
                number += 1;
                number % 2 == 0
            });
            self.thinned += 1;
        }
    }

    /// Notes that forces are nearly in equilibrium.
    pub(crate) fn note_near_equilibrium(&mut self, step: u64) {
        self.settling_steps = self.settling_steps.max(step - self.since.min(step));
    }

    /// True at a sample if forces have not faded for long although no motion continues. Slip that
    /// is mapped from the last equilibrium takes no energy, so that blocks which rattle on it need
    /// not come to rest.
    pub(crate) fn rattles(&self, step: u64) -> bool {
        let steps = step - self.since;
        steps.is_multiple_of(self.interval())
            && steps >= self.waiting_time()
            && self.force_persists()
    }

    /// Number of steps after an event from which a verdict is possible.
    fn waiting_time(&self) -> u64 {
        if self.settling_steps == 0 {
            DEFAULT_WAIT
        } else {
            SHORTEST_WAIT.max(self.settling_steps.saturating_mul(2))
        }
    }

    /// True if a relaxation has become an endless motion: it reaches `far`, as a fraction of an
    /// edge, or continues for long.
    pub(crate) fn fails(&self, far: f64) -> bool {
        let waiting_time = self.waiting_time();
        let steps = self.interval() * self.samples.len() as u64;
        let far = self.samples.last().is_some_and(|sample| sample[0] >= far);
        steps >= waiting_time
            && grows(&self.touching())
            && self.force_persists()
            && (far || steps >= waiting_time.saturating_mul(LONG_WAIT))
    }

    /// Verdict on a dynamic stage.
    pub(crate) fn verdict(&self, ratio: f64) -> Verdict {
        let motion: Vec<f64> = self.samples.iter().map(|sample| sample[0].max(sample[2])).collect();
        let last = motion.last().copied().unwrap_or_default();
        let late = last - motion.get(3 * motion.len().saturating_sub(1) / 4).unwrap_or(&0.0);
        if last >= FAR && grows(&motion) && !slows(&motion) {
            Verdict::Fails
        } else if ratio <= BALANCED_RATIO
            && (late < SMALLEST_MOTION || (late <= NEGLIGIBLE_MOTION && fades(&motion)))
        {
            Verdict::AtRest
        } else {
            Verdict::Undecided
        }
    }

    /// Verdict with which a dynamic stage ends early, if any. Falling blocks may come to rest. Only
    /// blocks that slide or rotate on others, steadily and far, fail.
    pub(crate) fn decided(&self, ratio: f64) -> Option<Verdict> {
        if self.samples.len() < FEWEST_SAMPLES {
            return None;
        }
        match self.verdict(ratio) {
            Verdict::Fails => self.keeps_moving().then_some(Verdict::Fails),
            Verdict::AtRest => Some(Verdict::AtRest),
            Verdict::Undecided => None,
        }
    }

    /// True if touching blocks have moved by half an edge without slowing down, in contact all the
    /// way.
    fn keeps_moving(&self) -> bool {
        let motion = self.touching();
        let last = motion.last().copied().unwrap_or_default();
        let late = 1.0 - motion[7 * motion.len() / 8] / last;
        last >= FALLEN_AWAY
            && grows(&motion)
            && !slows(&motion)
            && (LATE_PART[0]..=LATE_PART[1]).contains(&late)
    }

    /// Motion of touching blocks at each sample.
    fn touching(&self) -> Vec<f64> {
        self.samples.iter().map(|sample| sample[0]).collect()
    }

    /// True if the unbalanced force does not fade.
    fn force_persists(&self) -> bool {
        let half = self.samples.len() / 2;
        let least =
            |samples: &[[f64; 3]]| samples.iter().map(|sample| sample[1]).fold(f64::MAX, f64::min);
        least(&self.samples[half..]) >= KEPT_IMBALANCE * least(&self.samples[half / 2..half.max(1)])
    }
}

/// True if a motion has grown by the factor [`GROWTH`] since the middle sample.
fn grows(motion: &[f64]) -> bool {
    let Some(&last) = motion.last() else { return false };
    last >= SMALLEST_MOTION && last >= GROWTH * motion[motion.len() / 2]
}

/// True if the path of the second half is shorter than that of the first.
fn slows(motion: &[f64]) -> bool {
    let half = motion.len() / 2;
    if half == 0 {
        return false;
    }
    let [first, both] = [half, 2 * half].map(|samples| motion[samples - 1]);
    both - first < STEADY_PATH * first
}

/// True if the mean of a motion grows less from the third to the fourth quarter than from the
/// second to the third. A vibration does not grow. A motion that has just begun to accelerate,
/// after blocks have settled, grows more.
fn fades(motion: &[f64]) -> bool {
    let at = |quarter: usize| quarter * motion.len() / 4;
    let mean = |quarter: usize| {
        let samples = &motion[at(quarter)..at(quarter + 1)];
        samples.iter().sum::<f64>() / samples.len().max(1) as f64
    };
    let [second, third, fourth] = [1, 2, 3].map(mean);
    let late = &motion[at(2)..];
    let span = late.iter().fold(f64::MIN, |most, &x| most.max(x))
        - late.iter().fold(f64::MAX, |least, &x| least.min(x));
    // For a steady motion in one direction the means differ by half of the span.
    fourth - third
        < SMALLEST_MOTION.max(FADING_GROWTH * (third - second)).max(SWING_TOLERANCE * span)
}

#[cfg(test)]
mod tests;
