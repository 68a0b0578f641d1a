//! Results of a run.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Results of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputTable {
    /// Wall time between checkpoints within a stage, which does not change the results, 0 or more
    /// `[s]`; default 60.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = OutputTable::CHECKPOINT_EVERY))]
    pub checkpoint_every: Option<f64>,
}

impl OutputTable {
    /// Default wall time between checkpoints within a stage `[s]`.
    pub const CHECKPOINT_EVERY: f64 = 60.0;

    /// True if no key is given.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Wall time between checkpoints within a stage.
    #[must_use]
    pub fn checkpoint_interval(&self) -> Duration {
        let seconds = self.checkpoint_every.unwrap_or(Self::CHECKPOINT_EVERY);
        // More than the age of the universe is never.
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }
}
