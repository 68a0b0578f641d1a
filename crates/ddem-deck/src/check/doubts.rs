//! Warnings about a deck.

use std::collections::BTreeSet;

use super::shown;
use super::units::units;
use crate::schema::{ContactTable, Deck, Joint, Stage, StageKind};

/// Part of the resolution of a factor of safety that the tolerance may be.
const FINER: f64 = 0.02;

/// Warnings about contacts, rigid blocks and the used joints, which are given by their numbers in sorted order of the
/// names.
pub(crate) fn doubts(deck: &Deck, used: &BTreeSet<u16>) -> Vec<String> {
    let numbered = deck.joints.iter().enumerate();
    let later = |name: &String| {
        deck.assign.iter().any(|entry| entry.joint.as_ref() == Some(name) && entry.from.is_some())
    };
    let breaking: Vec<(&str, &Joint)> = numbered
        .filter(|(i, (name, joint))| {
            joint.breaks() && (u16::try_from(*i).is_ok_and(|i| used.contains(&i)) || later(name))
        })
        .map(|(_, (name, joint))| (name.as_str(), joint))
        .collect();
    let mut doubts = units(deck);
    doubts.extend(contact_without_effect(deck));
    doubts.extend(gravity_upwards(deck));
    doubts.extend(without_supports(deck));
    doubts.extend(loose_tolerance(deck));
    doubts.extend(releases(deck));
    for (name, joint) in breaking {
        doubts.extend(tension_out_of_reach(name, joint));
        doubts.extend(steep_dilation(name, joint));
    }
    doubts
}

/// Warning about contact keys where no contacts are searched for.
fn contact_without_effect(deck: &Deck) -> Option<String> {
    // Failed pairs have the damping of contacts.
    let breaks = deck.joints.values().any(Joint::breaks);
    let others = match breaks {
        true => ContactTable { damping: None, restitution: None, ..deck.contact },
        false => deck.contact,
    };
    if others.is_empty() || deck.finds_contacts() {
        return None;
    }
    let why = match deck.model.contact {
        Some(_) => "`contact = false` in [model] says that none are looked for",
        None => {
            "none are looked for in one set of blocks whose joints never fail, but with \
             `contact = true` in [model]"
        }
    };
    let but = if others == deck.contact { "" } else { " but for its damping" };
    Some(format!("`[contact]` has no effect{but}: {why}"))
}

/// Gravity along an axis, upwards where z is up.
fn gravity_upwards(deck: &Deck) -> Option<String> {
    let [x, y, z] = deck.model.gravity;
    (x == 0.0 && y == 0.0 && z > 0.0).then(|| {
        let up = shown(z);
        format!("`gravity` is along +z: where z is up it would be [0.0, 0.0, -{up}]")
    })
}

/// Weight that nothing bears.
fn without_supports(deck: &Deck) -> Option<String> {
    let held = !deck.fix.is_empty() || !deck.boundary.is_empty();
    (deck.model.gravity != [0.0; 3] && !held).then(|| {
        "nothing holds the model: without `[[fix]]` or `[[boundary]]` it falls under its `gravity`".to_owned()
    })
}

/// Searches for a factor of safety finer than forces balance.
fn loose_tolerance(deck: &Deck) -> impl Iterator<Item = String> {
    let searches = deck.stage.iter().filter(|stage| stage.kind == StageKind::Safety);
    searches.filter_map(|stage| {
        let search = stage.search();
        let most = FINER * search.resolution;
        (search.tolerance > most * (1.0 + 1e-9)).then(|| {
            format!(
                "stage `{}`: with a `tolerance` of {:e} trials come to rest that do not hold: at most {most:e} for a \
                 `resolution` of {}",
                stage.name,
                search.tolerance,
                shown(search.resolution)
            )
        })
    })
}

/// Forces of removed blocks that go at once although they are to fade, or have not gone in the end.
fn releases(deck: &Deck) -> impl Iterator<Item = String> {
    deck.remove.iter().enumerate().filter_map(|(index, remove)| {
        let release = remove.release.filter(|&time| time > 0.0)?;
        let first = deck.stage.iter().position(|stage| remove.from.as_ref() == Some(&stage.name))?;
        let relax = |stage: &&Stage| stage.kind == StageKind::Relax;
        let stages = &deck.stage[first..];
        if let Some(stage) = stages.first().filter(relax) {
            return (stage.increments.unwrap_or(1) == 1).then(|| {
                format!(
                    "remove {index}: `release` has no effect: relax stage `{}` has one increment; more \
                     `increments` there let the forces go little by little",
                    stage.name
                )
            });
        }
        let moving = stages.iter().take_while(|stage| !relax(stage));
        let time: f64 = moving.filter_map(|stage| stage.duration).sum();
        let left = 100.0 * (1.0 - time / release);
        let then = match stages.iter().find(relax) {
            Some(stage) => format!("go at once in relax stage `{}`", stage.name),
            None => "never go".to_owned(),
        };
        (time < release * (1.0 - 1e-9)).then(|| {
            format!(
                "remove {index}: `release` is {} s, and the dynamic stages from `{}` on take {} s: \
                 {left:.0} % of the forces {then}",
                shown(release),
                deck.stage[first].name,
                shown(time)
            )
        })
    })
}

/// In tension the strength in shear falls by tan φ per unit: at c/tan φ none is left.
fn tension_out_of_reach(name: &str, joint: &Joint) -> Option<String> {
    // Roughness has no cohesion, and gives no strength in shear under tension.
    if joint.jrc.is_some() {
        return None;
    }
    let (tension, cohesion) = (joint.tension?, joint.cohesion.unwrap_or(0.0));
    let slope = libm::tan(joint.friction.unwrap_or(0.0).to_radians());
    let apex = if cohesion > 0.0 { cohesion / slope } else { 0.0 };
    // A tension that is meant to be the apex is off by rounding.
    (tension > apex * (1.0 + 1e-9)).then(|| {
        format!(
            "joint `{name}`: the tensile strength of {} Pa is reached only where nothing shears the \
             joint: no strength in shear is left at a tension of {} Pa, cohesion/tan(friction)",
            shown(tension),
            shown(format!("{apex:.3e}").parse().unwrap_or(apex))
        )
    })
}

/// Work of a slip s against a pressure σ is `σ s (tan φ_r − tan ψ)`.
fn steep_dilation(name: &str, joint: &Joint) -> Option<String> {
    let (dilation, residual) = (joint.dilation?, joint.residual_friction.or(joint.friction)?);
    (dilation > residual).then(|| {
        format!(
            "joint `{name}`: dilation, {} degrees, is above the friction that is left after \
             failure, {} degrees: sliding under pressure would yield energy instead of taking it",
            shown(dilation),
            shown(residual)
        )
    })
}
