//! Treatment of diagnostics.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Deck;
use crate::lint::{Code, Diagnostic};

/// Diagnostics of a deck and its run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LintTable {
    /// Codes of warnings that are not issued; default none.
    pub allow: Vec<Code>,
}

impl LintTable {
    /// True if no code is given.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.allow.is_empty()
    }
}

impl Deck {
    /// True if a diagnostic is reported: the deck does not allow it.
    #[must_use]
    pub fn reports(&self, diagnostic: &Diagnostic) -> bool {
        !self.lint.allow.contains(&diagnostic.code)
    }
}
