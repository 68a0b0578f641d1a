//! Faults of a deck, and errors of a run.

use std::fmt;

use serde::{Deserialize, Serialize};

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

/// One thing that is wrong with a deck: where, what, and what would be right.
#[derive(Clone, PartialEq)]
#[non_exhaustive]
pub struct Fault {
    /// Path of the key, as in `materials.rock.poisson` or `blocks[0].count`.
    pub place: String,
    /// The value and the rule it breaks.
    pub message: String,
    /// The expected or nearest valid value.
    pub help: Option<String>,
}

impl Fault {
    /// A fault at a place.
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into(), help: None }
    }

    /// Adds a hint.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

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
        Ok(())
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
        "time step {time_step:.6e} s is above the critical one, {critical:.6e} s (2/ω_max): the \
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
        "a time step of {time_step:e} s is less than a billionth of the critical one, \
         {critical:.6e} s"
    )]
    TooShort {
        /// Asked for `[s]`.
        time_step: f64,
        /// Largest stable one `[s]`.
        critical: f64,
    },
    /// The stiffness or the masses are outside what numbers can hold.
    #[error("the critical time step is not a number: density or moduli are out of all proportion")]
    NoCriticalStep,
    /// Relaxation finds no mass for a node: rounding has taken what its joints do not hold.
    #[error(
        "relaxation finds no mass for node {node} of block {block}: the joints there are stiffer than the block by more \
         than numbers can tell, or a stiffness is not a number; thicker or softer joints have masses"
    )]
    NoMass {
        /// Block of the node.
        block: usize,
        /// The node.
        node: usize,
    },
    /// Strengths that change gradually between more joints than can be numbered.
    #[error(
        "the relaxation needs {laws} joint laws, more than 65 534, to change strengths gradually: `increments = 1` \
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
         a state that was saved before goes back"
    )]
    EarlierStage {
        /// The stage, by its number in the deck.
        stage: usize,
        /// The present one.
        present: usize,
    },
    /// A force is not a number any more.
    #[error(
        "diverged at step {step}, time {time:.6e} s: the forces are not finite any more, first on \
         node {node} of block {block}; loads or velocities beyond what the blocks can bear, or a \
         block turned inside out, are the usual causes"
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
        "block {block} of `{set}` went {distance:.3e} m in step {step}, at time {time:.6e} s: more than a \
         quarter of the shortest edge of a block, {edge} m, so that it could pass through another; {}",
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
        "block {} of `{}` and block {} of `{}` are {depth:.3e} m in each other in step {step}, at time \
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
        "not in equilibrium after {max_steps} steps: unbalanced ratio {ratio:.3e}, wanted \
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
        "the unbalanced ratio stays at {ratio:.1e}, wanted {tolerance:.1e}: the rest is rounding, most of it \
         at block {block}{}; a tolerance of {:.0e} can be reached{}",
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

/// Likely cause of a block that moves too fast.
fn too_fast(driven: Option<usize>) -> String {
    driven.map_or_else(
        || {
            "a shorter `time_step` follows such a speed, loads beyond what the blocks can bear are the \
             usual cause of one"
                .to_owned()
        },
        |fix| {
            format!("its support, fix[{fix}], moves it: a smaller `velocity` or a shorter `time_step`")
        },
    )
}

/// Likely cause of an excessive penetration.
fn too_deep(driven: Option<(usize, usize)>, relaxes: bool) -> String {
    match driven {
        Some((fix, block)) => format!(
            "the support fix[{fix}] moves block {block}, whatever is in its way: a smaller `velocity`, \
             or one that ends before, is the usual remedy"
        ),
        None if relaxes => "a contact as soft as this does not carry what is as heavy: a larger \
                            `normal_stiffness` in [contact] does; blocks that nothing holds are for \
                            a dynamic stage"
            .to_owned(),
        None => "a contact as soft as this does not stop what is as fast or as heavy: a larger \
                 `normal_stiffness` in [contact] does"
            .to_owned(),
    }
}

/// Source of forces of the last digits of displacements, or of positions far from the origin.
fn stiff(joint: Option<&(String, f64)>, force: f64, far: Option<f64>) -> String {
    if let Some(far) = far {
        return format!(
            ", {far:.0e} m from the origin, where the last digit of a position is {force:.0e} N in its contacts"
        );
    }
    let what = joint.map_or_else(String::new, |(name, thickness)| match thickness {
        0.0 => format!(" with its springs of joint `{name}`"),
        _ => format!(" with its joint `{name}`, {thickness:e} m thick"),
    });
    format!("{what}, where the last digit of a displacement is {force:.0e} N")
}

/// Change to a joint that would reduce the ratio by a factor of `missing`.
fn thicker(joint: Option<&(String, f64)>, missing: f64, far: Option<f64>) -> String {
    if far.is_some() {
        return ", or a smaller one with the model nearer to the origin".to_owned();
    }
    // No joint is to be that much thicker or softer for its sake.
    let some = joint.filter(|_| missing < 1e4);
    let Some((_, thickness)) = some else { return String::new() };
    match thickness {
        0.0 => format!(", or this one with springs {:.0e} times as soft", 3.0 * missing),
        _ => format!(", or this one with a thickness of {:.0e} m", 3.0 * missing * thickness),
    }
}

/// Fastest block of an unfinished relaxation.
fn moving(fastest: Option<&(usize, String, f64)>) -> String {
    fastest.map_or_else(String::new, |(block, set, distance)| {
        format!("; block {block} of `{set}` moves most, {distance:.1e} m in the last step")
    })
}

/// Blocks named in a message.
const NAMED: usize = 3;

/// Blocks that move.
fn named(moving: &[MovingBlock]) -> String {
    if moving.is_empty() {
        return "no block has moved so far".to_owned();
    }
    let each = moving.iter().take(NAMED).map(
        |MovingBlock { set, block, distance, direction: [x, y, z] }| {
            format!("block {block} of `{set}`, {distance:.2e} m towards ({x:.2}, {y:.2}, {z:.2})")
        },
    );
    let more = if moving.len() > NAMED { ", ..." } else { "" };
    let blocks = if moving.len() == 1 {
        "1 block moves".to_owned()
    } else {
        format!("{} blocks move", moving.len())
    };
    format!("{blocks} on: {}{more}", each.collect::<Vec<_>>().join("; "))
}

/// Failures before an error.
fn after(failed: u64) -> String {
    if failed == 0 { String::new() } else { format!(", after {failed} pairs have failed") }
}

/// Likely cause of a relaxation that takes too long.
fn hint(ratio: f64, failed: u64) -> String {
    match (ratio > 1.0, failed) {
        (true, _) => "; the motion grows: look whether more `increments` change that; a damped dynamic stage \
                      follows what no relaxation does"
            .to_owned(),
        (false, 0) => String::new(),
        (false, failed) => {
            format!("; {failed} pairs have failed, and what they let go may still be on its way")
        }
    }
}
