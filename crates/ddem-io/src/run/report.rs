//! What `--check` says of a model.

use std::fmt;

/// Size of a model and what running it will take.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Title of the deck.
    pub title: String,
    /// Blocks.
    pub blocks: u64,
    /// Nodes.
    pub nodes: u64,
    /// Hex8 elements of the blocks.
    pub elements: u64,
    /// Joint faces between two blocks.
    pub joints: u64,
    /// Pairs of facing nodes.
    pub pairs: u64,
    /// Critical time step `[s]`.
    pub critical_step: f64,
    /// Memory that a run needs `[bytes]`.
    pub bytes: u64,
    /// For each stage: its name, steps (the most, in relaxation), time step `[s]` and an estimate
    /// of its wall time `[s]`.
    pub stages: Vec<(String, u64, f64, f64)>,
    /// What is allowed but perhaps not meant.
    pub warnings: Vec<String>,
}

/// A number of bytes for people.
pub(crate) fn bytes(n: u64) -> String {
    let (mut value, mut unit) = (n as f64, "B");
    for next in ["kB", "MB", "GB", "TB", "PB", "EB"] {
        if value < 1000.0 {
            break;
        }
        (value, unit) = (value / 1000.0, next);
    }
    if unit == "B" { format!("{n} B") } else { format!("{value:.1} {unit}") }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.title.is_empty() {
            writeln!(f, "{}", self.title)?;
        }
        writeln!(f, "blocks         {}", self.blocks)?;
        writeln!(f, "nodes          {}", self.nodes)?;
        writeln!(f, "elements       {}", self.elements)?;
        writeln!(f, "joints         {}", self.joints)?;
        writeln!(f, "pairs          {}", self.pairs)?;
        writeln!(f, "critical step  {:.6e} s", self.critical_step)?;
        writeln!(f, "memory         {}", bytes(self.bytes))?;
        for (name, steps, time_step, seconds) in &self.stages {
            let step = if *time_step > 0.0 { format!(" of {time_step:.4e} s") } else { String::new() };
            let most = if *time_step > 0.0 { "" } else { "at most " };
            writeln!(f, "stage {name}: {most}{steps} steps{step}, {most}about {seconds:.0} s")?;
        }
        Ok(())
    }
}
