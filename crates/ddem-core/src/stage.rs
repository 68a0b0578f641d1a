//! Stages: kinds, damping, time step, and from when to when something is in force.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    pub(crate) until: Option<usize>,
}

impl Period {
    /// All stages.
    pub(crate) const ALWAYS: Self = Self { from: None, until: None };

    pub(crate) fn has(&self, stage: usize) -> bool {
        self.from.is_none_or(|from| stage >= from) && self.until.is_none_or(|until| stage < until)
    }
}
