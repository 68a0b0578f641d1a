//! Warnings about a deck.

use std::collections::BTreeSet;

use ddem_core::Simulation;

use super::shown;
use super::units::units;
use crate::lint::{Code, Diagnostic, loose_tolerance};
use crate::schema::names::segment;
use crate::schema::{ContactTable, Deck, Joint, Stage, StageKind};

/// Warnings about contacts, rigid blocks and the used joints; `used` are their numbers in sorted
/// order of the names.
pub(crate) fn warnings(deck: &Deck, used: &BTreeSet<u16>) -> Vec<Diagnostic> {
    let numbered = deck.joints.iter().enumerate();
    let later = |name: &String| {
        deck.assign.iter().any(|entry| entry.joint.as_ref() == Some(name) && entry.from.is_some())
    };
    let breaking: Vec<(&str, &Joint)> = numbered
        .filter(|(i, (name, joint))| {
            joint.can_fail() && (u16::try_from(*i).is_ok_and(|i| used.contains(&i)) || later(name))
        })
        .map(|(_, (name, joint))| (name.as_str(), joint))
        .collect();
    let mut warnings = units(deck);
    warnings.extend(contact_without_effect(deck));
    warnings.extend(upward_gravity(deck));
    warnings.extend(no_support(deck));
    warnings.extend(loose_tolerances(deck));
    warnings.extend(releases(deck));
    for (name, joint) in breaking {
        let at = format!("joints.{}", segment(name));
        warnings.extend(unreachable_tension(&at, joint));
        warnings.extend(steep_dilation(&at, joint));
    }
    warnings
}

/// Warning about contact keys if no contacts are searched for.
fn contact_without_effect(deck: &Deck) -> Option<Diagnostic> {
    // Failed pairs use the damping of contacts.
    let can_fail = deck.joints.values().any(Joint::can_fail);
    let others = match can_fail {
        true => ContactTable { damping: None, restitution: None, ..deck.contact },
        false => deck.contact,
    };
    if others.is_empty() || deck.finds_contacts() {
        return None;
    }
    let (why, help) = match deck.model.contact {
        Some(_) => (
            "`contact = false` in `[model]` switches the search for contacts off",
            "leave out `[contact]`, or give `contact = true`",
        ),
        None => (
            "no contacts are searched for in one set of blocks whose joints never fail",
            "`contact = true` in `[model]` switches the search on",
        ),
    };
    let but = if others == deck.contact { "" } else { " besides its damping" };
    let message = format!("`[contact]` has no effect{but}: {why}");
    Some(Diagnostic::warning(Code::ContactWithoutEffect, "contact", message, help))
}

fn upward_gravity(deck: &Deck) -> Option<Diagnostic> {
    let [x, y, z] = deck.model.gravity;
    (x == 0.0 && y == 0.0 && z > 0.0).then(|| {
        let message = "`gravity` points along +z, usually upwards";
        let help = format!("where z is up, gravity is [0.0, 0.0, -{}]", shown(z));
        Diagnostic::warning(Code::UpwardGravity, "model.gravity", message, help)
    })
}

fn no_support(deck: &Deck) -> Option<Diagnostic> {
    let held = !deck.fix.is_empty() || !deck.boundary.is_empty();
    (deck.model.gravity != [0.0; 3] && !held).then(|| {
        let message = "nothing supports the model: it falls under its `gravity`";
        let help = "`[[fix]]` or `[[boundary]]` supports it";
        Diagnostic::warning(Code::NoSupport, "model.gravity", message, help)
    })
}

/// Warnings about searches for a factor of safety with a tolerance that is too large for their
/// resolution.
fn loose_tolerances(deck: &Deck) -> impl Iterator<Item = Diagnostic> {
    let searches = deck.stage.iter().enumerate();
    let searches = searches.filter(|(_, stage)| stage.kind == StageKind::Safety);
    searches.filter_map(|(index, stage)| {
        Some(loose_tolerance(&stage.search())?.below(&format!("stage[{index}]")))
    })
}

/// Warnings about forces of removed blocks that vanish at once although they should fade, or that
/// do not fade completely.
fn releases(deck: &Deck) -> impl Iterator<Item = Diagnostic> {
    deck.remove.iter().enumerate().filter_map(|(index, remove)| {
        let release = remove.release.filter(|&time| time > 0.0)?;
        let first = deck.stage.iter().position(|stage| remove.from.as_ref() == Some(&stage.name))?;
        let relax = |stage: &&Stage| stage.kind == StageKind::Relax;
        let stages = &deck.stage[first..];
        let at = format!("remove[{index}].release");
        if let Some(stage) = stages.first().filter(relax) {
            return (stage.increments.unwrap_or(Simulation::INCREMENTS) == 1).then(|| {
                let message = format!(
                    "`release` has no effect: relax stage `{}` has one increment",
                    stage.name
                );
                let help = "more `increments` release the forces gradually";
                Diagnostic::warning(Code::ReleaseWithoutEffect, at, message, help)
            });
        }
        let moving = stages.iter().take_while(|stage| !relax(stage));
        let time: f64 = moving.filter_map(|stage| stage.duration).sum();
        let left = 100.0 * (1.0 - time / release);
        let then = match stages.iter().find(relax) {
            Some(stage) => format!("vanish at once in relax stage `{}`", stage.name),
            None => "are never released".to_owned(),
        };
        (time < release * (1.0 - 1e-9)).then(|| {
            let message = format!(
                "`release` takes {} s, but the dynamic stages from `{}` on take {} s: {left:.0} % of the forces \
                 {then}",
                shown(release),
                deck.stage[first].name,
                shown(time)
            );
            let help = "give a shorter `release`, or the stage a longer `duration`";
            Diagnostic::warning(Code::UnfinishedRelease, at, message, help)
        })
    })
}

/// Warning about a tensile strength that is reached only without shear. In tension the shear
/// strength falls by tan φ per unit: at c/tan φ it is zero.
fn unreachable_tension(at: &str, joint: &Joint) -> Option<Diagnostic> {
    // With roughness there is no cohesion and no shear strength under tension.
    if joint.jrc.is_some() {
        return None;
    }
    let (tension, cohesion) = (joint.tension?, joint.cohesion.unwrap_or_default());
    let slope = libm::tan(joint.friction.unwrap_or_default().to_radians());
    let apex = if cohesion > 0.0 { cohesion / slope } else { 0.0 };
    // A tension that is meant to be at the apex may differ from it by rounding.
    (tension > apex * (1.0 + 1e-9)).then(|| {
        let message = format!(
            "the tensile strength of {} Pa is reached only without any shear: the shear strength is zero at a \
             tension of {} Pa, cohesion/tan(friction)",
            shown(tension),
            shown(format!("{apex:.3e}").parse().unwrap_or(apex))
        );
        let help = "lower `tension` to that, or raise `cohesion`";
        Diagnostic::warning(Code::UnreachableTension, format!("{at}.tension"), message, help)
    })
}

/// Warning about a dilation above the residual friction. The work of a slip s against a pressure σ
/// is `σ s (tan φ_r − tan ψ)`.
fn steep_dilation(at: &str, joint: &Joint) -> Option<Diagnostic> {
    let (dilation, residual) = (joint.dilation?, joint.residual_friction.or(joint.friction)?);
    (dilation > residual).then(|| {
        let message = format!(
            "a dilation of {} degrees exceeds the residual friction, {} degrees: sliding under pressure would \
             create energy",
            shown(dilation),
            shown(residual)
        );
        let help = format!("give at most {}", shown(residual));
        Diagnostic::warning(Code::SteepDilation, format!("{at}.dilation"), message, help)
    })
}
