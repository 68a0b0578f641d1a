//! Wall time of a stage by phase.

use std::fmt;

use ddem_core::Profile;
use serde::{Deserialize, Serialize};

/// Wall times of a stage `[s]`; of a stage that was resumed, since then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageProfile {
    /// Phases of the steps. `start_up` includes building the model in the first stage.
    #[serde(flatten)]
    pub steps: Profile,
    /// Results: fields, probes, energies, files and checkpoints.
    pub output: f64,
    /// Remaining time.
    pub other: f64,
}

impl StageProfile {
    /// Sum of all phases `[s]`.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.steps.total() + self.output + self.other
    }

    /// Names of the phases with their times `[s]`.
    fn rows(&self) -> [(&'static str, f64); 8] {
        let Profile { blocks, joints, contacts, nodes, relaxation, start_up } = self.steps;
        [
            ("blocks", blocks),
            ("joints", joints),
            ("contacts", contacts),
            ("nodes", nodes),
            ("relaxation", relaxation),
            ("output", self.output),
            ("start-up", start_up),
            ("other", self.other),
        ]
    }
}

/// Table with a line for each phase: seconds and share.
impl fmt::Display for StageProfile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let total = self.total();
        for (name, seconds) in self.rows() {
            let share = if total > 0.0 { 100.0 * seconds / total } else { 0.0 };
            writeln!(f, "{name:<12}{seconds:>10.3} s{share:>6.1} %")?;
        }
        write!(f, "{:<12}{total:>10.3} s", "all")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_refer_to_the_whole_stage() {
        let steps = Profile { blocks: 1.5, nodes: 0.5, ..Profile::default() };
        let profile = StageProfile { steps, output: 1.0, other: 1.0 };
        let table = profile.to_string();
        for line in [
            "blocks           1.500 s  37.5 %",
            "output           1.000 s  25.0 %",
            "start-up         0.000 s   0.0 %",
            "all              4.000 s",
        ] {
            assert!(table.lines().any(|found| found == line), "{table}");
        }
        assert!(StageProfile::default().to_string().contains("  0.0 %"));
    }
}
