//! Faults of the input, and errors of a run.

mod advice;
mod code;

use std::fmt;

use serde::{Deserialize, Serialize};

use advice::{after, hint, moving, named, stiff, thicker, too_deep, too_fast};
pub use code::ErrorCode;

/// A block that moves on where a stage fails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MovingBlock {
    /// Name of its set.
    pub set: String,
    /// Number of the block.
    #[serde(rename = "index")]
    pub block: usize,
    /// Length of the mean displacement of its nodes in the stage `[m]`.
    pub distance: f64,
    /// Direction of that displacement, a unit vector.
    pub direction: [f64; 3],
}

/// An error in the input: its code, its place, and what would be right.
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
    /// A fault at a place.
    pub fn new(code: ErrorCode, place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { code, place: place.into(), message: message.into(), help: None }
    }

    /// Adds a hint.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Place, message, help and code on one line.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // What is wrong with a whole deck has no place.
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

/// A deck that cannot become a model: every fault that was found, at least one.
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

/// A run that cannot go on.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The time step that was asked for is not stable.
    #[error(
        "the time step, {time_step:.6e} s, exceeds the critical time step, {critical:.6e} s (2/ω_max): the \
         motion would grow without bound"
    )]
    TimeStep {
        /// Asked for `[s]`.
        time_step: f64,
        /// Largest stable one `[s]`.
        critical: f64,
    },
    /// The time step, or the whole duration, is out of all proportion.
    #[error(
        "the time step, {time_step:e} s, is less than a billionth of the critical time step, \
         {critical:.6e} s"
    )]
    TooShort {
        /// Asked for `[s]`.
        time_step: f64,
        /// Largest stable one `[s]`.
        critical: f64,
    },
    /// The stiffness or the masses are outside what numbers can hold.
    #[error("the critical time step is not a number: density or moduli are far out of range")]
    NoCriticalStep,
    /// Relaxation finds no mass for a node: rounding has taken what its joints do not hold.
    #[error(
        "relaxation finds no mass for node {node} of block {block}: its joints are so much stiffer than the block that \
         rounding removes it, or a stiffness is not a number; use thicker or softer joints"
    )]
    NoMass {
        /// Block of the node.
        block: usize,
        /// The node.
        node: usize,
    },
    /// Strengths that change gradually between more joints than can be numbered.
    #[error(
        "the relaxation needs {laws} joint laws, more than 65 534, to change strengths gradually; `increments = 1` \
         changes them at once"
    )]
    TooManyLaws {
        /// Number of laws.
        laws: usize,
    },
    /// Values that a program gives are none that a deck could have; nothing has changed.
    #[error("{}", faults.iter().map(Fault::to_string).collect::<Vec<_>>().join("; "))]
    Values {
        /// Faults of the values, by key.
        faults: Vec<Fault>,
    },
    /// A program wanted it to stop, before anything moved.
    #[error("stopped")]
    Stopped,
    /// A history that a program computes has no value.
    #[error("the history of {entry} failed at time {time:.6e} s: {message}")]
    History {
        /// The load or support, as in `load[0]`.
        entry: String,
        /// Time since the history began `[s]`.
        time: f64,
        /// Reason.
        message: String,
    },
    /// A stage is entered that comes before the present one; nothing has changed.
    #[error(
        "stage {stage} comes before stage {present}, which has begun: stages are entered forwards only; \
         to go back, load a state that was saved before"
    )]
    EarlierStage {
        /// The stage, by its number in the deck.
        stage: usize,
        /// The present one.
        present: usize,
    },
    /// A force is not a number any more.
    #[error(
        "diverged at step {step}, time {time:.6e} s: the forces are no longer finite, first at \
         node {node} of block {block}; the usual causes are excessive loads or velocities, or an \
         inverted element"
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
    /// A block goes so far in a step that contacts could be missed.
    #[error(
        "block {block} of `{set}` moved {distance:.3e} m in step {step}, at time {time:.6e} s: more than a \
         quarter of the shortest edge of a block, {edge} m, so that contacts could be missed; {}",
        too_fast(*driven)
    )]
    TooFast {
        /// The fastest block.
        block: usize,
        /// The set that it belongs to.
        set: String,
        /// Steps since the start of the run.
        step: u64,
        /// Simulated time `[s]`.
        time: f64,
        /// Displacement of one of its nodes in the step `[m]`.
        distance: f64,
        /// Shortest edge of a block `[m]`.
        edge: f64,
        /// The support that moves it, by its number in the deck.
        driven: Option<usize>,
    },
    /// Two blocks are so deep in each other that they could pass through.
    #[error(
        "block {} of `{}` and block {} of `{}` penetrate each other by {depth:.3e} m in step {step}, at time \
         {time:.6e} s: more than a quarter of their shortest edge, {edge} m; {}",
        .blocks[0], .sets[0], .blocks[1], .sets[1], too_deep(*driven, *relaxes)
    )]
    TooDeep {
        /// The two blocks.
        blocks: [usize; 2],
        /// The sets that they belong to.
        sets: Box<[String; 2]>,
        /// Steps since the start of the run.
        step: u64,
        /// Simulated time `[s]`.
        time: f64,
        /// Penetration `[m]`.
        depth: f64,
        /// Their shortest edge `[m]`.
        edge: f64,
        /// A support that moves one of them, by its number in the deck, and which block.
        driven: Option<(usize, usize)>,
        /// In a relaxation.
        relaxes: bool,
    },
    /// Blocks part or slide without end in a relaxation: their joints have failed.
    #[error("there is no equilibrium: {}{}", named(moving), after(*failed))]
    Collapsed {
        /// Two blocks that have moved farthest against each other since pairs last failed.
        blocks: [usize; 2],
        /// Displacement `[m]`.
        distance: f64,
        /// All blocks that move, and how far they have come in the stage.
        moving: Vec<MovingBlock>,
        /// Unbalanced ratio reached.
        ratio: f64,
        /// Pairs that have failed.
        failed: u64,
    },
    /// Relaxation took too long.
    #[error(
        "not in equilibrium after {max_steps} steps: unbalanced ratio {ratio:.3e}, tolerance \
         {tolerance:.3e}{}{}",
        hint(*ratio, *failed), moving(fastest.as_ref())
    )]
    NotConverged {
        /// Unbalanced ratio reached.
        ratio: f64,
        /// Unbalanced ratio wanted.
        tolerance: f64,
        /// Steps allowed.
        max_steps: u64,
        /// Pairs that have failed.
        failed: u64,
        /// The block that moves most, its set, and its way in the last step `[m]`.
        fastest: Option<(usize, String, f64)>,
    },
    /// Relaxation has come as near to equilibrium as rounding lets it.
    #[error(
        "the unbalanced ratio stays at {ratio:.1e}, above the tolerance {tolerance:.1e}: the rest is rounding, most of \
         it at block {block}{}; use a tolerance of {:.0e}{}",
        stiff(joint.as_ref(), *force, *far), 3.0 * ratio, thicker(joint.as_ref(), ratio / tolerance, *far)
    )]
    OutOfReach {
        /// Unbalanced ratio reached.
        ratio: f64,
        /// Unbalanced ratio wanted.
        tolerance: f64,
        /// Block with the largest rounding force.
        block: usize,
        /// Rounding force `[N]`.
        force: f64,
        /// The stiffest joint of that block, and its thickness `[m]`, 0 if it is springs.
        joint: Option<(String, f64)>,
        /// Distance from the origin `[m]`, where the last digit of a position makes that force.
        far: Option<f64>,
    },
}

/// Implements `Debug` by `Display`: a program whose `main` returns an error shows its `Debug`.
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
