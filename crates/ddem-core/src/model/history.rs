//! Factors in time (§6).

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::{ErrorCode, Fault};

/// Factor in time that a program computes from the time `[s]` since the start of its history. An
/// error states the reason for a missing value. The result must depend on that time alone, because
/// the function is called at every step and whenever forces are evaluated.
pub type Function = dyn Fn(f64) -> Result<f64, String> + Send + Sync;

/// A factor in time, counted from the start of the stage named in `from`, otherwise of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum History {
    /// Rise from 0 to 1 in this time `[s]`, then 1.
    Ramp(f64),
    /// Pairs of time `[s]` and factor, linear between, constant outside.
    Table(Vec<[f64; 2]>),
    /// A blast after Duvall: the difference of two exponentials with a peak of 1.
    Duvall(Duvall),
    /// Rise from 0 to 1 and fall back to 0, along straight lines.
    Triangle(Triangle),
}

/// `ξ (e^(−αt) − e^(−βt))`, with ξ so that the peak is 1; 0 before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Duvall {
    /// Rate α of the fall `[1/s]`.
    pub alpha: f64,
    /// Rate β of the rise, larger than `alpha` `[1/s]`.
    pub beta: f64,
}

/// Triangular pulse of straight lines. Give exactly one of `fall` and `duration`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Triangle {
    /// Time of the rise from 0 to 1 `[s]`.
    pub rise: f64,
    /// Time of the fall from 1 to 0 `[s]`, after the rise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fall: Option<f64>,
    /// Total time of rise and fall `[s]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
}

/// Time function of a load, charge, driven support or boundary.
#[derive(Clone)]
pub enum TimeFunction {
    /// Always 1.
    Constant,
    /// A given history.
    Given(History),
    /// A function that a program computes.
    Computed(Arc<Function>),
}

impl TimeFunction {
    /// Time function of a history; constant without one.
    pub fn new(history: Option<&History>) -> Self {
        history.map_or(Self::Constant, |history| Self::Given(history.clone()))
    }

    /// The factor at a time `[s]` after the history begins.
    pub fn factor(&self, time: f64) -> Result<f64, String> {
        match self {
            Self::Constant => Ok(1.0),
            Self::Given(history) => Ok(history.factor(time)),
            Self::Computed(function) => match function(time)? {
                factor if factor.is_finite() => Ok(factor),
                factor => Err(format!("it gave {factor}, which is not a finite number")),
            },
        }
    }
}

impl TimeFunction {
    /// True if the factor may change after a time `[s]`; false for functions of a program.
    pub(super) fn changes_after(&self, time: f64) -> bool {
        matches!(self, Self::Given(history) if time < history.end())
    }
}

/// Fault of a history of a support that is not driven.
pub fn no_velocity(at: &str) -> Fault {
    Fault::new(ErrorCode::MissingKey, format!("{at}.history"), "`history` needs `velocity`").help(
        "it is the factor on the velocity in time; without a velocity the support stands still",
    )
}

impl fmt::Debug for TimeFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant => f.write_str("Constant"),
            Self::Given(history) => history.fmt(f),
            Self::Computed(_) => f.write_str("Computed"),
        }
    }
}

impl History {
    /// The factor at a time `[s]` after the history begins.
    #[must_use]
    pub fn factor(&self, time: f64) -> f64 {
        match self {
            Self::Ramp(rise) => {
                if time >= *rise {
                    1.0
                } else {
                    (time / rise).max(0.0)
                }
            }
            Self::Duvall(pulse) => pulse.factor(time),
            Self::Triangle(pulse) => pulse.factor(time),
            Self::Table(rows) => {
                let after = rows.partition_point(|row| row[0] <= time);
                match (after.checked_sub(1).map(|i| rows[i]), rows.get(after)) {
                    (Some([t0, f0]), Some(&[t1, f1])) => f0 + (f1 - f0) * (time - t0) / (t1 - t0),
                    (Some([_, f]), None) | (None, Some(&[_, f])) => f,
                    (None, None) => 0.0,
                }
            }
        }
    }
}

impl History {
    /// Time from which the factor is constant `[s]`; for a blast, from which it is within a
    /// thousandth of its peak.
    fn end(&self) -> f64 {
        match self {
            Self::Ramp(rise) => *rise,
            Self::Duvall(pulse) => {
                // Only the slower one of the two exponentials remains.
                let slower = pulse.alpha.min(pulse.beta);
                libm::log(1000.0 / pulse.bare(pulse.peak()).abs()) / slower
            }
            Self::Triangle(pulse) => pulse.rise + pulse.down(),
            Self::Table(rows) => rows.last().map_or(0.0, |row| row[0]),
        }
    }
}

impl Duvall {
    /// Time of the peak `[s]`: `ln(β/α)/(β − α)`.
    #[must_use]
    pub fn peak(&self) -> f64 {
        let Self { alpha, beta } = self;
        libm::log(beta / alpha) / (beta - alpha)
    }

    fn factor(&self, time: f64) -> f64 {
        if time <= 0.0 {
            return 0.0;
        }
        self.bare(time) / self.bare(self.peak())
    }

    /// Pulse before the division by its peak.
    fn bare(&self, time: f64) -> f64 {
        libm::exp(-self.alpha * time) - libm::exp(-self.beta * time)
    }
}

impl Triangle {
    /// Time of the fall from 1 to 0 `[s]`.
    pub fn down(&self) -> f64 {
        let rest = self.duration.map(|duration| duration - self.rise);
        self.fall.or(rest).unwrap_or(0.0)
    }

    fn factor(&self, time: f64) -> f64 {
        let Self { rise, .. } = *self;
        let end = rise + self.down();
        if time <= 0.0 && rise > 0.0 || time < 0.0 || time >= end {
            0.0
        } else if time < rise {
            time / rise
        } else {
            (end - time) / self.down()
        }
    }
}

#[cfg(test)]
mod tests;
