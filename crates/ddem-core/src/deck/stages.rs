//! What is done, in order.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One stage. Keys of the other kind of stage are errors.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name, for `from` and `until`.
    pub name: String,
    /// Static, dynamic, or a search for the factor of safety.
    pub kind: StageKind,
    /// safety: factors between which it is looked for; default `[0.5, 4.0]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bracket: Option<[f64; 2]>,
    /// safety: width of the bracket that is left; default 0.005.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<f64>,
    /// safety: joints whose strengths are divided; default all, and the friction of contacts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<String>>,
    /// safety: motion of neighbours that counts as failure where it goes on, as a part of an edge; default
    /// 0.02.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// relax, safety: unbalanced force ratio at which the stage is done; default 1e-5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// relax, safety: steps after which the stage, or a trial, is undecided; default 200 000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_steps: Option<u64>,
    /// relax: equal parts in which loads reach their value; default 1, and 10 where supports are driven by a
    /// `displacement`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub increments: Option<u32>,
    /// Way on after a stage that fails or stays undecided; default `"stop"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_failure: Option<OnFailure>,
    /// dynamic: simulated time `[s]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// dynamic: damping; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Damping>,
    /// dynamic: `"auto"`, or seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_step: Option<TimeStep>,
    /// dynamic: whether the stage ends as soon as blocks are at rest or fail; default false.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_rest: Option<bool>,
    /// dynamic: simulated time between frames `[s]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fields_every: Option<f64>,
    /// dynamic: frames in the stage, instead of `fields_every`; default 20.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<u64>,
}

/// Kind of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StageKind {
    /// Static, by dynamic relaxation (§7).
    #[default]
    Relax,
    /// In time (§6).
    Dynamic,
    /// Static, with strengths divided by factors: how large one the blocks bear (§7).
    Safety,
}

impl Stage {
    /// The search of a stage for the factor of safety.
    #[must_use]
    pub fn search(&self) -> Search {
        let standard = Search::default();
        Search {
            bracket: self.bracket.unwrap_or(standard.bracket),
            resolution: self.resolution.unwrap_or(standard.resolution),
            joints: self.joints.clone(),
            limit: self.limit.unwrap_or(standard.limit),
            tolerance: self.tolerance.unwrap_or(standard.tolerance),
            max_steps: self.max_steps.unwrap_or(standard.max_steps),
        }
    }
}

/// Search for a factor of safety.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// Factors between which it is looked for.
    pub bracket: [f64; 2],
    /// Largest width of the bracket that is left.
    pub resolution: f64,
    /// Names of the joints whose strengths are divided; `None`: all, and the friction of contacts.
    pub joints: Option<Vec<String>>,
    /// Motion of neighbours that counts as failure where it goes on, as a part of an edge.
    pub limit: f64,
    /// Unbalanced force ratio at which a trial is at rest.
    pub tolerance: f64,
    /// Steps after which a trial is undecided.
    pub max_steps: u64,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            bracket: [0.5, 4.0],
            resolution: 0.005,
            joints: None,
            limit: 0.02,
            tolerance: 1e-5,
            max_steps: 200_000,
        }
    }
}

/// Way on after a stage that fails.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OnFailure {
    /// It ends.
    #[default]
    Stop,
    /// The next stage starts from there.
    Continue,
}

/// Damping of a dynamic stage (§6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Damping {
    /// None.
    #[default]
    None,
    /// `c = 2 ζ √(m k)`, eq. (10), ζ given.
    Ratio(f64),
    /// `c = α m`, α given `[1/s]`.
    Mass(f64),
    /// `C = β K` with the stiffness K of the blocks, β given `[s]`: a vibration of a block at f Hz has
    /// the ratio `π f β`. Motions of whole blocks are left alone.
    Stiffness(f64),
    /// Cundall's local damping, `F_d = −α |F| sign v`, α in [0, 1).
    Local(f64),
}

impl Damping {
    /// The longest stable step where `critical` is that without damping `[s]` (§6). Local damping adds
    /// to a force that slows a node down, as in the fastest mode every force does: that mode is
    /// 1 + α times as stiff, `1/√(1 + α)`. That of the stiffness works with velocities half a step old:
    /// `√(1 + ξ²) − ξ` with `ξ = β/Δt_c`. The others are part of the scheme.
    #[must_use]
    pub fn stable_step(self, critical: f64) -> f64 {
        match self {
            Self::Local(alpha) => critical / (1.0 + alpha).sqrt(),
            // √(1 + ξ²) − ξ without the difference of large numbers.
            Self::Stiffness(beta) => {
                let xi = beta / critical;
                critical / ((1.0 + xi * xi).sqrt() + xi)
            }
            Self::None | Self::Ratio(_) | Self::Mass(_) => critical,
        }
    }

    /// β of damping by the stiffness of the blocks `[s]`; 0: none.
    pub(crate) fn stiffness(self) -> f64 {
        if let Self::Stiffness(beta) = self { beta } else { 0.0 }
    }
}

/// Time step of a dynamic stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TimeStep {
    /// 0.9 of the critical step, a quarter of that where rigid blocks may meet, shrunk so that the stage
    /// ends on time; 0.8 of the one with failed joints from the first failure on, or from the start where blocks
    /// already move and joints can fail.
    #[default]
    Auto,
    /// Taken as given `[s]`.
    Seconds(f64),
}

/// From the start of one stage up to the start of another.
#[derive(Clone, Debug)]
pub(crate) struct Period {
    pub(crate) from: Option<usize>,
    until: Option<usize>,
}

impl Period {
    pub(crate) fn new(deck: &super::Deck, from: Option<&String>, until: Option<&String>) -> Self {
        let stage = |name: &String| deck.stage.iter().position(|s| s.name == *name);
        Self { from: from.and_then(stage), until: until.and_then(stage) }
    }

    pub(crate) fn has(&self, stage: usize) -> bool {
        self.from.is_none_or(|from| stage >= from) && self.until.is_none_or(|until| stage < until)
    }
}
