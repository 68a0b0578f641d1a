//! Stages: kinds, damping, time step, and ranges of stages.

use serde::{Deserialize, Serialize};

use crate::error::{ErrorCode, Fault, RunError};
use crate::model::rules::{Faults, Rule};

/// Kind of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum StageKind {
    /// Static, by dynamic relaxation (§7).
    #[default]
    Relax,
    /// Motion in time (§6).
    Dynamic,
    /// Static search for the largest factor by which strengths can be divided (§7).
    Safety,
}

/// Damping of a dynamic stage (§6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Damping {
    /// None.
    #[default]
    None,
    /// `c = 2 ζ √(m k)`, eq. (10), ζ given.
    Ratio(f64),
    /// `c = α m`, α given `[1/s]`.
    Mass(f64),
    /// `C = β K` with the stiffness K of the blocks, β given `[s]`: a vibration of a block at f Hz
    /// has the ratio `π f β`. Rigid motion of blocks is not damped.
    Stiffness(f64),
    /// Cundall's local damping, `F_d = −α |F| sign v`, α in [0, 1).
    Local(f64),
}

impl Damping {
    /// Longest stable step `[s]`, where `critical` is that without damping (§6).
    ///
    /// Local damping adds to a force that slows a node down. In the fastest mode every force does
    /// so: the mode is 1 + α times as stiff, and the step is multiplied by `1/√(1 + α)`. Stiffness
    /// damping uses velocities half a step old: the step is multiplied by `√(1 + ξ²) − ξ` with
    /// `ξ = β/Δt_c`. The other kinds are part of the scheme and do not change the step.
    #[must_use]
    pub fn stable_step(self, critical: f64) -> f64 {
        match self {
            Self::Local(alpha) => critical / (1.0 + alpha).sqrt(),
            // √(1 + ξ²) − ξ, written without a difference of large numbers.
            Self::Stiffness(beta) => {
                let xi = beta / critical;
                critical / ((1.0 + xi * xi).sqrt() + xi)
            }
            Self::None | Self::Ratio(_) | Self::Mass(_) => critical,
        }
    }

    /// Adds a fault if the number is invalid, with a place below `at`.
    pub fn check(self, at: &str, faults: &mut Faults) {
        let (key, number, rule) = match self {
            Self::None => return,
            Self::Ratio(ratio) => ("ratio", ratio, Rule::ZeroOrMore),
            Self::Mass(alpha) => ("mass", alpha, Rule::ZeroOrMore),
            Self::Stiffness(beta) => ("stiffness", beta, Rule::ZeroOrMore),
            Self::Local(alpha) => ("local", alpha, Rule::From(0.0, 1.0)),
        };
        faults.number(format!("{at}.{key}"), number, rule);
    }

    /// β of stiffness damping `[s]`; 0 without it.
    pub(crate) fn stiffness(self) -> f64 {
        if let Self::Stiffness(beta) = self { beta } else { 0.0 }
    }
}

/// Time step of a dynamic stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum TimeStep {
    /// 0.9 of the critical step, or a quarter of that if rigid blocks may meet, shrunk so that the
    /// stage ends on time. From the first failure on it is 0.8 of the critical step with failed
    /// joints. If joints can fail and blocks already move, this holds from the start.
    #[default]
    Auto,
    /// Taken as given `[s]`.
    #[serde(untagged)]
    Seconds(f64),
}

/// Search for a factor of safety.
#[derive(Clone, Debug, PartialEq)]
pub struct SafetySearch {
    /// Lowest and highest factor of the search.
    pub bracket: [f64; 2],
    /// Largest width of the final bracket.
    pub resolution: f64,
    /// Names of the joints whose strengths are divided; `None` for all joints and the friction of
    /// contacts.
    pub joints: Option<Vec<String>>,
    /// Relative motion of neighbours that counts as failure if it continues, as a fraction of an
    /// edge.
    pub limit: f64,
    /// Unbalanced force ratio at which a trial is at rest.
    pub tolerance: f64,
    /// Steps after which a trial is undecided.
    pub max_steps: u64,
}

impl Default for SafetySearch {
    fn default() -> Self {
        Self {
            bracket: [0.5, 4.0],
            resolution: 0.005,
            joints: None,
            limit: Self::LIMIT,
            tolerance: 1e-5,
            max_steps: 200_000,
        }
    }
}

impl SafetySearch {
    /// Default of `limit`, which applies to relax and dynamic stages, too: motion, as a fraction of
    /// an edge, beyond that of blocks that settle.
    pub const LIMIT: f64 = 0.02;

    /// Faults of the search, by key. `can_fail` tells if a joint can fail; it returns `None` for an
    /// unknown name.
    pub fn check(&self, can_fail: &dyn Fn(&str) -> Option<bool>) -> Vec<Fault> {
        let mut faults = Faults::default();
        faults.number("resolution", self.resolution, Rule::AboveZero);
        faults.number("limit", self.limit, Rule::AboveZero);
        faults.number("tolerance", self.tolerance, Rule::Between(0.0, 1.0));
        faults.not_zero("max_steps", self.max_steps);
        let [low, high] = self.bracket;
        if !(low > 0.0 && low < high && high.is_finite()) {
            let message =
                format!("`bracket` is [{low}, {high}]: two factors above 0, the smaller one first");
            faults.add(ErrorCode::OutOfRange, "bracket", message);
        }
        if self.joints.as_ref().is_some_and(Vec::is_empty) {
            let message = "`joints` is empty: no strength would be divided";
            faults.add_help(
                ErrorCode::MissingKey,
                "joints",
                message,
                "without it those of all joints are",
            );
        }
        for name in self.joints.iter().flatten() {
            match can_fail(name) {
                None => faults.add(
                    ErrorCode::UnknownName,
                    "joints",
                    format!("there is no joint named `{name}`"),
                ),
                Some(false) => faults.add(
                    ErrorCode::NotSupported,
                    "joints",
                    format!("joint `{name}` never fails"),
                ),
                Some(true) => {}
            }
        }
        faults.0
    }

    /// True if the strengths of a joint are divided.
    pub(crate) fn divides(&self, name: &String) -> bool {
        self.joints.as_ref().is_none_or(|joints| joints.contains(name))
    }
}

/// Refuses a tolerance of forces that is not between 0 and 1.
pub(crate) fn allow_tolerance(tolerance: f64) -> Result<(), RunError> {
    // Called at every step, so a valid value returns at once.
    if tolerance > 0.0 && tolerance < 1.0 {
        return Ok(());
    }
    let mut faults = Faults::default();
    faults.number("tolerance", tolerance, Rule::Between(0.0, 1.0));
    faults.none()
}

/// Refuses an invalid damping, time step or duration.
pub(crate) fn allow_motion(
    damping: Damping,
    time_step: TimeStep,
    duration: Option<f64>,
) -> Result<(), RunError> {
    let mut faults = Faults::default();
    faults.optional("duration", duration, Rule::AboveZero);
    if let TimeStep::Seconds(seconds) = time_step {
        faults.number("time_step", seconds, Rule::AboveZero);
    }
    damping.check("damping", &mut faults);
    faults.none()
}

/// Range of stages, from the start of one up to the start of another.
#[derive(Clone, Debug)]
pub struct StageRange {
    /// The first stage; `None` for the start of the run.
    pub from: Option<usize>,
    /// The stage at whose start the range ends; `None` if it does not end.
    pub until: Option<usize>,
}

impl StageRange {
    /// All stages.
    pub const ALWAYS: Self = Self { from: None, until: None };

    /// True if the range contains a stage.
    #[must_use]
    pub fn has(&self, stage: usize) -> bool {
        self.from.is_none_or(|from| stage >= from) && self.until.is_none_or(|until| stage < until)
    }
}
