//! Checks of supports, loads, boundaries and the initial state.

use super::selection::{Selected, selector};
use super::{ErrorCode, Faults, NameFaults, Rule, history, shown};
use crate::schema::{Boundary, BoundaryKind, Deck, Fix, Gradient, Initial, Load, StageKind};
use ddem_core::problem::no_velocity;

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    for (i, entry) in deck.fix.iter().enumerate() {
        let at = format!("fix[{i}]");
        selector(deck, &format!("{at}.where"), (&entry.r#where, Selected::Nodes), faults);
        fix(&at, entry, faults);
        driven(deck, &at, entry, faults);
        force_time(deck, &at, entry.from.as_deref(), entry.until.as_deref(), faults);
    }
    for (i, entry) in deck.load.iter().enumerate() {
        let at = format!("load[{i}]");
        let of = if entry.traction.is_some() || entry.pressure.is_some() {
            Selected::Faces
        } else {
            Selected::Nodes
        };
        selector(deck, &format!("{at}.where"), (&entry.r#where, of), faults);
        load(&at, entry, faults);
        force_time(deck, &at, entry.from.as_deref(), entry.until.as_deref(), faults);
    }
    for (i, entry) in deck.boundary.iter().enumerate() {
        let at = format!("boundary[{i}]");
        selector(deck, &format!("{at}.where"), (&entry.r#where, Selected::Faces), faults);
        boundary(&at, entry, faults);
        force_time(deck, &at, entry.from.as_deref(), entry.until.as_deref(), faults);
    }
    for (i, entry) in deck.initial.iter().enumerate() {
        let at = format!("initial[{i}]");
        selector(deck, &format!("{at}.where"), (&entry.r#where, Selected::Nodes), faults);
        initial(&at, entry, faults);
    }
}

/// Checks the stages between which an entry is in force.
pub(super) fn force_time(
    deck: &Deck,
    at: &str,
    from: Option<&str>,
    until: Option<&str>,
    faults: &mut Faults,
) {
    let stages = || deck.stage.iter().map(|stage| stage.name.as_str());
    for (key, name) in [("from", from), ("until", until)] {
        if let Some(name) = name {
            faults.reference(format!("{at}.{key}"), name, stages(), ("stage", "`[[stage]]`"));
        }
    }
    let index = |name: &str| stages().position(|stage| stage == name);
    let Some(until) = until.and_then(|name| Some((name, index(name)?))) else { return };
    let help = "`until` names the stage at whose start it ends";
    match from {
        None if until.1 == 0 => faults.add_help(
            ErrorCode::NeverInForce,
            format!("{at}.until"),
            format!("never in force: `{}` is the first stage", until.0),
            help,
        ),
        Some(from) if index(from).is_some_and(|start| start >= until.1) => faults.add_help(
            ErrorCode::NeverInForce,
            format!("{at}.until"),
            format!("never in force: stage `{}` does not come after stage `{from}`", until.0),
            help,
        ),
        _ => {}
    }
}

fn fix(at: &str, fix: &Fix, faults: &mut Faults) {
    let place = format!("{at}.axes");
    let help = "`axes` names directions, as in \"x\" or \"xyz\"";
    let letters: Vec<char> = fix.axes.chars().collect();
    if letters.is_empty() {
        faults.add_help(ErrorCode::WrongType, place, "`axes` names no direction", help);
    } else if let Some(&wrong) = letters.iter().find(|letter| !"xyz".contains(**letter)) {
        let message = format!("`axes` has the letter {wrong:?}; only x, y and z are directions");
        faults.add_help(ErrorCode::WrongType, place, message, help);
    } else if let Some((_, twice)) =
        letters.iter().enumerate().find(|(i, letter)| letters[..*i].contains(letter))
    {
        faults.add_help(ErrorCode::WrongType, place, format!("`axes` names {twice} twice"), help);
    }
    for (key, values) in [("velocity", fix.velocity), ("displacement", fix.displacement)] {
        let Some(values) = values else { continue };
        faults.finite(format!("{at}.{key}"), &values);
        for (k, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
            if values[k] != 0.0 && values[k].is_finite() && !letters.contains(&axis) {
                faults.add_help(
                    ErrorCode::IneffectiveKey,
                    format!("{at}.{key}[{k}]"),
                    format!("a {key} of {} along {axis}, which is free", shown(values[k])),
                    format!("only directions named in `axes` are driven: give 0, or name {axis}"),
                );
            }
        }
    }
    if fix.velocity.is_none() && fix.history.is_some() {
        faults.0.push(no_velocity(at));
    }
    history::check(at, fix.history.as_ref(), faults);
}

/// Checks that a support with a `displacement` does not begin in a dynamic stage.
fn driven(deck: &Deck, at: &str, fix: &Fix, faults: &mut Faults) {
    if fix.displacement.is_none() {
        return;
    }
    let place = format!("{at}.displacement");
    if fix.velocity.is_some() {
        let help = "supports go to a `displacement` in relax stages and with a `velocity` in dynamic ones: \
                    two entries with `from` and `until`";
        faults.add_help(
            ErrorCode::ConflictingKeys,
            place,
            "`displacement` cannot be combined with `velocity`",
            help,
        );
        return;
    }
    let stage = match &fix.from {
        Some(name) => deck.stage.iter().find(|stage| stage.name == *name),
        None => deck.stage.first(),
    };
    if let Some(stage) = stage.filter(|stage| stage.kind == StageKind::Dynamic) {
        let message =
            format!("stage `{}`, in which the support comes into force, is dynamic", stage.name);
        let help = "a support goes to its `displacement` by the `increments` of a relax stage: name one in \
                    `from`, or give a `velocity`";
        faults.add_help(ErrorCode::IneffectiveKey, place, message, help);
    }
}

fn load(at: &str, load: &Load, faults: &mut Faults) {
    let vectors = [("traction", load.traction), ("line", load.line), ("force", load.force)];
    for (key, vector) in vectors {
        if let Some(vector) = vector {
            faults.finite(format!("{at}.{key}"), &vector);
        }
    }
    faults.optional(format!("{at}.pressure"), load.pressure, Rule::Any);
    let kinds = [
        ("traction", load.traction.is_some()),
        ("pressure", load.pressure.is_some()),
        ("line", load.line.is_some()),
        ("force", load.force.is_some()),
    ];
    let given: Vec<&str> =
        kinds.into_iter().filter(|(_, given)| *given).map(|(key, _)| key).collect();
    let help = "a load has exactly one of `traction`, `pressure`, `line` and `force`";
    match given[..] {
        [] => faults.add_help(ErrorCode::MissingKey, at, "the load has no value", help),
        [_] => {}
        [first, second, ..] => {
            let message = format!("`{second}` cannot be combined with `{first}`");
            faults.add_help(ErrorCode::ConflictingKeys, format!("{at}.{second}"), message, help);
        }
    }
    let planes = load.r#where.n_planes();
    if load.line.is_some() && planes != 2 {
        faults.add_help(
            ErrorCode::WrongType,
            format!("{at}.where"),
            format!("`line` needs two planes in `where`, found {planes}"),
            "they meet in the line, as in `where = { x = 6.0, z = 3.0 }`",
        );
    }
    history::check(at, load.history.as_ref(), faults);
}

fn boundary(at: &str, boundary: &Boundary, faults: &mut Faults) {
    if let Some(velocity) = boundary.velocity {
        faults.finite(format!("{at}.velocity"), &velocity);
        if boundary.kind == BoundaryKind::FreeField {
            faults.add_help(
                ErrorCode::ConflictingKeys,
                format!("{at}.velocity"),
                "`velocity` cannot be combined with `kind = \"free-field\"`",
                "the wave comes in through the base, a boundary of kind \"viscous\" or a driven \
                 `[[fix]]`; the sides follow",
            );
        }
    } else if boundary.history.is_some() {
        faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.history"),
            "`history` needs `velocity`",
            "it is the factor in time on the velocity of a wave that comes in",
        );
    }
    history::check(at, boundary.history.as_ref(), faults);
}

fn initial(at: &str, initial: &Initial, faults: &mut Faults) {
    let keys = [("velocity", initial.velocity), ("spin", initial.spin), ("centre", initial.centre)];
    for (key, vector) in keys {
        if let Some(vector) = vector {
            faults.finite(format!("{at}.{key}"), &vector);
        }
    }
    if let Some(stress) = initial.stress {
        faults.finite(format!("{at}.stress"), &stress);
    }
    if let Some(Gradient { x, y, z }) = initial.gradient {
        for (axis, slope) in [("x", x), ("y", y), ("z", z)] {
            if let Some(slope) = slope {
                faults.finite(format!("{at}.gradient.{axis}"), &slope);
            }
        }
        if initial.stress.is_none() {
            let message = "`gradient` needs `stress`: it is the change of stress per metre";
            faults.add_help(
                ErrorCode::MissingKey,
                format!("{at}.gradient"),
                message,
                "`stress` is the one at the origin",
            );
        }
    }
    if initial.velocity.is_none() && initial.spin.is_none() && initial.stress.is_none() {
        faults.add(
            ErrorCode::MissingKey,
            at,
            "the entry sets nothing: it needs `velocity`, `spin` or `stress`",
        );
    }
    if initial.centre.is_some() && initial.spin.is_none() {
        let message = "`centre` needs `spin`: it is the point about which the nodes turn";
        faults.add(ErrorCode::MissingKey, format!("{at}.centre"), message);
    }
}
