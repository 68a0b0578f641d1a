//! What can be wrong with a deck.

use std::fmt;

/// One thing that is wrong with a deck: where, what, and what would be right.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Fault {
    /// Path of the key, as in `materials.rock.poisson` or `blocks[0].count`.
    pub place: String,
    /// What is wrong: the value and the rule it breaks.
    pub message: String,
    /// What was expected, or the nearest valid thing.
    pub help: Option<String>,
}

impl Fault {
    /// A fault at a place.
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into(), help: None }
    }

    /// The same fault with a hint.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)?;
        if let Some(help) = &self.help {
            write!(f, " ({help})")?;
        }
        Ok(())
    }
}

/// A deck that cannot become a model: every fault that was found, at least one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", .faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ModelError {
    /// What is wrong, in the order of the deck.
    pub faults: Vec<Fault>,
}

impl From<Fault> for ModelError {
    fn from(fault: Fault) -> Self {
        Self { faults: vec![fault] }
    }
}
