//! Stages.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use ddem_core::Simulation;
use ddem_core::problem::StageRange;

use super::{Damping, Deck, SafetySearch, StageKind, TimeStep, forms};

/// Number of frames of a dynamic stage.
const FRAMES: u64 = 20;

/// One stage. Keys of other kinds of stages are errors.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name, for `from`, `until` and the results.
    pub name: String,
    /// Kind: `"relax"` (static), `"dynamic"` (in time), or `"safety"` (factor of safety of the
    /// present state).
    pub kind: StageKind,
    /// safety: smallest and largest factor of the search; default `[0.5, 4.0]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = SafetySearch::default().bracket))]
    pub bracket: Option<[f64; 2]>,
    /// safety: width of the final bracket; default 0.005.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = SafetySearch::default().resolution))]
    pub resolution: Option<f64>,
    /// safety: names of the joints whose strengths are divided; default all, and the friction of
    /// contacts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<String>>,
    /// safety: continuing motion between neighbours that counts as failure, relative to an edge;
    /// default 0.02.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = SafetySearch::default().limit))]
    pub limit: Option<f64>,
    /// relax, safety: unbalanced force ratio at which the stage, or a trial, is done, in (0, 1);
    /// default 1e-5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = SafetySearch::default().tolerance))]
    pub tolerance: Option<f64>,
    /// relax, safety: number of steps after which the stage, or a trial, is undecided;
    /// default 200 000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = SafetySearch::default().max_steps))]
    pub max_steps: Option<u64>,
    /// relax: number of equal parts in which loads and other changes are applied; default 1, 10
    /// with supports driven by a `displacement`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = Simulation::INCREMENTS))]
    pub increments: Option<u32>,
    /// relax, dynamic: behaviour if the stage fails or stays undecided, `"stop"` or `"continue"`;
    /// default `"stop"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = OnFailure::default()))]
    pub on_failure: Option<OnFailure>,
    /// dynamic: simulated time, with `until_rest` the longest `[s]`; needed in dynamic stages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// dynamic: `"none"`, or one of `ratio`, `mass`, `stiffness` and `local`, as in
    /// `{ ratio = 0.05 }`; default `"none"`.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "forms::damping")]
    #[schemars(extend("default" = Damping::default()))]
    pub damping: Option<Damping>,
    /// dynamic: `"auto"`, a part of the critical step, or a number `[s]`; default `"auto"`.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "forms::time_step"
    )]
    #[schemars(extend("default" = TimeStep::default()))]
    pub time_step: Option<TimeStep>,
    /// dynamic: end as soon as blocks are at rest, or fail (move without slowing down); default
    /// `false`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = bool::default()))]
    pub until_rest: Option<bool>,
    /// dynamic: time between frames, instead of `frames` `[s]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fields_every: Option<f64>,
    /// dynamic: number of frames; default 20.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = FRAMES))]
    pub frames: Option<u64>,
}

impl Stage {
    /// Settings of the search for the factor of safety.
    #[must_use]
    pub fn search(&self) -> SafetySearch {
        let standard = SafetySearch::default();
        SafetySearch {
            bracket: self.bracket.unwrap_or(standard.bracket),
            resolution: self.resolution.unwrap_or(standard.resolution),
            joints: self.joints.clone(),
            limit: self.limit.unwrap_or(standard.limit),
            tolerance: self.tolerance(),
            max_steps: self.max_steps(),
        }
    }

    /// Unbalanced force ratio at which the stage, or a trial, is done: `tolerance` or its default.
    #[must_use]
    pub fn tolerance(&self) -> f64 {
        self.tolerance.unwrap_or(SafetySearch::default().tolerance)
    }

    /// Steps after which the stage, or a trial, is undecided: `max_steps` or its default.
    #[must_use]
    pub fn max_steps(&self) -> u64 {
        self.max_steps.unwrap_or(SafetySearch::default().max_steps)
    }

    /// Number of frames of a dynamic stage without `fields_every`: `frames` or its default.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames.unwrap_or(FRAMES)
    }
}

/// Behaviour after a failed stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OnFailure {
    /// The run stops.
    #[default]
    Stop,
    /// The next stage starts from the present state.
    Continue,
}

impl Deck {
    /// Number of the stage with a name.
    pub(crate) fn stage_number(&self, name: &str) -> Option<usize> {
        self.stage.iter().position(|stage| stage.name == name)
    }

    /// Range of stages from the start of one to the start of another, by their names.
    pub(crate) fn stage_range(&self, from: Option<&String>, until: Option<&String>) -> StageRange {
        let number = |name: &String| self.stage_number(name);
        StageRange { from: from.and_then(number), until: until.and_then(number) }
    }
}
