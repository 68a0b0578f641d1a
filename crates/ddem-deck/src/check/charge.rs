//! Checks of charges.

use super::conditions::force_time;
use super::selection::{Selected, selector};
use super::{ErrorCode, Faults, Rule, history, names, shown};
use crate::schema::{
    Charge, ChargeHistory, Deck, Detonation, EXPLOSIVES, Explosive, StageKind, Where,
};
/// Smallest density `[kg/m³]` and detonation velocity `[m/s]` of an explosive. Values that are
/// given in g/cm³ or km/s are below them.
const LEAST: [f64; 2] = [100.0, 100.0];

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    for (i, entry) in deck.charge.iter().enumerate() {
        let at = format!("charge[{i}]");
        position(deck, &at, &entry.r#where, faults);
        strength(&at, entry, faults);
        gas(&at, entry, faults);
        force_time(deck, &at, entry.from.as_deref(), entry.until.as_deref(), faults);
        if let Some(delay) = entry.delay
            && faults.number(format!("{at}.delay"), delay, Rule::ZeroOrMore)
        {
            late(deck, &at, entry, delay, faults);
        }
    }
}

fn position(deck: &Deck, at: &str, given: &Where, faults: &mut Faults) {
    if given.is_everywhere() {
        faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.where"),
            "`where` of a charge names no part of the model",
            "a sphere or a cylinder around the hole, ranges, or a set of blocks",
        );
    }
    selector(deck, &format!("{at}.where"), (given, Selected::Faces), faults);
}

/// Checks that there is exactly one of mass and pressure, and an explosive with a mass.
fn strength(at: &str, charge: &Charge, faults: &mut Faults) {
    let help = "a charge has `mass` and `explosive`, or `pressure`";
    match (charge.mass, charge.pressure) {
        (None, None) => {
            faults.add_help(ErrorCode::MissingKey, at, "the charge has no strength", help)
        }
        (Some(_), Some(_)) => {
            faults.add_help(
                ErrorCode::ConflictingKeys,
                format!("{at}.pressure"),
                "`pressure` cannot be combined with `mass`",
                help,
            );
        }
        (Some(_), None) if charge.explosive.is_none() => faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.mass"),
            "`mass` needs `explosive`",
            format!("one of {}, or its numbers", known()),
        ),
        _ => {}
    }
    faults.optional(format!("{at}.mass"), charge.mass, Rule::AboveZero);
    faults.optional(format!("{at}.pressure"), charge.pressure, Rule::AboveZero);
    match &charge.explosive {
        Some(Explosive::Named(name)) if !EXPLOSIVES.iter().any(|(known, _)| known == name) => {
            let near = names::nearest(name, EXPLOSIVES.iter().map(|(name, _)| *name));
            let near = near.map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
            faults.add_help(
                ErrorCode::UnknownName,
                format!("{at}.explosive"),
                format!("there is no explosive named `{name}`"),
                format!(
                    "{near}explosives are {}, or `{{ density, detonation_velocity, gamma }}`",
                    known()
                ),
            );
        }
        Some(Explosive::Given(numbers)) => detonation(&format!("{at}.explosive"), *numbers, faults),
        _ => {}
    }
}

fn known() -> String {
    names::list(EXPLOSIVES.iter().map(|(name, _)| *name))
}

fn detonation(at: &str, numbers: Detonation, faults: &mut Faults) {
    let Detonation { density, detonation_velocity, gamma } = numbers;
    let units =
        [("density", density, "kg/m³"), ("detonation_velocity", detonation_velocity, "m/s")];
    for ((key, value, unit), least) in units.into_iter().zip(LEAST) {
        let place = format!("{at}.{key}");
        if faults.number(place.as_str(), value, Rule::AboveZero) && value < least {
            let message = format!("`{key}` is {} {unit}: no explosive has that", shown(value));
            faults.add_help(
                ErrorCode::OutOfRange,
                place,
                message,
                format!("it is given in {unit}"),
            );
        }
    }
    index(&format!("{at}.gamma"), gamma, faults);
}

fn index(place: &str, gamma: f64, faults: &mut Faults) {
    if faults.number(place, gamma, Rule::AboveZero) && gamma <= 1.0 {
        faults.add_help(
            ErrorCode::OutOfRange,
            place,
            format!("`gamma` is {} but must be above 1", shown(gamma)),
            "the adiabatic index of a gas; about 3 for the products of a detonation",
        );
    }
}

/// Checks the keys of a gas that expands, and of one that does not.
fn gas(at: &str, charge: &Charge, faults: &mut Faults) {
    if let Some(gamma) = charge.gamma {
        index(&format!("{at}.gamma"), gamma, faults);
        if charge.mass.is_some() {
            faults.add_help(
                ErrorCode::ConflictingKeys,
                format!("{at}.gamma"),
                "`gamma` cannot be combined with `mass`",
                "it is a number of the explosive",
            );
        }
    }
    if !charge.expands() && charge.mass.is_none() {
        let keys = [("gamma", charge.gamma.is_some()), ("explosive", charge.explosive.is_some())];
        for (key, _) in keys.into_iter().filter(|(_, given)| *given) {
            faults.add_help(
                ErrorCode::IneffectiveKey,
                format!("{at}.{key}"),
                format!("`{key}` has no effect on a `pressure` that does not fall as gas expands"),
                "give `history = \"gas\"`, or leave it out",
            );
        }
    }
    // An unknown explosive has already been reported.
    if charge.expands() && charge.gamma.is_none() && charge.explosive.is_none() {
        faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.history"),
            "\"gas\" needs `gamma`, or an explosive that has it",
            "p = p0 (V0/V)^gamma",
        );
    }
    match &charge.history {
        Some(ChargeHistory::Given(given)) => history::check(at, Some(given), faults),
        Some(ChargeHistory::Gas(_)) | None => {}
    }
}

/// Adds a fault if a charge would detonate after the end of the run.
fn late(deck: &Deck, at: &str, charge: &Charge, delay: f64, faults: &mut Faults) {
    let stage = |name: &Option<String>| {
        let name = name.as_deref()?;
        deck.stage.iter().position(|stage| stage.name == name)
    };
    let from = stage(&charge.from).unwrap_or(0);
    let until = stage(&charge.until).unwrap_or(deck.stage.len());
    let Some(stages) = deck.stage.get(from..until) else { return };
    let dynamic = stages.iter().filter(|stage| stage.kind == StageKind::Dynamic);
    let time: f64 = dynamic.filter_map(|stage| stage.duration).sum();
    if !stages.is_empty() && delay > 0.0 && delay >= time {
        faults.add_help(
            ErrorCode::NeverInForce,
            format!("{at}.delay"),
            format!(
                "it never detonates: the stages in which the charge is in force last {} s in all",
                shown(time)
            ),
            "`delay` counts from the start of the stage named in `from`, otherwise of the run",
        );
    }
}
