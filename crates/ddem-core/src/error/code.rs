//! Stable codes of diagnostics.

use std::fmt;

use super::{Fault, ModelError, RunError};

/// Declares an enum of codes with their meanings, in alphabetical order.
#[doc(hidden)]
#[macro_export]
macro_rules! codes {
    ($(#[$attribute:meta])* $name:ident: $($rule:ident $code:literal $meaning:literal)*) => {
        $(#[$attribute])*
        pub enum $name {
            $(#[doc = $meaning] $rule,)*
        }

        impl $name {
            /// All codes, in alphabetical order.
            pub const ALL: &'static [Self] = &[$(Self::$rule),*];

            /// The code in lower case with hyphens.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$rule => $code,)*
                }
            }

            /// Condition under which the diagnostic is issued.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(Self::$rule => $meaning,)*
                }
            }
        }
    };
}

codes! {
    /// Code of an error.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    ErrorCode:
    BlockTooFast "block-too-fast" "A block moves so far in one step that contacts could be missed."
    Busy "busy" "Another thread, or a call that runs a function of the program, uses the simulation or model."
    CheckpointMismatch "checkpoint-mismatch" "A checkpoint or a saved state belongs to another deck, model or version."
    ConflictingKeys "conflicting-keys" "Keys exclude or contradict each other."
    DeepPenetration "deep-penetration" "Blocks penetrate each other by more than a quarter of their shortest edge."
    Diverged "diverged" "Forces are no longer finite."
    EarlierStage "earlier-stage" "A stage before the present one is entered."
    EmptyModel "empty-model" "The model has no materials, no blocks or no stages."
    EmptySelection "empty-selection" "`where` selects nothing."
    FileAccess "file-access" "A file of results cannot be read or written."
    HistoryFailed "history-failed" "A history that a program computes has no value."
    IneffectiveKey "ineffective-key" "A key has no effect on its entry."
    InternalError "internal-error" "The program itself has a fault."
    InvalidArgument "invalid-argument" "An argument that a program gives is wrong."
    InvalidBoundary "invalid-boundary" "The dashpots of a boundary could not act on its faces."
    InvalidFile "invalid-file" "A file has another format or content than expected, or a file of the deck cannot be read."
    InvalidGeometry "invalid-geometry" "Cuts, axes, planes or surfaces bound no volume."
    InvalidHistory "invalid-history" "A history has no rows, or its times do not increase."
    InvalidLaw "invalid-law" "A joint law of a program breaks a rule of joint laws."
    InvalidMesh "invalid-mesh" "A mesh of nodes and hexahedra is inconsistent."
    InvalidName "invalid-name" "A name is empty, or two entries of one kind share it."
    Mechanism "mechanism" "Blocks can move freely in a relax stage."
    MissingKey "missing-key" "A required key is missing."
    MissingProgram "missing-program" "A program that a command needs, such as Python, is missing or does not start."
    NeverInForce "never-in-force" "An entry is in force in no stage."
    NoCriticalStep "no-critical-step" "The critical time step is not a number."
    NoEquilibrium "no-equilibrium" "Blocks part or slide without end in a relaxation."
    NoRelaxationMass "no-relaxation-mass" "Rounding leaves a node without mass in a relaxation."
    NotConverged "not-converged" "A relaxation reached its largest number of steps."
    NotSupported "not-supported" "The method does not apply to this combination."
    OutOfMemory "out-of-memory" "The model does not fit in memory."
    OutOfRange "out-of-range" "A number is outside its valid range."
    OverlappingBlocks "overlapping-blocks" "Blocks of two sets overlap."
    ResultsFolder "results-folder" "The folder of the results cannot be used."
    Stopped "stopped" "A program stopped the run."
    Syntax "syntax" "The text is not TOML."
    ThickJoint "thick-joint" "The thickness of a joint does not suit its blocks."
    Threads "threads" "The threads cannot be started."
    TooLarge "too-large" "There are more blocks, joints, laws or steps than can be numbered."
    UnknownCommand "unknown-command" "A command of the command line does not exist."
    UnknownKey "unknown-key" "A key does not exist here."
    UnknownName "unknown-name" "A name refers to nothing."
    UnreachableTolerance "unreachable-tolerance" "Rounding keeps a relaxation above its tolerance."
    UnstableTimeStep "unstable-time-step" "A given time step is above the critical one, or out of proportion."
    WrongType "wrong-type" "A value has another type or form than its key."
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl ErrorCode {
    /// Text of an error without this code at its end, to which a program can add advice.
    #[must_use]
    pub fn strip(self, text: &str) -> &str {
        let mark = format!(" [{self}]");
        text.strip_suffix(mark.as_str()).unwrap_or(text)
    }
}

impl RunError {
    /// Code of the error; for [`Values`](Self::Values) the code of the first fault.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::UnstableTimeStep { .. } | Self::TooShort { .. } => ErrorCode::UnstableTimeStep,
            Self::NoCriticalStep => ErrorCode::NoCriticalStep,
            Self::NoRelaxationMass { .. } => ErrorCode::NoRelaxationMass,
            Self::TooManyLaws { .. } => ErrorCode::TooLarge,
            Self::Values { faults } => code_of(faults),
            Self::Stopped => ErrorCode::Stopped,
            Self::HistoryFailed { .. } => ErrorCode::HistoryFailed,
            Self::EarlierStage { .. } => ErrorCode::EarlierStage,
            Self::Diverged { .. } => ErrorCode::Diverged,
            Self::BlockTooFast { .. } => ErrorCode::BlockTooFast,
            Self::DeepPenetration { .. } => ErrorCode::DeepPenetration,
            Self::NoEquilibrium { .. } => ErrorCode::NoEquilibrium,
            Self::NotConverged { .. } => ErrorCode::NotConverged,
            Self::UnreachableTolerance { .. } => ErrorCode::UnreachableTolerance,
        }
    }
}

impl ModelError {
    /// Code of the first fault.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        code_of(&self.faults)
    }
}

/// Code of the first of several faults.
fn code_of(faults: &[Fault]) -> ErrorCode {
    faults.first().map_or(ErrorCode::InvalidArgument, |fault| fault.code)
}
