//! Checks of materials and joints.

use super::{ErrorCode, Faults, NameFaults, Rule, strength};
use crate::schema::names::segment;
use crate::schema::{Deck, Joint};
/// Largest number of materials, and of joints: their numbers have 16 bits, and one number means
/// none.
const MOST: usize = u16::MAX as usize;

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    if deck.materials.is_empty() {
        faults.add_help(
            ErrorCode::EmptyModel,
            "materials",
            "the model has no materials",
            "`[materials.rock]` with `density`, `young` and `poisson` makes one",
        );
    }
    for (section, number) in [("materials", deck.materials.len()), ("joints", deck.joints.len())] {
        if number > MOST {
            faults.add(
                ErrorCode::TooLarge,
                section,
                format!("the model has {number} {section}: {MOST} are the most"),
            );
        }
    }
    for (name, material) in &deck.materials {
        let at = format!("materials.{}", segment(name));
        faults.printable(at.as_str(), name);
        if name.is_empty() {
            faults.add(ErrorCode::InvalidName, at.as_str(), "the name of a material is empty");
        }
        constants(
            &at,
            [Some(material.density), Some(material.young), Some(material.poisson)],
            faults,
        );
    }
    for (name, joint) in &deck.joints {
        let at = format!("joints.{}", segment(name));
        faults.printable(at.as_str(), name);
        if name.is_empty() {
            faults.add(ErrorCode::InvalidName, at.as_str(), "the name of a joint is empty");
        }
        stiffness(deck, &at, joint, faults);
        strength::check(deck, &at, joint, faults);
    }
}

fn constants(at: &str, [density, young, poisson]: [Option<f64>; 3], faults: &mut Faults) {
    faults.optional(format!("{at}.density"), density, Rule::AboveZero);
    faults.optional(format!("{at}.young"), young, Rule::AboveZero);
    faults.optional(format!("{at}.poisson"), poisson, Rule::Between(-1.0, 0.5));
}

/// Checks that a joint gets its stiffness in exactly one of three ways.
fn stiffness(deck: &Deck, at: &str, joint: &Joint, faults: &mut Faults) {
    let own = [joint.density, joint.young, joint.poisson];
    let springs = [joint.normal_stiffness, joint.shear_stiffness];
    constants(at, own, faults);
    faults.optional(format!("{at}.normal_stiffness"), springs[0], Rule::AboveZero);
    faults.optional(format!("{at}.shear_stiffness"), springs[1], Rule::AboveZero);
    if let Some(material) = joint.material.as_deref().filter(|_| !deck.materials.is_empty()) {
        let known = deck.materials.keys().map(String::as_str);
        let place = format!("{at}.material");
        faults.reference(place, material, known, ("material", "`[materials.NAME]`"));
    }

    let alternatives = "a joint has exactly one of: `material`; `density`, `young` and `poisson`; \
                `normal_stiffness` and `shear_stiffness` (a spring joint)";
    let own_named = named(["density", "young", "poisson"], own);
    let springs_named = named(["normal_stiffness", "shear_stiffness"], springs);
    let first_own = own_named.iter().find(|(_, given)| *given).map(|(key, _)| *key);
    let first_spring = springs_named.iter().find(|(_, given)| *given).map(|(key, _)| *key);
    let given: Vec<&str> = [joint.material.as_ref().map(|_| "material"), first_own, first_spring]
        .into_iter()
        .flatten()
        .collect();
    match given[..] {
        [] => {
            faults.add_help(ErrorCode::MissingKey, at, "the joint has no stiffness", alternatives)
        }
        [_] => {}
        [first, second, ..] => {
            let message = format!("`{second}` cannot be combined with `{first}`");
            faults.add_help(
                ErrorCode::ConflictingKeys,
                format!("{at}.{second}"),
                message,
                alternatives,
            );
        }
    }
    // If two ways are mixed, it is unknown which one to complete.
    if given.len() == 1 {
        for group in [own_named, springs_named] {
            let Some((first, _)) = group.iter().find(|(_, given)| *given) else { continue };
            for (missing, _) in group.iter().filter(|(_, given)| !*given) {
                let message = format!("key `{missing}` is missing: it is needed with `{first}`");
                faults.add_help(
                    ErrorCode::MissingKey,
                    format!("{at}.{missing}"),
                    message,
                    alternatives,
                );
            }
        }
    }
    thickness(at, joint.thickness, first_spring.is_some(), faults);
}

fn thickness(at: &str, thickness: f64, is_spring: bool, faults: &mut Faults) {
    let place = format!("{at}.thickness");
    if thickness == 0.0 && !is_spring {
        faults.add_help(
            ErrorCode::MissingKey,
            place,
            "key `thickness` is missing or 0",
            "the thickness of the layer, in metres; only a spring joint may have none",
        );
    } else {
        faults.number(place, thickness, Rule::ZeroOrMore);
    }
}

/// Keys, each with true if it is given.
fn named<const N: usize>(
    keys: [&'static str; N],
    values: [Option<f64>; N],
) -> Vec<(&'static str, bool)> {
    keys.into_iter().zip(values.map(|value| value.is_some())).collect()
}
