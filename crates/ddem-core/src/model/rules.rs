//! Rules for numbers, and faults of numbers that break them.

use std::fmt::Display;

use crate::error::{ErrorCode, Fault, RunError};

/// Largest size of any number. No quantity of rock mechanics comes near it in SI units, and products
/// of a few such numbers do not overflow.
const LARGEST: f64 = 1e30;

/// Rule for a number, whose size must also be at most 1e30.
#[derive(Clone, Copy, Debug)]
pub enum Rule {
    /// Any number.
    Any,
    /// Above 0.
    AboveZero,
    /// 0 or more.
    ZeroOrMore,
    /// In (from, to).
    Between(f64, f64),
    /// In [from, to).
    From(f64, f64),
    /// In [from, to].
    Within(f64, f64),
}

impl Rule {
    fn broken(self, value: f64) -> Option<String> {
        let (held, rule) = match self {
            Rule::Any => (true, String::new()),
            Rule::AboveZero => (value > 0.0, "above 0".to_owned()),
            Rule::ZeroOrMore => (value >= 0.0, "0 or more".to_owned()),
            Rule::Between(from, to) => {
                (value > from && value < to, format!("above {from} and below {to}"))
            }
            Rule::From(from, to) => {
                (value >= from && value < to, format!("{from} or more and below {to}"))
            }
            Rule::Within(from, to) => {
                (value >= from && value <= to, format!("from {from} to {to}"))
            }
        };
        (!held).then_some(rule)
    }
}

/// The faults found so far.
#[derive(Debug, Default)]
pub struct Faults(pub Vec<Fault>);

impl Faults {
    /// Returns an error if there are faults.
    pub fn none(self) -> Result<(), RunError> {
        if self.0.is_empty() { Ok(()) } else { Err(RunError::Values { faults: self.0 }) }
    }

    /// Adds a fault without help.
    pub fn add(&mut self, code: ErrorCode, place: impl Into<String>, message: impl Into<String>) {
        self.0.push(Fault::new(code, place, message));
    }

    /// Adds a fault with help.
    pub fn add_help(
        &mut self,
        code: ErrorCode,
        place: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.0.push(Fault::new(code, place, message).help(help));
    }

    /// Adds a fault if a number breaks a rule; returns true if it keeps the rule.
    pub fn number(&mut self, place: impl Into<String>, value: f64, rule: Rule) -> bool {
        let place = place.into();
        let key = key_of(&place);
        if !value.is_finite() {
            let message = format!("`{key}` is {} but must be a finite number", shown(value));
            self.add(ErrorCode::OutOfRange, place, message);
            return false;
        }
        let size = match value.is_sign_negative() {
            _ if value.abs() <= LARGEST => None,
            true => Some(format!("at least {:e}", -LARGEST)),
            false => Some(format!("at most {LARGEST:e}")),
        };
        let Some(rule) = rule.broken(value).or(size) else { return true };
        let message = format!("`{key}` is {} but must be {rule}", shown(value));
        self.add(ErrorCode::OutOfRange, place, message);
        false
    }

    /// Checks a number that may be absent.
    pub fn optional(&mut self, place: impl Into<String>, value: Option<f64>, rule: Rule) -> bool {
        value.is_none_or(|value| self.number(place, value, rule))
    }

    /// Checks that all numbers of a list keep a rule.
    pub fn numbers(&mut self, place: impl Display, values: &[f64], rule: Rule) -> bool {
        let mut held = true;
        for (i, &value) in values.iter().enumerate() {
            held &= self.number(format!("{place}[{i}]"), value, rule);
        }
        held
    }

    /// Checks that all numbers of a list are finite and not too large.
    pub fn finite(&mut self, place: impl Display, values: &[f64]) -> bool {
        self.numbers(place, values, Rule::Any)
    }

    /// Checks that a whole number is not 0.
    pub fn not_zero(&mut self, place: impl Into<String>, value: impl Into<u64>) -> bool {
        let place = place.into();
        let held = value.into() > 0;
        if !held {
            let message = format!("`{}` is 0 but must be 1 or more", key_of(&place));
            self.add(ErrorCode::OutOfRange, place, message);
        }
        held
    }
}

/// The key at the end of a place, without indices: `size` of `blocks[0].size[1]`.
fn key_of(place: &str) -> &str {
    let key = place.rsplit('.').next().unwrap_or(place);
    key.split('[').next().unwrap_or(key)
}

/// A number as a user would write it: 2e6, not 2000000.
pub fn shown(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && size.is_finite() && !(1e-3..1e5).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}
