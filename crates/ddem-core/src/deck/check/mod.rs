//! Everything that can be told from the deck alone, before any geometry is built.

mod blocks;
mod charge;
mod conditions;
mod contact;
mod doubts;
mod history;
mod matter;
mod region;
mod stages;
mod strength;
#[cfg(test)]
mod tests;
mod units;

pub(crate) use conditions::no_velocity;
pub(crate) use doubts::doubts;
pub(crate) use stages::allow_tolerance;

use std::fmt::Display;

use super::{Deck, names};
use crate::Fault;

/// Every fault that can be told from the deck alone; none means that the deck is consistent.
///
/// Whether blocks overlap and whether a `where` selects anything needs the geometry, and is not
/// looked at here.
pub fn check(deck: &Deck) -> Vec<Fault> {
    let mut faults = Faults(Vec::new());
    faults.finite("model.gravity", &deck.model.gravity);
    contact::check(&deck.contact, &mut faults);
    matter::check(deck, &mut faults);
    blocks::check(deck, &mut faults);
    conditions::check(deck, &mut faults);
    charge::check(deck, &mut faults);
    stages::check(deck, &mut faults);
    faults.0
}

/// What a number must be, besides finite.
#[derive(Clone, Copy)]
enum Rule {
    Any,
    AboveZero,
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
struct Faults(Vec<Fault>);

impl Faults {
    fn add(&mut self, place: impl Into<String>, message: impl Into<String>) {
        self.0.push(Fault::new(place, message));
    }

    fn add_help(
        &mut self,
        place: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.0.push(Fault::new(place, message).help(help));
    }

    /// A number that keeps a rule; says whether it does.
    fn number(&mut self, place: impl Into<String>, value: f64, rule: Rule) -> bool {
        let place = place.into();
        let key = key_of(&place);
        if !value.is_finite() {
            let message = format!("`{key}` is {} but must be a finite number", shown(value));
            self.add(place, message);
            return false;
        }
        let Some(rule) = rule.broken(value) else { return true };
        let message = format!("`{key}` is {} but must be {rule}", shown(value));
        self.add(place, message);
        false
    }

    fn optional(&mut self, place: impl Into<String>, value: Option<f64>, rule: Rule) -> bool {
        value.is_none_or(|value| self.number(place, value, rule))
    }

    /// A list of numbers that all keep a rule.
    fn numbers(&mut self, place: impl Display, values: &[f64], rule: Rule) -> bool {
        let mut held = true;
        for (i, &value) in values.iter().enumerate() {
            held &= self.number(format!("{place}[{i}]"), value, rule);
        }
        held
    }

    fn finite(&mut self, place: impl Display, values: &[f64]) -> bool {
        self.numbers(place, values, Rule::Any)
    }

    /// A whole number that must not be 0.
    fn not_zero(&mut self, place: impl Into<String>, value: impl Into<u64>) -> bool {
        let place = place.into();
        let held = value.into() > 0;
        if !held {
            let message = format!("`{}` is 0 but must be 1 or more", key_of(&place));
            self.add(place, message);
        }
        held
    }

    /// A name that must be among the known ones; `kind` is what it names, `header` the table that
    /// makes one.
    fn reference<'a>(
        &mut self,
        place: impl Into<String>,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
        (kind, header): (&str, &str),
    ) {
        let known: Vec<&str> = known.into_iter().collect();
        if known.contains(&name) {
            return;
        }
        let help = if known.is_empty() {
            format!("the deck has no {kind} with a name; `{header}` makes one")
        } else {
            let near = names::nearest(name, known.iter().copied())
                .map(|near| format!("did you mean `{near}`? "))
                .unwrap_or_default();
            format!("{near}{kind}s of this deck: {}", names::list(known))
        };
        self.add_help(place, format!("there is no {kind} named `{name}`"), help);
    }

    /// Names that must differ.
    fn unique<'a>(&mut self, kind: &str, names: impl IntoIterator<Item = (String, &'a str)>) {
        let mut seen: Vec<&str> = Vec::new();
        for (place, name) in names {
            if name.is_empty() {
                self.add(place, format!("the name of a {kind} is empty"));
            } else if seen.contains(&name) {
                self.add(place, format!("there is another {kind} named `{name}`"));
            } else {
                seen.push(name);
            }
        }
    }
}

/// The key at the end of a place, without indices: `size` of `blocks[0].size[1]`.
fn key_of(place: &str) -> &str {
    let key = place.rsplit('.').next().unwrap_or(place);
    key.split('[').next().unwrap_or(key)
}

/// A number as a user would write it: 2e6, not 2000000.
fn shown(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && size.is_finite() && !(1e-3..1e5).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}
