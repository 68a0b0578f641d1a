//! Checks of histories.

use super::{ErrorCode, Faults, Rule, shown};
use crate::schema::{Duvall, History, Triangle};
/// Checks a factor in time.
pub(super) fn check(at: &str, history: Option<&History>, faults: &mut Faults) {
    match history {
        None => {}
        Some(&History::Ramp(seconds)) => {
            faults.number(format!("{at}.history.ramp"), seconds, Rule::ZeroOrMore);
        }
        Some(&History::Duvall(pulse)) => duvall(&format!("{at}.history.duvall"), pulse, faults),
        Some(&History::Triangle(pulse)) => {
            triangle(&format!("{at}.history.triangle"), pulse, faults);
        }
        Some(History::Table(rows)) => {
            let place = format!("{at}.history.table");
            if rows.is_empty() {
                faults.add(
                    ErrorCode::InvalidHistory,
                    place.as_str(),
                    "`table` has no rows but needs 1 or more",
                );
            }
            let mut finite = true;
            for (i, row) in rows.iter().enumerate() {
                finite &= faults.finite(format!("{place}[{i}]"), row);
            }
            if let Some(i) = rows.windows(2).position(|pair| pair[0][0] >= pair[1][0])
                && finite
            {
                let (before, after) = (rows[i][0], rows[i + 1][0]);
                faults.add(
                    ErrorCode::InvalidHistory,
                    format!("{place}[{}][0]", i + 1),
                    format!(
                        "the times of a `table` must increase: {} comes after {}",
                        shown(after),
                        shown(before)
                    ),
                );
            }
        }
    }
}

fn duvall(at: &str, Duvall { alpha, beta }: Duvall, faults: &mut Faults) {
    let alpha_held = faults.number(format!("{at}.alpha"), alpha, Rule::AboveZero);
    let held = faults.number(format!("{at}.beta"), beta, Rule::AboveZero) && alpha_held;
    // If the rates are equal up to rounding, the peak cannot be computed.
    if held && beta < alpha * (1.0 + 1e-6) {
        faults.add_help(
            ErrorCode::OutOfRange,
            format!("{at}.beta"),
            format!("`beta` is {} but must be above `alpha`, {}", shown(beta), shown(alpha)),
            "it rises with `beta` and fades with `alpha`, in 1/s",
        );
    }
}

fn triangle(at: &str, triangle: Triangle, faults: &mut Faults) {
    let Triangle { rise, fall, duration } = triangle;
    let held = faults.number(format!("{at}.rise"), rise, Rule::ZeroOrMore);
    let help = "a triangle has `rise`, and exactly one of `fall` and `duration`";
    match (fall, duration) {
        (None, None) => faults.add_help(
            ErrorCode::MissingKey,
            at,
            "the triangle has neither `fall` nor `duration`",
            help,
        ),
        (Some(_), Some(_)) => {
            faults.add_help(
                ErrorCode::ConflictingKeys,
                format!("{at}.duration"),
                "`duration` cannot be combined with `fall`",
                help,
            );
        }
        _ => {}
    }
    faults.optional(format!("{at}.fall"), fall, Rule::AboveZero);
    if faults.optional(format!("{at}.duration"), duration, Rule::AboveZero)
        && held
        && duration.is_some_and(|duration| duration <= rise)
    {
        faults.add_help(
            ErrorCode::OutOfRange,
            format!("{at}.duration"),
            format!("`duration` is {} but must be above `rise`", shown(duration.unwrap_or(0.0))),
            "it is that of rise and fall together",
        );
    }
}
