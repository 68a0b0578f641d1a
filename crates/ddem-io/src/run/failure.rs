//! Reasons for an early end of a run.

use std::path::PathBuf;

use ddem_core::{ErrorCode, ModelError, RunError};

use crate::folder::FolderError;
use ddem_deck::DeckError;

use crate::OutputError;

/// Reason why a run did not start or did not reach its end. A message includes its cause, which `source()` does not
/// repeat, and ends with the code.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum RunFailure {
    /// The deck is wrong.
    #[error(transparent)]
    Deck(#[from] DeckError),
    /// The model that a program describes is wrong.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The results folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The model does not fit in memory.
    #[error(
        "the model needs about {} of memory, and {} is available ({nodes} nodes in {blocks} \
         blocks): use fewer blocks or divisions [{}]",
        super::report::bytes(*needed), super::report::bytes(*available),
        ErrorCode::OutOfMemory
    )]
    Memory {
        /// Bytes that the run would need.
        needed: u64,
        /// Bytes that are free.
        available: u64,
        /// Blocks of the model.
        blocks: u64,
        /// Nodes of the model.
        nodes: u64,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {error} [{}]", ErrorCode::Threads)]
    Threads {
        /// Requested number of threads.
        threads: usize,
        /// Cause.
        error: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The observer stopped the run before anything was written.
    #[error("stopped before the first step [{}]", ErrorCode::Stopped)]
    Stopped,
    /// A stage could not continue. The files written so far are intact.
    #[error("stage `{stage}`: {error}")]
    Stage {
        /// Name of the stage.
        stage: String,
        /// Error of the simulation.
        error: RunError,
    },
    /// A result file could not be written. The files written before are intact.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Another simulation has written results to a folder since this one did.
    #[error(
        "another simulation has recorded in {} since this one did: record in another folder [{}]",
        folder.display(),
        ErrorCode::ResultsFolder
    )]
    Recorded {
        /// The folder.
        folder: PathBuf,
    },
    /// The checkpoint is damaged, or not one of this deck.
    #[error(
        "`{}` cannot be resumed: {message} [{}]",
        path.display(), code
    )]
    Checkpoint {
        /// The checkpoint.
        path: PathBuf,
        /// Description of the fault.
        message: String,
        /// Code of the fault.
        code: ErrorCode,
    },
    /// The program itself has a fault.
    #[error("internal error, please report it: {message} [{}]", ErrorCode::InternalError)]
    Internal {
        /// Message of the panic.
        message: String,
    },
}

ddem_core::debug_as_display!(RunFailure);

impl RunFailure {
    /// True if the run ended on request.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        matches!(self, Self::Stopped | Self::Stage { error: RunError::Stopped, .. })
    }

    /// Code of the error.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Deck(error) => error.code(),
            Self::Model(error) => error.code(),
            Self::Stage { error, .. } => error.code(),
            Self::Folder(error) => error.code(),
            Self::Recorded { .. } => ErrorCode::ResultsFolder,
            Self::Memory { .. } => ErrorCode::OutOfMemory,
            Self::Threads { .. } => ErrorCode::Threads,
            Self::Stopped => ErrorCode::Stopped,
            Self::Output(error) => error.code(),
            Self::Checkpoint { code, .. } => *code,
            Self::Internal { .. } => ErrorCode::InternalError,
        }
    }

    /// Exit status of a command that ends with this failure: 2 if nothing has run, 1 if the run
    /// failed.
    #[must_use]
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Deck(_)
            | Self::Stopped
            | Self::Model(_)
            | Self::Folder(_)
            | Self::Memory { .. }
            | Self::Threads { .. }
            | Self::Checkpoint { .. }
            | Self::Recorded { .. } => 2,
            Self::Stage { .. } | Self::Output(_) | Self::Internal { .. } => 1,
        }
    }
}
