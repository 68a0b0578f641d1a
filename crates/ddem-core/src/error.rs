//! Faults of the input, and errors of a run.

mod advice;
mod code;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use advice::counted;
pub(crate) use advice::numbered;
use advice::{after, block_too_fast, deep_penetration, hint, less_rounding, moving, named, stiff};
pub use code::ErrorCode;

/// A block that still moves when a stage fails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MovingBlock {
    /// Name of its set.
    pub set: String,
    /// Number of the block.
    #[serde(rename = "index")]
    pub block: usize,
    /// Magnitude of the mean displacement of its nodes in the stage `[m]`.
    pub distance: f64,
    /// Direction of its motion since pairs last failed in the stage, a unit vector.
    pub direction: [f64; 3],
}

/// The block with the fastest node.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FastestBlock {
    /// Number of the block.
    pub block: usize,
    /// Name of its set.
    pub set: String,
    /// Speed of the node `[m/s]`; in a relaxation its displacement in the last step `[m]`.
    pub speed: f64,
}

/// An error in the input, with its code, its place and the valid value.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub struct Fault {
    /// Code of the error.
    pub code: ErrorCode,
    /// Path of the key, as in `materials.rock.poisson` or `blocks[0].count`.
    pub place: String,
    /// The value and the rule it breaks.
    pub message: String,
    /// The expected or nearest valid value.
    pub help: Option<String>,
}

impl Fault {
    /// Fault at a place, without help.
    pub fn new(code: ErrorCode, place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { code, place: place.into(), message: message.into(), help: None }
    }

    /// Adds the help.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Place, message, help and code on one line.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A fault of the whole deck has no place.
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        f.write_str(&self.message)?;
        if let Some(help) = &self.help {
            write!(f, " ({help})")?;
        }
        write!(f, " [{}]", self.code)
    }
}

impl std::error::Error for Fault {}

/// Error of a deck that cannot become a model: all faults found, at least one.
#[derive(Clone, PartialEq, thiserror::Error)]
#[error("{}", .faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ModelError {
    /// Faults, in the order of the deck.
    pub faults: Vec<Fault>,
}

impl From<Fault> for ModelError {
    fn from(fault: Fault) -> Self {
        Self { faults: vec![fault] }
    }
}

/// Error of a run that cannot continue. Its display ends with the code.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The requested time step is unstable.
    #[error(
        "the time step, {time_step:.6e} s, exceeds the critical time step, {critical:.6e} s (2/ω_max): the \
         motion would grow without bound [{}]",
        ErrorCode::UnstableTimeStep
    )]
    UnstableTimeStep {
        /// Requested time step `[s]`.
        time_step: f64,
        /// Critical time step `[s]`.
        critical: f64,
    },
    /// The time step or the duration is less than a billionth of the critical time step.
    #[error(
        "the time step, {time_step:e} s, is less than a billionth of the critical time step, \
         {critical:.6e} s [{}]",
        ErrorCode::UnstableTimeStep
    )]
    TooShort {
        /// Requested time step `[s]`.
        time_step: f64,
        /// Critical time step `[s]`.
        critical: f64,
    },
    /// The critical time step is not a positive number: stiffnesses or masses are out of range.
    #[error(
        "the critical time step is not a number: density or moduli are far out of range [{}]",
        ErrorCode::NoCriticalStep
    )]
    NoCriticalStep,
    /// Relaxation finds no mass for a node: its joints are so stiff that rounding removes the
    /// block's stiffness.
    #[error(
        "relaxation finds no mass for node {node} of block {block}: its joints are so much stiffer than the block that \
         rounding removes it, or a stiffness is not a number; use thicker or softer joints [{}]",
        ErrorCode::NoRelaxationMass
    )]
    NoRelaxationMass {
        /// Block of the node.
        block: usize,
        /// Number of the node.
        node: usize,
    },
    /// Gradual changes of strengths need more joint laws than can be numbered.
    #[error(
        "the relaxation needs {laws} joint laws, more than 65 534, to change strengths gradually; `increments = 1` \
         changes them at once [{}]",
        ErrorCode::TooLarge
    )]
    TooManyLaws {
        /// Number of required laws.
        laws: usize,
    },
    /// A program passed values that are invalid in a deck. Nothing has changed.
    #[error("{}", faults.iter().map(Fault::to_string).collect::<Vec<_>>().join("; "))]
    Values {
        /// Faults of the values, by key.
        faults: Vec<Fault>,
    },
    /// A program stopped the run before anything moved.
    #[error("stopped [{}]", ErrorCode::Stopped)]
    Stopped,
    /// A history that a program computes has no value.
    #[error(
        "the history of {entry} failed at time {time:.6e} s: {message} [{}]",
        ErrorCode::HistoryFailed
    )]
    HistoryFailed {
        /// The load, charge, support or boundary, as in `load[0]`.
        entry: String,
        /// Time since the history began `[s]`.
        time: f64,
        /// Reason.
        message: String,
    },
    /// A program entered a stage before the present one. Nothing has changed.
    #[error(
        "stage {stage} comes before stage {present}, which has begun: stages are entered forwards only; \
         to go back, load a state that was saved before [{}]",
        ErrorCode::EarlierStage
    )]
    EarlierStage {
        /// Number of the stage in the deck.
        stage: usize,
        /// Number of the present stage.
        present: usize,
    },
    /// A force is no longer finite.
    #[error(
        "diverged at step {step}, time {time:.6e} s: the forces are no longer finite, first at \
         node {node} of block {block}; the usual causes are excessive loads or velocities, or an \
         inverted element [{}]",
        ErrorCode::Diverged
    )]
    Diverged {
        /// Steps since the start of the run.
        step: u64,
        /// Simulated time `[s]`.
        time: f64,
        /// Block of the node.
        block: usize,
        /// First node without a finite force.
        node: usize,
    },
    /// A block moves so far in one step that contacts could be missed.
    #[error(
        "block {block} (set `{set}`) moved {distance:.3e} m in step {step}, at time {time:.6e} s: more than a \
         quarter of the shortest edge of a block, {edge} m, so that contacts could be missed; {} [{}]",
        block_too_fast(*driven),
        ErrorCode::BlockTooFast
    )]
    BlockTooFast {
        /// The fastest block.
        block: usize,
        /// Name of its set.
        set: String,
        /// Steps since the start of the run.
        step: u64,
        /// Simulated time `[s]`.
        time: f64,
        /// Displacement of one of its nodes in the step `[m]`.
        distance: f64,
        /// Shortest edge of a block `[m]`.
        edge: f64,
        /// Number in the deck of the support that moves it.
        driven: Option<usize>,
    },
    /// Two blocks penetrate each other so deeply that they could pass through each other.
    #[error(
        "block {} (set `{}`) and block {} (set `{}`) penetrate each other by {depth:.3e} m in step {step}, at time \
         {time:.6e} s: more than a quarter of their shortest edge, {edge} m; {} [{}]",
        .blocks[0], .sets[0], .blocks[1], .sets[1], deep_penetration(*driven, *relaxes),
        ErrorCode::DeepPenetration
    )]
    DeepPenetration {
        /// The two blocks.
        blocks: [usize; 2],
        /// Names of their sets.
        sets: Box<[String; 2]>,
        /// Steps since the start of the run.
        step: u64,
        /// Simulated time `[s]`.
        time: f64,
        /// Penetration `[m]`.
        depth: f64,
        /// Shortest edge of both blocks `[m]`.
        edge: f64,
        /// Number in the deck of a support that moves one of the blocks, and the number of that
        /// block.
        driven: Option<(usize, usize)>,
        /// True in a relaxation.
        relaxes: bool,
    },
    /// There is no equilibrium: blocks separate or slide without end, because their joints have
    /// failed.
    #[error(
        "there is no equilibrium: {}{} [{}]",
        named(moving), after(*failed), ErrorCode::NoEquilibrium
    )]
    NoEquilibrium {
        /// Two neighbours with the largest relative displacement since the last event: the start of
        /// the stage, an increment or a failure.
        blocks: [usize; 2],
        /// Relative displacement of the two blocks `[m]`.
        distance: f64,
        /// Moving blocks, with their displacements in the stage.
        moving: Vec<MovingBlock>,
        /// Unbalanced ratio reached.
        ratio: f64,
        /// Number of failed pairs.
        failed: u64,
    },
    /// Relaxation has not converged within the allowed number of steps.
    #[error(
        "not in equilibrium after {max_steps} steps: unbalanced ratio {ratio:.3e}, tolerance \
         {tolerance:.3e}{}{} [{}]",
        hint(*ratio, *failed), moving(fastest.as_ref()),
        ErrorCode::NotConverged
    )]
    NotConverged {
        /// Unbalanced ratio reached.
        ratio: f64,
        /// Required unbalanced ratio.
        tolerance: f64,
        /// Allowed number of steps.
        max_steps: u64,
        /// Number of failed pairs.
        failed: u64,
        /// The block that moved most in the last step.
        fastest: Option<FastestBlock>,
    },
    /// Rounding keeps the unbalanced ratio above the tolerance.
    #[error(
        "the unbalanced ratio stays at {ratio:.1e}, above the tolerance {tolerance:.1e}: the rest is rounding, most of \
         it at block {block}{}; {} [{}]",
        stiff(joint.as_ref(), *force), less_rounding(*ratio, *tolerance, joint.as_ref()),
        ErrorCode::UnreachableTolerance
    )]
    UnreachableTolerance {
        /// Unbalanced ratio reached.
        ratio: f64,
        /// Required unbalanced ratio.
        tolerance: f64,
        /// Block with the largest rounding force.
        block: usize,
        /// Rounding force `[N]`.
        force: f64,
        /// Name of the stiffest joint of that block, and its thickness `[m]`, 0 for springs.
        joint: Option<(String, f64)>,
    },
}

/// Implements `Debug` by `Display`, because a program whose `main` returns an error prints its
/// `Debug` form.
#[doc(hidden)]
#[macro_export]
macro_rules! debug_as_display {
    ($($error:ty),*) => {$(
        impl ::std::fmt::Debug for $error {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                ::std::fmt::Display::fmt(self, f)
            }
        }
    )*};
}

debug_as_display!(Fault, ModelError, RunError);
